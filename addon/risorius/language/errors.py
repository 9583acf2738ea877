# SPDX-License-Identifier: GPL-3.0-or-later
"""Translates error messages of the package `risorius`.

The package knows no languages: its messages are finished English sentences. errors_<language>.toml
has a row for each message, with {names} for the values in it. A message is compared with the rows,
and its values are put into the translation.

A row with few words, such as "{range} was expected, found {found}", matches many messages. A
message can begin with places of the error: "take.csv, line 3: a number was expected". So each row
is compared with the whole message, and also with the rest of the message after one or more places.
The matching row that translates the most letters is used.
"""

from __future__ import annotations

import re
from functools import cache, lru_cache
from typing import NamedTuple

from . import tables

_SLOT = re.compile(r"\{(\w+)\}")
_DEEPEST = 4  # most levels of messages inside a message: a file, a row, a cell, a reason
_MOST_PLACES = 5  # most places, such as a file and a line, before a message
_AND = " and "  # key of the row that translates the word before the last name of a list
_LISTS = ("controls", "materials", "meshes", "names")  # values that may be lists of names
_SEVERAL = "changes"  # value with texts between commas, each of which has its own row
_LONGEST = 1000  # most characters of a translated message: the time grows faster than its length


class _Row(NamedTuple):
    pattern: re.Pattern[str]
    piece: str
    """The longest English text between two values; a message without this text does not match."""
    letters: int
    """Number of letters of the English text outside the values."""
    translation: str


class _Found(NamedTuple):
    text: str
    letters: int = 0
    """English letters that were translated."""


def local(message: str, language: str) -> str:
    """Translate a message of the package; text without a row in the table stays English.

    Args:
        message: the English message.
        language: a language of `tables.languages`, or "" for English.
    """
    return best(message, language, 0).text if language else message


@lru_cache(maxsize=512)  # panels show the same message at each redraw
def best(message: str, language: str, depth: int) -> _Found:
    """Find the translation that translates the most letters of a message.

    A message of a single word stays as it is, because the word is a name or a number. So do
    messages that no row matches, that are too long, or that are parts of too many messages.

    Args:
        message: the English message.
        language: a language of `tables.languages`, not "".
        depth: number of longer messages of which this message is a part; 0 for a whole message.
    """
    found = _Found(message)
    if " " not in message or len(message) > _LONGEST or depth > _DEEPEST:
        return found
    parts = message.split(": ")
    for places in range(min(len(parts), _MOST_PLACES + 1)):
        rest = ": ".join(parts[places:])
        for row in rows(language):
            match = row.piece in rest and row.pattern.fullmatch(rest)
            if match:
                values = match.groupdict().items()
                inside = {k: _value(k, v, language, depth + 1) for k, v in values}
                before = [best(place, language, depth + 1) for place in parts[:places]]
                letters = row.letters + sum(f.letters for f in (*inside.values(), *before))
                if letters > found.letters:
                    text = row.translation.format(**{k: f.text for k, f in inside.items()})
                    found = _Found(": ".join([*(f.text for f in before), text]), letters)
    return found


def _value(name: str, value: str, language: str, depth: int) -> _Found:
    """Translate a value of a message.

    In the value of the name "changes", each text between commas is translated. In a list of names
    without a translation, only the "and" is translated.

    Args:
        name: name of the value in the row's template.
        value: the value's text in the message.
        language: a language of `tables.languages`, not "".
        depth: number of messages that contain this value, one inside another; 1 or more.
    """
    if name == _SEVERAL:
        each = [best(part, language, depth) for part in value.split(", ")]
        return _Found(", ".join(f.text for f in each), sum(f.letters for f in each))
    found = best(value, language, depth)
    others, word, last = value.rpartition(_AND)
    if found.letters or not word or name not in _LISTS:
        return found
    return _Found(others + tables.error_rows(language).get(_AND, _AND) + last)


@cache
def rows(language: str) -> list[_Row]:
    """All rows of errors_<language>.toml.

    Args:
        language: a language of `tables.languages`, not "".
    """
    return [_row(*row) for row in tables.error_rows(language).items()]


def _row(english: str, translation: str) -> _Row:
    parts = _SLOT.split(english)
    names = [f"(?P<{part}>.+?)" if i % 2 else re.escape(part) for i, part in enumerate(parts)]
    return _Row(
        re.compile("".join(names), re.DOTALL),
        max(parts[::2], key=len),
        sum(letter.isalpha() for part in parts[::2] for letter in part),
        translation,
    )
