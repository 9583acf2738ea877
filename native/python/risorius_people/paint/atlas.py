# SPDX-License-Identifier: MIT
"""Defines the texture atlas of hair cards: a group of tiles for each kind of hair."""

from __future__ import annotations

import numpy as np

from ..polygons import Floats, Ints

ATLAS_SIZE = 1024
# Kind -> (column and row at which the first tile begins, width and height of a tile, all in texels;
# number of tiles, which are side by side).
TILES = {
    "scalp": (0, 512, 128, 512, 8),
    "brows": (0, 256, 64, 256, 8),
    "lashes": (512, 256, 32, 256, 16),
    "beard": (0, 0, 64, 256, 8),
    "solid": (512, 0, 64, 256, 4),  # opaque hair
}
DENSE = 5  # scalp tiles with a smaller number are dense, the others thin
_FIRST = {"scalp": 0, "brows": 8, "lashes": 16, "beard": 32, "solid": 40}
_MARGIN = 1.0  # texels at the border of a tile that cards do not use


def tile(kind: str, numbers: Ints) -> Ints:
    """int64[n]: atlas numbers of tiles of one kind.

    Args:
        kind: kind of hair, a key of TILES.
        numbers: int64[n], numbers within the kind; too large numbers wrap around.
    """
    return np.asarray(_FIRST[kind] + numbers % TILES[kind][4])


def tile_corners(tiles: Ints) -> tuple[Floats, Floats]:
    """Corners of tiles in texture coordinates, float64[n, 2] each: left end of the root, right end
    of the tip.

    Args:
        tiles: int64[n], atlas numbers.
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
