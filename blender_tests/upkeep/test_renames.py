# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that names are only labels: after any renaming, the face finds its parts."""

import bpy
import numpy as np
import pytest
from support import scene
from support.faces import small_face

JAW = "CTRL_expressions.jawOpen"
LONG = "漢" * 40  # 120 bytes: Blender keeps 63


def _is_right(rig, dna_file, **values):
    scene.set_controls(rig, **values)
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE
    bad, seen = scene.invalid_drivers()
    assert not bad
    assert seen


def _rename_everything(rig):
    controls = scene.controls(rig)
    held = [rig, rig.data, controls, controls.data, rig["risorius_dna"], *bpy.data.collections]
    for item in scene.meshes(rig).values():
        held += [item, item.data, item.data.shape_keys, *item.data.materials, *item.modifiers]
        held += list(item.data.shape_keys.key_blocks)
        held += list(item.data.uv_layers)
    held += list(rig.data.bones)
    for number, item in enumerate(held):
        item.name = f"{number} \"'\\ {LONG}"
    bpy.context.view_layer.update()


def _the_rig():
    return next(o for o in bpy.data.objects if "risorius_controls" in o)


def test_everything_may_have_another_name(mode, dna_file, tmp_path):
    rig = scene.load(dna_file, mode)
    for frame, value in ((1, 0.0), (10, 0.9)):
        scene.face(rig)[JAW] = value
        scene.face(rig).keyframe_insert(f'["{JAW}"]', frame=frame)
    scene.controls(rig).animation_data.action.name = "other"
    _rename_everything(rig)
    _is_right(rig, dna_file, mouthCornerPullL=0.7, browDownL=0.4)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "renamed.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "renamed.blend"))
    rig = _the_rig()
    bpy.context.scene.frame_set(10)
    raw = scene.raw_of(rig, dna_file)
    assert raw[0] == pytest.approx(0.9)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE
    for wanted in ("KEYS", "LIVE", "KEYS", "LIVE"):
        assert bpy.ops.risorius.set_shape_mode(mode=wanted) == {"FINISHED"}
        _is_right(rig, dna_file, mouthCornerPullR=0.6)


def test_the_live_key_is_found_after_a_rename_and_a_move(dna_file):
    rig = scene.load(dna_file, "LIVE")
    item = scene.meshes(rig)[0]
    item.shape_key_add(name="mine", from_mix=False).value = 0.0
    item.data.shape_keys.key_blocks["<channel sum>"].name = "what is this"
    item.active_shape_key_index = 2
    with bpy.context.temp_override(object=item, active_object=item):
        bpy.ops.object.shape_key_move(type="TOP")
    _is_right(rig, dna_file, jawOpen=0.7)


@pytest.mark.parametrize("name", ["face", "head", "eye_L"])
def test_control_bones_get_their_names_back(mode, dna_file, name):
    rig = scene.load(dna_file, mode)
    controls = scene.controls(rig)
    scene.face(rig)[JAW] = 0.8
    scene.face(rig).keyframe_insert(f'["{JAW}"]', frame=1)
    controls.data.bones[name].name = "something"
    bpy.context.view_layer.update()
    bpy.context.view_layer.update()
    assert name in controls.data.bones
    assert "something" not in controls.data.bones
    bpy.context.scene.frame_set(1)
    raw = scene.raw_of(rig, dna_file)
    assert raw[0] == pytest.approx(0.8)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE
    turned = scene.snapshot(rig)
    head = controls.pose.bones["head"]
    head.rotation_mode = "XYZ"
    head.rotation_euler.x = 0.4
    scene.update(controls)
    assert np.abs(scene.snapshot(rig) - turned).max() > 0.01


def test_a_bone_of_the_users_with_that_name_is_not_touched(dna_file):
    rig = scene.load(dna_file)
    bones = scene.controls(rig).data.bones
    bones["head"].name = "something"
    bones["neck"].name = "head"
    bpy.context.view_layer.update()
    bpy.context.view_layer.update()
    assert {b.get("risorius_part") for b in bones} == {
        "face", "head", "neck", "eyes", "eye_L", "eye_R"
    }  # fmt: skip
    _is_right(rig, dna_file, jawOpen=0.5)


def test_a_slider_that_was_renamed_is_made_anew(mode, dna_file):
    rig = scene.load(dna_file, mode)
    face = scene.face(rig)
    face["renamed"] = face[JAW]
    del face[JAW]
    scene.update(scene.controls(rig))
    scene.update(scene.controls(rig))
    assert face[JAW] == 0.0
    assert face.id_properties_ui(JAW).as_dict()["max"] == 1.0
    _is_right(rig, dna_file, jawOpen=0.6)


def test_characters_of_one_name_and_of_long_names(mode, tmp_path):
    name = "n" * 100
    paths = [tmp_path / f"{name}.dna", tmp_path / "sub" / f"{name}.dna"]
    paths[1].parent.mkdir()
    rigs = []
    for path in paths:
        small_face(name=name).save(str(path))
        rigs += [scene.load(path, mode), scene.load(path, mode)]
    for number, rig in enumerate(rigs):
        _is_right(rig, paths[0], jawOpen=0.2 * number + 0.1, browDownL=0.5)
    assert len({scene.controls(r).name for r in rigs}) == 4
    bpy.context.view_layer.objects.active = scene.controls(rigs[1])
    before = scene.snapshot(rigs[0])
    assert bpy.ops.risorius.reload() == {"FINISHED"}
    np.testing.assert_array_equal(scene.snapshot(rigs[0]), before)
