# SPDX-License-Identifier: MIT
"""Filters against noise, for complete curves and for live values."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .errors import ArgumentError

Doubles = npt.NDArray[np.float64]


def gaussian(curves: npt.ArrayLike, times: Doubles, width: float, reach: int) -> Doubles:
    """Smooth curves with a mean around each frame, weighted by a Gaussian over time; without delay.

    At the ends the mean uses only the existing frames.

    Args:
        curves: [..., N] values at N frames.
        times: float64[N] seconds, ascending.
        width: standard deviation of the Gaussian in seconds, above 0.
        reach: number of frames before and after each frame that are included.

    Returns:
        float64[..., N].
    """
    values = np.asarray(curves, np.float64)
    count = len(times)
    total, weights = np.zeros(values.shape), np.zeros(count)
    reach = min(reach, count - 1)
    for lag in range(-reach, reach + 1):
        here = slice(max(0, -lag), count - max(0, lag))
        there = slice(max(0, lag), count - max(0, -lag))
        weight = np.exp(-0.5 * ((times[there] - times[here]) / width) ** 2)
        total[..., here] += values[..., there] * weight
        weights[here] += weight
    return np.asarray(total / np.maximum(weights, 1e-300))


class OneEuro:
    """The one-euro filter for live values: a low pass whose cutoff grows with speed.

    A low `cutoff` suppresses noise of slow motion; a high `beta` lets fast motion pass with little
    delay.
    From: Casiez, Roussel, Vogel, "1 euro filter", CHI 2012.

    Attributes:
        cutoff: cutoff frequency at speed 0, in Hz; may be changed between frames.
        beta: growth of the cutoff: Hz per (unit per second) of speed.
        speed_cutoff: cutoff frequency for the speed in Hz.
        longest_gap: seconds between two frames; after a gap of this length or longer, or a step
            back in time, the filter restarts. None: it never restarts.
    """

    def __init__(
        self,
        cutoff: float = 1.5,
        beta: float = 5.0,
        speed_cutoff: float = 1.0,
        longest_gap: float | None = None,
    ) -> None:
        """Start without previous values.

        Args:
            cutoff: cutoff frequency at speed 0, in Hz, above 0.
            beta: growth of the cutoff with speed, 0 or more.
            speed_cutoff: cutoff for the speed in Hz, above 0.
            longest_gap: seconds; None: no gap restarts the filter, and a frame that is not later
                than the last one returns the last values.

        Raises:
            ArgumentError: a number outside of these ranges.
        """
        if not (cutoff > 0.0 and beta >= 0.0 and speed_cutoff > 0.0):
            raise ArgumentError("cutoffs above 0 Hz and a beta of 0 or more were expected")
        self.cutoff, self.beta, self.speed_cutoff = cutoff, beta, speed_cutoff
        self.longest_gap = longest_gap
        self._time = 0.0
        self._values: Doubles | None = None
        self._speeds: Doubles | None = None

    def __call__(self, time: float, values: npt.ArrayLike) -> Doubles:
        """Filtered values of a frame.

        Args:
            time: time in seconds. A repeated time returns the last values; so does an earlier time
                if longest_gap is None, otherwise it restarts the filter.
            values: [controls]; a different number of controls restarts the filter.

        Returns:
            float64[controls].
        """
        now = np.asarray(values, np.float64)
        step = time - self._time
        gap = self.longest_gap is not None and not 0.0 <= step < self.longest_gap
        if self._values is None or self._speeds is None or self._values.shape != now.shape or gap:
            self._time, self._values, self._speeds = time, now.copy(), np.zeros_like(now)
            return now.copy()
        if step <= 0.0:
            return self._values.copy()
        speeds = (now - self._values) / step
        self._speeds += _share(self.speed_cutoff, step) * (speeds - self._speeds)
        cutoffs = self.cutoff + self.beta * np.abs(self._speeds)
        self._values = self._values + _share(cutoffs, step) * (now - self._values)
        self._time = time
        return self._values.copy()


def _share(cutoff: float | Doubles, step: float) -> Doubles:
    """The weight of a new value in a first-order low pass at `cutoff` Hz after `step` seconds."""
    return np.asarray(1.0 / (1.0 + 1.0 / (2.0 * np.pi * np.asarray(cutoff) * step)))
