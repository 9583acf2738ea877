# SPDX-License-Identifier: MIT
"""Curves with keyframes at different times, and resampling of curves to common times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..base.budget import Budget

Doubles = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]

CONSTANT, LINEAR, CUBIC = 0, 1, 2
# Bytes per value while a clip is made: float64 twice, float32 once.
VALUE_BYTES = 20


@dataclass
class Keys:
    """The keyframes (keys) of one curve, with their interpolation.

    Attributes:
        times: float64[keys], seconds, ascending.
        values: float64[keys].
        kinds: uint8[keys], interpolation after each key: CONSTANT, LINEAR or CUBIC; empty: linear
            everywhere.
        leave: float64[keys], slope just after each key, per second; empty unless a key is CUBIC.
        arrive: float64[keys], slope just before each key, per second; empty as `leave`.
    """

    times: Doubles
    values: Doubles
    kinds: Bytes = field(default_factory=lambda: np.zeros(0, np.uint8))
    leave: Doubles = field(default_factory=lambda: np.zeros(0))
    arrive: Doubles = field(default_factory=lambda: np.zeros(0))

    @property
    def is_straight(self) -> bool:
        return self.kinds.size == 0 or bool((self.kinds[:-1] == LINEAR).all())

    def sample(self, at: Doubles) -> Doubles:
        """Values at times in seconds, constant before the first and after the last key; 0 for a
        curve without keys."""
        if self.times.size == 0:
            return np.zeros(at.size)
        straight = np.interp(at, self.times, self.values)
        if self.is_straight:
            return straight
        i = np.clip(np.searchsorted(self.times, at, side="right") - 1, 0, self.times.size - 2)
        kind = self.kinds[i]
        inside = (at >= self.times[0]) & (at < self.times[-1])
        out = np.where(inside & (kind == CONSTANT), self.values[i], straight)
        if (self.kinds == CUBIC).any():
            out = np.where(inside & (kind == CUBIC), self._hermite(at, i), out)
        return out

    def _hermite(self, at: Doubles, i: npt.NDArray[np.intp]) -> Doubles:
        length = self.times[i + 1] - self.times[i]
        u = (at - self.times[i]) / length
        first, second = self.values[i], self.values[i + 1]
        return (
            (2 * u**3 - 3 * u**2 + 1) * first
            + (u**3 - 2 * u**2 + u) * length * self.leave[i]
            + (3 * u**2 - 2 * u**3) * second
            + (u**3 - u**2) * length * self.arrive[i + 1]
        )


def on_one_clock(
    curves: Sequence[Keys], rate: float | None, budget: Budget
) -> tuple[Doubles, Doubles]:
    """Resamples all curves at the union of their keyframe times.

    Linear curves are then exact. If a curve is smooth or stepped, all curves are also sampled
    `rate` times per second.

    Args:
        curves: curves with keyframes; a curve without any becomes 0.
        rate: samples per second, or None for no samples between keyframes.
        budget: budget of the file.

    Returns:
        float64[frames], seconds, and float64[curves, frames].

    Raises:
        BudgetError: too many curves with different keyframe times, or keyframes too far apart.
    """
    # Each array of times is used once, because curves with equal times normally share one array.
    parts = list({id(keys.times): keys.times for keys in curves if keys.times.size}.values())
    if not parts:
        return np.zeros(0), np.zeros((len(curves), 0))
    count = sum(part.size for part in parts)
    budget.hold(count * 4 * 8, f"{count} times of keys")
    times = np.unique(np.concatenate(parts))
    if rate is not None and not all(keys.is_straight for keys in curves):
        _take(len(curves), (times[-1] - times[0]) * rate, times, budget)
        count = int(np.floor((times[-1] - times[0]) * rate + 1e-6)) + 1
        times = np.union1d(times, times[0] + np.arange(count) / rate)
    # Keyframe times closer than a microsecond differ by rounding only, and become one time.
    times = times[np.concatenate([[True], np.diff(times) > 1e-6])]
    _take(len(curves), times.size, times, budget)
    rows = np.empty((len(curves), times.size))
    for row, keys in zip(rows, curves, strict=True):
        row[:] = keys.sample(times)
    return times, rows


def _take(curves: int, frames: float, times: Doubles, budget: Budget) -> None:
    place = (
        f"{curves} curves of {frames:.0f} frames, from a key at {times[0]:g} s to one at "
        f"{times[-1]:g} s"
    )
    budget.hold(curves * frames * VALUE_BYTES, place)
    budget.work(curves * frames, place)
