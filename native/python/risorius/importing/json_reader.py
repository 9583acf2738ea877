# SPDX-License-Identifier: MIT
"""Checks numbers, names, rates and times of JSON, and makes a Take from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from ..base.budget import Budget
from .clock.units import Asked, TimeName, row_times, seconds_of, time_name
from .errors import AnimationFileError
from .source import Take, keep_ascending, make_clip

Doubles = npt.NDArray[np.float64]

RATE_KEYS = ("exportFps", "fps", "rate", "frameRate", "framerate", "frame_rate", "sampleRate")
# Range of frames per second; a rate outside it is an error in the file.
SLOWEST, FASTEST = 0.01, 1e6
_LARGEST = float(np.finfo(np.float32).max)


class Reader:
    """The name of a file, its budget, and the caller's options on time."""

    def __init__(self, name: str, asked: Asked, budget: Budget) -> None:
        self.name = name
        self.asked = asked
        self.budget = budget
        self.notes: list[str] = []

    def fail(self, message: str, place: str | None = None) -> AnimationFileError:
        """Makes an AnimationFileError that names the file and the place.

        Args:
            message: the expected and the found value.
            place: place in the JSON, e.g. "frames[3]"; None: the whole document.
        """
        return AnimationFileError(self.name, f"{place}: {message}" if place else message)

    def number(self, value: object, place: str) -> float:
        """Reads a finite number in the range of float32; "0.5" as a string is accepted too.

        Args:
            value: a value of the JSON.
            place: the value's name in errors.

        Raises:
            AnimationFileError: the value is not a finite number in this range.
        """
        found = math.nan
        if isinstance(value, int | float | str) and not isinstance(value, bool):
            try:  # some programs write numbers as text
                found = float(value)
            except (ValueError, OverflowError):
                found = math.nan
        if math.isfinite(found) and abs(found) <= _LARGEST:
            return found
        raise self.fail(f"a finite number was expected, found {_shown(value)}", place)

    def numbers(self, values: object, place: str, *, has_holes: bool = False) -> list[float]:
        """Reads a list of finite numbers.

        Args:
            values: a value of the JSON.
            place: its name in errors.
            has_holes: null means a missing value and becomes NaN, which `take` fills.

        Raises:
            AnimationFileError: not a list, or an item is not a finite number in the range of
                float32.
        """
        if not isinstance(values, list):
            raise self.fail(f"a list of numbers was expected, found {_kind(values)}", place)
        return [
            math.nan if has_holes and value is None else self.number(value, f"{place}[{i}]")
            for i, value in enumerate(values)
        ]

    def strings(self, values: object, place: str) -> list[str]:
        """Reads a list of names.

        Args:
            values: a value of the JSON.
            place: its name in errors.

        Raises:
            AnimationFileError: not a list, or an item that is not text.
        """
        if not isinstance(values, list) or not all(isinstance(v, str) for v in values):
            raise self.fail(f"a list of names was expected, found {_kind(values)}", place)
        return values

    def rate_of(self, *tables: object) -> float | None:
        """Frames per second from the caller, else from the first table that states them."""
        if self.asked.rate is not None:
            return self.asked.rate
        for table in tables:
            if isinstance(table, dict) and (key := first_key(table, RATE_KEYS)):
                return self.frames_a_second(table[key], key)
        return None

    def frames_a_second(self, value: object, place: str) -> float:
        """Reads a rate from 0.01 to 1,000,000 frames per second.

        Args:
            value: a value of the JSON.
            place: its name in errors.

        Raises:
            AnimationFileError: not a number, or out of range.
        """
        rate = self.number(value, place)
        if not SLOWEST <= rate <= FASTEST:
            raise self.fail(
                f"frames a second above 0 were expected ({SLOWEST:g} to {FASTEST:g}), "
                f"found {rate:g}",
                place,
            )
        return rate

    def times(self, given: object, count: int, rate: float | None, place: str) -> Doubles:
        """float64[count]: times of frames in seconds, converted from the times of the JSON. Without
        such times, or if the user chose to count rows, the frames begin at 0 and are evenly spaced
        at the rate.

        Args:
            given: the list of times from the JSON, or None.
            count: number of frames.
            rate: frames per second; None: unknown.
            place: the key of the times, which may contain their unit; also their name in errors.

        Raises:
            AnimationFileError: a different number of times, neither times nor a rate, an unknown
                unit.
        """
        asked = self.asked._replace(rate=rate)
        if given is None or asked.counts_rows:
            return row_times(count, asked, self.name)
        times = np.array(self.numbers(given, place))
        if times.size != count:
            raise self.fail(f"{count} times were expected, found {times.size}", place)
        said = time_name(place) or TimeName("")
        return seconds_of(times, said, asked, self.notes, name=self.name, column=place)

    def take(
        self, names: Sequence[str], rows: npt.ArrayLike, times: Doubles, rate: float | None = None
    ) -> Take:
        """Makes a Take from curves; frames whose time does not ascend are dropped, with a note.

        Args:
            names: names of the curves, each once.
            rows: float[names, frames]; NaN for missing values, which are interpolated.
            times: float64[frames], seconds.
            rate: frames per second; None: inferred from the times.

        Raises:
            AnimationFileError: a repeated name, a curve in which all values are missing, or times
                of which more than a third do not ascend.
        """
        if len(set(names)) != len(names):
            twice = next(name for name in names if list(names).count(name) > 1)
            raise self.fail(f"{twice!r} was expected once, found it twice")
        keep = keep_ascending(times, self.notes, self.name)
        curves = np.array(rows, np.float64).reshape(len(names), times.size)[:, keep]
        for name, curve in zip(names, curves, strict=True):
            holes = np.isnan(curve)
            if holes.all() and holes.size:
                raise self.fail("numbers were expected, found only null", name)
            if holes.any():
                curve[holes] = np.interp(times[keep][holes], times[keep][~holes], curve[~holes])
                self.notes.append(f"{name}: null in {int(holes.sum())} frame(s), filled")
        return Take(make_clip(names, curves, times[keep], rate=rate), "json", "", self.notes)


def first_key(table: Mapping[str, object], keys: Sequence[str]) -> str | None:
    """The first key in `keys` that a table has; None if it has none of them.

    Args:
        table: table of the JSON.
        keys: keys in order of preference.
    """
    return next((key for key in keys if key in table), None)


def _shown(value: object) -> str:
    """A value as text for messages; for a list or table, only its kind."""
    if isinstance(value, dict | list):
        return _kind(value)
    is_long = isinstance(value, int) and abs(value) >= 1 << 64
    return "a long number" if is_long else str(value)[:40]


def _kind(value: object) -> str:
    names = {
        dict: "a table",
        list: "a list",
        str: "text",
        bool: "true or false",
        type(None): "null",
    }
    return names.get(type(value), "a number")
