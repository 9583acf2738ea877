# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that files of older versions play the same values bit for bit.

Bones and shape keys are compared in Live mode, in which these files were saved; Direct mode must
show the same vertices.
"""

import shutil

import bpy
import numpy as np
import pytest
from support import past

NEAR = 1e-5  # tolerance as a share of a mesh's size
# Files whose face Small_rig is never in Direct mode, because its joints have keyframes, it has a
# shape key for each channel, or it is a library override.
ORDINARY = ("baked_result", "baked_controls", "overridden_live", "overridden_keys")

MAKERS = sorted(p.name for p in past.DATA.iterdir() if p.is_dir())


@pytest.fixture(autouse=True)
def _same_on_every_processor():
    with past.scalar():
        yield


def folder_of(maker, tmp_path):
    """A copy of the folder with files that an older Blender saved.

    The test is skipped if the running Blender has a lower major version than `maker`.

    Args:
        maker: version of the Blender that saved the files, such as "4.2.23".
        tmp_path: folder for the copy.
    """
    made_by = tuple(int(n) for n in maker.split("."))
    if made_by[0] > bpy.app.version[0]:
        pytest.skip(
            f"EXTRA NOT RUN: files of Blender {maker}, which {bpy.app.version_string} cannot open"
        )
    return shutil.copytree(past.DATA / maker, tmp_path / maker)


def assert_same(found, wanted, where):
    """Check that a recording of past.film equals a stored recording bit for bit.

    Args:
        found: the recording.
        wanted: the stored recording, with flat arrays.
        where: "name/route/play", for the message of a failure.
    """
    assert found.keys() == wanted.keys(), where
    for name, values in wanted.items():
        flat = np.ascontiguousarray(found[name]).ravel()
        apart = float(np.abs(flat - values).max()) if flat.shape == values.shape else flat.shape
        assert flat.tobytes() == values.tobytes(), f"{where}/{name}: {apart} apart"


def assert_same_in_direct_mode(where):
    """Check that faces have the same vertices in Direct and in Live mode at all frames.

    Also check which faces are in Direct mode if the mode is Automatic. Afterwards all faces are in
    Live mode.

    Args:
        where: "name/route/play" of the open file.
    """
    name, route, _play = where.split("/")
    may_be = name not in ORDINARY and route not in ("link", "override")
    films = {}
    for mode in ("AUTO", "LIVE"):
        past.show(mode)
        films[mode] = past.film(read=past.vertices)
        direct = [rig.name for rig in past.direct_rigs()]
        assert direct == (["Small_rig"] if may_be and mode == "AUTO" else []), (where, mode)
    for name, wanted in films["LIVE"].items():
        apart = np.abs(films["AUTO"][name] - wanted).max() / np.ptp(wanted, axis=0).max()
        assert apart < NEAR, f"{where}/{name}: {apart} of the mesh's size apart in Direct mode"


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
        assert_same_in_direct_mode(key)
