# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits Bezier curves with few keyframes to samples, within a tolerance of every sample."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
TOLERANCE = 0.005  # largest error of a control, whose range is 0 to 1
_LONGEST = 1000  # most samples between two keys
_BETWEEN = 4.0  # factor of the tolerance that is allowed at midpoints between samples
_HALVES = 0.1  # weight of a midpoint in the fit; a sample weighs 1
_ROUNDING = 1e-6  # Blender keeps keys and handles as float32
_ASIDE = np.array([1.0, 0.0])  # offset (frames, value) of the unused handles of outer keys


@dataclass
class Bezier:
    """Keyframes of a Bezier curve, called keys here.

    Attributes:
        co: float64[keys, 2], frame and value of each key.
        left, right: float64[keys, 2], frame and value of each handle's end. The frame lies a third
            of the way to the neighbouring key, so that the value is a cubic polynomial of the
            frame. The handles before the first and after the last key are unused; they lie one
            frame away.
    """

    co: Float
    left: Float
    right: Float


def straight(frames: Float, values: Float) -> Bezier:
    """A curve with a key for each sample, and handles on the straight lines between the keys.

    Args:
        frames: float64[n], ascending, n at least 1.
        values: float64[n].
    """
    co = np.stack([frames, values], axis=1)
    right, left = np.add(co, _ASIDE), np.subtract(co, _ASIDE)
    third = np.diff(co, axis=0) / 3.0
    right[:-1], left[1:] = co[:-1] + third, co[1:] - third
    return Bezier(co, left, right)


class _Basis(NamedTuple):
    """Values of the cubic Bernstein polynomials for the fit of one cubic to a range of samples.

    The attributes near, far, begin and end are float64[m]: values at all samples except the first
    and the last one, then at the midpoints between neighbouring samples.

    Attributes:
        near, far: weights of the values of the first and of the second handle.
        begin, end: weights of the values of the first and of the last sample.
    """

    near: Float
    far: Float
    begin: Float
    end: Float
    solve: Float
    """float64[2, m]: the matrix from wanted values to the handle values of least squares."""


class Fitter:
    """Fits Bezier curves to samples.

    Two fits to the same number of equally spaced samples use the same least-squares matrix, which
    is cached.
    """

    def __init__(self, tolerance: float) -> None:
        """Make a fitter with empty caches.

        Args:
            tolerance: largest difference of a curve's value from a sample, above 0.
        """
        self._most = max(tolerance - _ROUNDING, _ROUNDING)
        self._bases: dict[int, _Basis] = {}
        self._done: dict[tuple[bytes, bytes], Bezier] = {}

    def keys(self, frames: Float, values: Float) -> Bezier:
        """Fit keys and handles to samples.

        From each key, a cubic covers as many later samples as it can. It may differ from a sample
        by at most the tolerance. Midway between two samples, it may differ from their mean by at
        most four times the tolerance.

        Args:
            frames: float64[n], ascending, n at least 1.
            values: float64[n], finite.

        Returns:
            Bezier; each key has the value of its sample. If all samples are within the tolerance
            of the first sample, the curve has one key.
        """
        # Results are cached by their samples, because a left and a right control often have equal
        # samples.
        known = frames.tobytes(), values.tobytes()
        if known not in self._done:
            self._done[known] = self._fit(frames, values)
        return self._done[known]

    def _fit(self, frames: Float, values: Float) -> Bezier:
        if np.abs(values - values[0]).max() <= self._most:
            point = np.array([[frames[0], values[0]]])
            return Bezier(point, np.subtract(point, _ASIDE), np.add(point, _ASIDE))
        return self.between(frames, values)

    def between(self, frames: Float, values: Float) -> Bezier:
        """Fit keys and handles as `keys` does, but always with keys at the first and last sample.

        Args:
            frames: float64[n], ascending, n at least 2.
            values: float64[n], finite.
        """
        steps = np.diff(frames)
        even = bool(np.ptp(steps) < 1e-6)
        kept, handles = [0], []
        while kept[-1] < len(frames) - 1:
            last, pair = self._reach(frames, values, kept[-1], even)
            kept.append(last)
            handles.append(pair)
        co = np.stack([frames[kept], values[kept]], axis=1)
        third = np.diff(co[:, 0]) / 3.0
        out, into = np.array(handles).T
        right, left = co + _ASIDE, co - _ASIDE
        right[:-1] = np.stack([co[:-1, 0] + third, out], axis=1)
        left[1:] = np.stack([co[1:, 0] - third, into], axis=1)
        return Bezier(co, left, right)

    def _reach(
        self, frames: Float, values: Float, first: int, even: bool
    ) -> tuple[int, tuple[float, float]]:
        """Find how many samples one cubic covers.

        Args:
            frames, values: float64[n], all samples.
            first: index of the sample at which the cubic begins.
            even: whether the samples are equally spaced, so that cached matrices can be used.

        Returns:
            Index of the last sample that a cubic from sample `first` covers, and the values of the
            two handles of this cubic.
        """
        low, high = values[first], values[first + 1]
        best = first + 1, (low + (high - low) / 3.0, high - (high - low) / 3.0)
        for last in range(first + 2, min(first + _LONGEST, len(frames) - 1) + 1):
            basis = self._basis(frames[first : last + 1], even)
            inner = values[first : last + 1]
            wanted = np.concatenate([inner[1:-1], 0.5 * (inner[1:] + inner[:-1])])
            wanted -= basis.begin * inner[0] + basis.end * inner[-1]
            out, into = basis.solve @ wanted
            off = np.abs(basis.near * out + basis.far * into - wanted)
            count = len(inner) - 2
            if off[:count].max() > self._most or off[count:].max() > _BETWEEN * self._most:
                break
            best = last, (float(out), float(into))
        return best

    def _basis(self, frames: Float, even: bool) -> _Basis:
        if even and len(frames) in self._bases:
            return self._bases[len(frames)]
        shares = (frames - frames[0]) / (frames[-1] - frames[0])
        t = np.concatenate([shares[1:-1], 0.5 * (shares[1:] + shares[:-1])])
        rest = 1.0 - t
        near, far = 3.0 * t * rest * rest, 3.0 * t * t * rest
        columns = np.stack([near, far], axis=1)
        weighted = columns * np.where(np.arange(len(t)) < len(shares) - 2, 1.0, _HALVES)[:, None]
        solve = np.linalg.solve(weighted.T @ columns, weighted.T)
        basis = _Basis(near, far, np.power(rest, 3.0), np.power(t, 3.0), solve)
        if even:
            self._bases[len(frames)] = basis
        return basis
