# SPDX-License-Identifier: MIT
"""The base class of this package's errors, and the text of any error for users."""

from __future__ import annotations


class RisoriusError(ValueError):
    """An error that the user can mend; its text is one sentence with the cause and the place.

    A ValueError of another class is a fault of the calling program or of this package.
    """

    code: str = "invalid"
    """The kind of error as a word for programs, e.g. "truncated"."""
    where: str = ""
    """The file, field or argument; "" if the sentence names it."""
    offset: int | None = None
    """Byte offset in the file."""


class ArgumentError(RisoriusError):
    """An invalid value from the caller, often typed by a user."""

    code = "invalid_argument"


def sentence(error: BaseException) -> str:
    """The error as a sentence, with the file's name if the error has one."""
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    if isinstance(error, MemoryError):
        return "not enough memory"
    return str(error) or type(error).__name__
