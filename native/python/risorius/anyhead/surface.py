# SPDX-License-Identifier: MIT
"""Defines a triangle mesh, and computes its normals, edges and border."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..author.geometry.skeleton import Doubles, Ints


@dataclass(frozen=True)
class Surface:
    """Triangles in any unit; functions state the direction of the head that they expect."""

    points: Doubles  # [V, 3]
    triangles: Ints  # [T, 3], counter-clockwise seen from outside

    @staticmethod
    def of_polygons(points: Doubles, faces: Sequence[Sequence[int]]) -> Surface:
        """A surface of polygons, which are split into fans of triangles.

        Args:
            points: float64[V, 3], vertex positions.
            faces: vertices of each polygon, counter-clockwise seen from outside.
        """
        sizes = np.fromiter(map(len, faces), np.int64, len(faces))
        corners = np.fromiter(itertools.chain.from_iterable(faces), np.int64, int(sizes.sum()))
        fans = np.maximum(sizes - 2, 0)
        first = np.repeat(np.cumsum(sizes) - sizes, fans)
        step = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
        rows = np.stack([first, first + step + 1, first + step + 2], axis=1)
        return Surface(np.asarray(points, np.float64), corners[rows])

    def face_normals(self) -> Doubles:
        """float64[T, 3]: normals with twice the area of the triangle as length."""
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        return np.cross(b - a, c - a)

    def normals(self) -> Doubles:
        """float64[V, 3]: unit vertex normals, weighted by area; 0 at a vertex without triangles."""
        out = np.zeros_like(self.points)
        normals = self.face_normals()
        for k in range(3):
            for axis in range(3):
                out[:, axis] += np.bincount(self.triangles[:, k], normals[:, axis], len(out))
        length = np.linalg.norm(out, axis=1, keepdims=True)
        return np.divide(out, length, out=np.zeros_like(out), where=length > 0)

    def edges(self) -> Ints:
        """int64[E, 2]: the vertices of each edge, the smaller index first; each edge occurs
        once."""
        return self._edges()[0]

    def border(self) -> npt.NDArray[np.bool_]:
        """bool[V]: True for vertices of an edge that belongs to only one triangle."""
        edges, times = self._edges()
        out = np.zeros(len(self.points), bool)
        out[edges[times == 1]] = True
        return out

    def at(self, triangle: Ints, shares: Doubles) -> Doubles:
        """float64[n, 3]: points on the surface.

        Args:
            triangle: int[n], triangle of each point.
            shares: float64[n, 3], barycentric coordinates in the triangle.
        """
        return np.einsum("nk,nkd->nd", shares, self.points[self.triangles[triangle]])

    def _edges(self) -> tuple[Ints, Ints]:
        """int64[E, 2]: the vertices of each edge, which occurs once; int64[E]: the number of
        triangles that have the edge."""
        sides = self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64)
        count = max(len(self.points), 1)
        key, times = np.unique(sides.min(axis=1) * count + sides.max(axis=1), return_counts=True)
        return np.stack(np.divmod(key, count), axis=1), times
