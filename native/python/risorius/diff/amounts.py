# SPDX-License-Identifier: MIT
"""How much numbers changed, in units that people think in."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from .pairs import Bools

Floats = npt.NDArray[np.float32]
_MILLIMETRES = {"cm": 10.0, "m": 1000.0}


def differs(a: Floats, b: Floats) -> Bools:
    """Where the bits differ: a NaN is equal to itself, 0 and -0 are not equal."""
    return a.view(np.uint32) != b.view(np.uint32)


def near(a: Floats, b: Floats) -> Bools:
    """Where the numbers are equal but for rounding."""
    with np.errstate(invalid="ignore", over="ignore"):
        wide = a.astype(np.float64)
        return np.abs(wide - b) <= 1e-5 * np.maximum(1.0, np.abs(wide))


def largest(a: Floats, b: Floats) -> float:
    """The largest difference; infinite where one is not finite."""
    with np.errstate(invalid="ignore", over="ignore"):
        apart = np.abs(a.astype(np.float64) - b.astype(np.float64))
    apart = np.where(np.isnan(apart), np.inf, apart)
    return float(np.max(apart, initial=0.0))


def length(amount: float, unit: str) -> str:
    """A length of the file's translation unit, e.g. "0.3 mm"."""
    if unit not in _MILLIMETRES:
        return f"{amount:.3g}"
    millimetres = amount * _MILLIMETRES[unit]
    if millimetres >= 10_000:
        return f"{millimetres / 1000:,.3g} m"
    return f"{millimetres / 10:.3g} cm" if millimetres >= 100 else f"{millimetres:.3g} mm"


def angle(amount: float, unit: str) -> str:
    """An angle of the file's rotation unit, e.g. "0.5 degrees"."""
    degrees = math.degrees(amount) if unit == "radians" else amount
    return f"{degrees:.3g} degree{'' if degrees == 1 else 's'}"


def by(amount: float, words: str, several: bool) -> str:
    """E.g. "by up to 0.3 mm"."""
    if amount == 0:
        return "only from 0 to -0 or back"
    if math.isinf(amount):
        return "to or from what is not a finite number"
    return f"by {'up to ' if several else ''}{words}"
