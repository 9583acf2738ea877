# SPDX-License-Identifier: MIT
"""Cuts and subdivides polygon meshes, by linear operators for positions and displacements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[Any]  # Any, because NumPy's stubs lose the type in arithmetic
Ints = NDArray[Any]


class Operator:
    """A sparse matrix; `apply` converts values [n, k] to [rows, k]."""

    def __init__(self, rows: Ints, columns: Ints, weights: Floats, shape: tuple[int, int]) -> None:
        self.rows, self.columns, self.weights, self.shape = rows, columns, weights, shape
        self._used = np.unique(columns)

    def apply(self, values: Floats) -> Floats:
        flat = values.reshape(len(values), -1)
        out = np.zeros((self.shape[0], flat.shape[1]))
        # skips the multiplication for values that are all 0, as most expressions are on most meshes
        moves = flat[self._used].any()
        for k in range(flat.shape[1] if moves else 0):
            terms = self.weights * flat[self.columns, k]
            out[:, k] = np.bincount(self.rows, terms, minlength=self.shape[0])
        return out.reshape(self.shape[0], *values.shape[1:])


@dataclass
class Polygons:
    """A polygon mesh: indices of vertices and of texture coordinates for each corner of a face."""

    faces: list[list[int]]
    uv_faces: list[list[int]]
    uvs: Floats  # [T, 2] texture coordinates
    vertex_count: int


def edges_of(faces: list[list[int]]) -> dict[tuple[int, int], list[int]]:
    """Undirected edge -> numbers of its faces."""
    edges: dict[tuple[int, int], list[int]] = {}
    for f, face in enumerate(faces):
        for a, b in zip(face, [*face[1:], face[0]], strict=True):
            edge = (a, b) if a < b else (b, a)
            if edge in edges:
                edges[edge].append(f)
            else:
                edges[edge] = [f]
    return edges


def clip_below(mesh: Polygons, heights: Floats, level: float) -> tuple[Polygons, Operator]:
    """Removes the part of a mesh below a height; edges that cross this height get a new vertex.

    Args:
        mesh: the mesh; not changed.
        heights: float64[V], height of each vertex, by any measure.
        level: height at which the mesh is cut.

    Returns:
        The part that is left, with renumbered vertices, and the operator from old to new vertices.
    """
    rows: list[tuple[int, int, float]] = []
    number: dict[object, int] = {}
    uvs = list(mesh.uvs)
    uv_number: dict[object, int] = {}

    def kept(v: int) -> int:
        if v not in number:
            number[v] = len(number)
            rows.append((number[v], v, 1.0))
        return number[v]

    def cut(a: int, b: int) -> tuple[int, float]:
        low, high = min(a, b), max(a, b)
        t = (level - heights[low]) / (heights[high] - heights[low])
        if (low, high) not in number:
            number[(low, high)] = len(number)
            rows.extend([(number[(low, high)], low, 1 - t), (number[(low, high)], high, t)])
        return number[(low, high)], t if a == low else 1 - t

    faces, uv_faces = [], []
    for face, uv_face in zip(mesh.faces, mesh.uv_faces, strict=True):
        new, new_uv = [], []
        n = len(face)
        for i in range(n):
            a, b = face[i], face[(i + 1) % n]
            if heights[a] >= level:
                new.append(kept(a))
                new_uv.append(uv_face[i])
            if (heights[a] >= level) != (heights[b] >= level):
                vertex, t = cut(a, b)
                ua, ub = uv_face[i], uv_face[(i + 1) % n]
                key = (min(ua, ub), max(ua, ub), vertex)
                if key not in uv_number:
                    uv_number[key] = len(uvs)
                    uvs.append((1 - t) * mesh.uvs[ua] + t * mesh.uvs[ub])
                new.append(vertex)
                new_uv.append(uv_number[key])
        if len(new) >= 3:
            faces.append(new)
            uv_faces.append(new_uv)
    table = np.array(rows)
    operator = Operator(
        table[:, 0].astype(int),
        table[:, 1].astype(int),
        table[:, 2],
        (len(number), mesh.vertex_count),
    )
    return compact_uvs(Polygons(faces, uv_faces, np.array(uvs), len(number))), operator


def compact_uvs(mesh: Polygons) -> Polygons:
    """Drops texture coordinates that no face uses, and renumbers the others."""
    used = sorted({t for face in mesh.uv_faces for t in face})
    number = {t: i for i, t in enumerate(used)}
    uv_faces = [[number[t] for t in face] for face in mesh.uv_faces]
    return Polygons(mesh.faces, uv_faces, mesh.uvs[used], mesh.vertex_count)


def subdivide(mesh: Polygons) -> tuple[Polygons, Operator]:
    """Subdivides once by Catmull-Clark; texture coordinates are subdivided linearly. Returns the
    new mesh, and the operator that converts values of the old vertices to the new ones.

    E. Catmull and J. Clark, "Recursively generated B-spline surfaces on arbitrary topological
    meshes", 1978; borders become cubic B-spline curves.
    """
    vertex_count, face_count = mesh.vertex_count, len(mesh.faces)
    edges = edges_of(mesh.faces)
    edge_number = {edge: i for i, edge in enumerate(edges)}
    entries: list[tuple[int, int, float]] = []
    around: list[list[int]] = [[] for _ in range(vertex_count)]
    borders: list[list[int]] = [[] for _ in range(vertex_count)]
    neighbours: list[list[int]] = [[] for _ in range(vertex_count)]
    for i, face in enumerate(mesh.faces):
        entries += [(vertex_count + i, corner, 1 / len(face)) for corner in face]
        for corner in face:
            around[corner].append(i)
    for (a, b), owners in edges.items():
        row = vertex_count + face_count + edge_number[(a, b)]
        neighbours[a].append(b)
        neighbours[b].append(a)
        if len(owners) == 2:
            entries += [(row, a, 0.25), (row, b, 0.25)]
            for owner in owners:
                face = mesh.faces[owner]
                entries += [(row, corner, 0.25 / len(face)) for corner in face]
        else:
            entries += [(row, a, 0.5), (row, b, 0.5)]
            borders[a].append(b)
            borders[b].append(a)
    for i in range(vertex_count):
        if borders[i] or not around[i]:
            ends = borders[i][:2]
            entries.append((i, i, 1 - 0.125 * len(ends)))
            entries += [(i, end, 0.125) for end in ends]
            continue
        count = len(around[i])
        entries.append((i, i, (count - 3) / count + 1 / count))
        entries += [(i, other, 1 / count**2) for other in neighbours[i]]
        for owner in around[i]:
            face = mesh.faces[owner]
            entries += [(i, corner, 1 / count**2 / len(face)) for corner in face]
    table = np.array(entries)
    operator = Operator(
        table[:, 0].astype(int),
        table[:, 1].astype(int),
        table[:, 2],
        (vertex_count + face_count + len(edges), vertex_count),
    )
    return _split_faces(mesh, edge_number, vertex_count, face_count), operator


def _split_faces(
    mesh: Polygons, edge_number: dict[tuple[int, int], int], vertex_count: int, face_count: int
) -> Polygons:
    uv_edges: dict[tuple[int, int], int] = {}
    uvs = list(mesh.uvs)
    faces, uv_faces = [], []
    for i, (face, uv_face) in enumerate(zip(mesh.faces, mesh.uv_faces, strict=True)):
        corners = len(face)
        middle = len(uvs)
        uvs.append(mesh.uvs[uv_face].mean(axis=0))

        def point(corner: int, face: list[int] = face, corners: int = corners) -> int:
            a, b = face[corner % corners], face[(corner + 1) % corners]
            return vertex_count + face_count + edge_number[(min(a, b), max(a, b))]

        def uv_point(corner: int, uv_face: list[int] = uv_face, corners: int = corners) -> int:
            a, b = uv_face[corner % corners], uv_face[(corner + 1) % corners]
            key = (min(a, b), max(a, b))
            if key not in uv_edges:
                uv_edges[key] = len(uvs)
                uvs.append((mesh.uvs[a] + mesh.uvs[b]) / 2)
            return uv_edges[key]

        for corner in range(corners):
            faces.append(
                [face[corner], point(corner), vertex_count + i, point(corner + corners - 1)]
            )
            uv_faces.append(
                [uv_face[corner], uv_point(corner), middle, uv_point(corner + corners - 1)]
            )
    return Polygons(faces, uv_faces, np.array(uvs), vertex_count + face_count + len(edge_number))
