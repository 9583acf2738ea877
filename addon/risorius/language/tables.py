# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the tables of descriptions and translations in this file's folder.

controls_<language>.toml describes each control; * in a control's name stands for L and R.
interface_<language>.toml translates the texts of panels, dialogs and reports from English.
errors_<language>.toml translates the package's error messages from English. A new language needs
these three files.
"""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

from ..logic.base.control_words import ControlWords, expand

CONTEXT = "Risorius"  # translations apart from Blender's, in which Face means a polygon
TOOLTIPS = "*"  # Blender looks for tooltips without a context
ENGLISH = "en"
_HERE = Path(__file__).parent


def _read(name: str) -> dict[str, Any]:
    return tomllib.loads((_HERE / f"{name}.toml").read_text(encoding="utf-8"))


@cache
def controls(language: str = ENGLISH) -> ControlWords:
    """The descriptions (for tooltips) and search words of the standard controls in a language."""
    table = _read(f"controls_{language}")
    return expand(table, table.pop("sides"))


@cache
def error_rows(language: str) -> dict[str, str]:
    """English error message, with {names} in place of values -> its translation."""
    return _read(f"errors_{language}")


@cache
def languages() -> tuple[str, ...]:
    """All languages except English, as Blender's codes without a country, such as "de"."""
    return tuple(sorted(p.stem.partition("_")[2] for p in _HERE.glob("interface_*.toml")))


@cache
def search_words() -> dict[str, str]:
    """Name of a control without its prefix -> its search words in all languages, in one text."""
    tables = [controls(language) for language in (ENGLISH, *languages())]
    return {name: " ".join(table.searched(name) for table in tables) for name in tables[0].rows}


def language_of(locale: str) -> str:
    """The language of the tables for a locale of Blender, such as "de" for "de_DE"; "" for English
    and for languages without tables."""
    language = locale.replace("@", "_").partition("_")[0]
    return language if language in languages() else ""


@cache
def translation(language: str) -> dict[tuple[str, str], str]:
    """The translations that Blender shows: (context, English text) -> text in the language."""
    words = {
        (context, key): text
        for context, table in _read(f"interface_{language}").items()
        for key, text in table.items()
    }
    english, theirs = controls(), controls(language)
    for name in english.rows:
        words[TOOLTIPS, english.tooltip(name)] = theirs.tooltip(name)
    return words
