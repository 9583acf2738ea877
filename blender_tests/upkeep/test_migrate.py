# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that characters of older add-on versions are updated, and newer ones left unchanged."""

import bpy
import numpy as np
import pytest
from support import past, scene
from support.layout import Recorder

FOLDER = past.DATA / "4.2.23"
LAYERS = FOLDER / "layers.blend"
VERSION = "risorius_version"
PRESENT = 4


def _said():
    layout = Recorder()
    scene.submodule("ui.upkeep.panel").draw_trouble(layout, bpy.context)
    return layout.text()


def _lines(capsys):
    return [x for x in capsys.readouterr().out.splitlines() if x.startswith("Risorius: Small")]


def test_a_new_character_is_of_the_present_form_and_says_what_it_needs(dna_file, capsys):
    controls = scene.controls(scene.load(dna_file))
    assert controls[VERSION] == scene.submodule("scene.base.form").PRESENT == PRESENT
    assert "add-on" in controls["Needs Risorius"]
    bpy.context.view_layer.update()
    assert _lines(capsys) == []


@pytest.mark.parametrize("how", ["open", "append"])
def test_an_old_character_is_brought_up_once_and_it_is_said(capsys, tmp_path, how):
    past.ROUTES[how](LAYERS, tmp_path)
    controls = past.controls()[0]
    assert controls[VERSION] == PRESENT
    assert "add-on" in controls["Needs Risorius"]
    (line,) = _lines(capsys)
    assert "older file" in line
    assert "need Risorius" in line
    scene.update(controls)
    past.open_it(LAYERS, tmp_path)
    past.save_and_open(LAYERS, tmp_path)
    bpy.ops.wm.open_mainfile(filepath=bpy.data.filepath)  # what was just saved
    assert len(_lines(capsys)) == 1  # of opening LAYERS


def test_undo_brings_back_an_old_character_and_it_is_brought_up_again(capsys):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.wm.open_mainfile(filepath=str(LAYERS))
    del past.controls()[0][VERSION]
    bpy.ops.ed.undo_push(message="old")
    past.controls()[0].location.x = 1.0
    bpy.ops.ed.undo_push(message="changed")
    capsys.readouterr()
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    assert past.controls()[0][VERSION] == PRESENT
    assert len(_lines(capsys)) == 1


def test_a_linked_character_is_not_written_and_its_override_is(capsys, tmp_path):
    past.link(LAYERS, tmp_path)
    assert VERSION not in past.controls()[0]
    assert _lines(capsys) == []
    bpy.context.view_layer.objects.active = past.controls()[0]
    assert bpy.ops.risorius.make_override() == {"FINISHED"}
    bpy.context.view_layer.update()
    own = next(c for c in past.controls() if not c.library)
    assert own[VERSION] == PRESENT
    assert _lines(capsys) == []  # nothing of it had to be changed
    shot = tmp_path / "shot.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(shot))
    capsys.readouterr()
    bpy.ops.wm.open_mainfile(filepath=str(shot))
    assert next(c for c in past.controls() if not c.library)[VERSION] == PRESENT
    assert _lines(capsys) == []


@pytest.mark.parametrize("how", ["open", "append", "link"])
def test_a_newer_character_plays_and_is_left_as_it_is(capsys, tmp_path, how):
    bpy.ops.wm.open_mainfile(filepath=str(LAYERS))
    past.show("LIVE")
    wanted = past.film((1.0, 9.0, 20.0))
    controls = past.controls()[0]
    controls[VERSION], controls["of_the_future"] = 7, "kept"
    bpy.context.scene.frame_set(9)
    path = tmp_path / "newer.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    capsys.readouterr()
    past.ROUTES[how](path, tmp_path)
    controls = past.controls()[0]
    assert (controls[VERSION], controls["of_the_future"]) == (7, "kept")
    found = past.film((1.0, 9.0, 20.0))
    for name, values in wanted.items():
        if how != "link":  # stands as it was saved
            np.testing.assert_array_equal(found[name], values)
    (line,) = _lines(capsys)
    assert "newer Risorius" in line
    bpy.context.view_layer.objects.active = controls
    assert f"form 7, this one knows {PRESENT}" in " ".join(_said().split())


@pytest.mark.parametrize("rubbish", ["words", -3, 2.5, [1, 2]])
def test_a_form_that_is_no_number_counts_as_none(rubbish):
    bpy.ops.wm.open_mainfile(filepath=str(LAYERS))
    del past.controls()[0][VERSION]
    past.controls()[0][VERSION] = rubbish
    assert scene.submodule("scene.base.form").version_of(past.controls()[0]) == 0
    scene.submodule("scene.upkeep.migrations").bring_up_all()
    assert past.controls()[0][VERSION] == PRESENT


def test_an_old_bake_whose_tracks_are_gone_is_brought_up(capsys):
    """A bake of an older version, which stores its muted tracks by index, is updated.

    If the NLA tracks do not exist any more, the list of tracks becomes empty.
    """
    with bpy.data.libraries.load(str(FOLDER / "baked_controls.blend")) as (there, into):
        into.objects = [name for name in there.objects if name.endswith("_controls")]
    controls = into.objects[0]
    assert not controls["risorius_before"]["tracks"][0].startswith("[")  # stored by their index
    controls.animation_data_clear()
    note = scene.submodule("scene.animation.actions").note_tracks_by_name
    assert note(controls) is False
    assert list(controls["risorius_before"]["tracks"]) == []
    assert note(controls) is False


def test_what_an_old_bake_silenced_is_known_by_name(capsys):
    bpy.ops.wm.open_mainfile(filepath=str(FOLDER / "baked_controls.blend"))
    (line,) = _lines(capsys)
    assert "NLA tracks that its bake silenced are known by name" in line
    controls = past.controls()[0]
    tracks = controls.animation_data.nla_tracks
    assert [t.name for t in tracks[:3]] == ["Low", "High", "Silent"]
    tracks.new(prev=tracks[0]).name = "New"
    tracks.remove(tracks["High"])
    tracks[-1].name = "Renamed"
    bpy.context.view_layer.objects.active = controls
    assert bpy.ops.risorius.unbake() == {"FINISHED"}
    flags = [(t.name, t.mute, t.is_solo) for t in tracks]
    assert flags == [("Low", False, True), ("New", False, False), ("Silent", True, False)]
