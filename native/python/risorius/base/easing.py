# SPDX-License-Identifier: MIT
"""Smooth transitions between two values."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[Any]  # Any, because NumPy's stubs lose the type in arithmetic


def smooth_step(x: Floats) -> Floats:
    """0 below 0, 1 above 1, and smooth in between: x * x * (3 - 2 * x)."""
    t = np.clip(x, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)
