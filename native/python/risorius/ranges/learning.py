# SPDX-License-Identifier: MIT
"""Learns the neutral and the extreme value of each control from a take.

A control is not rescaled if the take does not prove its range: if the control hardly moves, if its
value is too high (above 0.25) in nearly all frames, or if it does not come near its extreme. The
controls of the gaze, and controls that partly undo another one (mouthClose), are never rescaled.
The left and the right control of a pair get the same range.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..anim.clip import Clip
from ..base.errors import ArgumentError
from ..controls import arkit
from ..controls.sides import mirrored_name
from .remap import WIDTHS, Learned, Range, Ranges, require_untouched

Doubles = npt.NDArray[np.float64]

MOST_GAIN = 1.6
"""Largest gain; a control that would need more did not reach its extreme in the take."""
SHORTEST = 2.0
"""Seconds: shorter takes are refused."""
# Largest gain of the lid controls. It is larger than MOST_GAIN, because everybody can shut the
# eyes: a low peak of a blink means that the capture is weak, not that the eyes stayed open.
_LID_GAIN = 2.0
_LEAST_RANGE = 0.15  # ranges below it count as hardly moving
_LEAST_OVER_NOISE = 8.0  # smallest range in standard deviations of the noise
_REST_SHARE = 10  # smallest percentage of frames in which a control must be at rest
_HIGHEST_REST = 0.25  # a control whose lowest tenth of values is higher is never at rest
_SPIKE = 0.05  # seconds of the median filter, so that shorter peaks are ignored
_WIDEST = 4  # frames to either side: largest window of the median, which limits the memory
_NEAR = 0.8  # fraction of the highest peak from which a peak counts as extreme
_LOW_PEAKS = 25  # percentage of the extreme peaks that may stay below 1 after rescaling
_LOW_BLINKS = 10  # the same for lids, because an incomplete blink is noticeable
# In a performance, half of the peaks of a control must reach this fraction of its highest peak,
# except for lids.
_CEILING = 0.85
_LEAST_PEAKS = 3  # in a performance, smallest number of peaks
_SAME = 0.7  # ratio of the extremes of both sides: above it both get the smaller one
_PREFIX = "CTRL_expressions."


@dataclass
class _Measured:
    """The measurements of a control's curve.

    Attributes:
        neutral: value of the control at rest.
        extreme: value of the control at its extreme.
        noise: standard deviation of the noise in a frame.
        rests: whether a tenth of the values is at most _HIGHEST_REST (0.25).
        has_ceiling: whether the curve has at least three peaks and half of them reach 85 % of the
            highest one; a lid only needs the three peaks.
    """

    neutral: float
    extreme: float
    noise: float
    rests: bool
    has_ceiling: bool


def learn(clip: Clip, *, performance: bool = False, most_gain: float = MOST_GAIN) -> Ranges:
    """Learns the ranges of a person from a take.

    Args:
        clip: raw controls as captured, without gain, smoothing or rescaling.
        performance: whether the take shows acting instead of one extreme after another; the
            range of a control is then used only if its curve has at least three peaks and half of
            them reach 85 % of the highest one; a lid only needs the three peaks.
        most_gain: largest gain, 1 to 4; the largest gain of lids is at least 2.

    Returns:
        The ranges of all controls in the clip's order, without angles of the head.

    Raises:
        ArgumentError: a take shorter than SHORTEST, no raw controls, a value that is not finite, a
            clip that was rescaled before, or a gain outside 1 to 4.
    """
    if not 1.0 <= most_gain <= 4.0:
        raise ArgumentError(f"a largest gain of 1 to 4 was expected, found {most_gain:g}")
    if clip.duration < SHORTEST:
        raise ArgumentError(
            f"a take of at least {SHORTEST:g} s was expected to learn ranges from, "
            f"found {clip.duration:.2f} s"
        )
    require_untouched(clip)
    bad = np.argwhere(~np.isfinite(clip.curves))
    if bad.size:
        control, frame = bad[0]
        raise ArgumentError(f"{clip.names[control]}, frame {frame}: a finite number was expected")
    names = [name for name in clip.names if name.startswith("CTRL_")]
    if not names:
        raise ArgumentError(
            "raw controls (CTRL_expressions.*) were expected to learn ranges from, found none"
        )
    measured = {n: _measure(clip.curve(n).astype(np.float64), clip.rate, n) for n in names}
    found: dict[str, Learned] = {}
    for name in names:
        pair = [measured[name]]
        if mirrored_name(name) in measured:
            pair.append(measured[mirrored_name(name)])
        found[name] = _judge(name, _together(pair), performance, most_gain)
    return Ranges(found, clip.metadata.get("source", ""))


def _measure(curve: Doubles, rate: float, name: str) -> _Measured:
    """Measures a control.

    Args:
        curve: float64[frames], values of the control.
        rate: frames per second.
        name: name of the control.
    """
    calm = _without_spikes(curve, rate)
    lowest = float(np.percentile(calm, _REST_SHARE))
    neutral = min(max(lowest, 0.0), _HIGHEST_REST)
    peaks = _peaks(calm, neutral)
    highest = float(peaks.max(initial=neutral))
    near = peaks[peaks - neutral >= _NEAR * (highest - neutral)]
    low = _LOW_BLINKS if _is_lid(name) else _LOW_PEAKS
    extreme = float(np.percentile(near, low)) if near.size else neutral
    high = int((peaks - neutral >= _CEILING * (highest - neutral)).sum())
    steps = np.abs(np.diff(curve, 2))
    return _Measured(
        neutral,
        extreme,
        float(1.4826 * np.median(steps) / np.sqrt(6.0)) if steps.size else 0.0,
        lowest <= _HIGHEST_REST,
        peaks.size >= _LEAST_PEAKS and (_is_lid(name) or 2 * high >= peaks.size),
    )


def _without_spikes(curve: Doubles, rate: float) -> Doubles:
    """The median over _SPIKE seconds around each frame, at least 3 and at most 9 frames."""
    half = min(max(1, round(0.5 * _SPIKE * rate)), _WIDEST)
    padded = np.pad(curve, half, mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1)
    out: Doubles = np.median(windows, axis=1)
    return out


def _peaks(curve: Doubles, neutral: float) -> Doubles:
    """The maximum of each interval in which the curve is above half of its range.

    Args:
        curve: float64[frames].
        neutral: value of the control at rest.
    """
    above = curve - neutral > 0.5 * (curve.max(initial=neutral) - neutral)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], above, [False]]).astype(np.int8)))
    pairs = edges.reshape(-1, 2)
    return np.array([curve[first:end].max() for first, end in pairs], np.float64)


def _together(pair: list[_Measured]) -> _Measured:
    """Combines the measurements of a left and a right control to the same range for both, so that a
    symmetric face stays symmetric."""
    extremes = [side.extreme for side in pair]
    least, most = min(extremes), max(extremes)
    # If the extremes are similar, both sides get the smaller one, so that both can reach 1.
    # Otherwise one side did not reach its extreme in the take, and both get the larger one.
    return _Measured(
        float(np.mean([side.neutral for side in pair])),
        least if least >= _SAME * most else most,
        max(side.noise for side in pair),
        all(side.rests for side in pair),
        all(side.has_ceiling for side in pair),
    )


def _judge(name: str, found: _Measured, performance: bool, most_gain: float) -> Learned:
    """The range of a control, with the reason if it is not used.

    Args:
        name: name of the control.
        found: measurements of the control, of both sides together.
        performance: whether the take shows acting instead of one extreme after another.
        most_gain: largest gain of controls other than lids.
    """
    moved = found.extreme - found.neutral
    gain = max(most_gain, _LID_GAIN) if _is_lid(name) else most_gain
    reasons = {
        "gaze is an angle": "eyeLook" in name,
        "is a share of another control": name in arkit.shares(),
        "hardly moves": moved < _LEAST_RANGE,
        "moves no more than its noise": moved < _LEAST_OVER_NOISE * found.noise,
        "is never at rest": not found.rests,
        "its peaks differ, so none is an extreme": performance and not found.has_ceiling,
        "does not come near its extreme": moved * gain < 1.0 or moved > WIDTHS[1],
    }
    # The extreme is rounded down, so that the measured value maps to 1 and not slightly below.
    range_ = Range(round(found.neutral, 3), float(np.floor(found.extreme * 1e3)) / 1e3)
    return Learned(range_, next((reason for reason, holds in reasons.items() if holds), ""))


def _is_lid(name: str) -> bool:
    return name.startswith(f"{_PREFIX}eyeBlink")
