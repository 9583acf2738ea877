# SPDX-License-Identifier: MIT
"""Smooths values on a surface by its cotangent Laplacian."""

from __future__ import annotations

import numpy as np

from ..._native import SparseCholesky
from ...author.geometry.skeleton import Doubles
from ..surface import Surface

_LEAST, _MOST = 1e-3, 10.0  # bounds of half a cotangent, because slivers give extreme values


def areas(surface: Surface) -> Doubles:
    """float64[V]: a third of the area of the triangles at each vertex.

    Args:
        surface: any surface; every vertex gets at least 1e-4 of the mean area.
    """
    third = np.linalg.norm(surface.face_normals(), axis=1) / 6
    sums = np.bincount(
        surface.triangles.ravel(), np.repeat(third, 3), minlength=len(surface.points)
    )
    return np.maximum(sums, 1e-4 * (sums.mean() or 1.0))


class Smoothing:
    """The Laplacian of a surface, by cotangents (Pinkall and Polthier 1993)."""

    def __init__(self, surface: Surface) -> None:
        """Compute the weights of the edges of `surface`; triangles without area are allowed."""
        self._count = len(surface.points)
        corners = surface.triangles
        first, second, weight = [], [], []
        for k in range(3):
            i, j, across = corners[:, (k + 1) % 3], corners[:, (k + 2) % 3], corners[:, k]
            a = surface.points[i] - surface.points[across]
            b = surface.points[j] - surface.points[across]
            area = np.linalg.norm(np.cross(a, b), axis=1)
            half = np.einsum("ij,ij->i", a, b) / np.maximum(2 * area, 1e-30)
            first.append(i)
            second.append(j)
            weight.append(np.clip(half, _LEAST, _MOST))
        self._first, self._second = np.concatenate(first), np.concatenate(second)
        self._weight = np.concatenate(weight)

    def solver(self, held: Doubles, length: float) -> SparseCholesky:
        """A solver of held x + length^2 L x = right, where L is the Laplacian.

        Args:
            held: float64[V], above 0: weight of each vertex's own value. To give all vertices the
                same weight per area, pass the result of areas().
            length: smoothing radius in the surface's unit.
        """
        weight = length**2 * self._weight
        every = np.arange(self._count)
        low = np.maximum(self._first, self._second)
        high = np.minimum(self._first, self._second)
        apart = low != high  # a triangle may name a vertex twice
        rows = np.concatenate([every, self._first, self._second, low[apart]])
        columns = np.concatenate([every, self._first, self._second, high[apart]])
        values = np.concatenate([held, weight * apart, weight * apart, -weight[apart]])
        return SparseCholesky(rows.astype(np.int32), columns.astype(np.int32), values, self._count)
