# SPDX-License-Identifier: MIT
"""Tests that comments and docstrings avoid the phrases that docs/style.md forbids."""

from functools import lru_cache
from pathlib import Path

import pytest
from phrases import PHRASES, TO_REWRITE, files, findings, found

ROOT = Path(__file__).resolve().parents[2]


@lru_cache
def result():
    return findings(files(ROOT))


def test_comments_name_the_thing():
    assert result()[0] == []


def test_every_room_to_rewrite_still_has_a_phrase():
    assert sorted(set(TO_REWRITE) - result()[1]) == []


@pytest.mark.parametrize("name", PHRASES)
@pytest.mark.parametrize(
    ("path", "form"),
    [
        ("planted.h", "/// {}\nint x;\n"),
        ("planted.cpp", "int x;  // {}\n"),
        ("planted.py", "# {}\nx = 1\n"),
        ("planted.py", '"""{}"""\n'),
        ("planted.js", "/** {} */\nlet x;\n"),
    ],
)
def test_a_planted_phrase_is_found(name, path, form):
    assert len(found(path, form.format(PHRASES[name]["plant"]))) >= 1


def test_a_phrase_across_two_lines_is_found_at_its_first_word():
    text = "// Fills the layers as\n// far as anything reads them.\n"
    assert [line.split(":")[1] for line in found("planted.cpp", text)] == ["1"]


def test_code_and_strings_are_not_read():
    assert found("planted.cpp", 'const char* x = "what is left";\n') == []
    assert found("planted.py", 'x = "what is left"\n') == []
