# SPDX-License-Identifier: MIT
"""Recognises units of time in headers and keys, and converts times to seconds."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..errors import AnimationFileError

Doubles = npt.NDArray[np.float64]

UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0}
"""Seconds in one unit."""
FRAMES, ROWS = "frames", "rows"
CHOICES = (*UNITS, FRAMES, ROWS)
"""Units that a caller may state; ROWS ignores the times, and each row is a frame."""
GIVE_RATE = "give the rate in frames a second (clip convert --input-rate; File Rate in Blender)"
COUNT_ROWS = (
    "clip convert --time-unit rows with --input-rate (Time Unit and File Rate in Blender) counts "
    "rows instead"
)

_SPELLINGS = {
    "s": "s sec secs second seconds",
    "ms": "ms msec msecs millis millisec millisecs millisecond milliseconds",
    "us": "us usec usecs micros microsec microsecs microsecond microseconds",
    "ns": "ns nsec nsecs nanos nanosec nanosecs nanosecond nanoseconds",
    "min": "min mins minute minutes",
    "h": "h hr hrs hour hours",
    FRAMES: "frame frames",
}
_UNIT_OF = {word: unit for unit, words in _SPELLINGS.items() for word in words.split()}
_WORDS = (
    "time times timestamp timestamps timecode timecodes elapsed elapsedtime timeelapsed epoch "
    "unixtime unixtimestamp frametime sampletime"
).split()
_FRAME_NUMBERS = "frame frames framenumber frameindex frameid frameno framenr".split()
# Units that are recognised as a whole header. Other units, such as "h", could be the name of a
# curve or a mouth shape.
_ALONE = "s sec secs second seconds ms msec millis milliseconds us microseconds nanoseconds".split()
_NAMES: dict[str, str] = {
    **{word + unit: of for word in _WORDS for unit, of in _UNIT_OF.items()},
    **{f"{word}in{unit}": of for word in _WORDS for unit, of in _UNIT_OF.items()},
    **{unit: _UNIT_OF[unit] for unit in _ALONE},
    **dict.fromkeys(_FRAME_NUMBERS, FRAMES),
    # These entries are last, so that they replace equal keys above: the header "times" is a word
    # without a unit, and not the word "time" with the unit "s".
    **dict.fromkeys([*_WORDS, "t", "ts"], ""),
}
# Texts in brackets in the header of frame numbers, as in "frame (no)", that are no unit of time.
_NUMBERED = ("", "no", "nr", "number", "index", "id", "count")
_BRACKETS = re.compile(r"\(([^)]*)\)|\[([^\]]*)\]|\{([^}]*)\}")
# Times without a unit are seconds if their median step is at most this number, because keyframes
# can be 4 s apart. Larger steps are ms, us or ns if they are usual steps (_STEPS) in that unit.
_LONGEST_STEP = 4.0
# Smallest and largest usual step of a capture in milliseconds: 250 and 5 frames per second.
_STEPS = (4.0, 200.0)
_LEAST_ROWS = 8  # number of rows from which a unit is inferred from even steps
# Unit, and the number above which times in this unit are dates, counted from 1970. Each limit is a
# date in 1973.
_DATES = (("ns", 1e17), ("us", 1e14), ("ms", 1e11))
_LONGEST = 1e8  # seconds; a larger start time is a date


class TimeName(NamedTuple):
    """The unit of time that the header of a column names."""

    unit: str
    """One of UNITS, FRAMES, or "" if the header names none."""
    odd: str = ""
    """The text in brackets if it is an unknown unit, or ""."""


class Asked(NamedTuple):
    """The caller's options on time; None: the value comes from the file."""

    rate: float | None = None
    """Frames per second of the file."""
    timecode_rate: float | None = None
    """Frames per second of timecodes."""
    unit: str | None = None
    """Unit of the times, one of CHOICES."""

    @property
    def counts_rows(self) -> bool:
        return self.unit == ROWS


def plain(header: str) -> str:
    """A header in lower case without blanks and punctuation; the signs for micro become u."""
    return re.sub(r"[^a-z0-9]", "", re.sub("[µμ]", "u", header.lower()))


