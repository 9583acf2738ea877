# SPDX-License-Identifier: MIT
"""The opacity of the lashes' cards."""

from __future__ import annotations

import numpy as np

from ..polygons import Floats

LASH_SIZE = (4096, 256, 330)  # width, height, hairs over the strips' whole length


def paint_lashes() -> Floats:
    """Opacity of the lashes' strips: curved hairs that taper from the lid (v = 0) to the tip."""
    random = np.random.default_rng(5)
    width, height, count = LASH_SIZE
    image = np.zeros((height, width))
    v = (np.arange(height) + 0.5) / height
    for number in range(count):
        root = (number + random.uniform(0.1, 0.9)) / count * width
        lean, bend = random.normal(0, 5), random.normal(0, 9)
        length, thick = random.uniform(0.55, 1.0), random.uniform(2.0, 3.2)
        middle = root + lean * v + bend * v**2
        half = thick * np.sqrt(np.clip(1 - v / length, 0, 1))
        low = int(max(0, middle.min() - 6))
        x = np.arange(low, min(width, int(middle.max()) + 7)) + 0.5
        hair = np.clip(half[:, None] - np.abs(x[None, :] - middle[:, None]) + 0.5, 0, 1)
        part = image[:, low : low + len(x)]
        np.maximum(part, hair, out=part)
    return image
