# SPDX-License-Identifier: MIT
"""Tools for painting textures: changes of size, smooth steps, noise, layers."""

from __future__ import annotations

import numpy as np
from risorius.base.easing import smooth_step

from ..polygons import Floats


def shrunk(image: Floats, side: int) -> Floats:
    """Halves an image until it has at most side * side texels; new texels are means of 2 x 2.

    Args:
        image: float64[h, w, ...]; h and w are powers of two.
        side: side of the largest allowed square.
    """
    while image.shape[0] * image.shape[1] > side * side:
        blocks = image.reshape(image.shape[0] // 2, 2, image.shape[1] // 2, 2, *image.shape[2:])
        image = blocks.mean(axis=(1, 3))
    return image


def enlarged(image: Floats, side: int) -> Floats:
    """float[side, side]: an image enlarged with linear interpolation.

    Args:
        image: float[h, h].
        side: side of the result, a multiple of h.
    """
    times = side // len(image)
    at = (np.arange(side) + 0.5) / times - 0.5
    low = np.clip(np.floor(at).astype(int), 0, len(image) - 2)
    part = np.clip(at - low, 0, 1).astype(np.float32)
    rows = image[low] * (1 - part)[:, None] + image[low + 1] * part[:, None]
    return np.asarray(rows[:, low] * (1 - part) + rows[:, low + 1] * part)


def smooth(low: float, high: float, x: Floats) -> Floats:
    """0 where x is `low`, 1 where x is `high`, smooth between them, and constant beyond; falls with
    x if `low` is above `high`."""
    return smooth_step((x - low) / (high - low))


def noise(size: int, cells: int, random: np.random.Generator) -> Floats:
    """float64[size, size] in [-1, 1]: smooth noise, from a random grid with smooth interpolation.

    Args:
        size: number of texels of a side.
        cells: number of grid cells along a side; more cells make finer noise.
        random: generator of the grid.
    """
    grid = random.uniform(-1, 1, (cells + 1, cells + 1))
    at = np.linspace(0, cells, size, endpoint=False)
    low = at.astype(int)
    t = smooth_step(at - low)
    rows = grid[low] * (1 - t)[:, None] + grid[low + 1] * t[:, None]
    return rows[:, low] * (1 - t) + rows[:, low + 1] * t


def blend(image: Floats, colour: tuple[float, float, float], mask: Floats) -> Floats:
    """Blends a colour over an image [h, w, 3] by a mask [h, w] from 0 to 1."""
    mask = np.clip(mask, 0, 1)[:, :, None]
    return image * (1 - mask) + np.array(colour) * mask
