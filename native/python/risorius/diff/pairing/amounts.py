# SPDX-License-Identifier: MIT
"""Measures changes of numbers, and writes them in familiar units."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from .pairs import Bools

Floats = npt.NDArray[np.float32]
_MILLIMETRES = {"cm": 10.0, "m": 1000.0}


def differs(a: Floats, b: Floats) -> Bools:
    """bool[...]: whether two float32 arrays a and b of one shape differ in any bit.

    A NaN is equal to itself; 0 and -0 are not equal.
    """
    return a.view(np.uint32) != b.view(np.uint32)


def near(a: Floats, b: Floats) -> Bools:
    """bool[...]: whether two float32 arrays a and b of one shape are equal up to rounding.

    The tolerance is 1e-5 times the number in a, at least 1e-5. NaN is near nothing.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        wide = a.astype(np.float64)
        return np.abs(wide - b) <= 1e-5 * np.maximum(1.0, np.abs(wide))


def largest(a: Floats, b: Floats) -> float:
    """The largest |a - b| of float32 arrays of one shape; infinite if either is not finite."""
    with np.errstate(invalid="ignore", over="ignore"):
        apart = np.abs(a.astype(np.float64) - b.astype(np.float64))
    apart = np.where(np.isnan(apart), np.inf, apart)
    return float(np.max(apart, initial=0.0))


def length(amount: float, unit: str) -> str:
    """A length as text, e.g. "0.3 mm".

    Args:
        amount: length in the file's translation unit.
        unit: the translation unit, "cm" or "m"; for any other, the text has no unit.
    """
    if unit not in _MILLIMETRES:
        return f"{amount:.3g}"
    millimetres = amount * _MILLIMETRES[unit]
    if millimetres >= 10_000:
        return f"{millimetres / 1000:,.3g} m"
    return f"{millimetres / 10:.3g} cm" if millimetres >= 100 else f"{millimetres:.3g} mm"


def angle(amount: float, unit: str) -> str:
    """An angle as text, always in degrees, e.g. "0.5 degrees".

    Args:
        amount: angle in the file's rotation unit.
        unit: the rotation unit, "degrees" or "radians".
    """
    degrees = math.degrees(amount) if unit == "radians" else amount
    return f"{degrees:.3g} degree{'' if degrees == 1 else 's'}"


def by(amount: float, words: str, several: bool) -> str:
    """A change as the end of a sentence, e.g. "by up to 0.3 mm".

    Args:
        amount: the largest change; 0 if only the sign of a zero changed, infinite if a number is
            not finite.
        words: the amount as text, from `length` or `angle`.
        several: True: more than one number changed, which gives "up to".
    """
    if amount == 0:
        return "only from 0 to -0 or back"
    if math.isinf(amount):
        return "to or from what is not a finite number"
    return f"by {'up to ' if several else ''}{words}"
