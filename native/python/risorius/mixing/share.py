# SPDX-License-Identifier: MIT
"""Computes mixed points from weights of the parents."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..author.geometry.skeleton import Doubles


@dataclass
class Share:
    """Weights of the parents for n vertices or joints of a mix.

    Attributes:
        weights: float64[n, P], rows sum to 1.
        scaled: float64[n, P], weights times the scale of each parent's region.
        shift: float64[n, 3], added to mixed positions.
    """

    weights: Doubles
    scaled: Doubles
    shift: Doubles

    @property
    def is_whole(self) -> bool:
        """Whether no region is scaled or shifted."""
        return self.scaled is self.weights

    def places(self, points: Sequence[object]) -> Doubles:
        """float64[n, 3]: the mixed positions of corresponding points of the parents.

        Args:
            points: float64[n, 3] of each parent.
        """
        if self.is_whole:
            return mean_of(points, self.weights)
        return _sum_of([np.asarray(p, np.float64) for p in points], self.scaled) + self.shift


def mean_of(values: Sequence[object], weights: Doubles) -> Doubles:
    """float64[n, ...]: the weighted mean of equally shaped arrays; unchanged if all are equal.

    Args:
        values: float64[n, ...] of each parent.
        weights: float64[n, P], rows sum to 1.
    """
    rows = [np.asarray(v, np.float64) for v in values]
    if all(np.array_equal(rows[0], row) for row in rows[1:]):
        return rows[0].copy()
    return _sum_of(rows, weights)


def _sum_of(rows: Sequence[Doubles], weights: Doubles) -> Doubles:
    shape = (-1, *[1] * (rows[0].ndim - 1))
    return np.asarray(sum(weights[:, p].reshape(shape) * row for p, row in enumerate(rows)))
