# SPDX-License-Identifier: MIT
"""Reduces skin weights to the number of joints per vertex that all glTF viewers support."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

INFLUENCES = 4


def strongest(dense: Doubles) -> tuple[Ints, Doubles]:
    """int64[V, 4], float64[V, 4]: the four strongest joints of each vertex, and their weights.

    Weights are multiples of 1 / 255, and the weights of a vertex add up to 1.

    Args:
        dense: float64[V, joints], all weights, for at least four joints; each vertex has a weight
            above 0.
    """
    joints = np.argsort(-dense, axis=1, kind="stable")[:, :INFLUENCES]
    weights = np.take_along_axis(dense, joints, axis=1)
    steps = np.rint(255 * weights / weights.sum(axis=1, keepdims=True))
    steps[:, 0] += 255 - steps.sum(axis=1)  # the strongest takes what rounding leaves
    joints[steps <= 0] = 0
    return joints, steps / 255
