# SPDX-License-Identifier: MIT
"""Controls that take back a share of another control, such as lips that stay together on an open
jaw.

A capture has the amount (mouthClose, as large as jawOpen if the lips are shut); a raw control has
the share (mouthLipsTogether, 1 if they are shut), which is the amount divided by jawOpen.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

Numbers = TypeVar("Numbers", bound=npt.NDArray[np.floating[Any]])

# Below this jaw opening the share falls to 0 with the amount; otherwise the noise of a still face
# would make it jump between 0 and 1. At most a quarter of LEAST is lost, 0.2 mm between the lips.
LEAST = 0.02


def share_of(part: Numbers, whole: Numbers) -> Numbers:
    """The share `part` / `whole`, 0 to 1; 0 if both are 0.

    Args:
        part: any shape.
        whole: the same shape; values below LEAST count as LEAST.
    """
    return np.clip(part / np.maximum(whole, LEAST), 0.0, 1.0)


def part_of(share: Numbers, whole: Numbers) -> Numbers:
    """The inverse of share_of, unless its result was clamped.

    Args:
        share: any shape.
        whole: the same shape.
    """
    return share * np.maximum(whole, LEAST)
