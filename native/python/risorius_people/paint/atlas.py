# SPDX-License-Identifier: MIT
"""The picture that all cards of a person share: which hairs are where in it."""

from __future__ import annotations

import numpy as np

from ..polygons import Floats, Ints

ATLAS_SIZE = 1024
# Kind -> first column and row, width and height of a tile in texels, and how many stand in a row.
TILES = {
    "scalp": (0, 512, 128, 512, 8),
    "brows": (0, 256, 64, 256, 8),
    "lashes": (512, 256, 32, 256, 16),
    "beard": (0, 0, 64, 256, 8),
    "solid": (512, 0, 64, 256, 4),  # hair that nothing shows through
}
DENSE = 5  # tiles of the scalp before this one are dense, the others thin
_FIRST = {"scalp": 0, "brows": 8, "lashes": 16, "beard": 32, "solid": 40}
_MARGIN = 1.0  # texels beside a tile that cards leave out


def tile(kind: str, numbers: Ints) -> Ints:
    """int64[n]: numbers of tiles of a kind in the atlas.

    Args:
        kind: of TILES.
        numbers: int64[n] among those of the kind; any integers.
    """
    return np.asarray(_FIRST[kind] + numbers % TILES[kind][4])


def tile_corners(tiles: Ints) -> tuple[Floats, Floats]:
    """float64[n, 2] each: the texture place of the root's left end, and of the tip's right one.

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
