# SPDX-License-Identifier: MIT
"""Seamless tiles of skin patterns: mottling, and dots for pores and the fine net between them.

Lengths are in texels of the tile. Tiles wrap around; `laid` repeats them over a texture.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..polygons import Floats, Ints


def mottling(
    side: int, width: float, random: np.random.Generator, high: float | None = None
) -> Floats:
    """float32[side, side]: smooth noise with mean 0, standard deviation 1, spots `width` wide.

    Args:
        side: side of the tile in texels.
        width: width of a spot in texels.
        random: generator of the spots.
        high: height of a spot in texels; None: equal to `width`.
    """
    across = np.fft.rfftfreq(side) * width
    up = np.fft.fftfreq(side) * (width if high is None else high)
    kept = np.exp(-(up[:, None] ** 2 + across**2) * 1.8**2)
    kept[0, 0] = 0
    white = np.fft.rfft2(random.normal(size=(side, side)))
    out = np.fft.irfft2(white * kept, (side, side))
    return np.asarray(out / out.std(), np.float32)


@dataclass(frozen=True)
class Dots:
    """Random points, one in each cell of a grid, and the distance of each texel from them.

    Attributes:
        near: float32[side, side], distance to the nearest point, in sides of a cell.
        gap: float32[side, side], distance to the second nearest point minus `near`.
        rank: float32[side, side], random number from 0 to 1 that belongs to the nearest point.
    """

    near: Floats
    gap: Floats
    rank: Floats

    def over(
        self, share: Floats, at: Ints, size: float, soft: float = 0.35, bent: Floats | float = 0.0
    ) -> Floats:
        """float32[n]: a mask at some texels, 1 in dots, 0 outside; a fraction of the points gets
        dots.

        Args:
            share: float[n], 0 to 1, fraction of the points with a dot.
            at: int[n], texels of the tile, numbered row by row.
            size: radius of the largest dots, in sides of a cell.
            soft: fraction of the radius over which a dot fades out.
            bent: float[n], added to the distance, to make dots irregular.
        """
        rank = self.rank.ravel()[at]
        # A dot grows with share - rank, so dots at the edge of a region are small.
        radius = size * np.clip(1.6 * (share - rank) / np.maximum(share, 1e-6), 0, 1)
        depth = (radius - self.near.ravel()[at] - bent) / np.maximum(soft * radius, 1e-6)
        return np.asarray(np.clip(depth, 0, 1) * (share > rank), np.float32)


def dots(side: int, cell: float, random: np.random.Generator, loose: float = 0.8) -> Dots:
    """Makes a tile of dots.

    Args:
        side: side of the tile in texels.
        cell: approximate side of a cell in texels; a whole number of cells fills the tile.
        random: generator of the points.
        loose: largest distance of a point from the middle of its cell, 0 to 1, as a fraction of
            half a cell.
    """
    count = max(3, round(side / cell))
    point = (0.5 + loose * random.uniform(-0.5, 0.5, (count, count, 2))).astype(np.float32)
    rank = random.uniform(0, 1, (count, count)).astype(np.float32)
    at = ((np.arange(side) + 0.5) * count / side).astype(np.float32)
    low = at.astype(int)
    part = (at - low).astype(np.float32)
    near = np.full((side, side), 9.0, np.float32)
    second, ranks = near.copy(), np.zeros_like(near)
    for di in (-1, 0, 1):
        for dj in (-1, 0, 1):
            i, j = (low + di) % count, (low + dj) % count
            up = di + point[..., 0][i][:, j] - part[:, None]
            away = np.hypot(up, dj + point[..., 1][i][:, j] - part[None, :])
            nearer = away < near
            np.minimum(second, away, out=second)
            np.copyto(second, near, where=nearer)
            np.copyto(ranks, rank[i][:, j], where=nearer)
            np.copyto(near, away, where=nearer)
    return Dots(near, second - near, ranks)


def laid(where: Ints, size: int, side: int, shift: tuple[int, int] = (0, 0)) -> Ints:
    """int[n]: the texel of a repeated tile that covers each texel of a texture.

    Args:
        where: int[n], texels of the texture, numbered row by row.
        size: side of the texture in texels.
        side: side of the tile in texels.
        shift: rows and columns by which the tile is shifted, so that two patterns do not coincide.
    """
    rows, columns = np.divmod(where, size)
    return np.asarray(((rows + shift[0]) % side) * side + (columns + shift[1]) % side)
