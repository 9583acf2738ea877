# SPDX-License-Identifier: MIT
"""Converts a control's value to a fraction of another control's value, and back.

Example: mouthClose, which keeps the lips together, is a fraction of jawOpen.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

Numbers = TypeVar("Numbers", bound=npt.NDArray[np.floating[Any]])

# Smaller values of the other control (such as jawOpen) count as LEAST in the division; otherwise
# noise of a face at rest would make the fraction jump between 0 and 1. A rig that multiplies the
# fraction by the other control's value then gets the control's value with an error of at most
# LEAST / 4, which is 0.2 mm between the lips.
LEAST = 0.02


def share_of(part: Numbers, whole: Numbers) -> Numbers:
    """The share `part` / `whole`, clamped to [0, 1]; 0 if both are 0.

    Args:
        part: values of the control, in any shape.
        whole: values of the other control in the same shape; values below LEAST count as LEAST.
    """
    return np.clip(part / np.maximum(whole, LEAST), 0.0, 1.0)


def part_of(share: Numbers, whole: Numbers) -> Numbers:
    """The value of a control from its share: the inverse of share_of(), except for shares that
    share_of() clamped.

    Args:
        share: fractions from 0 to 1, in any shape.
        whole: values of the other control, in the same shape.
    """
    return share * np.maximum(whole, LEAST)
