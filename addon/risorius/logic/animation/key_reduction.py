# SPDX-License-Identifier: GPL-3.0-or-later
"""Removes a baked curve's keyframes if straight lines between the other keyframes replace them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..base.errors import FaceError
from ..base.sentences import told

Floats = NDArray[np.float32]
Times = NDArray[np.float64]
Kept = NDArray[np.bool_]
_EPS = float(np.finfo(np.float32).eps)


def frame_list(start: float, end: float, step: float) -> Times:
    """The frames to bake, float64[N]: from `start` to at most `end`, with distance `step`.

    Raises:
        ValueError: the end lies before the start, or the step is not above 0.
    """
    if end < start:
        raise FaceError(
            told(
                "The range ends at frame {end:g}, before it starts at {start:g}.",
                end=end,
                start=start,
            )
        )
    if not step > 0:
        raise FaceError(told("A step above 0 was expected, found {step:g}.", step=step))
    return start + step * np.arange(int(np.floor((end - start) / step + 1e-9)) + 1)


def continuous(quaternions: Floats) -> Floats:
    """Quaternions with signs that make neighbouring frames interpolate the short way.

    Args:
        quaternions: float32[frames, ..., 4].
    """
    dots = (quaternions[1:] * quaternions[:-1]).sum(axis=-1, keepdims=True)
    signs = np.cumprod(np.where(dots < 0.0, np.float32(-1), np.float32(1)), axis=0)
    return np.concatenate([quaternions[:1], quaternions[1:] * signs])


def reduce_keys(frames: ArrayLike, values: ArrayLike, error: float = 0.0) -> Kept:
    """Find the keys that each curve has to keep.

    All curves are processed together. For each curve, a range of slopes is known for which a line
    from its last key passes all later values within the error. If a value is outside of this
    range, the value before it becomes a key.

    Args:
        frames: float[N], ascending.
        values: float32[N, curves], finite.
        error: largest absolute distance of a line between keys from any value. 0 keeps every key of
            a moving curve.

    Returns:
        bool[N, curves]. A curve that stays within the error of its first value has one key.
    """
    times = np.asarray(frames, np.float64)
    values = np.asarray(values, np.float32)
    keep = np.ones(values.shape, bool)
    still = np.abs(values - values[:1]).max(axis=0, initial=0.0) <= error
    if error > 0.0 and len(times) > 2:
        keep = _cones(times, values.astype(np.float64), error)
        # Rounding to float32 can move a line beyond the error; then the curve keeps all keys.
        keep[:, np.abs(rebuilt(times, values, keep) - values).max(axis=0) > error] = True
    keep[1:, still] = False
    return keep


def _cones(frames: Times, values: Times, error: float) -> Kept:
    inner = np.maximum(error - 4 * _EPS * np.abs(values).max(axis=0), 0.0)
    keep = np.zeros(values.shape, bool)
    keep[[0, -1]] = True
    count = values.shape[1]
    time, value = np.full(count, frames[0]), values[0].copy()
    low, high = np.full(count, -np.inf), np.full(count, np.inf)
    for i in range(1, len(frames)):
        slope = (values[i] - value) / (frames[i] - time)
        outside = np.flatnonzero((slope < low) | (slope > high))
        if outside.size:
            keep[i - 1, outside] = True
            time[outside], value[outside] = frames[i - 1], values[i - 1, outside]
            low[outside], high[outside] = -np.inf, np.inf
        passed = frames[i] - time
        low = np.maximum(low, (values[i] - inner - value) / passed)
        high = np.minimum(high, (values[i] + inner - value) / passed)
    return keep


def rebuilt(frames: Times, values: Floats, keep: Kept) -> Floats:
    """The values at every frame if straight lines join the kept keys.

    Args:
        frames: float[N].
        values: float32[N, curves].
        keep: bool[N, curves], kept keys; values are constant before the first and after the last
            key.

    Returns:
        float32[N, curves], computed in float32 as Blender does.
    """
    count = len(frames)
    rows = np.arange(count)[:, None]
    before = np.maximum.accumulate(np.where(keep, rows, -1), axis=0)
    after = np.minimum.accumulate(np.where(keep, rows, count)[::-1], axis=0)[::-1]
    before = np.where(before < 0, after, before)
    after = np.where(after == count, before, after)
    times = np.asarray(frames, np.float32)
    span = times[after] - times[before]
    part = np.where(span > 0, (times[:, None] - times[before]) / np.where(span > 0, span, 1), 0)
    low = np.take_along_axis(values, before, axis=0)
    high = np.take_along_axis(values, after, axis=0)
    return (low + part.astype(np.float32) * (high - low)).astype(np.float32)
