# SPDX-License-Identifier: MIT
"""Curves as keys, each with times of its own, and how they come to share one clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from ..errors import ArgumentError

Doubles = npt.NDArray[np.float64]
Bytes = npt.NDArray[np.uint8]

CONSTANT, LINEAR, CUBIC = 0, 1, 2
# Values of all curves together: 2 GB; a file that asks for more is not animation.
MAX_VALUES = 1 << 28


@dataclass
class Keys:
    """Keys of one curve.

    Attributes:
        times: float64[keys], seconds, ascending.
        values: float64[keys].
        kinds: uint8[keys], how the curve goes on after each key; empty: straight throughout.
        leave: float64[keys], slope after each key, per second; empty unless a key is CUBIC.
        arrive: float64[keys], slope before each key, per second.
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
        """Values at times, held before the first key and after the last."""
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


def on_one_clock(curves: Sequence[Keys], rate: float | None = None) -> tuple[Doubles, Doubles]:
    """All curves at the times of all keys.

    Straight lines between the frames are then the curves themselves. Curves that bend or step are
    also taken `rate` times a second.

    Args:
        rate: frames a second, or None: nothing between keys.

    Returns:
        float64[frames] seconds; float64[curves, frames].

    Raises:
        ValueError: more than MAX_VALUES of them.
    """
    parts = [keys.times for keys in curves if keys.times.size]
    if not parts:
        return np.zeros(0), np.zeros((len(curves), 0))
    times = np.unique(np.concatenate(parts))
    if rate is not None and not all(keys.is_straight for keys in curves):
        _check_size(len(curves), (times[-1] - times[0]) * rate)
        count = int(np.floor((times[-1] - times[0]) * rate + 1e-6)) + 1
        times = np.union1d(times, times[0] + np.arange(count) / rate)
    # Key times that were rounded apart by a tool are one time.
    times = times[np.concatenate([[True], np.diff(times) > 1e-6])]
    _check_size(len(curves), times.size)
    return times, np.array([keys.sample(times) for keys in curves])


def _check_size(curves: int, frames: float) -> None:
    if curves * frames > MAX_VALUES:
        raise ArgumentError(f"{curves} curves of {frames:.0f} frames are more than can be held")
