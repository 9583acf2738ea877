# SPDX-License-Identifier: MIT
"""The family of this package's errors: one class above all of them, and one way to say them."""

from __future__ import annotations


class RisoriusError(ValueError):
    """Something that a user can mend; the text is one sentence that says what and where.

    A ValueError of another class is a fault in the program that calls, or in this one.
    """

    code: str = "invalid"
    """What kind of error it is, for programs, e.g. "truncated"."""
    where: str = ""
    """The file, field or argument; empty where the sentence alone says it."""
    offset: int | None = None
    """Byte offset in the file."""


class ArgumentError(RisoriusError):
    """A value that the caller gave, often as a user typed it, which makes no sense."""

    code = "invalid_argument"


def sentence(error: BaseException) -> str:
    """What went wrong, with the file's name where the error knows it."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    if isinstance(error, MemoryError):
        return "not enough memory"
    return str(error) or type(error).__name__
