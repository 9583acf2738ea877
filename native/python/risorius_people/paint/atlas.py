# SPDX-License-Identifier: MIT
"""The texture atlas of all hair cards of a person: its tiles by kind of hair."""

from __future__ import annotations

import numpy as np

from ..polygons import Floats, Ints

ATLAS_SIZE = 1024
# Kind -> first column and row, width and height of a tile in texels, and tiles per row.
TILES = {
    "scalp": (0, 512, 128, 512, 8),
    "brows": (0, 256, 64, 256, 8),
    "lashes": (512, 256, 32, 256, 16),
    "beard": (0, 0, 64, 256, 8),
    "solid": (512, 0, 64, 256, 4),  # opaque hair
}
DENSE = 5  # scalp tiles below this number are dense, the rest thin
_FIRST = {"scalp": 0, "brows": 8, "lashes": 16, "beard": 32, "solid": 40}
_MARGIN = 1.0  # border of a tile in texels that cards leave out


def tile(kind: str, numbers: Ints) -> Ints:
    """Atlas numbers of the tiles of one kind, int64[n].

    Args:
        kind: a key of TILES.
        numbers: int64[n], numbers within the kind; any integers, they wrap around.
    """
    return np.asarray(_FIRST[kind] + numbers % TILES[kind][4])


def tile_corners(tiles: Ints) -> tuple[Floats, Floats]:
    """Texture coordinates of a tile: left end of the root and right end of the tip, float64[n, 2]
    each.

    Args:
        tiles: int64[n].
    """
    table = np.zeros((64, 4))
    for kind, (left, low, width, height, count) in TILES.items():
        for k in range(count):
            at = left + k * width
            table[_FIRST[kind] + k] = (
                at + _MARGIN,
                low + _MARGIN,
                at + width - _MARGIN,
                low + height - _MARGIN,
            )
    rows = table[tiles] / ATLAS_SIZE
    return rows[:, :2], rows[:, 2:]
