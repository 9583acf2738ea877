# SPDX-License-Identifier: MIT
"""Simplifies large meshes for the fit of joints, and carries the weights back to all vertices."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Generic, TypeVar

import numpy as np

from ... import Dna, Mesh, _native
from ...base.patience import patiently
from . import skeleton as sk
from .blocks import SparseWeights, split_mesh
from .simplify import Floats, fan_triangles, fewer_triangles, simplified
from .skeleton import Doubles, Ints
from .wanted import Face, Wanted, known_attributes

F = TypeVar("F", bound=Face)
_SMALL = 2000  # vertices: smaller meshes are not simplified
_FACING = 0.4  # least cosine between the normals of a vertex and of its place when simplified


@dataclass
class Simplified:
    """A simplified mesh. Its vertices are vertices of the whole mesh.

    Attributes:
        mesh: the simplified mesh with skin weights and blend shapes.
        kept: int64[n], index in the whole mesh of each vertex.
        corners: int64[V, 3], vertices of the simplified mesh that surround each vertex of the whole
            mesh.
        shares: float64[V, 3], weight of each of these corners; each row has the sum 1.
    """

    mesh: Mesh
    kept: Ints
    corners: Ints
    shares: Doubles

    def carried(self, rows: Doubles) -> SparseWeights:
        """Weights of all vertices of the whole mesh.

        Args:
            rows: float64[n, joints], weights of the vertices of the simplified mesh.
        """
        most = min(int((rows > 0).sum(axis=1).max(initial=1)), rows.shape[1])
        own = np.argsort(-rows, axis=1, kind="stable")[:, :most].astype(np.int32)
        weights = np.take_along_axis(rows, own.astype(np.int64), axis=1).astype(np.float32)
        joints = np.concatenate([own[self.corners[:, k]] for k in range(3)], axis=1)
        shares = self.shares.astype(np.float32)
        mixed = np.concatenate(
            [weights[self.corners[:, k]] * shares[:, k, None] for k in range(3)], axis=1
        )
        return SparseWeights(joints, mixed, rows.shape[1])


@dataclass
class Fewer(Generic[F]):
    """A face for the fit of joints, whose large meshes are simplified.

    Attributes:
        work: the face, in which simplified meshes replace the large meshes at the same indices.
        wanted: index of a mesh -> displacements of the mesh in each expression.
        meshes: the simplified meshes by index.
        made: the simplified meshes with weights on the new joints; empty before these are known.
    """

    work: F
    wanted: dict[int, Wanted]
    meshes: dict[int, Simplified]
    made: dict[int, Mesh] = field(default_factory=dict)


def fewer_vertices(
    work: F,
    shaped: Sequence[int],
    wanted: Mapping[int, Wanted],
    most: int,
    attributes: dict[int, Floats],
    levels: Mapping[tuple[int, int], Ints],
    go_on: Callable[[], None],
) -> Fewer[F] | None:
    """Simplify meshes for the fit of joints. Returns None if they have at most `most` vertices.

    Args:
        work: the face.
        shaped: indices of the meshes that are fitted.
        wanted: index of a mesh -> displacements of the mesh in each expression.
        most: wanted number of vertices of all these meshes.
        attributes: index of a mesh -> result of attributes_of(), which the simplification
            preserves; meshes without an entry are added.
        levels: (level, mesh) -> int64[n, 3], the layout indices of each triangle of a coarser LOD.
        go_on: called before each mesh; raises an error to stop.
    """
    counts = {m: len(wanted[m]) for m in shaped}
    if sum(counts.values()) <= most:
        return None
    large = [m for m in shaped if counts[m] > _SMALL]
    rest = max(most - sum(counts[m] for m in shaped if m not in large), _SMALL)
    share = rest / max(sum(counts[m] for m in large), 1)
    made: dict[int, Simplified] = {}
    for m in large:
        go_on()
        budget = max(round(share * counts[m]), _SMALL)
        known = known_attributes(attributes, m, wanted[m])
        finer = None if wanted[m].small else _finer(levels, m, budget)
        simplify = partial(fewer_triangles, wanted[m].mesh, known, budget, finer)
        triangles = patiently(simplify, go_on)
        if budget < counts[m] and len(triangles):
            made[m] = patiently(partial(_simplified, wanted[m], triangles), go_on)
    source = _with_meshes(work.source, {m: fewer.mesh for m, fewer in made.items()})
    small = copy.copy(work)
    small.source = source
    own = {m: Wanted(small, made[m].mesh) if m in made else wanted[m] for m in shaped}
    return Fewer(small, own, made)


def _finer(levels: Mapping[tuple[int, int], Ints], m: int, vertices: int) -> Ints | None:
    """The triangles of mesh `m` at the coarsest LOD that has more than 4 * `vertices` triangles;
    None if no LOD has more."""
    able = [t for (_, mesh), t in levels.items() if mesh == m and len(t) > 4 * vertices]
    return min(able, key=len, default=None)


def _with_meshes(dna: Dna, changed: Mapping[int, Mesh]) -> Dna:
    out = copy.copy(dna)
    out.meshes = [changed.get(m, mesh) for m, mesh in enumerate(dna.meshes)]
    return out


def _simplified(wanted: Wanted, triangles: Ints) -> Simplified:
    mesh, kept = simplified(wanted.mesh, triangles)
    (part,) = split_mesh(wanted.mesh, [kept])
    mesh.skin_offsets, mesh.skin_weights = part.skin_offsets, part.skin_weights
    mesh.skin_joint_indices = part.skin_joint_indices
    mesh.blend_shape_targets = part.blend_shape_targets
    corners, shares = _nearest(wanted.mesh, mesh)
    _take_own(wanted, kept, corners, shares)
    corners[kept], shares[kept] = np.arange(len(kept))[:, None], [1.0, 0.0, 0.0]
    return Simplified(mesh, kept, corners, shares)


def _nearest(whole: Mesh, small: Mesh) -> tuple[Ints, Doubles]:
    """For each vertex of the whole mesh, int64[V, 3]: the corners of the nearest triangle of the
    simplified mesh, and float64[V, 3]: barycentric coordinates. Only triangles with a similar
    normal are searched; if there is none, all triangles are searched."""
    positions = np.asarray(small.positions, np.float64)
    triangles = np.asarray(small.layout_positions, np.int64)[fan_triangles(small)]
    points = np.asarray(whole.positions, np.float64)
    normals = _normals(whole)
    tree = _native.ClosestPoints(positions, np.ascontiguousarray(triangles, np.int32))
    found, shares, _ = tree.nearest(points, normals, _FACING)
    lost = np.flatnonzero(found < 0)
    if len(lost):
        found[lost], shares[lost], _ = tree.nearest(points[lost])
    return triangles[found], np.array(shares, np.float64)


def _normals(mesh: Mesh) -> Doubles:
    """float64[V, 3]: unit vertex normals; 0 for a vertex without polygons."""
    points = np.asarray(mesh.positions, np.float64)
    triangles = np.asarray(mesh.layout_positions, np.int64)[fan_triangles(mesh)]
    a, b, c = (points[triangles[:, k]] for k in range(3))
    area = np.cross(b - a, c - a)
    out = np.stack(
        [
            sum(np.bincount(triangles[:, k], area[:, axis], len(points)) for k in range(3))
            for axis in range(3)
        ],
        axis=1,
    )
    return np.asarray(out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-30))


def _take_own(wanted: Wanted, kept: Ints, corners: Ints, shares: Doubles) -> None:
    """Correct `corners` and `shares` of vertices that were matched to the wrong part of the mesh,
    such as vertices of a lip that lie nearer to the other lip.

    A vertex gets the kept vertex that is nearest along the edges if the motion of this kept vertex
    is more similar to the vertex's motion than the motion of the nearest triangle.

    Args:
        wanted: the displacements of the whole mesh.
        kept: int64[n], index in the whole mesh of each vertex of the simplified mesh.
        corners, shares: the attributes of the same names of Simplified; changed.
    """
    of_kept = wanted.at(kept)
    owner = _owners(wanted.mesh, kept)
    for block in wanted.blocks():
        at = block.vertices
        placed, alone = np.zeros(len(at)), np.zeros(len(at))
        for row in np.flatnonzero(block.wanted.any(axis=(1, 2))).tolist():
            way, own = block.wanted[row], of_kept[row]
            mixed = sum(shares[at, k, None] * own[corners[at, k]] for k in range(3))
            placed += np.square(mixed - way).sum(axis=1)
            alone += np.square(own[owner[at]] - way).sum(axis=1)
        better = at[alone < placed]
        corners[better], shares[better] = owner[better, None], [1.0, 0.0, 0.0]


def _owners(mesh: Mesh, kept: Ints) -> Ints:
    """int64[V]: for each vertex, the kept vertex that is reached first along edges, as index in
    `kept`; 0 for a vertex on an island without kept vertices."""
    owner = np.full(len(mesh.positions), -1)
    owner[kept] = np.arange(len(kept))
    edges = sk.mesh_edges(mesh).astype(np.int64)
    while len(edges):
        known = owner[edges] >= 0
        edges, known = edges[~known.all(axis=1)], known[~known.all(axis=1)]
        reached = known.any(axis=1)
        if not reached.any():
            break
        ends = np.where(known[reached, :1], edges[reached], edges[reached, ::-1])
        owner[ends[:, 1]] = owner[ends[:, 0]]
    return np.maximum(owner, 0)
