# SPDX-License-Identifier: MIT
"""Tests that names inside files become valid file names, never paths."""

import re
import unicodedata
from pathlib import Path, PureWindowsPath

import pytest
from risorius.files.names import LONGEST, file_name, folded, is_file_name

GOOD = [
    "jawOpen",
    "Mein Gruß",
    "shot.v02",
    "a-b_c (1)",
    "日本語",
    "e\u0301te",
    "concept",
    "nullify",
]
CHANGED = [
    ("../X", "_X"), ("/etc/passwd", "_etc_passwd"), ("C:\\x", "C__x"), ("..", "unnamed"),
    ("", "unnamed"), (" . ", "unnamed"), ("CON", "_CON"), ("nul.tar", "_nul.tar"),
    ("com1 .x", "_com1 .x"), ("LPT\u00b2", "_LPT\u00b2"), ("a. .", "a"), (".hidden", "hidden"),
    ("a\0b\nc", "a_b_c"), ("a\u202etxt.exe", "a_txt.exe"), ("\udc80", "_"), ("a:b?*", "a_b__"),
]  # fmt: skip


HOSTILE = [name for name, _ in CHANGED] + [
    "x" * 5000, "\U0001f600" * 90, "~/x", "$HOME", "-rf", "%2e%2e%2fx", "\\\\server\\share\\x",
    "//x", "aux.toml", "con" + " " * 300 + "x", "x" * 195 + "....", "a\u2028b", "\ufeffBOM",
    "x:stream",
]  # fmt: skip


@pytest.mark.parametrize("name", GOOD)
def test_a_good_name_stays(name):
    assert file_name(name, ".toml") == f"{name}.toml"
    assert is_file_name(name)


@pytest.mark.parametrize(("name", "expected"), CHANGED)
def test_what_no_system_or_only_some_would_take(name, expected):
    assert file_name(name) == expected
    assert file_name(name, ".png") == f"{expected}.png"
    assert not is_file_name(name)


@pytest.mark.parametrize("name", HOSTILE)
def test_what_comes_out_is_a_name_on_every_system_and_stays_one(name, tmp_path):
    found = file_name(name, ".toml")
    assert file_name(found) == found
    assert Path(found).name == PureWindowsPath(found).name == found
    assert not re.match(r"(?i)(con|prn|aux|nul|(com|lpt)[0-9\u00b9\u00b2\u00b3]) *(\.|$)", found)
    assert len(found.encode()) <= LONGEST
    (tmp_path / found).write_text("x")
    assert [p.name for p in tmp_path.iterdir()] == [found]


def test_names_that_are_one_on_some_system_get_numbers():
    taken = ["Smile.toml", "cafe\u0301.toml"]
    assert file_name("smile", ".toml", taken) == "smile-2.toml"
    assert file_name("SMILE", ".toml", [*taken, "smile-2.toml"]) == "SMILE-3.toml"
    assert file_name("caf\u00e9", ".toml", taken) == "caf\u00e9-2.toml"
    assert file_name("a/b", ".toml", ["a_b.toml"]) == "a_b-2.toml"
    assert folded("ΑΣ") == folded("ας")
    long = "é" * 300
    given: list[str] = []
    for _ in range(3):
        given.append(file_name(long, ".toml", given))
    assert len(set(given)) == 3
    assert all(len(name.encode()) <= LONGEST for name in given)
    assert unicodedata.is_normalized("NFC", given[0])
