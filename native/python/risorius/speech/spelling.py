# SPDX-License-Identifier: MIT
"""Finds the phonemes of written words, in PocketSphinx's dictionary or else by rules."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.machinery import PathFinder
from pathlib import Path

from ..base.errors import ArgumentError
from . import letters, text

_DICTIONARY = ("model", "en-us", "cmudict-en-us.dict")


def spell(said: str, places: Sequence[str] | None = None) -> list[tuple[str, list[str]]]:
    """The pronunciation of the words in a text.

    Args:
        said: text of English words, numbers and signs.
        places: folders in which PocketSphinx may be installed; None: Python's search path. Its
            dictionary is read as a file, without importing the package. If there is none, rules are
            used.

    Returns:
        (word in lower case, its phonemes) of each spoken word; at least one.

    Raises:
        ArgumentError: the text has no English word.
    """
    words = text.words(said)
    if not words:
        raise ArgumentError(
            f"a word of the letters a to z was expected, found {said.strip()[:40]!r}"
        )
    known = _looked_up(set(words), sys.path if places is None else places)
    return [(word, known.get(word) or letters.pronounce(word)) for word in words]


def _looked_up(words: set[str], places: Sequence[str]) -> dict[str, list[str]]:
    """Word -> phonemes of its first pronunciation in the dictionary; unknown words are absent."""
    path = _dictionary(places)
    if path is None:
        return {}
    found: dict[str, list[str]] = {}
    with path.open(encoding="utf-8", errors="replace") as lines:
        for line in lines:
            word, _, phones = line.partition(" ")
            if word in words and word not in found:
                found[word] = phones.split()
    return found


def _dictionary(places: Sequence[str]) -> Path | None:
    spec = PathFinder.find_spec("pocketsphinx", [os.fspath(place) for place in places])
    if spec is None or spec.origin is None:
        return None
    path = Path(spec.origin).parent.joinpath(*_DICTIONARY)
    return path if path.is_file() else None
