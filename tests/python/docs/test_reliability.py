# SPDX-License-Identifier: MIT
"""Checks that all tests exist which docs/reliability.md names."""

import re

from conftest import PROJECT

_NAMED = re.compile(r"`(?:(?P<file>test_\w+)::|::)(?P<test>test_[\w…]+|…[\w…]+)`")


def _missing(text):
    """Names in a page for which no test exists; `…` in a name stands for any letters."""
    homes = {}
    for folder in ("tests", "blender_tests"):
        for path in (PROJECT / folder).rglob("test_*.py"):
            homes.setdefault(path.stem, []).append(path.read_text(encoding="utf-8"))
    missing, stem = [], ""
    for found in _NAMED.finditer(text):
        stem = found["file"] or stem
        pattern = "def " + found["test"].replace("…", r"\w*") + r"\("
        if not any(re.search(pattern, code) for code in homes.get(stem, [])):
            missing.append(f"{stem}::{found['test']}")
    return missing


def test_every_test_that_is_named_is_there():
    text = (PROJECT / "docs" / "reliability.md").read_text(encoding="utf-8")
    assert len(_NAMED.findall(text)) > 30
    assert _missing(text) == []
    assert _missing("`test_live::test_that_nobody_wrote`, `::test_nor_this`") == [
        "test_live::test_that_nobody_wrote",
        "test_live::test_nor_this",
    ]
