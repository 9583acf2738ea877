# SPDX-License-Identifier: MIT
"""Makes the meshes of a joint rig: fits weights, adds corrective shapes, and measures errors."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np

from .. import BlendShapeTarget, Dna, Mesh
from .between import Between, Ways
from .geometry import skeleton as sk
from .geometry.simplify import simplified
from .geometry.skeleton import Doubles, Ints
from .level_meshes import LevelMeshes
from .level_weights import level_weights
from .levels import level_name
from .lighter import count_deltas
from .reference import Reference
from .work import (
    MM,
    Level,
    MeshErrors,
    RigOptions,
    Work,
    listed_meshes,
)

_LEAST_WEIGHT = 1e-3


class Made:
    """Makes the meshes of all LODs, one LOD after the other."""

    def __init__(
        self,
        work: Work,
        options: RigOptions,
        weights: dict[int, Doubles],
        coarse: LevelMeshes,
        like: Reference | None = None,
        *,
        whole: bool = True,
    ) -> None:
        """Prepare an empty list of meshes.

        Args:
            work: the face; it must already have the new joints.
            options: options of the rig.
            weights: mesh -> float64[V, joints] of the finest meshes.
            coarse: triangles of the coarser LODs.
            like: reference to reuse, or None.
            whole: whether to make blend shapes and measure errors.
        """
        self.whole = whole
        self.work, self.options, self.weights, self.like = work, options, weights, like
        self.coarse = coarse
        self.triangles: dict[str, Ints] = {}  # coarse mesh -> layout indices of the fine mesh
        self.ways = Ways(work)
        self.meshes: list[Mesh] = []
        self.names: list[str] = []
        self.listed: list[list[int]] = []
        self.errors: list[MeshErrors] = []
        self.own = max(1, work.source.lod_count)
        self._numbers: dict[int, int] = {}  # mesh of the source -> mesh here; levels share meshes

    def add_level(self, lod: int, wanted: dict[int, Doubles], needs: set[int]) -> None:
        """Make the meshes of a LOD: meshes of the source, or simplified meshes of LOD 0.

        Args:
            lod: index of the LOD; LODs are added in order.
            wanted: mesh of the source -> displacements float64[E, V, 3].
            needs: meshes that get weights on new joints.
        """
        self.listed.append([])
        source = self.work.source
        if lod < self.own:
            for m in listed_meshes(source, lod):
                if m in self._numbers:
                    self.listed[lod].append(self._numbers[m])
                    continue
                self._numbers[m] = len(self.meshes)
                mesh = source.meshes[m]
                start = self._start(mesh) if m in needs and m not in self.weights else None
                start = self.weights.get(m, start)
                finest = m if m in self.weights else None
                self._add(lod, mesh, source.mesh_names[m], wanted[m], start, finest)
            return
        for m in listed_meshes(source, 0):
            mesh, name = source.meshes[m], source.mesh_names[m]
            triangles = self._triangles(lod, m, name)
            if not len(triangles):
                continue
            coarse, kept = simplified(mesh, triangles)
            _set_skin(coarse, sk.dense_weights(mesh, len(source.joint_names))[kept])
            name = level_name(name, lod)
            self.triangles[name] = triangles
            start = self.weights[m][kept] if m in needs else None
            self._add(lod, coarse, name, wanted[m][:, kept], start)

    def _triangles(self, lod: int, m: int, name: str) -> Ints:
        """int64[n, 3]: triangles of a coarse mesh as layouts of the fine mesh; empty: no mesh."""
        none = np.zeros((0, 3), np.int64)
        if self.like is not None:
            return self.like.triangles.get(level_name(name, lod), none)
        return self.coarse.triangles.get((lod, m), none)

    def _start(self, mesh: Mesh) -> Doubles:
        """Weights float64[V, joints] of the nearest vertices of the meshes of LOD 0."""
        source = self.work.source
        fine = np.concatenate([np.asarray(source.meshes[m].positions) for m in self.weights])
        rows = np.concatenate(list(self.weights.values()))
        positions = np.asarray(mesh.positions)
        lengths = (fine**2).sum(axis=1)
        nearest = [
            (lengths - 2 * positions[at : at + 256] @ fine.T).argmin(axis=1)
            for at in range(0, len(positions), 256)
        ]
        return rows[np.concatenate(nearest)]

    def _add(
        self,
        lod: int,
        mesh: Mesh,
        name: str,
        wanted: Doubles,
        rows: Doubles | None,
        finest: int | None = None,
    ) -> None:
        """Add a mesh with its own weights, or fit new weights that start with `rows`.

        Args:
            lod: index of the LOD.
            mesh: the mesh with its weights in the source.
            name: name of the mesh.
            wanted: its displacements float64[E, V, 3].
            rows: dense weights to start with; None keeps the mesh unchanged.
            finest: index of the mesh of the source if coarser LODs start with its new weights.
        """
        self.listed[lod].append(len(self.meshes))
        self.names.append(name)
        if rows is None:
            self.meshes.append(mesh)
            return
        if self.like is not None:
            rows = self.like.weights[name]
        else:
            rows = level_weights(self.ways, self.options.fit, lod, mesh, wanted, rows)
        if finest is not None:
            self.weights[finest] = rows
        if not self.whole:
            made = copy.copy(mesh)
            _set_skin(made, rows)
            self.meshes.append(made)
            return
        shaped = self.options if lod < self.own else replace(self.options, shapes=False)
        made, left = _finish_mesh(self.ways, mesh, rows, wanted, shaped)
        left.name, left.lod = name, lod
        self.meshes.append(made)
        self.errors.append(left)

    def finish(self) -> None:
        """Store the meshes in the Dna."""
        dna = self.work.dna
        dna.meshes, dna.mesh_names, dna.lod_mesh_mapping = self.meshes, self.names, self.listed
        dna.mesh_blend_shape_channel_mapping = np.array(
            [
                (m, t.blend_shape_channel_index)
                for m, mesh in enumerate(self.meshes)
                for t in mesh.blend_shape_targets
            ]
        ).reshape(-1, 2)

    def levels(self) -> list[Level]:
        out = []
        for lod, listed in enumerate(self.listed):
            names = {self.names[m] for m in listed}
            errors = [e for e in self.errors if e.name in names]
            meshes = [self.meshes[m] for m in listed]
            vertices = sum(len(mesh.positions) for mesh in meshes)
            squares = sum((e.joints_rms**2).mean() * e.vertices for e in errors)
            count = max(1, sum(e.vertices for e in errors))
            out.append(
                Level(
                    joints=len(self.work.new[lod]),
                    vertices=vertices,
                    deltas=count_deltas(meshes),
                    rms=float(np.sqrt(squares / count)),
                    largest=max((float(e.joints_largest.max()) for e in errors), default=0.0),
                    largest_with_shapes=max((float(e.largest.max()) for e in errors), default=0.0),
                )
            )
        return out


def _finish_mesh(
    ways: Ways,
    mesh: Mesh,
    rows: Doubles,
    wanted: Doubles,
    options: RigOptions,
) -> tuple[Mesh, MeshErrors]:
    """The mesh with new weights and with blend shapes for the joints' errors; and the errors."""
    work = ways.work
    out = copy.copy(mesh)
    _set_skin(out, rows)
    weights = sk.dense_weights(out, rows.shape[1])
    positions = np.asarray(mesh.positions, np.float64)
    mm = MM.get(work.dna.translation_unit, 10.0)
    channel = channels_of(work.dna)
    between, skin = Between(ways, mesh), sk.Skin(positions, weights)
    found, targets = _no_errors(len(positions), work.names), []
    own = ways.whole[:, weights.any(axis=0)]
    still = np.abs(own - np.eye(3, 4)).max(axis=(1, 2, 3)) < sk.STILL
    for row, column in enumerate(work.columns):
        if still[row] and not wanted[row].any():
            continue  # the error is 0, because neither joints nor shapes move the mesh
        goal = positions + wanted[row]
        error = np.linalg.norm(skin.moved(ways.whole[row]) - wanted[row], axis=1) * mm
        if options.between:
            found.between_largest[row] = between.largest(row, wanted[row], skin) * mm
        found.motion[row] = np.sqrt((wanted[row] ** 2).sum(axis=1).mean()) * mm
        found.joints_rms[row] = np.sqrt((error**2).mean())
        found.joints_largest[row], found.worst_vertex[row] = error.max(), error.argmax()
        if options.shapes and column in channel:
            moved = np.flatnonzero(error > (options.tolerance_mm or 0.0))
            if len(moved):
                shaped = sk.before_skin(goal[moved], weights[moved], ways.whole[row])
                targets.append(
                    BlendShapeTarget(
                        deltas=shaped - positions[moved],
                        vertex_indices=moved,
                        blend_shape_channel_index=channel[column],
                    )
                )
            error[moved] = 0
        found.largest[row] = error.max()
    out.blend_shape_targets = targets
    return out, found


def channels_of(dna: Dna) -> dict[int, int]:
    """Input -> blend shape channel that it drives."""
    channels = dna.blend_shape_channels
    pairs = zip(channels.input_indices, channels.output_indices, strict=True)
    return {int(source): int(channel) for source, channel in pairs}


def _no_errors(vertices: int, expressions: list[str]) -> MeshErrors:
    def none() -> Doubles:
        return np.zeros(len(expressions))

    worst = np.zeros(len(expressions), np.int64)
    return MeshErrors("", vertices, expressions, none(), none(), none(), none(), worst, none())


def _set_skin(mesh: Mesh, rows: Doubles) -> None:
    kept = np.where(rows > _LEAST_WEIGHT, rows, 0)
    kept[~kept.any(axis=1), 0] = 1  # vertices without weights follow the root
    kept /= kept.sum(axis=1, keepdims=True)
    vertex, joint = np.nonzero(kept)
    counts = (kept > 0).sum(axis=1)
    mesh.skin_offsets = np.concatenate([[0], np.cumsum(counts)])
    mesh.skin_weights = kept[vertex, joint]
    mesh.skin_joint_indices = joint
    mesh.maximum_influence_per_vertex = int(counts.max())
