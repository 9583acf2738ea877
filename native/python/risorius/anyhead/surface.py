# SPDX-License-Identifier: MIT
"""Defines a triangle mesh, and computes its normals, edges and border."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..author.geometry.skeleton import Doubles, Ints


@dataclass(frozen=True)
class Surface:
    """Triangles in any unit, y up, the face towards +z, the character's left at +x."""

    points: Doubles  # [V, 3]
    triangles: Ints  # [T, 3], counter-clockwise seen from outside

    @staticmethod
    def of_polygons(points: Doubles, faces: Sequence[Sequence[int]]) -> Surface:
        """A surface of polygons, which are split into fans of triangles.

        Args:
            points: float64[V, 3], vertex positions.
            faces: vertices of each polygon, counter-clockwise seen from outside.
        """
        fans = [(f[0], f[k], f[k + 1]) for f in faces for k in range(1, len(f) - 1)]
        return Surface(np.asarray(points, np.float64), np.array(fans, np.int64).reshape(-1, 3))

    def face_normals(self) -> Doubles:
        """float64[T, 3]: normals with twice the area of the triangle as length."""
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        return np.cross(b - a, c - a)

    def normals(self) -> Doubles:
        """float64[V, 3]: unit vertex normals, weighted by area; 0 at a vertex without triangles."""
        out = np.zeros_like(self.points)
        normals = self.face_normals()
        for k in range(3):
            np.add.at(out, self.triangles[:, k], normals)
        length = np.linalg.norm(out, axis=1, keepdims=True)
        return np.divide(out, length, out=np.zeros_like(out), where=length > 0)

    def edges(self) -> Ints:
        """int64[E, 2], each edge once, the smaller vertex first."""
        return np.unique(self._sides(), axis=0)

    def border(self) -> npt.NDArray[np.bool_]:
        """bool[V]: True for vertices of an edge that belongs to only one triangle."""
        edges, times = np.unique(self._sides(), axis=0, return_counts=True)
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

    def _sides(self) -> Ints:
        sides = self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        return np.sort(sides, axis=1)
