# SPDX-License-Identifier: MIT
"""Tests that each error message of the package that Blender shows has a German row."""

import re
import tomllib
from pathlib import Path

from messages import messages, raised, without_names

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "addon" / "risorius" / "language" / "errors_de.toml"


def rows():
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))


def test_each_message_has_a_row():
    known = {without_names(english) for english in rows()}
    shown = messages(ROOT / "native" / "python" / "risorius")
    assert len(shown) > 400
    assert {f"{place}: {text}" for text, place in shown.items() if text not in known} == set()


def test_a_message_without_a_row_is_found():
    source = 'raise Error(f"{path}: three planted words, found {count}") from None'
    assert raised(source) == ["{}: three planted words, found {}"]


def test_a_row_and_its_translation_have_the_same_values():
    names = re.compile(r"\{(\w+)\}")
    for english, german in rows().items():
        assert sorted(names.findall(english)) == sorted(names.findall(german)), english
        assert len(set(names.findall(english))) == len(names.findall(english)), english
