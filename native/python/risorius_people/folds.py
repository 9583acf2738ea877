# SPDX-License-Identifier: MIT
"""Locates the laugh line, along which a smile folds the cheek over the lip.

Lengths are in decimetres.
"""

from __future__ import annotations

import numpy as np
from risorius.base.easing import smooth_step

from .polygons import Floats

_DOWN = (0.36, 0.50, 0.62, 0.74, 0.86)  # points of the laugh line: distance below the eye
# The same points of the laugh line, from the eye down: distance from the middle of the face.
_ASIDE = (0.165, 0.215, 0.27, 0.325, 0.345)


def from_laugh_line(places: Floats) -> tuple[Floats, Floats]:
    """Distance from the laugh line, which runs from the wing of the nose past the mouth.

    Args:
        places: float64[..., 3] on the man's head, relative to the point between his eyes.

    Returns:
        Distances float64[...], positive on the cheek and negative on the lip; and weights
        float64[...], 1 at the height of the line, 0 beyond its ends and for places more than 0.5
        behind the eyes.
    """
    x, y = np.abs(places[..., 0]), places[..., 1]
    away = 0.86 * (x - np.interp(-y, _DOWN, _ASIDE))
    there = smooth_step((-y - 0.36) / 0.10) * smooth_step((0.90 + y) / 0.14)
    return away, np.asarray(there * smooth_step((places[..., 2] + 0.5) / 0.2))
