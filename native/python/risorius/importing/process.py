# SPDX-License-Identifier: MIT
"""Processing of captured clips, such as smoothing; each function returns a new clip."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from ..anim.clip import Clip, Event
from ..base import filters
from ..base.budget import Budget
from ..base.errors import ArgumentError
from ..base.filters import OneEuro
from ..base.given import GivenError, finite_text, shown
from ..controls import arkit
from ..controls.shares import part_of, share_of
from ..controls.sides import mirrored_name
from .mapping import ANGLES, fits

Doubles = npt.NDArray[np.float64]

# Smallest divisor 1 - n, where n is the neutral value of a control; a smaller divisor would only
# amplify noise.
LEAST_RANGE = 0.05
# Angles of head and eyes that change their sign when a face is mirrored; pitch keeps its sign.
_MIRRORED_ANGLES = ("yaw", "roll")


def resample(clip: Clip, rate: float) -> Clip:
    """Resamples a clip at even times, linearly between its frames.

    Args:
        clip: any clip.
        rate: frames per second of the result, above 0 and below 1e6.

    Raises:
        ValueError: a rate out of range.
    """
    if not 0.0 < rate < 1e6:
        raise ArgumentError(f"a rate above 0 frames per second was expected, found {rate}")
    return clip.resampled(rate)


def shift(clip: Clip, seconds: float) -> Clip:
    """Moves the clip and its events by `seconds`, later if positive."""
    times = None if clip.times is None else clip.times + seconds
    events = [event._replace(time=event.time + seconds) for event in clip.events]
    return clip.replaced(start=clip.start + seconds, times=times, events=events)


def cut(clip: Clip, first: float, last: float) -> Clip:
    """The frames and events of clip from `first` to `last`, in seconds, both included.

    Raises:
        ValueError: there is no frame in this range.
    """
    at = clip.frame_times()
    keep = (at >= first - 1e-9) & (at <= last + 1e-9)
    if not keep.any():
        raise ArgumentError(
            f"frames from {first:g} s to {last:g} s were expected, the clip goes from "
            f"{at.min(initial=0.0):g} s to {at.max(initial=0.0):g} s"
        )
    events: list[Event] = [e for e in clip.events if first <= e.time <= last]
    times = None if clip.times is None else at[keep]
    return clip.replaced(
        curves=clip.curves[:, keep], start=float(at[keep][0]), times=times, events=events
    )


def adjust(
    clip: Clip, gains: Mapping[str, float] | None = None, offsets: Mapping[str, float] | None = None
) -> Clip:
    """Changes each control to gain * value + offset.

    Args:
        clip: any clip.
        gains: pattern of control names -> factor; the factors of all matches are multiplied.
        offsets: pattern -> offset, added after the gain; the offsets of all matches are added.

    Raises:
        ValueError: a pattern that matches no control.
    """
    curves = clip.curves.astype(np.float64)
    for table, is_gain in ((gains or {}, True), (offsets or {}, False)):
        for pattern, amount in table.items():
            rows = [i for i, name in enumerate(clip.names) if fits(name, pattern)]
            if not rows:
                raise ArgumentError(f"{pattern}: fits no control of the clip")
            curves[rows] = curves[rows] * amount if is_gain else curves[rows] + amount
    return clip.replaced(curves=curves)


def calibrate(clip: Clip, first: int, last: int | None = None) -> Clip:
    """Makes a face's neutral values 0: subtracts them, and rescales the rest so that 1 stays 1.

    A control with the neutral value n becomes (value - n) / (1 - n), clamped to 0 unless the
    control was negative in the capture; the divisor is at least LEAST_RANGE (0.05). From angles of
    head and eyes, n is only subtracted. Some controls are a share of another control, such as the
    share of the jaw's opening that the lips close. Such controls are calibrated as share times the
    other control, because a neutral face with shut lips may have any share.

    Args:
        clip: a capture that contains a neutral face.
        first: frame of the neutral face, from 0.
        last: last frame (inclusive), to use the mean of several.

    Raises:
        ValueError: frames out of range.
    """
    last = first if last is None else last
    if not 0 <= first <= last < clip.frame_count:
        raise ArgumentError(
            f"frames from 0 to {clip.frame_count - 1} were expected, found {first} to {last}"
        )
    curves = clip.curves.astype(np.float64)
    place = {name: row for row, name in enumerate(clip.names)}
    shares = [(place[c], place[w]) for c, w in arkit.shares().items() if c in place and w in place]
    for control, whole in shares:
        curves[control] = part_of(curves[control], curves[whole])
    neutral = curves[:, first : last + 1].mean(axis=1)[:, None]
    is_angle = np.array([name in ANGLES for name in clip.names], bool)[:, None]
    left = np.where(is_angle, 1.0, np.maximum(1.0 - neutral, LEAST_RANGE))
    out = (curves - neutral) / left
    is_positive = ~is_angle & (curves.min(axis=1, initial=0.0)[:, None] >= 0.0)
    out = np.where(is_positive, np.maximum(out, 0.0), out)
    for control, whole in shares:
        out[control] = share_of(out[control], out[whole])
    return clip.replaced(curves=out)


def smooth(clip: Clip, window: float, *, order: int = 3) -> Clip:
    """Smooths with a Savitzky-Golay filter: peaks keep their height and time.

    Polynomials up to `order` pass unchanged, also at the ends; there is no delay; no curve leaves
    its old range. Frames are treated as evenly spaced, because captures are, except for dropped
    frames.

    Args:
        clip: any clip; it is returned unchanged if it has fewer frames than the window, or if the
            window has at most order + 1 frames.
        window: duration of each fit in seconds, above 0.
        order: degree of the polynomial, 0 or more.

    Raises:
        ValueError: an invalid window or order.
        BudgetError: a window of too many frames for the memory.
    """
    if not window > 0.0 or order < 0:
        raise ArgumentError(f"a window above 0 s was expected, found {window:g} s, degree {order}")
    half = round(0.5 * window * clip.rate)
    if 2 * half <= order or clip.frame_count <= 2 * half:
        return clip
    budget = Budget.of(clip.curves.nbytes)
    budget.hold((2 * half + 1) ** 2 * 24, f"a window of {window:g} s, {2 * half + 1} frames")
    curves = clip.curves.astype(np.float64)
    low, high = curves.min(axis=1, keepdims=True), curves.max(axis=1, keepdims=True)
    # Each curve is clamped to its old range, because the polynomial overshoots at a sharp edge, and
    # for example a lid may not open further than in the capture.
    return clip.replaced(curves=np.clip(_savitzky_golay(curves, half, order), low, high))


def _savitzky_golay(curves: Doubles, half: int, order: int) -> Doubles:
    size = 2 * half + 1
    base = np.vander(np.arange(-half, half + 1) / half, order + 1, increasing=True)
    # fit[i, j]: weight of the window's value j in the fitted polynomial's value at position i
    fit = base @ np.linalg.pinv(base)
    out = np.empty_like(curves)
    windows = np.lib.stride_tricks.sliding_window_view(curves, size, axis=1)
    out[:, half:-half] = windows @ fit[half]
    out[:, :half] = curves[:, :size] @ fit[:half].T
    out[:, -half:] = curves[:, -size:] @ fit[half + 1 :].T
    return out


def gaussian(clip: Clip, width: float) -> Clip:
    """Smooths with a Gaussian-weighted mean around each frame: softer than `smooth`, lowers peaks.

    Args:
        clip: any clip.
        width: standard deviation in seconds; the weights follow the frames' times.

    Raises:
        ValueError: a width that is not above 0.
    """
    if not width > 0.0:
        raise ArgumentError(f"a width above 0 s was expected, found {width:g} s")
    reach = int(np.ceil(4.0 * width * clip.rate))
    return clip.replaced(curves=filters.gaussian(clip.curves, clip.frame_times(), width, reach))


def one_euro(clip: Clip, cutoff: float = 1.5, beta: float = 5.0) -> Clip:
    """Smooths with a one-euro filter, frame by frame, as the live capture does.

    Args:
        clip: any clip.
        cutoff: cutoff frequency of the filter while a value does not change, in Hz; lower is
            smoother.
        beta: increase of the cutoff frequency with the speed of a value, Hz per (unit per second).
    """
    running = OneEuro(cutoff, beta)
    rows = [running(t, v) for t, v in zip(clip.frame_times(), clip.curves.T, strict=True)]
    return clip.replaced(curves=np.array(rows).reshape(clip.frame_count, -1).T)


def fill_gaps(clip: Clip, longest: float | None = None) -> Clip:
    """Resamples at the clip's rate, so that missing frames are interpolated linearly.

    Args:
        clip: any clip.
        longest: seconds; in a longer gap the last value is held until one frame before the gap's
            end. None: every gap is interpolated.

    Raises:
        BudgetError: a gap with too many frames.
    """
    if clip.frame_count < 2:
        return clip
    at, filled = clip.frame_times(), clip.without_gaps()
    if longest is not None:
        wanted, curves = filled.frame_times(), filled.curves
        before = np.clip(np.searchsorted(at, wanted, side="right") - 1, 0, clip.frame_count - 2)
        long = at[before + 1] - at[before] > longest
        held = long & (wanted < at[before + 1] - 1.0 / clip.rate + 1e-9)
        filled = filled.replaced(curves=np.where(held, clip.curves[:, before], curves))
    return filled


def drop_repeats(clip: Clip) -> Clip:
    """Drops frames that equal the frame before in every curve; captures repeat a frame if no new
    one arrives. The last frame stays, so that the clip keeps its length.
    """
    if clip.frame_count < 3:
        return clip
    same = (clip.curves[:, 1:] == clip.curves[:, :-1]).all(axis=0)
    same[-1] = False
    keep = np.concatenate([[True], ~same])
    return clip.replaced(curves=clip.curves[:, keep], times=clip.frame_times()[keep])


def mirror(clip: Clip) -> Clip:
    """Mirrors a clip: left and right controls swap their curves; yaw and roll change their sign."""
    names = [mirrored_name(name) for name in clip.names]
    turned = [name in ANGLES and name.rpartition(".")[2] in _MIRRORED_ANGLES for name in names]
    signs = np.where(np.array(turned, bool), -1.0, 1.0).astype(np.float32)
    return clip.replaced(names=names, curves=clip.curves * signs[:, None])


def parse_amounts(texts: Sequence[str]) -> dict[str, float]:
    """Parses texts such as "jaw*=1.2" to {pattern of control names: amount}.

    Raises:
        ValueError: a text of another form.
    """
    out = {}
    for text in texts:
        pattern, equals, amount = text.rpartition("=")
        try:
            out[pattern] = finite_text(amount)
        except GivenError:
            equals = ""
        if not equals or not pattern:
            raise ArgumentError(f"PATTERN=NUMBER was expected, found {shown(text)}")
    return out
