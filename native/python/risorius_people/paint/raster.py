# SPDX-License-Identifier: MIT
"""Interpolates values of vertices at the texels of a texture."""

from __future__ import annotations

import numpy as np

from ..polygons import Floats, Ints, Polygons

_AT_ONCE = 1 << 20  # largest number of texels that are searched together


class Raster:
    """The triangle and the weights of each texel that a polygon covers, for interpolation.

    Attributes:
        covered: bool[size, size], whether a polygon covers a texel.
        where: int[n], the covered texels, numbered row by row.
    """

    def __init__(self, polygons: Polygons, uvs: Floats, size: int) -> None:
        """Finds the texels of all polygons; if two polygons overlap, the later one counts.

        Args:
            polygons: mesh with texture coordinates.
            uvs: float64[T, 2] in [0, 1].
            size: number of texels of a side.
        """
        corners, places = [], []
        for face, uv_face in zip(polygons.faces, polygons.uv_faces, strict=True):
            for k in range(1, len(face) - 1):
                corners.append((face[0], face[k], face[k + 1]))
                places.append((uv_face[0], uv_face[k], uv_face[k + 1]))
        self._corners: Ints = np.array(corners, np.int32)
        self._uv: Floats = uvs[np.array(places)] * size - 0.5
        self._owner = np.full(size * size, -1, np.int32)
        self._all_shares = np.zeros((size * size, 2), np.float32)
        low = np.maximum(np.floor(self._uv.min(axis=1)).astype(int), 0)
        high = np.minimum(np.ceil(self._uv.max(axis=1)).astype(int) + 1, size)
        room = np.prod(np.maximum(high - low, 0), axis=1)
        room[np.abs(self._double_area()) < 1e-9] = 0
        begin = 0
        total = np.cumsum(room)
        while begin < len(room):
            done = total[begin - 1] if begin else 0
            end = max(begin + 1, int(np.searchsorted(total, done + _AT_ONCE)))
            self._triangles(begin, min(end, len(room)), low, high - low, room, size)
            begin = end
        self.covered = (self._owner >= 0).reshape(size, size)
        self.where: Ints = np.flatnonzero(self._owner >= 0)
        self._owner, self._shares = self._owner[self.where], self._all_shares[self.where]
        del self._all_shares

    def _double_area(self) -> Floats:
        a, b = self._uv[:, 1] - self._uv[:, 0], self._uv[:, 2] - self._uv[:, 0]
        return np.asarray(a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1])

    def _triangles(
        self, begin: int, end: int, low: Ints, span: Ints, room: Ints, size: int
    ) -> None:
        """Finds the texels inside some triangles, in the rectangle around each triangle.

        Args:
            begin, end: first triangle, and the triangle after the last one.
            low: int[F, 2], lowest column and row of each triangle's rectangle.
            span: int[F, 2], columns and rows of the rectangle.
            room: int[F], number of texels of the rectangle.
            size: number of texels of a side of the texture.
        """
        count = room[begin:end]
        which = np.repeat(np.arange(begin, end), count)
        if not len(which):
            return
        number = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        wide = span[which, 0]
        column, row = low[which, 0] + number % wide, low[which, 1] + number // wide
        a, ab, ac = (
            self._uv[which, 0],
            (self._uv[:, 1] - self._uv[:, 0])[which],
            (self._uv[:, 2] - self._uv[:, 0])[which],
        )
        x, y = column - a[:, 0], row - a[:, 1]
        area = self._double_area()[which]
        b = (x * ac[:, 1] - y * ac[:, 0]) / area
        c = (y * ab[:, 0] - x * ab[:, 1]) / area
        inside = (b >= -1e-3) & (c >= -1e-3) & (b + c <= 1 + 1e-3)
        texel = (row * size + column)[inside]
        self._owner[texel] = which[inside]
        self._all_shares[texel] = np.column_stack([b, c])[inside]

    def values(self, values: Floats) -> Floats:
        """float32[n, k]: values of vertices, interpolated at the covered texels.

        Args:
            values: float[V, k], values of the vertices.
        """
        values = values.astype(np.float32)
        first, second, third = self._corners.T
        out = values[first][self._owner]
        for share, corner in zip(self._shares.T, (second, third), strict=True):
            out += share[:, None] * (values[corner] - values[first])[self._owner]
        return np.asarray(out)

    def steps(self, places: Floats) -> Floats:
        """float32[n, 2]: width and height of each covered texel on the surface.

        Args:
            places: float64[V, 3], positions of the vertices; results are in the same unit.
        """
        uv = np.stack([self._uv[:, k] - self._uv[:, 0] for k in (1, 2)], axis=1)
        edges = places[self._corners[:, 1:]] - places[self._corners[:, :1]]
        flat = np.abs(self._double_area()) < 1e-9
        uv[flat] = np.eye(2)
        ways = np.linalg.solve(uv, edges)
        lengths = np.linalg.norm(ways, axis=2).astype(np.float32)
        return np.asarray(lengths[self._owner])

    def spread(self, values: Floats) -> Floats:
        """An image float32[size, size] or [size, size, k] of values at the covered texels, 0
        elsewhere.

        Args:
            values: float[n] or [n, k], values at the covered texels.
        """
        size = len(self.covered)
        out = np.zeros((size * size, *values.shape[1:]), np.float32)
        out[self.where] = values
        return out.reshape(size, size, *values.shape[1:])

    def image(self, values: Floats) -> Floats:
        """float32[size, size, k]: an image of values of vertices, 0 where no polygon is.

        Args:
            values: float[V, k], values of the vertices.
        """
        return self.spread(self.values(values))


def filled(image: Floats, covered: Floats) -> Floats:
    """The image with uncovered texels filled with colours of nearby covered texels.

    Filtering of the texture then shows no other colour at the rims of islands, and the space
    between islands compresses well.

    Args:
        image: float[h, w, ...]; h and w are powers of two.
        covered: bool[h, w], whether a texel is painted.
    """
    bare = ~covered
    share = covered.astype(np.float32)
    if image.ndim == 3:
        share = share[..., None]
    out = image.astype(np.float32)
    out[bare] = 0
    coarse, share = _halves(out), _halves(share)
    coarse = _filled(coarse, share)
    rows, columns = np.nonzero(bare)
    out[rows, columns] = coarse[rows // 2, columns // 2]
    return out


def _halves(whole: Floats) -> Floats:
    rows = whole[0::2] + whole[1::2]
    return np.asarray((rows[:, 0::2] + rows[:, 1::2]) / 4)


def _filled(image: Floats, share: Floats) -> Floats:
    """Image / share, the mean of the covered texels in each block; blocks without covered texels
    take the value of a coarser level.

    Args:
        image: float32[h, w, ...], mean of each block, with 0 for uncovered texels.
        share: float32[h, w, ...], fraction of covered texels in each block.
    """
    mean = image / np.maximum(share, 1e-6)
    bare = share == 0
    if min(image.shape[:2]) < 2 or not bare.any():
        return np.asarray(mean)
    coarse = _filled(_halves(image), _halves(share))
    for axis in (0, 1):
        coarse = np.repeat(coarse, 2, axis)
    return np.asarray(np.where(bare, coarse, mean))
