# SPDX-License-Identifier: MIT
"""Tests that each error and each note of the package that Blender shows has a German row."""

import re
import tomllib
from pathlib import Path

from messages import messages, noted, raised, without_names

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "addon" / "risorius" / "language" / "errors_de.toml"


def rows():
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))


def test_each_message_has_a_row():
    known = {without_names(english) for english in rows()}
    shown = messages(ROOT / "native" / "python" / "risorius")
    assert len(shown) > 500
    assert {f"{place}: {text}" for text, place in shown.items() if text not in known} == set()


def test_a_message_without_a_row_is_found():
    source = 'raise Error(f"{path}: three planted words, found {count}") from None'
    assert raised(source) == ["{}: three planted words, found {}"]


def test_a_note_without_a_row_is_found():
    source = """
notes = [f"{name}: three listed words"]
self.notes.append(f"{name}: three appended words" if name else "three other words")
out.notes += [f"{curve}: three added words" for curve in curves]
notes.extend(f"three words of {', '.join(name for name in names)}" for names in rows)
names.append("three words elsewhere")
def said_of(part):
    'A docstring is no note.'
    return f"{part} is told here"
"""
    assert sorted(noted(source)) == [
        "three other words",
        "three words of {}",
        "{} is told here",
        "{}: three added words",
        "{}: three appended words",
        "{}: three listed words",
    ]


def test_a_row_and_its_translation_have_the_same_values():
    names = re.compile(r"\{(\w+)\}")
    for english, german in rows().items():
        assert sorted(names.findall(english)) == sorted(names.findall(german)), english
        assert len(set(names.findall(english))) == len(names.findall(english)), english