def time_name(header: str) -> TimeName | None:
    """The unit in a header such as "Time (ms)", "timestamp_us", "frame"; None: not a header of
    times.

    Args:
        header: header of a column, or a key of JSON.
    """
    brackets = _BRACKETS.search(header)
    if brackets is None:
        unit = _NAMES.get(plain(header))
        return None if unit is None else TimeName(unit)
    base = _NAMES.get(plain(header[: brackets.start()] + header[brackets.end() :]))
    if base is None:
        return None
    written = next(part for part in brackets.groups() if part is not None)
    inside = _UNIT_OF.get(plain(written), "")
    if inside:
        return TimeName(inside)
    if base == FRAMES and plain(written) in _NUMBERED:
        return TimeName(FRAMES)
    return TimeName(base, written.strip() or "()")


def row_times(count: int, asked: Asked, name: str) -> Doubles:
    """float64[count]: seconds of rows that are evenly spaced at the given rate.

    Args:
        count: number of rows.
        asked: the caller's options; the rate is required.
        name: the file's name in errors.

    Raises:
        AnimationFileError: the options have no rate.
    """
    if asked.rate is None:
        raise AnimationFileError(name, f"nothing gives the time: {GIVE_RATE}")
    return np.arange(count) / asked.rate


def seconds_of(
    values: Doubles,
    said: TimeName,
    asked: Asked,
    notes: list[str],
    *,
    name: str,
    column: str | None = None,
) -> Doubles:
    """Converts times to seconds, by the caller's unit, else the header's, else the inferred unit.

    Args:
        values: float64[frames], as in the file.
        said: unit in the header.
        asked: the options on time from the user. The option `counts_rows` has no effect here; code
            that calls this function must check it before.
        notes: receives a sentence if a unit other than seconds is inferred, and if dates are
            counted from the first frame.
        name: the file's name in errors.
        column: column of the times, for errors.

    Returns:
        float64[frames]; dates are counted from the first frame.

    Raises:
        AnimationFileError: an unknown unit, a frame number without a rate, no recognisable unit.
    """
    unit = asked.unit or said.unit
    if said.odd and not asked.unit:
        raise AnimationFileError(
            name,
            f"its unit of time is not known ({said.odd[:40]!r}; known are {', '.join(CHOICES)} and "
            "their full names): give it (clip convert --time-unit; Time Unit in Blender)",
            column=column,
        )
    if unit == FRAMES:
        if asked.rate is None:
            raise AnimationFileError(
                name, f"its time is a frame number: {GIVE_RATE}", column=column
            )
        return values / asked.rate
    if not unit:
        unit = _shown(values, name, column)
        if unit != "s":
            notes.append(
                f"its times have no unit and are read as {unit} (--time-unit, or Time Unit in "
                "Blender, sets another)"
            )
    seconds = values * UNITS[unit]
    if seconds.size and seconds[0] > _LONGEST:
        notes.append("its times are dates: they count from the first frame")
        seconds = seconds - seconds[0]
    return seconds


def _shown(values: Doubles, name: str, column: str | None) -> str:
    """Infers the unit of times from their size and steps.

    Args:
        values: float64[frames], times as in the file.
        name: the file's name in errors.
        column: column of the times, for errors.

    Raises:
        AnimationFileError: the size and the steps of the times fit no unit.
    """
    smallest = float(values.min(initial=np.inf))
    for unit, least in _DATES:
        if np.isfinite(smallest) and smallest > least:
            return unit
    steps = np.diff(values)
    steps = np.sort(steps[steps > 0.0])
    # the median step; of two middle steps the smaller one, because the other may be a gap
    step = float(steps[(steps.size - 1) // 2]) if steps.size else 0.0
    if step <= _LONGEST_STEP:
        return "s"
    is_even = float(np.mean(np.abs(steps - step) <= 0.5 * step)) >= 0.8
    if values.size >= _LEAST_ROWS and is_even:
        for unit in ("ms", "us", "ns"):
            if _STEPS[0] <= step * UNITS[unit] * 1e3 <= _STEPS[1]:
                return unit
    raise AnimationFileError(
        name,
        f"its times say no unit and go up by {step:g} from frame to frame, which is too much for "
        "seconds: give their unit (clip convert --time-unit ms or s; Time Unit in Blender)",
        column=column,
    )
