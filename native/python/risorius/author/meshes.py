# SPDX-License-Identifier: MIT
"""Makes the meshes of a joint rig: fits weights, adds corrective shapes, and measures errors."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .. import BlendShapeTarget, Dna, Mesh
from .between import Between, Ways
from .geometry import skeleton as sk
from .geometry.blocks import LARGE, SparseWeights, joined_targets, split_mesh
from .geometry.fewer import Fewer
from .geometry.simplify import simplified
from .geometry.skeleton import Doubles, Ints
from .geometry.wanted import Wanted
from .level_meshes import LevelMeshes
from .level_weights import inherited, level_weights
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
Rows = Doubles | SparseWeights  # weights on all joints, of a large mesh as SparseWeights


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
        fewer: Fewer[Work] | None = None,
        go_on: Callable[[], None] = lambda: None,
    ) -> None:
        """Prepare an empty list of meshes.

        Args:
            work: the face; it must already have the new joints.
            options: options of the rig.
            weights: mesh -> float64[V, joints] of the finest meshes, or of their simplified meshes.
            coarse: triangles of the coarser LODs.
            like: reference whose joints and weights are reused, or None.
            whole: whether to make blend shapes and measure errors.
            fewer: the simplified meshes to which the joints were fitted, or None.
            go_on: called before each mesh and each block; raises an error to stop.
        """
        self.whole, self.fewer, self.go_on = whole, fewer, go_on
        self.work, self.options, self.like = work, options, like
        self.weights: dict[int, Rows] = dict(weights)
        self.coarse = coarse
        self.triangles: dict[str, Ints] = {}  # coarse mesh -> layout indices of the fine mesh
        self.ways = Ways(work)
        self.meshes: list[Mesh] = []
        self.names: list[str] = []
        self.listed: list[list[int]] = []
        self.errors: list[MeshErrors] = []
        self.own = max(1, work.source.lod_count)
        self._numbers: dict[int, int] = {}  # mesh of the source -> mesh here; levels share meshes

    def add_level(self, lod: int, wanted: dict[int, Wanted], needs: set[int]) -> None:
        """Make the meshes of a LOD: meshes of the source, or simplified meshes of LOD 0.

        Args:
            lod: index of the LOD; LODs are added in order.
            wanted: mesh of the source -> its displacements.
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
                name = source.mesh_names[m]
                if m in self.weights:
                    self._add_finest(lod, m, name, wanted[m])
                else:
                    start = self._start(mesh) if m in needs else None
                    self._add(lod, mesh, name, wanted[m], start)
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
            if m in needs:
                self._add_coarse(lod, coarse, name, wanted[m], m, kept)
            else:
                self._add(lod, coarse, name, wanted[m], None)

    def _triangles(self, lod: int, m: int, name: str) -> Ints:
        """int64[n, 3]: triangles of a coarse mesh, as indices of the fine mesh's vertex layouts;
        n is 0 if there are none."""
        none = np.zeros((0, 3), np.int64)
        if self.like is not None:
            return self.like.triangles.get(level_name(name, lod), none)
        return self.coarse.triangles.get((lod, m), none)

    def _start(self, mesh: Mesh) -> Doubles:
        """Weights float64[V, joints] of the nearest vertices of the meshes of LOD 0."""
        source = self.work.source
        fine = np.concatenate([np.asarray(source.meshes[m].positions) for m in self.weights])
        rows = np.concatenate([w[np.arange(len(w))] for w in self.weights.values()])
        positions = np.asarray(mesh.positions)
        lengths = (fine**2).sum(axis=1)
        nearest = [
            (lengths - 2 * positions[at : at + 256] @ fine.T).argmin(axis=1)
            for at in range(0, len(positions), 256)
        ]
        return rows[np.concatenate(nearest)]

    def _add(self, lod: int, mesh: Mesh, name: str, wanted: Wanted, start: Doubles | None) -> None:
        """Add a mesh whose weights are fitted.

        Args:
            lod: index of the LOD.
            mesh: the mesh with its weights in the source.
            name: name of the mesh.
            wanted: displacements of the mesh.
            start: float64[V, joints], weights to start with; None keeps the mesh unchanged.
        """
        self._listed(lod, name)
        if start is None:
            self.meshes.append(mesh)
            return
        every = wanted.at(np.arange(len(wanted)))
        self._finished(lod, mesh, name, wanted, self._fitted(lod, mesh, name, every, start))

    def _listed(self, lod: int, name: str) -> None:
        self.go_on()
        self.listed[lod].append(len(self.meshes))
        self.names.append(name)

    def _fitted(self, lod: int, mesh: Mesh, name: str, wanted: Doubles, start: Doubles) -> Doubles:
        """float64[V, joints]: the weights of the reference; without a reference, weights whose fit
        starts with `start`."""
        if self.like is not None:
            return self.like.weights[name]
        return level_weights(self.ways, self.options.fit, lod, mesh, wanted, start)

    def _add_finest(self, lod: int, m: int, name: str, wanted: Wanted) -> None:
        """Add a mesh of LOD 0. The fits of coarser LODs start with its weights."""
        self._listed(lod, name)
        mesh, start = wanted.mesh, self.weights[m]
        small = self.fewer.meshes.get(m) if self.fewer is not None else None
        if small is not None and self.fewer is not None:
            assert not isinstance(start, SparseWeights)
            if not wanted.small:
                self._add_large(lod, m, name, wanted, start)
                return
            start = small.carried(start)
        every = np.arange(len(wanted))
        self.weights[m] = self._fitted(lod, mesh, name, wanted.at(every), start[every])
        self._finished(lod, mesh, name, wanted, self.weights[m])

    def _add_large(self, lod: int, m: int, name: str, wanted: Wanted, start: Doubles) -> None:
        """Add a large mesh of LOD 0 with the weights that were fitted to its simplified mesh."""
        assert self.fewer is not None
        small = self.fewer.meshes[m]
        own = self.fewer.wanted[m].at(np.arange(len(small.kept)))
        rows = self._fitted(lod, small.mesh, name, own, start)
        made, left = _finish_mesh(self.ways, small.mesh, rows, own, self.options)
        _set_skin(made, rows)
        self.fewer.made[m] = made
        self.weights[m] = small.carried(rows)
        self._finished(lod, wanted.mesh, name, wanted, self.weights[m])
        if self.whole:  # between 0 and 1, only the errors of the simplified mesh are measured
            self.errors[-1].between_largest = left.between_largest

    def _add_coarse(
        self, lod: int, mesh: Mesh, name: str, wanted: Wanted, m: int, kept: Ints
    ) -> None:
        """Add the mesh of a coarser LOD that was simplified from a mesh of LOD 0.

        Args:
            lod: index of the LOD.
            mesh: the simplified mesh with its weights in the source.
            name: name of the mesh.
            wanted: displacements of the finest mesh.
            m: index of the finest mesh.
            kept: index in the finest mesh of each vertex.
        """
        self._listed(lod, name)
        finest = self.weights[m]
        if len(kept) <= LARGE or not isinstance(finest, SparseWeights):
            own = wanted.at(kept)
            rows: Rows = self._fitted(lod, mesh, name, own, finest[kept])
            at = np.arange(len(kept))
        else:  # the errors of a large mesh are measured at some of its vertices
            rows = inherited(self.work, finest.some(kept), lod)
            at = np.arange(0, len(kept), -(-len(kept) // LARGE))
            own = wanted.at(kept[at])
        made = copy.copy(mesh)
        _set_skin(made, rows)
        self.meshes.append(made)
        if self.whole:
            between = self.options.between and wanted.small
            options = replace(self.options, shapes=False, between=between)
            (part,) = split_mesh(mesh, [at])
            _, left = _finish_mesh(self.ways, part, rows[at], own, options)
            left.name, left.lod, left.vertices = name, lod, len(kept)
            left.worst_vertex = at[left.worst_vertex]
            self.errors.append(left)

    def _finished(self, lod: int, mesh: Mesh, name: str, wanted: Wanted, rows: Rows) -> None:
        """Add a mesh with its weights, with blend shapes for the joints' errors, and the errors.

        Args:
            lod: index of the LOD.
            mesh: the mesh with its weights in the source.
            name: name of the mesh.
            wanted: displacements of the mesh.
            rows: new weights of the vertices on all joints.
        """
        made = copy.copy(mesh)
        _set_skin(made, rows)
        self.meshes.append(made)
        if not self.whole:
            return
        shaped = self.options if lod < self.own else replace(self.options, shapes=False)
        shaped = replace(shaped, between=shaped.between and wanted.small)
        parts, left = [], _no_errors(len(wanted), self.work.names)
        for block in wanted.blocks():
            self.go_on()
            own = rows[block.vertices]
            part, errors = _finish_mesh(self.ways, block.mesh, own, block.wanted, shaped)
            parts.append((block.vertices, part.blend_shape_targets))
            _take_errors(left, errors, block.vertices)
        made.blend_shape_targets = joined_targets(parts)
        left.name, left.lod = name, lod
        self.errors.append(left)

    def finish(self) -> None:
        """Store the finished meshes of all LODs in the face of joints."""
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
    """The mesh with new weights and with blend shapes for the joints' errors; and the errors.

    Args:
        ways: joint motions of the face.
        mesh: the mesh with its weights in the source.
        rows: float64[V, joints], new weights.
        wanted: float64[E, V, 3], displacements with each expression at 1.
        options: options of the rig.
    """
    work = ways.work
    out = copy.copy(mesh)
    weights = _kept_weights(rows)
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


def _take_errors(whole: MeshErrors, part: MeshErrors, vertices: Ints) -> None:
    """Merge the errors of a block of vertices into the errors of the mesh.

    Args:
        whole: errors of the mesh; changed.
        part: errors of the block.
        vertices: index in the mesh of each vertex of the block.
    """
    worse = part.joints_largest > whole.joints_largest
    whole.worst_vertex[worse] = vertices[part.worst_vertex[worse]]
    share = part.vertices / whole.vertices
    whole.motion = np.sqrt(whole.motion**2 + share * part.motion**2)
    whole.joints_rms = np.sqrt(whole.joints_rms**2 + share * part.joints_rms**2)
    for key in ("joints_largest", "largest", "between_largest"):
        setattr(whole, key, np.maximum(getattr(whole, key), getattr(part, key)))


def _kept_weights(rows: Doubles) -> Doubles:
    """float64[V, joints]: the weights above 0.001, scaled so that each row has the sum 1."""
    kept = np.where(rows > _LEAST_WEIGHT, rows, 0)
    kept[~kept.any(axis=1), 0] = 1  # vertices without weights follow the root
    kept /= kept.sum(axis=1, keepdims=True)
    return np.asarray(kept)


def _set_skin(mesh: Mesh, rows: Rows) -> None:
    counts, joints, weights = [], [], []
    for begin in range(0, len(rows), LARGE):
        kept = _kept_weights(rows[np.arange(begin, min(begin + LARGE, len(rows)))])
        vertex, joint = np.nonzero(kept)
        counts.append((kept > 0).sum(axis=1))
        joints.append(joint)
        weights.append(kept[vertex, joint].astype(np.float32))
    number = np.concatenate([np.zeros(1, np.int64), *counts])
    mesh.skin_offsets = np.cumsum(number)
    mesh.skin_weights = np.concatenate(weights)
    mesh.skin_joint_indices = np.concatenate(joints)
    mesh.maximum_influence_per_vertex = int(number.max())
