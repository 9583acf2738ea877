# SPDX-License-Identifier: MIT
"""Checks of numbers and texts from users and files, where they enter the program.

TOML and JSON allow integers of any length, and Python accepts spellings of digits that other
programs do not. A value is checked here once and is in range from then on.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from numbers import Integral, Real
from typing import TypeVar

from .errors import ArgumentError

T = TypeVar("T")
LARGEST = 3.4028234663852886e38
"""The largest float32, the type of DNA files and clips."""
MOST = (1 << 53) - 1
"""The largest integer that a float64 and every JSON reader keep exactly."""
_WHOLE = re.compile(r"[+-]?[0-9]{1,18}")
_SHOWN = 40  # most characters of a value in an error message


class GivenError(ArgumentError):
    """A value of the wrong type or range; the sentence names the expected value.

    The sentence names no file and no field; the code that reads the file adds them.
    """

    code = "given"


def whole(value: object, low: int, high: int = MOST) -> int:
    """Check an integer from a file or a caller.

    Args:
        value: a value of any type; true and false do not count as numbers.
        low: smallest allowed value.
        high: largest allowed value.

    Raises:
        GivenError: not an integer, or out of range.
    """
    if isinstance(value, bool) or not isinstance(value, Integral):
        raise GivenError(f"a whole number was expected, found {shown(value)}")
    number = int(value)
    if not low <= number <= high:
        raise GivenError(f"{_range(number, low, high)} was expected, found {shown(number)}")
    return number


def finite(
    value: object, low: float = -LARGEST, high: float = LARGEST, *, above: bool = False
) -> float:
    """Check a finite number from a file or a caller.

    Args:
        value: a value of any type; true and false do not count as numbers.
        low: smallest allowed value.
        high: largest allowed value.
        above: True: `low` itself is not allowed.

    Raises:
        GivenError: not a finite number, or out of range.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        raise GivenError(f"a number was expected, found {shown(value)}")
    number = int(value) if isinstance(value, Integral) else float(value)
    return _inside(number, value, low, high, above=above)


def whole_text(typed: str, low: int, high: int = MOST) -> int:
    """Convert the text of an integer that a user typed: a sign or none, and at most 18 of the
    digits 0 to 9.

    Args:
        typed: the text.
        low: smallest allowed value.
        high: largest allowed value.

    Raises:
        GivenError: not an integer, or out of range.
    """
    if not _WHOLE.fullmatch(typed):
        raise GivenError(f"a whole number was expected, found {shown(typed)}")
    return whole(int(typed), low, high)


def finite_text(
    typed: str, low: float = -LARGEST, high: float = LARGEST, *, above: bool = False
) -> float:
    """Convert the text of a finite number that a user typed, in ASCII and without underscores.

    Args:
        typed: the text.
        low: smallest allowed value.
        high: largest allowed value.
        above: True: `low` itself is not allowed.

    Raises:
        GivenError: not a finite number, or out of range.
    """
    try:
        value = float(typed if typed.isascii() and "_" not in typed else "")
    except ValueError:
        raise GivenError(f"a number was expected, found {shown(typed)}") from None
    return _inside(value, typed, low, high, above=above)


def text(value: object) -> str:
    """Check a text from a file.

    Args:
        value: a value of any type.

    Raises:
        GivenError: not a text, empty, or with a zero byte, which no name may contain.
    """
    if not isinstance(value, str) or not value or "\0" in value:
        raise GivenError(f"text was expected, found {shown(value)}")
    return value


def flag(value: object) -> bool:
    """Check a truth value from a file.

    Args:
        value: a value of any type.

    Raises:
        GivenError: neither true nor false.
    """
    if not isinstance(value, bool):
        raise GivenError(f"true or false was expected, found {shown(value)}")
    return value


def several(value: object, of: Callable[[object], T]) -> tuple[T, ...]:
    """Check a list from a file.

    Args:
        value: a value of any type.
        of: function that checks and returns one item.

    Raises:
        GivenError: not a list, or an item is invalid.
    """
    if not isinstance(value, list):
        raise GivenError(f"a list was expected, found {shown(value)}")
    return tuple(of(item) for item in value)


def checked(name: str, check: Callable[..., T], value: object, low: float, high: float) -> T:
    """Check an argument of a function with `whole` or `finite`.

    Args:
        name: name of the argument.
        check: `whole` or `finite`.
        value: a value of any type.
        low: smallest allowed value.
        high: largest allowed value.

    Raises:
        ArgumentError: `check` refuses the value; the error names the argument.
    """
    try:
        return check(value, low, high)
    except GivenError as error:
        raise ArgumentError(f"{name}: {error}") from None


def shown(value: object) -> str:
    """A value as text for errors, shortened if it is long. The text is "a list" for any list, and
    "a table" for any table.

    Args:
        value: a value of any type.
    """
    if isinstance(value, list | tuple | dict):
        return "a table" if isinstance(value, dict) else "a list"
    if isinstance(value, int) and value.bit_length() > 128:  # Python refuses to print it
        return f"a number of {int(value.bit_length() * math.log10(2)) + 1:,} digits"
    spelled = repr(value)
    return spelled if len(spelled) <= _SHOWN else f"{spelled[: _SHOWN - 3]}..."


def _inside(value: float, found: object, low: float, high: float, *, above: bool) -> float:
    """Return `value` if it is in range. Raises: GivenError with `found` in its text.

    Args:
        value: the number.
        found: the value as it was given, for the error.
        low: smallest allowed value.
        high: largest allowed value.
        above: True: `low` itself is not allowed.
    """
    if isinstance(value, float) and not math.isfinite(value):
        known = low > -LARGEST and high < LARGEST
        expected = f"{low:g} to {high:g}" if known else "a finite number"
        raise GivenError(f"{expected} was expected, found {shown(found)}")
    if not low <= value <= high or (above and value == low):
        raise GivenError(f"{_range(value, low, high, above)} was expected, found {shown(found)}")
    return float(value)


def _range(value: float, low: float, high: float, above: bool = False) -> str:
    """The expected range as text; if only one side has a limit, the side that `value` exceeds."""
    bounded = high < (MOST if isinstance(high, int) else LARGEST)
    if above and low == 0:
        return "more than 0" + (f", at most {_plain(high)}" if bounded else "")
    if bounded and low > -LARGEST:
        return f"{_plain(low)} to {_plain(high)}"
    return f"{_plain(low)} or more" if value < low else f"at most {_plain(high)}"


def _plain(number: float) -> str:
    return str(number) if isinstance(number, int) else f"{number:g}"
