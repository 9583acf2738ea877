# SPDX-License-Identifier: MIT
"""Welds vertices that a file duplicates along seams of the texture or of the normals.

Duplicates are on open edges, have the same position, and move equally in all shapes. Texture
coordinates are stored per corner and do not change.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ..geometry.skeleton import Doubles, Ints
from .obj import ObjMesh

_SAME = 1e-6  # tolerance of equal positions, in sizes of the mesh
_FARTHEST = 1e30  # larger coordinates are not welded; a later check of sizes rejects them
_ROUNDINGS = 4  # tolerance in float32 roundings at the largest coordinate


def welded(
    mesh: ObjMesh, deltas: Sequence[Doubles], *, all_polygons: bool = True
) -> tuple[ObjMesh, list[Doubles]]:
    """The welded mesh and its shapes; vertices keep the file's order.

    Args:
        mesh: the mesh of the file.
        deltas: displacements float64[V, 3] of each shape.
        all_polygons: True keeps vertices apart if a polygon would degenerate to a line, so that
            all polygons remain. False removes such polygons.
    """
    of = _first_alike(mesh, deltas)
    if all_polygons and (of != np.arange(len(of))).any():
        root = of.tolist()
        for face in mesh.faces:
            if len({root[v] for v in face}) < min(3, len(set(face))):
                of[face] = face
    kept = np.flatnonzero(of == np.arange(len(of)))
    if len(kept) == len(of):
        return mesh, list(deltas)
    place = np.zeros(len(of), np.int64)
    place[kept] = np.arange(len(kept))
    now = place[of].tolist()
    out = ObjMesh(mesh.positions[kept], mesh.uvs)
    has_uvs = bool(mesh.uv_faces)
    for number, face in enumerate(mesh.faces):
        corners = [now[vertex] for vertex in face]
        apart = [i for i, vertex in enumerate(corners) if vertex != corners[i - 1]]
        if not all_polygons and len({corners[i] for i in apart}) < 3:
            continue
        out.faces.append([corners[i] for i in apart])
        if has_uvs:
            uvs = mesh.uv_faces[number]
            out.uv_faces.append([uvs[i] for i in apart] if uvs else [])
    return out, [delta[kept] for delta in deltas]


def _first_alike(mesh: ObjMesh, deltas: Sequence[Doubles]) -> Ints:
    """int64[V]: the first duplicate of each vertex; itself if it is unique."""
    points = mesh.positions
    out = np.arange(len(points))
    rim = _open_vertices(mesh) if mesh.faces else out[:0]
    if len(rim) < 2:
        return out
    far = float(np.abs(points).max())
    size = min(far, float((points.max(axis=0) / 2 - points.min(axis=0) / 2).max())) * 2
    same = max(_SAME * size, _ROUNDINGS * far * float(np.finfo(np.float32).eps))
    if not 0 < same < _FARTHEST:
        return out
    owner = out.tolist()
    for first, second in _pairs(points, rim, same):
        alike = np.abs(points[first] - points[second]).max(axis=1) <= same
        for delta in deltas:
            alike &= np.abs(delta[first] - delta[second]).max(axis=1) <= same
        for a, b in zip(first[alike].tolist(), second[alike].tolist(), strict=True):
            roots = _root(owner, a), _root(owner, b)
            owner[max(roots)] = min(roots)
    return np.array([_root(owner, vertex) for vertex in range(len(owner))], np.int64)


def _root(owner: list[int], vertex: int) -> int:
    while owner[vertex] != vertex:
        owner[vertex] = owner[owner[vertex]]
        vertex = owner[vertex]
    return vertex


def _open_vertices(mesh: ObjMesh) -> Ints:
    """Vertices of open edges, which belong to a single polygon."""
    faces = mesh.faces
    begins = np.fromiter(itertools.chain.from_iterable(faces), np.int64)
    ends = np.fromiter(itertools.chain.from_iterable((*f[1:], f[0]) for f in faces), np.int64)
    count = len(mesh.positions)
    edges = np.minimum(begins, ends) * count + np.maximum(begins, ends)
    each, counts = np.unique(edges, return_counts=True)
    return np.unique(np.stack(np.divmod(each[counts == 1], count)))


def _pairs(points: Doubles, rim: Ints, same: float) -> list[tuple[Ints, Ints]]:
    """Pairs of vertices in the same grid cell: the cell's first vertex and each other vertex.

    Eight grids are used, shifted by half a cell along every combination of axes, so that two close
    vertices share a cell in at least one grid.

    Args:
        points: float64[V, 3], vertex positions.
        rim: indices of the vertices on open edges.
        same: tolerance of equal positions; a cell has four times this size.
    """
    out = []
    cell = 4 * same
    places = (points[rim] - points[rim].min(axis=0)) / cell
    across = int(places.max()) + 2  # number of cells, at most 250,000, so the cube fits int64
    for shift in itertools.product((0.0, 0.5), repeat=3):
        x, y, z = np.floor(places + shift).astype(np.int64).T
        _, first, of = np.unique(
            (x * across + y) * across + z, return_index=True, return_inverse=True
        )
        one = first[of.ravel()]
        other = np.flatnonzero(one != np.arange(len(rim)))
        out.append((rim[one[other]], rim[other]))
    return out
