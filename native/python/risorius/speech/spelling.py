# SPDX-License-Identifier: MIT
"""The phonemes of written words: from PocketSphinx's dictionary, else by rule."""

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
    """How written words are pronounced.

    Args:
        said: words, numbers and signs, in English.
        places: folders in which PocketSphinx may be installed; None: where Python looks. It is
            read as a file and not imported. Without it words are pronounced by rule.

    Returns:
        Each spoken word, in lower case, with its phonemes, at least one.

    Raises:
        ArgumentError: there is no English word in it.
    """
    words = text.words(said)
    if not words:
        raise ArgumentError(
            f"a word of the letters a to z was expected, found {said.strip()[:40]!r}"
        )
    known = _looked_up(set(words), sys.path if places is None else places)
    return [(word, known.get(word) or letters.pronounce(word)) for word in words]


def _looked_up(words: set[str], places: Sequence[str]) -> dict[str, list[str]]:
    """The first pronunciation of each word that the dictionary has."""
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
