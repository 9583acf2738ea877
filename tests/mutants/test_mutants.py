# SPDX-License-Identifier: MIT
"""Tests that every source file has tests in tests.toml, and that sources() refuses bad paths."""

import re
import tomllib
from pathlib import Path

import mutants
import pytest

PROJECT = Path(__file__).resolve().parents[2]
TABLE = tomllib.loads((Path(__file__).parent / "tests.toml").read_text(encoding="utf-8"))
PROGRAMS = set(
    re.findall(
        r"risorius_test\((\w+)",
        "".join(p.read_text() for p in (PROJECT / "tests").glob("*/CMakeLists.txt")),
    )
)


@pytest.mark.parametrize("part", mutants.SOURCES)
def test_every_source_has_tests(part):
    files = mutants.sources(PROJECT, part)
    assert len(files) > 30
    assert [f for f in files if not mutants.tests_of(f, TABLE[part])] == []


@pytest.mark.parametrize("part", mutants.SOURCES)
def test_what_the_table_names_is_there(part):
    named = {test for tests in TABLE[part].values() for test in tests}
    programs = {test.partition(":")[0] for test in named if not test.endswith(".py")}
    assert programs <= PROGRAMS
    assert [t for t in named if t.endswith(".py") and not (PROJECT / t).is_file()] == []


@pytest.mark.parametrize("part", mutants.SOURCES)
def test_every_pattern_fits_a_file(part):
    files = mutants.sources(PROJECT, part)
    alone = {p: [f for f in files if mutants.tests_of(f, {p: ["x"]})] for p in TABLE[part]}
    assert [pattern for pattern, fits in alone.items() if not fits] == []


def test_some_places_of_a_part_are_drawn_from_alone():
    files = mutants.sources(PROJECT, "native", ["native/solve/", "native/author/mirror.cpp"])
    assert "native/author/mirror.cpp" in files
    assert {f.rpartition("/")[0] for f in files} == {"native/solve", "native/author"}
    assert len([f for f in files if f.startswith("native/author")]) == 1
    with pytest.raises(SystemExit, match="--under native/solv: no source of the part native"):
        mutants.sources(PROJECT, "native", ["native/solve", "native/solv"])
