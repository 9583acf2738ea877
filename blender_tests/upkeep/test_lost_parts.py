# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests deleted parts: no exception, the panel names the part, undo restores it."""

import bpy
import numpy as np
import pytest
from support import scene
from support.layout import drawn


@pytest.fixture
def rig(dna_file, mode):
    """A posed character; an undo step with the posed character was pushed."""
    bpy.context.preferences.edit.use_global_undo = True
    made = scene.load(dna_file, mode)
    scene.set_controls(made, jawOpen=0.8, mouthCornerPullL=0.5)
    bpy.ops.ed.undo_push(message="whole")
    return made


def _said(active):
    bpy.context.view_layer.objects.active = active
    said = ""
    for name in ("panel.RISORIUS_PT_character", "controls_panel.RISORIUS_PT_controls"):
        module, _, cls = name.partition(".")
        panel = getattr(scene.submodule(f"ui.face.{module}"), cls)
        if not hasattr(panel, "poll") or panel.poll(bpy.context):
            said += drawn(panel).text()
    return said


def _use(active):
    """Show two frames, and call each operator of ui.face.operators that is available.

    Args:
        active: the object that is made active.
    """
    bpy.context.view_layer.update()
    for frame in (2, 3):
        bpy.context.scene.frame_set(frame)
    bpy.context.view_layer.objects.active = active
    operators = scene.submodule("ui.face.operators").CLASSES
    for cls in operators:
        group, name = cls.bl_idname.split(".")
        operator = getattr(getattr(bpy.ops, group), name)
        if operator.poll():
            operator()
    bpy.context.scene.frame_set(1)


def _rig():
    return next(o for o in bpy.data.objects if o.get("risorius_controls"))


def _right(dna_file):
    rig = _rig()
    scene.set_controls(rig, jawOpen=0.4)
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE
    assert not scene.invalid_drivers()[0]


def test_without_its_controls(rig, dna_file):
    bpy.data.objects.remove(scene.controls(rig))
    _use(rig)
    mesh = next(o for o in bpy.data.objects if "dna_mesh" in o)
    assert "control armature was deleted" in _said(mesh)
    bpy.ops.ed.undo_push(message="ruin")
    bpy.ops.ed.undo()
    _right(dna_file)


def test_without_its_rig(rig, dna_file):
    controls = scene.controls(rig)
    bpy.data.objects.remove(rig)
    _use(controls)
    assert "deforming armature of this face was deleted" in _said(controls)
    bpy.ops.ed.undo_push(message="ruin")
    bpy.ops.ed.undo()
    _right(dna_file)


def test_without_a_mesh(rig, dna_file):
    controls = scene.controls(rig)
    bpy.data.objects.remove(scene.meshes(rig)[1])
    _use(controls)
    assert "1 of the meshes were deleted" in _said(controls)
    bpy.ops.ed.undo_push(message="ruin")
    bpy.ops.ed.undo()
    _right(dna_file)


def test_without_its_text(rig, dna_file):
    controls = scene.controls(rig)
    before = scene.snapshot(rig)
    bpy.data.texts.remove(rig["risorius_dna"])
    _use(controls)
    assert "text that holds the DNA was deleted" in _said(controls)
    np.testing.assert_array_equal(scene.snapshot(rig), before)
    bpy.ops.ed.undo_push(message="ruin")
    bpy.ops.ed.undo()
    _right(dna_file)


def test_without_its_live_key(dna_file):
    rig = scene.load(dna_file, "LIVE")
    item = scene.meshes(rig)[0]
    item.shape_key_remove(item.data.shape_keys.key_blocks["<channel sum>"])
    assert "has lost its key" in _said(scene.controls(rig))
    assert bpy.ops.risorius.set_shape_mode(mode="LIVE") == {"FINISHED"}
    assert "has lost its key" not in _said(scene.controls(rig))
    _right(dna_file)


def _delete(objects):
    with bpy.context.temp_override(selected_objects=objects, active_object=objects[0]):
        bpy.ops.object.delete()
    bpy.context.view_layer.update()


