# SPDX-License-Identifier: MIT
"""Tools for all textures: sizes, smooth steps, noise, layers."""

from __future__ import annotations

import numpy as np
from risorius.base.easing import smooth_step

from ..polygons import Floats


def shrunk(image: Floats, side: int) -> Floats:
    """An image halved until it has at most side * side texels; each new texel is the mean of 2 x 2.

    Args:
        image: float64[h, w, ...]; h and w are powers of two.
        side: side of the largest square.
    """
    while image.shape[0] * image.shape[1] > side * side:
        blocks = image.reshape(image.shape[0] // 2, 2, image.shape[1] // 2, 2, *image.shape[2:])
        image = blocks.mean(axis=(1, 3))
    return image


def enlarged(image: Floats, side: int) -> Floats:
    """An image [h, h] enlarged to this side, linear between the texels.

    Args:
        image: float[h, h].
        side: a multiple of h.
    """
    times = side // len(image)
    at = (np.arange(side) + 0.5) / times - 0.5
    low = np.clip(np.floor(at).astype(int), 0, len(image) - 2)
    part = np.clip(at - low, 0, 1).astype(np.float32)
    rows = image[low] * (1 - part)[:, None] + image[low + 1] * part[:, None]
    return np.asarray(rows[:, low] * (1 - part) + rows[:, low + 1] * part)


def smooth(low: float, high: float, x: Floats) -> Floats:
    """0 at x = low and below, 1 at x = high and above, smooth in between."""
    return smooth_step((x - low) / (high - low))


def noise(size: int, cells: int, random: np.random.Generator) -> Floats:
    """Smooth noise [size, size] in [-1, 1]: a random grid, interpolated with smooth steps.

    Args:
        size: texels of a side.
        cells: grid cells along a side; more cells make finer noise.
        random: source of the grid.
    """
    grid = random.uniform(-1, 1, (cells + 1, cells + 1))
    at = np.linspace(0, cells, size, endpoint=False)
    low = at.astype(int)
    t = smooth_step(at - low)
    rows = grid[low] * (1 - t)[:, None] + grid[low + 1] * t[:, None]
    return rows[:, low] * (1 - t) + rows[:, low + 1] * t


def blend(image: Floats, colour: tuple[float, float, float], mask: Floats) -> Floats:
    """An image [h, w, 3] with a colour laid over it by a mask [h, w] from 0 to 1."""
    mask = np.clip(mask, 0, 1)[:, :, None]
    return image * (1 - mask) + np.array(colour) * mask
