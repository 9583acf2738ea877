# SPDX-License-Identifier: GPL-3.0-or-later
"""Translates error messages of the package `risorius`.

The package knows no languages: its messages are finished English sentences. errors_<language>.toml
has a row for each message, with {names} for the values in it. A message is compared with the rows,
and its values are put into the translation.
"""

from __future__ import annotations

import re
from functools import cache

from . import tables

_SLOT = re.compile(r"\{(\w+)\}")
_DEEPEST = 4  # messages inside a message: a file, a row, a cell, a reason


def local(message: str, language: str, depth: int = 0) -> str:
    """A message of the package in a language.

    A message without a row stays English. "place: message" keeps the place if the rest has a row.

    Args:
        message: the English message.
        language: a language of `tables.languages`, or "" for English.
        depth: number of messages around this one.
    """
    if not language or depth > _DEEPEST:
        return message
    for pattern, translation in _rows(language):
        found = pattern.fullmatch(message)
        if found:
            values = {k: local(v, language, depth + 1) for k, v in found.groupdict().items()}
            return translation.format(**values)
    place, colon, rest = message.partition(": ")
    return f"{place}{colon}{local(rest, language, depth)}" if colon else message


@cache
def _rows(language: str) -> list[tuple[re.Pattern[str], str]]:
    """Each row as a pattern of English messages and its translation, the longest English first."""
    rows = tables.error_rows(language)
    longest = sorted(rows, key=lambda english: -len(_SLOT.sub("", english)))
    return [(_pattern(english), rows[english]) for english in longest]


def _pattern(english: str) -> re.Pattern[str]:
    parts = _SLOT.split(english)
    names = [f"(?P<{part}>.+?)" if i % 2 else re.escape(part) for i, part in enumerate(parts)]
    return re.compile("".join(names), re.DOTALL)