def test_deleted_parts_are_brought_back(rig, dna_file):
    """A deleted part that is still in the .blend file is brought back to the scene.

    Blender's Delete removes a part from the scene, but not from the file, because other parts of
    the face still refer to it.
    """
    _delete([scene.controls(rig)])
    _use(rig)
    assert "still in the file" in _said(rig)
    assert bpy.ops.risorius.bring_back() == {"FINISHED"}
    assert scene.controls(rig).name in bpy.context.scene.objects
    _right(dna_file)


def test_a_deleted_character_leaves_the_file(rig, dna_file, tmp_path):
    other = scene.load(dna_file)
    name = other.name
    _delete([rig, scene.controls(rig), *scene.meshes(rig).values()])
    assert rig.name in bpy.data.objects
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "one.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "one.blend"))
    assert [o.name for o in bpy.data.objects if "risorius_controls" in o] == [name]
    assert len(bpy.data.texts) == 1
    _right(dna_file)


def test_a_deleted_character_that_others_use_stays(rig, tmp_path):
    empty = bpy.data.objects.new("hand", None)
    bpy.context.scene.collection.objects.link(empty)
    empty.constraints.new("COPY_LOCATION").target = rig
    _delete([rig, scene.controls(rig), *scene.meshes(rig).values()])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "held.blend"))
    assert "risorius_controls" in rig


def test_one_of_two_is_deleted(rig, dna_file):
    other = scene.load(dna_file)
    scene.set_controls(other, jawOpen=0.3)
    before = scene.snapshot(other)
    bpy.data.batch_remove([rig, scene.controls(rig), *scene.meshes(rig).values()])
    bpy.context.view_layer.update()
    np.testing.assert_array_equal(scene.snapshot(other), before)
    _right(dna_file)


def test_a_deleted_character_with_a_material_without_nodes_leaves_the_file(rig, tmp_path):
    plain = bpy.data.materials.new("plain")
    plain.use_nodes = False
    scene.meshes(rig)[0].data.materials.append(plain)
    scene.meshes(rig)[0].data.materials.append(None)
    _delete([rig, scene.controls(rig), *scene.meshes(rig).values()])
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "gone.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "gone.blend"))
    assert not [o for o in bpy.data.objects if "risorius_controls" in o]
    assert not bpy.data.meshes


def test_a_copy_of_the_controls_alone_says_that_it_moves_nothing(rig, dna_file):
    controls = scene.controls(rig)
    copy = controls.copy()
    bpy.context.scene.collection.objects.link(copy)
    bpy.context.view_layer.update()
    assert f"{copy.name} is a copy of the controls alone" in " ".join(_said(copy).split())
    assert "copy of the controls" not in " ".join(_said(controls).split())


def _writer(rig):
    return scene.submodule("scene.base.last_written").bone_writers[rig.session_uid]


def test_a_step_of_a_slider_is_no_edit_of_the_bones(rig, dna_file):
    """The data of bones that the add-on has cached stay in use if a slider is moved.

    A slider of the sidebar tags the whole armature as changed, as an edit of bones does.
    """
    controls = scene.controls(rig)
    bpy.context.view_layer.update()
    scene.set_controls(rig, jawOpen=0.1)
    kept = _writer(rig)
    for value in (0.2, 0.3):
        controls.pose.bones["face"]["jawOpen"] = value
        controls.update_tag()  # of everything, as a slider of the sidebar does
        bpy.context.view_layer.update()
        assert (
            scene.error_against_oracle(rig, dna_file, scene.raw_of(rig, dna_file)) < scene.TOLERANCE
        )
    assert _writer(rig) is kept


def test_an_edit_of_the_bones_is_one(rig):
    scene.set_controls(rig, jawOpen=0.1)
    kept = _writer(rig)
    bpy.context.view_layer.objects.active = rig
    rig.hide_set(False)
    bpy.ops.object.mode_set(mode="EDIT")
    rig.data.edit_bones[-1].roll += 0.5
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.update()
    scene.set_controls(rig, jawOpen=0.2)
    assert _writer(rig) is not kept
    kept = _writer(rig)
    scene.controls(rig).data.bones["face"].name = "head of it"
    bpy.context.view_layer.update()
    bpy.context.view_layer.update()
    assert "face" in scene.controls(rig).data.bones
    scene.set_controls(rig, jawOpen=0.3)
    assert _writer(rig) is not kept
