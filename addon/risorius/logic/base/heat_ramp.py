# SPDX-License-Identifier: GPL-3.0-or-later
"""The colours of heat maps (viridis): from blue-violet over green to yellow.

Brightness grows from cool to hot, so colour-blind people and grey prints see the same order.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# Colours at equal steps from cool to hot, in sRGB, 0 to 1.
ANCHORS = (
    (0.267, 0.005, 0.329),
    (0.283, 0.141, 0.458),
    (0.254, 0.265, 0.530),
    (0.207, 0.372, 0.553),
    (0.164, 0.471, 0.558),
    (0.128, 0.567, 0.551),
    (0.135, 0.659, 0.518),
    (0.267, 0.749, 0.441),
    (0.478, 0.821, 0.318),
    (0.741, 0.873, 0.150),
    (0.993, 0.906, 0.144),
)


def colours(shares: NDArray[np.float64]) -> NDArray[np.float32]:
    """The sRGB colours of values on the heat map.

    Args:
        shares: float64[n], values from 0 (cool) to 1 (hot); others are clamped to this range.

    Returns:
        float32[n, 4], opaque.
    """
    table = np.array(ANCHORS)
    steps = np.linspace(0.0, 1.0, len(table))
    out = np.ones((len(shares), 4), np.float32)
    for channel in range(3):
        out[:, channel] = np.interp(shares, steps, table[:, channel])
    return out


def linear(srgb: NDArray[np.float32]) -> NDArray[np.float32]:
    """Convert sRGB colours to scene-linear colours, float32[n, 4]; alpha stays.

    Args:
        srgb: float32[n, 4].
    """
    out = srgb.copy()
    low = srgb[:, :3] / 12.92
    high = ((srgb[:, :3] + 0.055) / 1.055) ** 2.4
    out[:, :3] = np.where(srgb[:, :3] <= 0.04045, low, high)
    return out
