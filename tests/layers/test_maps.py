# SPDX-License-Identifier: MIT
"""Tests that tables in READMEs list exactly the names that exist, and that the check can fail."""

import pytest
from layers import ROOMS
from maps import ROOT, first_cells, folders, maps

MAPS = maps()


@pytest.mark.parametrize("each", MAPS, ids=lambda m: f"{m.page}, {m.head}")
def test_a_map_names_what_is_there(each):
    assert len(each.there) > 4
    assert each.wrong((ROOT / each.page).read_text(encoding="utf-8")) == []


@pytest.mark.parametrize("each", MAPS, ids=lambda m: f"{m.page}, {m.head}")
def test_a_name_too_few_and_a_name_too_many_are_found(each):
    text = (ROOT / each.page).read_text(encoding="utf-8")
    name = each.there[0]
    (first, *_) = [n for n in first_cells(text, each.head) if n.rstrip("/") == name]
    planted = text.replace(f"`{first}", "`attic")
    where = f"{each.page}, table {each.head}"
    assert each.wrong(planted) == [f"{where}: attic is nowhere", f"{where}: {name} is missing"]


def test_a_page_without_the_table_is_missing_all():
    each = MAPS[0]
    assert len(each.wrong("")) == len(each.there)


def test_folders_of_tests_bear_the_names_of_rooms():
    package = {room.split("/")[0] for room in ROOMS["package"]["rooms"]} | {"people"}
    native = {room.split("/")[0] for room in ROOMS["native"]["rooms"]}
    others = {"logic", "packaging", "docs", "bench", "support"}
    assert set(folders(ROOT / "tests" / "python")) - package - native == others
    addon = {part for room in ROOMS["addon"]["rooms"] for part in room.split("/")[:2]}
    inside = set(folders(ROOT / "blender_tests"))
    assert inside - addon == {"support", "data", "extension"}
