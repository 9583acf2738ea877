# SPDX-License-Identifier: MIT
"""Adds correctives to a face of shapes: PSD rows, channels and targets of all meshes."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np

from ... import BlendShapeTarget, Dna, Mesh, Psds
from ..._native import ClosestPoints, SkinChecker
from ...base.errors import ArgumentError
from ..geometry import skeleton as sk
from ..geometry.polygon_mesh import vertex_normals
from ..geometry.simplify import fan_triangles
from ..geometry.skeleton import Doubles, Ints
from ..work import MM, listed_meshes
from .poser import Controls, make_checker, skin_and_solids

Row = tuple[Controls, Doubles]
# Vertices of other meshes follow the skin fully if their distance from it is at most _NEAR_MM, and
# not at all beyond _FAR_MM.
_NEAR_MM, _FAR_MM = 6.0, 12.0
_LEAST_MM = 0.01  # shorter deltas are left out
_SKIN = 0.1  # a mesh with more than this fraction of the skin's vertices is a coarser skin


def add_correctives(dna: Dna, skin: int, correctives: Sequence[Row]) -> Dna:
    """Append correctives to a face. Returns the new face.

    If a combination already has a corrective, the displacements are added to its shapes. At LODs
    that use all blend shape channels, other skins, lashes and other meshes with blend shapes get
    the displacements of the nearest skin, which fade out at distances from 6 to 12 mm; teeth and
    eyeballs do not.

    Args:
        dna: a face of shapes; it is not changed.
        skin: index of the mesh of the correctives.
        correctives: (raw controls, displacements float64[V, 3] before skinning) of each corrective.

    Raises:
        ArgumentError: the face has networks or solvers. Their controls have numbers after the
            correctives, so that new correctives would change these numbers.
    """
    raw, had = len(dna.raw_control_names), dna.psd_count
    others = len(dna.machine_learned_behavior.neural_networks) + len(dna.rbf_behavior.solvers)
    if sk.column_count(dna) > raw + had or others:
        raise ArgumentError("a face without neural networks and RBF solvers was expected")
    channel_of = _channels(dna)
    new = [row for row in correctives if frozenset(row[0]) not in channel_of]
    out = _with_channels(dna, [controls for controls, _ in new])
    channel_of |= _channels(out)
    channels = [channel_of[frozenset(controls)] for controls, _ in correctives]
    meshes = {m for lod in _whole_levels(dna) for m in listed_meshes(dna, lod)}
    _add_targets(out, skin, correctives, channels, meshes)
    return out


def _channels(dna: Dna) -> dict[frozenset[int], int]:
    """Controls of a corrective -> its blend shape channel; correctives without a channel have no
    entry."""
    channels = dna.blend_shape_channels
    of_input = {
        int(c): int(o) for c, o in zip(channels.input_indices, channels.output_indices, strict=True)
    }
    parts = sk.psd_parts(dna).items()
    return {on: of_input[row] for row, on in parts if row in of_input}


def _whole_levels(dna: Dna) -> list[int]:
    """The LODs that use all blend shape channels."""
    lods, rows = dna.blend_shape_channels.lods, len(dna.blend_shape_channels.input_indices)
    return [lod for lod in range(min(len(lods), max(1, dna.lod_count))) if int(lods[lod]) == rows]


def _with_channels(dna: Dna, combinations: Sequence[Controls]) -> Dna:
    """The face with a corrective and a channel for each combination, but without targets."""
    out = copy.copy(dna)
    raw, had, count = len(dna.raw_control_names), dna.psd_count, len(combinations)
    names = [name.rpartition(".")[2] for name in dna.raw_control_names]
    first_channel = len(dna.blend_shape_channel_names)
    _add_rows(out, raw + had, combinations)
    out.psd_count = had + count
    out.joint_column_count = raw + had + count
    out.blend_shape_channel_names = [
        *dna.blend_shape_channel_names,
        *("_x_".join(names[c] for c in controls) for controls in combinations),
    ]
    # A LOD uses the first rows of the channel table. The new rows come last, so only LODs that use
    # all other channels can use the new ones.
    whole, channels = _whole_levels(dna), out.blend_shape_channels
    lods = [int(n) + count * (lod in whole) for lod, n in enumerate(channels.lods)]
    new = range(first_channel, first_channel + count)
    inputs = range(raw + had, raw + had + count)
    channels.input_indices = [*map(int, channels.input_indices), *inputs]
    channels.output_indices = [*map(int, channels.output_indices), *new]
    channels.lods = lods
    out.blend_shape_channels = channels
    mapping = dna.lod_blend_shape_mapping
    out.lod_blend_shape_mapping = [
        [*map(int, mapping[lod]), *(new if lod in whole else ())] for lod in range(len(mapping))
    ]
    return out


def _add_rows(dna: Dna, first: int, combinations: Sequence[Controls]) -> None:
    old = dna.psds
    rows = [first + i for i, controls in enumerate(combinations) for _ in controls]
    dna.psds = Psds(
        rows=[*map(int, old.rows), *rows],
        columns=[*map(int, old.columns), *(c for controls in combinations for c in controls)],
        values=np.concatenate([np.asarray(old.values, np.float32), np.ones(len(rows), np.float32)]),
    )


def _add_targets(
    dna: Dna, skin: int, correctives: Sequence[Row], channels: Sequence[int], meshes: set[int]
) -> None:
    solids = set(skin_and_solids(dna)[1])
    skins = {skin_and_solids(dna, (), lod)[0] for lod in _whole_levels(dna)}
    nearest = _Nearest(dna, skin)
    mm = MM.get(dna.translation_unit, 10.0)
    made = list(dna.meshes)
    mapping = [tuple(map(int, row)) for row in dna.mesh_blend_shape_channel_mapping]
    for m in sorted(meshes):
        mesh = copy.copy(made[m])
        # Skin and lashes get targets even if they have no target yet, which is the case if joints
        # do all of their motion.
        shaped = mesh.blend_shape_targets or m in skins or "lash" in dna.mesh_names[m].lower()
        if m in solids or not shaped:
            continue
        corners, shares = np.zeros((0, 3), np.int64), np.zeros((0, 3))
        if m != skin:
            points = np.asarray(mesh.positions, np.float64)
            # Only for a coarser skin, the nearest point must have a similar normal. The normals of
            # lashes point to both sides, so normals are not compared for lashes.
            is_skin = len(points) > _SKIN * len(made[skin].positions)
            normals = vertex_normals(points, face_lists(mesh)) if is_skin else np.zeros((0, 3))
            corners, shares, distance = nearest.of(points, normals)
            fade = np.clip((_FAR_MM - distance) / (_FAR_MM - _NEAR_MM), 0, 1)
            shares = shares * fade[:, None]
        targets = list(mesh.blend_shape_targets)
        at = {int(target.blend_shape_channel_index): n for n, target in enumerate(targets)}
        for channel, (_, whole) in zip(channels, correctives, strict=True):
            shape = whole if m == skin else _carried(whole, corners, shares)
            if channel in at:
                targets[at[channel]] = _more(targets[at[channel]], shape, mm)
                continue
            moved = np.flatnonzero(np.linalg.norm(shape, axis=1) * mm > _LEAST_MM)
            if not len(moved):
                continue
            targets.append(
                BlendShapeTarget(
                    deltas=shape[moved],
                    vertex_indices=moved,
                    blend_shape_channel_index=channel,
                )
            )
            mapping.append((m, channel))
        mesh.blend_shape_targets = targets
        made[m] = mesh
    dna.meshes = made
    dna.mesh_blend_shape_channel_mapping = np.array(mapping).reshape(-1, 2)


class _Nearest:
    """Finds the points of a skin, in its rest pose, that are nearest to other points."""

    def __init__(self, dna: Dna, skin: int) -> None:
        self._dna, self._skin = dna, skin
        self._checker: SkinChecker | None = None
        mesh = dna.meshes[skin]
        self._triangles = np.asarray(mesh.layout_positions, np.int64)[fan_triangles(mesh)]
        self._tree = ClosestPoints(
            np.asarray(mesh.positions, np.float64), self._triangles.astype(np.int32)
        )

    def of(self, points: Doubles, normals: Doubles) -> tuple[Ints, Doubles, Doubles]:
        """int64[n, 3], corners of the nearest triangle; float64[n, 3], barycentric coordinates;
        float64[n], distances in mm.

        Args:
            points: float64[n, 3], in the unit of the file.
            normals: float64[n, 3], normals of the points: only skin with a similar normal is
                searched. Empty: all skin is searched.
        """
        if len(normals):  # topology makes the checker expensive for a large skin
            self._checker = self._checker or make_checker(self._dna, self._skin, [])
            corners, shares, distance = self._checker.nearest(points, normals)
            return corners.astype(np.int64), shares, distance
        triangle, shares, distance = self._tree.nearest(points)
        mm = MM.get(self._dna.translation_unit, 10.0)
        return self._triangles[triangle], np.asarray(shares), mm * np.asarray(distance)


def _more(target: BlendShapeTarget, shape: Doubles, mm: float) -> BlendShapeTarget:
    """The target with the displacements float64[V, 3] of a shape added. Args: mm: length of the
    unit in mm."""
    sums = np.array(shape)
    np.add.at(sums, np.asarray(target.vertex_indices, np.int64), target.deltas)
    moved = np.flatnonzero(np.linalg.norm(sums, axis=1) * mm > _LEAST_MM)
    out = copy.copy(target)
    out.deltas, out.vertex_indices = sums[moved], moved
    return out


def face_lists(mesh: Mesh) -> list[list[int]]:
    """The vertex indices of each polygon."""
    layouts = np.asarray(mesh.layout_positions, np.int64)
    corners = layouts[np.asarray(mesh.face_layouts, np.int64)]
    ends = np.asarray(mesh.face_offsets, np.int64)[1:-1]
    return [part.tolist() for part in np.split(corners, ends)]


def _carried(shape: Doubles, corners: Ints, shares: Doubles) -> Doubles:
    """float64[n, 3]: displacements of the skin at other points.

    Args:
        shape: displacements of the skin, float64[V, 3].
        corners: int64[n, 3], the skin's triangle at each point.
        shares: float64[n, 3], weights of the corners.
    """
    return np.asarray((shape[corners] * shares[..., None]).sum(axis=1))
