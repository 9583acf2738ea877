# SPDX-License-Identifier: MIT
"""Tests vocabularies of shape names: the names in each of them, and their meanings."""

from __future__ import annotations

import re
import tomllib
from itertools import product
from pathlib import Path

import pytest
from risorius import expressions, importing
from risorius.controls import arkit, vocabulary
from risorius.controls.control_names import Meaning, UnknownControlError, find_controls
from risorius.importing.mapping import parse_mapping
from risorius.live.shaping import Plan

RAW = {"CTRL_expressions." + name for name in vocabulary.vocabulary("metahuman").meanings}
LISTS = tomllib.loads(
    (Path(__file__).parents[1] / "support" / "shape_names.toml").read_text(encoding="utf-8")
)


def spelled(kind):
    """All names of a program's list, with alternatives in braces expanded."""
    out = []
    for word in LISTS[kind]["names"].split():
        parts = re.split(r"\{([^}]*)\}", word)
        choices = [part.split(",") if i % 2 else [part] for i, part in enumerate(parts)]
        out += ["".join(chosen) for chosen in product(*choices)]
    return out


# Program -> three numbers. The first is the number of its names; all of them must be known. The
# other two are not tested; they show the use of the table of vocabularies. Without this table,
# `author` recognised the second number of names by their words, and the best mapping for clips
# contained the third number.
COUNTS = {
    "arkit": (52, 52, 52), "oculus": (15, 0, 15), "vrchat": (18, 0, 7), "vrm0": (17, 3, 17),
    "vrm1": (18, 3, 18), "vroid": (57, 0, 0), "cc4": (155, 16, 27), "cc3": (108, 6, 13),
    "unified": (102, 39, 35), "meta": (70, 5, 3), "genesis": (116, 0, 0), "genesis8": (41, 0, 0),
    "genesis3": (91, 0, 0), "mpfb": (34, 1, 0), "microsoft": (22, 0, 0), "faceit": (55, 4, 0),
    "mmd": (55, 0, 0),
}  # fmt: skip


@pytest.mark.parametrize("kind", LISTS)
def test_every_name_of_a_program_is_known(kind):
    names = spelled(kind)
    order = vocabulary.leading(names)
    unknown = [name for name in names if vocabulary.find(name, order) is None]
    assert (len(names) - len(unknown), unknown) == (COUNTS[kind][0], [])
    mapping = importing.load_mapping(importing.best_mapping(names) or "")
    find = mapping.finder()
    assert [name for name in names if find(name) is None] == []
    assert importing.mapping_title(mapping.name) == vocabulary.vocabulary(mapping.name).title


def test_meanings_are_controls_and_expressions_that_there_are():
    library = expressions.load()
    for of in map(vocabulary.vocabulary, vocabulary.names()):
        for meaning in of.meanings.values():
            assert set(meaning.controls) <= RAW, meaning
            assert all(0 < weight <= 1 for weight in meaning.controls.values()), meaning
            if not meaning.controls:
                assert not meaning.expression or meaning.expression in library, meaning


ARKIT_SPELLINGS = {
    "mouthSmile_L": lambda unit: re.sub("(Left|Right)$", lambda m: "_" + m[0][0], unit),
    "mouthSmileL": lambda unit: re.sub("(Left|Right)$", lambda m: m[0][0], unit),
    "Mouth_Smile_L": lambda unit: re.sub(
        "(Left|Right)$", lambda m: m[0][0], unit[0].upper() + re.sub("([A-Z])", r"_\1", unit[1:])
    ),
    "MouthSmile_Left": lambda unit: re.sub("(Left|Right)$", r"_\1", unit[0].upper() + unit[1:]),
    "mouthSmileLeft.001": lambda unit: unit + ".001",
}


@pytest.mark.parametrize("before", ["", "blendShape1.", "char:", "Group|Head.", "Head__"])
@pytest.mark.parametrize("spelling", ARKIT_SPELLINGS)
def test_arkit_is_known_in_all_spellings(spelling, before):
    for unit, row in arkit.mapping().items():
        found = vocabulary.find(before + ARKIT_SPELLINGS[spelling](unit))
        assert found is not None, unit
        assert found.controls == row, unit


def test_the_names_beside_it_say_what_a_name_means():
    alone = vocabulary.find("BrowDownLeft")
    assert set(alone.controls) == {"CTRL_expressions.browDownL"}  # ARKit's in Unreal's spelling
    unified = vocabulary.leading(spelled("unified"))
    beside = vocabulary.find("BrowDownLeft", unified)
    assert set(beside.controls) == {"CTRL_expressions.browDownL", "CTRL_expressions.browLateralL"}
    assert vocabulary.find("hat") is None
    assert vocabulary.known(["hat", "viseme_PP"]) == {"oculus": 1}


def test_names_without_letters_are_told_apart():
    find = importing.load_mapping("mmd").finder()
    assert [find(name) and find(name)[0] for name in "▲∧□"] == list("▲∧□")
    assert find("!!") is None


def test_live_names_of_any_vocabulary_move_what_they_move_in_clips():
    for kind, mapping in (("meta", "meta"), ("cc4", "cc4"), ("mmd", "mmd")):
        names = tuple(spelled(kind))
        find = importing.load_mapping(mapping).finder()
        plan = Plan(names, importing.load_mapping("arkit"))
        assert plan.unmapped == ()
        for column, name in enumerate(names):
            live = {c: w for c, w in zip(plan.controls, plan.matrix[:, column], strict=True) if w}
            assert live == pytest.approx(find(name)[1]), name


@pytest.mark.parametrize("name", ["mouthSmile_L", "Mouth_Smile_L", "lipCornerPullerL"])
def test_names_of_other_programs_may_be_typed(name):
    found = find_controls(name, sorted(RAW))
    assert found == Meaning({"CTRL_expressions.mouthCornerPullL": 1.0}, is_exact=False)
    with pytest.raises(UnknownControlError, match="there is no control 'Fcl_ALL_Joy'"):
        find_controls("Fcl_ALL_Joy", sorted(RAW))


def test_files_that_name_a_base_as_it_was_called_still_load():
    for old, new in (("arkit units", "arkit"), ("vrm expressions", "vrm")):
        mapping = parse_mapping(f'base = "{old}"', "mine")
        assert mapping.rows.items() <= importing.load_mapping(new).rows.items()
        assert "mouthSmileLeft" in mapping.rows
