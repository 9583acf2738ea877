# SPDX-License-Identifier: MIT
"""Paints the colour of a shirt: jersey with visible loops."""

from __future__ import annotations

import numpy as np

from ..polygons import Floats
from .images import noise

CLOTH_SIZE = 256
_LOOPS = 64  # number of loops across the texture, which repeats


def paint_cloth(colour: tuple[float, float, float]) -> Floats:
    """float64[CLOTH_SIZE, CLOTH_SIZE, 3]: columns of loops, with lighter and darker threads.

    Args:
        colour: colour of the shirt, sRGB in [0, 1].
    """
    random = np.random.default_rng(13)
    at = np.arange(CLOTH_SIZE) / CLOTH_SIZE * _LOOPS
    x, y = np.meshgrid(at, at)
    loops = np.sin(2 * np.pi * x) * np.sin(2 * np.pi * y + np.pi * np.abs(np.sin(np.pi * x)))
    shade = 1 + 0.06 * loops + 0.03 * noise(CLOTH_SIZE, 128, random)
    return np.asarray(np.clip(np.array(colour) * shade[:, :, None], 0, 1))
