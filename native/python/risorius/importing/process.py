# SPDX-License-Identifier: MIT
"""What is done to a clip between a capture and a face: each a function from clip to clip."""

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

# Where the neutral value leaves a smaller range than this, stretching would only amplify noise.
LEAST_RANGE = 0.05
# Mirroring a face negates these angles.
_MIRRORED_ANGLES = ("yaw", "roll")


def resample(clip: Clip, rate: float) -> Clip:
    """The clip at even times from its first frame to its last; straight lines between its frames.

    Args:
        clip: any clip.
        rate: frames a second of the result, above 0.

    Raises:
        ValueError: a rate that is not above 0.
    """
    if not 0.0 < rate < 1e6:
        raise ArgumentError(f"a rate above 0 frames per second was expected, found {rate}")
    return clip.resampled(rate)


def shift(clip: Clip, seconds: float) -> Clip:
    """The clip and its events, later by `seconds`; negative: earlier."""
    times = None if clip.times is None else clip.times + seconds
    events = [event._replace(time=event.time + seconds) for event in clip.events]
    return clip.replaced(start=clip.start + seconds, times=times, events=events)


def cut(clip: Clip, first: float, last: float) -> Clip:
    """The frames and events from `first` to `last`, seconds on the clip's clock, both included.

    Raises:
        ValueError: no frame lies there.
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
    """Each control as gain * value + offset.

    Args:
        clip: any clip.
        gains: pattern of control names -> factor; of several that fit, all are multiplied.
        offsets: pattern -> what is added after that; of several, all are added.

    Raises:
        ValueError: a pattern that fits no control.
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
    """Make a neutral face neutral: subtract it, and stretch the rest so that full stays full.

    A control whose neutral value is n becomes (value - n) / (1 - n), and 0 where that is negative
    and the control never was. Of the head and the eyes the angles are subtracted only. A control
    that says which share of another it takes back (lips of an open jaw) is calibrated as the part
    that it takes back: a face at rest with shut lips may have any share.

    Args:
        clip: a capture with a stretch of neutral face in it.
        first: frame of the neutral face, from 0.
        last: last frame, if it is the mean of several; included.

    Raises:
        ValueError: frames that the clip does not have.
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
    """Savitzky-Golay: fit a polynomial around each frame; peaks keep their height and their time.

    Polynomials up to `order` pass unchanged, at the ends too; nothing is delayed; no curve leaves
    the range that it had. A clip with times of its own is smoothed by frame, as captures are taken
    at even times but for what was dropped.

    Args:
        clip: any clip; one with fewer frames than the window is returned as it is.
        window: seconds of frames that each fit takes, above 0.
        order: degree of the polynomial, 0 or more.

    Raises:
        ValueError: a window or an order that makes no sense.
        BudgetError: a window of so many frames that the fit would fill the memory.
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
    # A fit swings beyond a sharp edge; no lid may open further than the capture ever had it.
    return clip.replaced(curves=np.clip(_savitzky_golay(curves, half, order), low, high))


def _savitzky_golay(curves: Doubles, half: int, order: int) -> Doubles:
    size = 2 * half + 1
    base = np.vander(np.arange(-half, half + 1) / half, order + 1, increasing=True)
    fit = base @ np.linalg.pinv(base)  # [at, from]: values of the polynomial fitted to a window
    out = np.empty_like(curves)
    windows = np.lib.stride_tricks.sliding_window_view(curves, size, axis=1)
    out[:, half:-half] = windows @ fit[half]
    out[:, :half] = curves[:, :size] @ fit[:half].T
    out[:, -half:] = curves[:, -size:] @ fit[half + 1 :].T
    return out


def gaussian(clip: Clip, width: float) -> Clip:
    """A weighted mean around each frame: softer than `smooth`, and lowers short peaks.

    Args:
        clip: any clip.
        width: standard deviation in seconds; the weights fall off over the frames' own times.

    Raises:
        ValueError: a width that is not above 0.
    """
    if not width > 0.0:
        raise ArgumentError(f"a width above 0 s was expected, found {width:g} s")
    reach = int(np.ceil(4.0 * width * clip.rate))
    return clip.replaced(curves=filters.gaussian(clip.curves, clip.frame_times(), width, reach))


def one_euro(clip: Clip, cutoff: float = 1.5, beta: float = 5.0) -> Clip:
    """What a live viewer would have seen: OneEuro over the frames, one after the other.

    Args:
        clip: any clip.
        cutoff: of `OneEuro`, Hz: how much a face at rest is smoothed.
        beta: of `OneEuro`: how quickly movement lifts the cutoff.
    """
    running = OneEuro(cutoff, beta)
    rows = [running(t, v) for t, v in zip(clip.frame_times(), clip.curves.T, strict=True)]
    return clip.replaced(curves=np.array(rows).reshape(clip.frame_count, -1).T)


def fill_gaps(clip: Clip, longest: float | None = None) -> Clip:
    """Even frames at the clip's rate; where frames are missing the curves go straight across.

    Args:
        longest: seconds; across a longer gap the last value is held until a frame before its end.

    Raises:
        BudgetError: a gap so long that its frames cannot be held.
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
    """Without frames that repeat the one before in every curve: a capture that stood still for a
    frame because none came. The last frame stays, so that the clip keeps its length.
    """
    if clip.frame_count < 3:
        return clip
    same = (clip.curves[:, 1:] == clip.curves[:, :-1]).all(axis=0)
    same[-1] = False
    keep = np.concatenate([[True], ~same])
    return clip.replaced(curves=clip.curves[:, keep], times=clip.frame_times()[keep])


def mirror(clip: Clip) -> Clip:
    """Left for right: each control takes its partner's curve, sideways angles change their sign."""
    names = [mirrored_name(name) for name in clip.names]
    turned = [name in ANGLES and name.rpartition(".")[2] in _MIRRORED_ANGLES for name in names]
    signs = np.where(np.array(turned, bool), -1.0, 1.0).astype(np.float32)
    return clip.replaced(names=names, curves=clip.curves * signs[:, None])


def parse_amounts(texts: Sequence[str]) -> dict[str, float]:
    """Patterns with amounts from texts as "jaw*=1.2".

    Raises:
        ValueError: another form.
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
