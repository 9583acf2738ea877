# SPDX-License-Identifier: MIT
"""Correctives written into a face of shapes: PSD rows, channels and targets of all its meshes."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np

from ... import BlendShapeTarget, Dna, Mesh, Psds
from ...base.errors import ArgumentError
from ..geometry import skeleton as sk
from ..geometry.polygon_mesh import vertex_normals
from ..geometry.skeleton import Doubles, Ints
from ..work import MM, listed_meshes
from .poser import Controls, make_checker, skin_and_solids

Row = tuple[Controls, Doubles]
_NEAR_MM, _FAR_MM = 6.0, 12.0  # lashes go with the skin that is near, nothing with what is far
_LEAST_MM = 0.01
_SKIN = 0.1  # of the skin's vertices: what has more is a level of it


def add_correctives(dna: Dna, skin: int, correctives: Sequence[Row]) -> Dna:
    """The same face with correctives at the end of those that it has.

    What a combination that has one already is to get is added to its shapes.

    What lies on the skin (lashes, coarser levels) goes with the skin nearest to it.

    Args:
        dna: a face of shapes; it stays as it is.
        skin: the mesh that the correctives are of.
        correctives: the raw controls of each, and float64[V, 3] what it adds before the joints.

    Raises:
        ArgumentError: a face with inputs behind its correctives, as networks have.
    """
    raw, had = len(dna.raw_control_names), dna.psd_count
    others = len(dna.machine_learned_behavior.neural_networks) + len(dna.rbf_behavior.solvers)
    if sk.column_count(dna) > raw + had or others:
        raise ArgumentError("a face without networks and solvers was expected")
    channel_of = _channels(dna)
    new = [row for row in correctives if frozenset(row[0]) not in channel_of]
    out = _with_channels(dna, [controls for controls, _ in new])
    channel_of |= _channels(out)
    channels = [channel_of[frozenset(controls)] for controls, _ in correctives]
    meshes = {m for lod in _whole_levels(dna) for m in listed_meshes(dna, lod)}
    _add_targets(out, skin, correctives, channels, meshes)
    return out


def _channels(dna: Dna) -> dict[frozenset[int], int]:
    """The channel of each corrective that has one, by its controls."""
    channels = dna.blend_shape_channels
    of_input = {
        int(c): int(o) for c, o in zip(channels.input_indices, channels.output_indices, strict=True)
    }
    parts = sk.psd_parts(dna).items()
    return {on: of_input[row] for row, on in parts if row in of_input}


def _whole_levels(dna: Dna) -> list[int]:
    """The levels that have all channels."""
    lods, rows = dna.blend_shape_channels.lods, len(dna.blend_shape_channels.input_indices)
    return [lod for lod in range(min(len(lods), max(1, dna.lod_count))) if int(lods[lod]) == rows]


def _with_channels(dna: Dna, combinations: Sequence[Controls]) -> Dna:
    """The face with a corrective and a channel for each combination, without targets."""
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
    # Rows of a level are the first so many: correctives come last, at levels that have all others.
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
    checker = make_checker(dna, skin, [])
    mm = MM.get(dna.translation_unit, 10.0)
    made = list(dna.meshes)
    mapping = [tuple(map(int, row)) for row in dna.mesh_blend_shape_channel_mapping]
    for m in sorted(meshes):
        mesh = copy.copy(made[m])
        # Joints may do all of what skin and lashes do, so that they have no shape yet.
        shaped = mesh.blend_shape_targets or m in skins or "lash" in dna.mesh_names[m].lower()
        if m in solids or not shaped:
            continue
        corners, shares = np.zeros((0, 3), np.int64), np.zeros((0, 3))
        if m != skin:
            points = np.asarray(mesh.positions, np.float64)
            # Another level of the skin looks the same way; lashes have two sides.
            is_skin = len(points) > _SKIN * len(made[skin].positions)
            normals = vertex_normals(points, face_lists(mesh)) if is_skin else np.zeros((0, 3))
            found, shares, distance = checker.nearest(points, normals)
            corners = found.astype(np.int64)
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


def _more(target: BlendShapeTarget, shape: Doubles, mm: float) -> BlendShapeTarget:
    """A target with a shape added to it."""
    sums = np.array(shape)
    np.add.at(sums, np.asarray(target.vertex_indices, np.int64), target.deltas)
    moved = np.flatnonzero(np.linalg.norm(sums, axis=1) * mm > _LEAST_MM)
    out = copy.copy(target)
    out.deltas, out.vertex_indices = sums[moved], moved
    return out


def face_lists(mesh: Mesh) -> list[list[int]]:
    """The vertices of each polygon."""
    layouts = np.asarray(mesh.layout_positions, np.int64)
    corners = layouts[np.asarray(mesh.face_layouts, np.int64)]
    ends = np.asarray(mesh.face_offsets, np.int64)[1:-1]
    return [part.tolist() for part in np.split(corners, ends)]


def _carried(shape: Doubles, corners: Ints, shares: Doubles) -> Doubles:
    """float64[n, 3]: what the skin does under other points."""
    return np.asarray((shape[corners] * shares[..., None]).sum(axis=1))
