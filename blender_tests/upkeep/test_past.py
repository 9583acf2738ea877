# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that an older Risorius saved play what they played there, bit for bit."""

import shutil

import bpy
import numpy as np
import pytest
from support import past

MAKERS = sorted(p.name for p in past.DATA.iterdir() if p.is_dir())


@pytest.fixture(autouse=True)
def _same_on_every_processor():
    with past.scalar():
        yield


def folder_of(maker, tmp_path):
    """A copy of the files that a Blender saved; not run where this Blender cannot open them."""
    made_by = tuple(int(n) for n in maker.split("."))
    if made_by[0] > bpy.app.version[0]:
        pytest.skip(
            f"EXTRA NOT RUN: files of Blender {maker}, which {bpy.app.version_string} cannot open"
        )
    return shutil.copytree(past.DATA / maker, tmp_path / maker)


def assert_same(found, wanted, where):
    """Compare two films bit for bit."""
    assert found.keys() == wanted.keys(), where
    for name, values in wanted.items():
        flat = np.ascontiguousarray(found[name]).ravel()
        apart = float(np.abs(flat - values).max()) if flat.shape == values.shape else flat.shape
        assert flat.tobytes() == values.tobytes(), f"{where}/{name}: {apart} apart"


def test_there_are_files():
    assert MAKERS == ["4.2.23", "5.0.1"]
    for maker in MAKERS:
        there = {p.stem for p in (past.DATA / maker).glob("*.blend")}
        assert {n for n in there if not n.startswith("library")} == set(past.PLAYS)
        assert max(p.stat().st_size for p in (past.DATA / maker).iterdir()) < 1 << 20


@pytest.mark.parametrize("name", past.PLAYS)
@pytest.mark.parametrize("maker", MAKERS)
def test_it_plays_as_it_did(maker, name, tmp_path):
    folder = folder_of(maker, tmp_path)
    wanted = past.recorded(folder)
    moving = wanted[f"{name}/open/{past.AS_SAVED}"]
    first, last = (moving[f"Small_rig/{frame}/bones"] for frame in (1, 31))
    assert np.abs(first - last).max() > 0.01
    for key, found in past.films(folder, name, tmp_path):
        assert_same(found, wanted[key], key)
