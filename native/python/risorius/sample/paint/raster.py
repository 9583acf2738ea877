# SPDX-License-Identifier: MIT
"""From vertices to texels."""

from __future__ import annotations

import numpy as np

from ..polygons import Floats, Polygons


class Raster:
    """Which corners each texel lies between, and where: found once, for any values of vertices.

    Attributes:
        covered: bool[size, size]: which texels a face covers.
    """

    def __init__(self, polygons: Polygons, uvs: Floats, size: int) -> None:
        """Finds the texels of all faces; of two on the same texel the later one has it.

        Args:
            polygons: the mesh.
            uvs: float64[T, 2] in [0, 1].
            size: texels of a side.
        """
        self._corners = np.zeros((size, size, 3), np.int32)
        self._shares = np.zeros((size, size, 3), np.float32)
        self.covered = np.zeros((size, size), bool)
        for face, uv_face in zip(polygons.faces, polygons.uv_faces, strict=True):
            for k in range(1, len(face) - 1):
                corners = [0, k, k + 1]
                uv = uvs[[uv_face[c] for c in corners]] * size - 0.5
                self._triangle([face[c] for c in corners], uv)

    def _triangle(self, vertices: list[int], uv: Floats) -> None:
        low = np.maximum(np.floor(uv.min(axis=0)).astype(int) - 1, 0)
        high = np.minimum(np.ceil(uv.max(axis=0)).astype(int) + 2, len(self.covered))
        (ax, ay), (bx, by), (cx, cy) = uv
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if (high <= low).any() or abs(area) < 1e-9:
            return
        x, y = np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1]))
        b = ((x - ax) * (cy - ay) - (cx - ax) * (y - ay)) / area
        c = ((bx - ax) * (y - ay) - (x - ax) * (by - ay)) / area
        a = 1 - b - c
        inside = (a >= -1e-3) & (b >= -1e-3) & (c >= -1e-3)
        rows, columns = y[inside], x[inside]
        self._shares[rows, columns] = np.stack([a[inside], b[inside], c[inside]], axis=1)
        self._corners[rows, columns] = vertices
        self.covered[rows, columns] = True

    def image(self, values: Floats) -> Floats:
        """float64[size, size, k]: values of vertices; 0 where no face is.

        Args:
            values: float64[V, k].
        """
        out = np.zeros((*self.covered.shape, values.shape[1]))
        corners, shares = self._corners[self.covered], self._shares[self.covered]
        out[self.covered] = sum(shares[:, k, None] * values[corners[:, k]] for k in range(3))
        return out


def bleed(image: Floats, covered: Floats, steps: int = 8) -> Floats:
    """Grow the painted islands, so that filtering finds no foreign colour at their rims.

    Args:
        image: float64[h, w, 3].
        covered: bool[h, w]: what is painted.
        steps: by how many texels; what is left then gets the mean colour.
    """
    image, covered = image.copy(), covered.copy()
    for _ in range(steps):
        for axis, shift in ((0, 1), (0, -1), (1, 1), (1, -1)):
            near = np.roll(covered, shift, axis) & ~covered
            image[near] = np.roll(image, shift, axis)[near]
            covered |= near
    image[~covered] = image[covered].mean(axis=0)
    return image
