# SPDX-License-Identifier: MIT
"""Controls that take back a share of another one: lips that stay together under an open jaw.

A capture says how far (mouthClose, as large as jawOpen where the lips are shut), a raw control
says which share (mouthLipsTogether, 1 where they are shut): the one over the other.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

Numbers = TypeVar("Numbers", bound=npt.NDArray[np.floating[Any]])

# Below this jaw the share falls to 0 with the part: a still face's noise over noise would jump
# between 0 and 1. What it leaves open is a quarter of it at most, 0.2 mm between lips.
LEAST = 0.02


def share_of(part: Numbers, whole: Numbers) -> Numbers:
    """The share of `whole` that `part` is, 0 to 1; 0 where both are 0.

    Args:
        part: any shape.
        whole: the same shape; what is below LEAST counts as LEAST.
    """
    return np.clip(part / np.maximum(whole, LEAST), 0.0, 1.0)


def part_of(share: Numbers, whole: Numbers) -> Numbers:
    """What share_of was given, where it was not cut off.

    Args:
        share: any shape.
        whole: the same shape.
    """
    return share * np.maximum(whole, LEAST)
