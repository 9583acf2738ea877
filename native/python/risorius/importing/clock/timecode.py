# SPDX-License-Identifier: MIT
"""Reads SMPTE timecodes HH:MM:SS:FF, drop-frame or not, whose frames may have fractions."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..errors import AnimationFileError

BASES = (24, 25, 30, 48, 50, 60, 100, 120)  # frames per second that timecodes count
PHONES = (30, 60)  # frames per second of nearly all phones
DAY = 86400.0
# A ; or , before the frame number means drop-frame, as in edit lists.
_FORM = re.compile(r"(\d{1,2})[:;](\d{1,2})[:;](\d{1,2})([:;,])(\d{1,3}(?:\.\d*)?)")


class Timecode(NamedTuple):
    hours: int
    minutes: int
    seconds: int
    frames: float
    """Frame number, which may have a fraction."""
    is_dropped: bool


def parse(text: str, name: str, line: int, column: int | str) -> Timecode:
    """Parses a timecode HH:MM:SS:FF, whose frame number may have a fraction.

    Args:
        text: the cell; ; or , before the frame means drop-frame.
        name: the file's name in errors.
        line: number of the line from 1; for errors.
        column: number of the column from 1, or the header of the column; for errors.

    Raises:
        AnimationFileError: not of this form; more than 23 hours, 59 minutes or 59 seconds.
    """
    match = _FORM.fullmatch(text.strip())
    if match is None:
        raise AnimationFileError(
            name,
            f"a timecode as 12:21:59:06.595 was expected, found {text[:40]!r}",
            line=line,
            column=column,
        )
    hours, minutes, seconds = (int(match[i]) for i in (1, 2, 3))
    if hours > 23 or minutes > 59 or seconds > 59:
        raise AnimationFileError(
            name,
            f"hours to 23, minutes and seconds to 59 were expected, found {text[:40]!r}",
            line=line,
            column=column,
        )
    return Timecode(hours, minutes, seconds, float(match[5]), match[4] != ":")


def infer_base(codes: Sequence[Timecode]) -> int | None:
    """Frames per second that the timecodes count, or None if it cannot be inferred.

    If every frame number is 0, the result is 30, because any rate gives the same times. Else a rate
    measured from the timecodes wins. It cannot be measured if the timecodes never reach the next
    second, or if too many rows are lost around each new second. Then the largest frame number
    decides: 30 to 59 means 60 frames per second, 29 in a take of 2 s or more means 30, and other
    numbers give None.
    """
    frames = np.array([code.frames for code in codes])
    seconds = np.array([3600 * c.hours + 60 * c.minutes + c.seconds for c in codes])
    largest = int(frames.max(initial=0.0))
    if largest == 0 and not frames.any():
        return 30  # every frame number is 0: any base gives the same times
    measured = _measured(frames, seconds, largest)
    if measured is not None:
        return measured
    if largest >= 30:
        return 60 if largest < 60 else None
    # A take of 2 s or more without frame numbers above 29 has 30 frames per second, not 60.
    if len(codes) > 1 and largest == 29 and seconds[-1] - seconds[0] >= 2:
        return 30
    return None


def _measured(
    frames: npt.NDArray[np.float64], seconds: npt.NDArray[np.int_], largest: int
) -> int | None:
    """Infers the frames per second from the frame number's drop at each new second, or None.

    The frame number drops by the frames per second minus one step. Lost rows reduce the drop, so an
    unusual rate is accepted only if several drops agree or no rows are lost.

    Args:
        frames: float64[codes], frame number of each timecode.
        seconds: int[codes], whole seconds since midnight of each timecode.
        largest: largest frame number, which the result must exceed.
    """
    change, step = np.diff(seconds), np.diff(frames)
    within = step[(change == 0) & (step > 0.0)]
    falls = -step[change == 1]
    if not (within.size and falls.size):
        return None
    usual = float(np.median(within))
    near = float(np.median(falls)) + usual
    whole = within[within < 1.5 * usual]
    agree = falls[np.abs(falls + usual - near) <= 0.75 * usual]
    is_clear = within.size == whole.size or (agree.size > 1 and 2 * agree.size > falls.size)
    known = min(BASES, key=lambda base: abs(base - near))
    distance = abs(known - near)
    if distance <= (0.04 * known if is_clear or known in PHONES else 0.5) and known > largest:
        return known
    base = round(float(agree.mean() + whole.mean())) if agree.size and whole.size else 0
    return base if is_clear and largest < base <= largest + np.ceil(usual) else None


def seconds_of(codes: Sequence[Timecode], base: int, is_true_rate: bool) -> npt.NDArray[np.float64]:
    """Seconds from the midnight before the first timecode to each timecode, even after another
    midnight.

    Args:
        codes: from `parse`, in the order of the frames.
        base: frames per second that the timecode counts: 30 for 29.97.
        is_true_rate: False if a second of timecode lasts 1.001 s, as at 23.976, 29.97, 59.94. It
            is ignored if any timecode is drop-frame: a second then lasts 1.001 s.

    Returns:
        float64[codes].
    """
    hours, minutes, secs, frames, dropped = np.array(codes, np.float64).reshape(-1, 5).T
    count = (3600.0 * hours + 60.0 * minutes + secs) * base + frames
    # Drop-frame skips the first 2 frame numbers of each minute (4 at 60 frames per second), except
    # in every tenth minute.
    total = 60.0 * hours + minutes
    count -= dropped * (base // 15) * (total - np.floor(total / 10.0))
    seconds = count / base * (1.0 if is_true_rate and not dropped.any() else 1.001)
    # A step back by more than 12 hours is midnight. A smaller step back is a row out of order, and
    # its time is not changed here.
    wraps = np.concatenate([[0.0], np.diff(seconds) < -0.5 * DAY])
    length = DAY if not dropped.any() else float((24 * 60 * 60 * base - 2592 * (base // 30)) / base)
    return seconds + np.cumsum(wraps) * (length if not dropped.any() else length * 1.001)
