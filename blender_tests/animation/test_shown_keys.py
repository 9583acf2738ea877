# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that keyframes of a face are visible in editors that show only selected items."""

import bpy
import pytest
from support import scene
from support.editors import seen_paths

JAW = 'pose.bones["face"]["CTRL_expressions.jawOpen"]'
PARTS = {"neck", "head", "eyes", "eye_L", "eye_R"}


@pytest.fixture
def rig(dna_file):
    return scene.load(dna_file)


def _selecting(bone):
    return bone if hasattr(bone, "select") else bone.bone


def _select(rig, *names):
    """Select the named bones of the control armature, and deselect its other bones."""
    for bone in scene.controls(rig).pose.bones:
        _selecting(bone).select = bone.name in names


def _selected(rig):
    return {b.name for b in scene.controls(rig).pose.bones if _selecting(b).select}


def _activate(item, *selected):
    for other in bpy.context.view_layer.objects:
        other.select_set(other in selected)
    bpy.context.view_layer.objects.active = item


def _other_armature():
    item = bpy.data.objects.new("body", bpy.data.armatures.new("body"))
    bpy.context.scene.collection.objects.link(item)
    return item


def test_a_key_is_seen_whatever_was_selected_before(rig):
    """The operator Key All makes its keys visible in editors that show only selected items.

    This holds if another bone, the head mesh, a body's armature or nothing was selected. Outside
    pose mode the keys of head and eyes become visible too, so that the user can move all keys of a
    frame together.
    """
    controls, head, body = scene.controls(rig), scene.meshes(rig)[0], _other_armature()
    bpy.ops.risorius.key()
    assert JAW in seen_paths()
    for bones, active, mode in (
        ((), controls, "OBJECT"),
        (("head",), controls, "POSE"),
        (("head",), head, "OBJECT"),
        ((), head, "SCULPT"),
        ((), body, "POSE"),
        ((), None, "OBJECT"),
    ):
        _activate(active, *filter(None, [active]))
        _select(rig, *bones)
        if active is not None:
            bpy.ops.object.mode_set(mode=mode)
        assert JAW not in seen_paths(), (bones, active, mode)
        assert bpy.ops.risorius.key() == {"FINISHED"}
        assert JAW in seen_paths(), (bones, active, mode)
        shown = {path.split('"')[1] for path in seen_paths()}
        posed = controls.mode == "POSE"
        assert shown == _selected(rig) == {*bones, "face", *(() if posed else PARTS)}
        assert bpy.context.view_layer.objects.active == (active or controls)
        assert active is None or (active.mode, active.select_get()) == (mode, True)
        for item in (controls, body):
            if item.mode != "OBJECT":
                _activate(item, item)
                bpy.ops.object.mode_set(mode="OBJECT")
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")


def test_a_key_of_blenders_own_is_seen_and_an_edit_of_keys_selects_nothing(rig):
    controls = scene.controls(rig)
    scene.update(controls)
    _select(rig, "head")
    _activate(scene.meshes(rig)[0], scene.meshes(rig)[0])
    controls.keyframe_insert(JAW, frame=3)
    bpy.context.view_layer.update()
    assert JAW in seen_paths()
    _select(rig, "head")
    curve = scene.curves(controls)[0]
    curve.keyframe_points[0].co.y = 0.4
    controls.animation_data.action.update_tag()
    bpy.context.view_layer.update()
    assert _selected(rig) == {"head"}


def test_keys_of_handles_are_seen_and_those_of_sliders_when_the_board_has_gone(rig):
    bpy.ops.risorius.key()
    scene.add_board()
    assert bpy.ops.risorius.lead(by="BOARD") == {"FINISHED"}
    _select(rig)
    bpy.ops.risorius.key()
    handles = {p.split('"')[1] for p in seen_paths() if p.endswith(".location")} - PARTS
    one = min(handles)
    _select(rig, one)
    bpy.ops.risorius.key()
    assert _selected(rig) == {one, "face", *PARTS}
    assert bpy.ops.risorius.remove_board() == {"FINISHED"}
    assert JAW in seen_paths()


def test_what_makes_actions_and_what_brings_faces_shows_their_keys(rig, tmp_path):
    table = tmp_path / "take.csv"
    table.write_text("time,CTRL_expressions.jawOpen\n0,0\n1,1\n")
    for way in (
        lambda: bpy.ops.risorius.import_animation(filepath=str(table)),
        lambda: bpy.ops.risorius.import_animation(filepath=str(table), target="LAYER"),
        bpy.ops.risorius.reset,
    ):
        _select(rig)
        _activate(scene.controls(rig), scene.controls(rig))
        assert way() == {"FINISHED"}
        assert JAW in seen_paths()
    scene.set_controls(rig, jawOpen=0.2)
    bpy.ops.risorius.key()
    _select(rig)
    path = tmp_path / "face.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    assert JAW in seen_paths()
