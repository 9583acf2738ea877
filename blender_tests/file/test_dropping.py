# SPDX-License-Identifier: GPL-3.0-or-later
"""Files that are dropped onto the window, or chosen together in the file browser."""

from types import SimpleNamespace

import bpy
import pytest
from support import scene
from support.faces import small_face


def _handler():
    return next(h for h in bpy.types.FileHandler.__subclasses__() if "dna" in h.bl_idname.lower())


def _drop(*paths):
    """Call the import operator as Blender does when files are dropped onto a window."""
    operator = getattr(bpy.ops.risorius, _handler().bl_import_operator.split(".")[1])
    known = operator.get_rna_type().properties.keys()
    given = {
        "filepath": str(paths[0]),
        "directory": str(paths[0].parent),
        "files": [{"name": path.name} for path in paths],
    }
    return operator("INVOKE_DEFAULT", **{k: v for k, v in given.items() if k in known})


@pytest.fixture
def two_files(tmp_path):
    for name in ("One", "Two"):
        small_face(name=name).save(str(tmp_path / f"{name}.dna"))
    return tmp_path / "One.dna", tmp_path / "Two.dna"


def test_the_handler_is_for_dna_files_over_views_that_show_objects():
    handler = _handler()
    assert handler.bl_file_extensions == ".dna"
    for kind, wanted in (("VIEW_3D", True), ("OUTLINER", True), ("TEXT_EDITOR", False)):
        assert handler.poll_drop(SimpleNamespace(area=SimpleNamespace(type=kind))) is wanted
    assert not handler.poll_drop(SimpleNamespace(area=None))


def test_one_file(two_files):
    assert _drop(two_files[0]) == {"FINISHED"}
    assert [r.name for r in scene.submodule("scene.base.parts").rigs()] == ["One_rig"]


def test_several_files_at_once(two_files):
    assert _drop(*two_files) == {"FINISHED"}
    assert {r.name for r in scene.submodule("scene.base.parts").rigs()} == {"One_rig", "Two_rig"}


def test_a_bad_file_among_good_ones_is_named_and_the_others_come_in(two_files):
    bad = two_files[0].with_name("bad.dna")
    bad.write_bytes(b"nothing of the kind")
    with pytest.raises(RuntimeError, match="bad.dna"):
        _drop(two_files[0], bad, two_files[1])
    assert {r.name for r in scene.submodule("scene.base.parts").rigs()} == {"One_rig", "Two_rig"}


def test_the_next_import_by_path_does_not_remember_the_drop(two_files):
    _drop(two_files[0])
    scene.load(two_files[1])
    assert {r.name for r in scene.submodule("scene.base.parts").rigs()} == {"One_rig", "Two_rig"}
