# SPDX-License-Identifier: MIT
"""Reads TOML from users, with limits on size and depth."""

from __future__ import annotations

import os
import re
import tomllib
from typing import Any

from . import reading
from .errors import ArgumentError, RisoriusError

MOST_BYTES = reading.TEXT
DEEPEST = 64
# Finds dotted keys of more than DEEPEST (64) parts. Such keys are refused, because the time of the
# parser grows with the square of the number of parts.
_DEEP_KEY = re.compile(rf"""(?<![\w"'-])(?:[\w"'-]+[ \t]*\.[ \t]*){{{DEEPEST}}}""")


class TomlError(RisoriusError):
    """Invalid or too large TOML; the error's text names the line if it is known."""

    code = "toml"


def parse(text: str) -> dict[str, Any]:
    """Parse a TOML text into a table.

    Args:
        text: the text.

    Raises:
        TomlError: the text is not TOML, has more than MOST_BYTES (16 Mi) characters, or is nested
            deeper than DEEPEST (64) levels.
    """
    if len(text) > MOST_BYTES:
        raise TomlError(f"at most {MOST_BYTES:,} characters were expected, found {len(text):,}")
    deep = f"nested at most {DEEPEST} deep was expected, found more"
    if found := _DEEP_KEY.search(text):
        raise TomlError(f"keys {deep} (line {text.count(chr(10), 0, found.start()) + 1})")
    try:
        table = tomllib.loads(text)
    except RecursionError:
        raise TomlError(f"values {deep}") from None
    except ValueError as error:  # TOMLDecodeError, or an integer with thousands of digits
        raise TomlError(str(error)) from error
    if _is_deep(table):
        raise TomlError(f"values {deep}")
    return table


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a TOML file into a table.

    Args:
        path: path of the file.

    Raises:
        ValueError: the file is invalid, too large or a device; the message names the file.
        OSError: the file cannot be read.
    """
    try:
        return parse(text_of(path))
    except TomlError as error:
        raise ArgumentError(f"{os.fspath(path)}: a TOML file was expected: {error}") from None


def text_of(path: str | os.PathLike[str]) -> str:
    """The text of a TOML file, with or without a byte order mark.

    Raises:
        TomlError: the file is not UTF-8; the error's text does not name the file.
        ReadingError: the file is larger than MOST_BYTES (16 MiB), or a device.
        OSError: the file cannot be read.
    """
    try:
        return reading.read_file(path, MOST_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise TomlError(f"UTF-8 text was expected (byte {error.start})") from None


def _is_deep(table: dict[str, Any]) -> bool:
    level: list[Any] = [table]
    for _ in range(DEEPEST):
        level = [
            inner
            for value in level
            for inner in (value.values() if isinstance(value, dict) else value)
            if isinstance(inner, dict | list)
        ]
        if not level:
            return False
    return True
