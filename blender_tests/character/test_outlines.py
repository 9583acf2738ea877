# SPDX-License-Identifier: GPL-3.0-or-later
"""Outlines of the control bones are beside the face and are no objects of a scene.

Hiding the outlines does not hide the bones' keyframes in the editors.
"""

import shutil

import bpy
import numpy as np
import pytest
from mathutils import Matrix
from support import past, scene


@pytest.fixture
def rig(dna_file):
    return scene.load(dna_file)


def outline(controls, name):
    """Corners of a bone's outline as Blender draws it, float64[V, 3], in world space."""
    bone = controls.pose.bones[name]
    size = [scale * bone.bone.length for scale in bone.custom_shape_scale_xyz]
    own = Matrix.LocRotScale(bone.custom_shape_translation, bone.custom_shape_rotation_euler, size)
    place = controls.matrix_world @ bone.matrix @ own
    return np.array([place @ vertex.co for vertex in bone.custom_shape.data.vertices])


def shapes(controls):
    return [bone.custom_shape for bone in controls.pose.bones]


def test_from_the_front_no_outline_lies_over_the_eyes_and_all_lie_near_the_head(rig):
    controls = scene.controls(rig)
    left, right = (np.array(controls.data.bones[f"eye_{s}"].head_local) for s in "LR")
    apart = abs(left[0] - right[0])
    target = outline(controls, "eyes")
    assert np.ptp(target[:, 0]) < apart  # between the eyes, straight ahead
    skin = np.concatenate([scene.evaluated(item) for item in scene.meshes(rig).values()])
    low, high = skin.min(axis=0), skin.max(axis=0)
    room = 0.75 * (high - low).max()
    for name in ("head", "neck", "eye_L", "eye_R", "face"):
        drawn = outline(controls, name)
        for eye in (left, right):
            over = np.all(drawn[:, ::2].min(axis=0) < eye[::2]) and np.all(
                drawn[:, ::2].max(axis=0) > eye[::2]
            )
            assert not over, name
        assert np.all(np.abs(drawn - (low + high) / 2) < room + np.ptp(drawn, axis=0)), name
    collar, neck = outline(controls, "neck"), controls.data.bones["neck"].head_local
    assert collar[:, 1].max() < neck.y + 1e-4  # behind it, so that it avoids the mouth
    assert np.ptp(collar[:, 1]) > 0.3 * np.ptp(collar[:, 0])
    sides = [outline(controls, f"eye_{side}")[:, 0].mean() for side in "LR"]
    assert (sides[0] - sides[1]) * (left[0] - right[0]) > 0  # each on the side of its eye


def test_outlines_of_an_older_file_move_beside_the_face(dna_file, tmp_path):
    """Outlines that an older version placed over the eyes stay there until an operator is called.

    The operator moves them beside the face; a second call finds nothing to move.
    """
    made = "4.2.23"
    folder = shutil.copytree(past.DATA / made, tmp_path / made)
    bpy.ops.wm.open_mainfile(filepath=str(folder / "bones.blend"))
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    controls = scene.controls(rig)
    controls.data.pose_position = "REST"
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = controls

    def over():
        eyes = [np.array(controls.data.bones[f"eye_{s}"].head_local) for s in "LR"]
        drawn = [outline(controls, name)[:, ::2] for name in ("head", "eye_L", "eye_R")]
        return [
            bool(np.all(d.min(axis=0) < e[::2]) and np.all(d.max(axis=0) > e[::2]))
            for d in drawn
            for e in eyes
        ]

    assert any(over())
    assert bpy.ops.risorius.move_outlines() == {"FINISHED"}
    bpy.context.view_layer.update()
    assert not any(over())
    assert bpy.ops.risorius.move_outlines() == {"CANCELLED"}


def test_appended_outlines_are_not_left_in_the_scene(rig, tmp_path):
    name, path = scene.controls(rig).name, tmp_path / "face.blend"
    scene.add_board()
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.wm.append(directory=f"{path}/Object", filename=rig_name(path))
    bpy.context.view_layer.update()
    controls = bpy.data.objects[name]
    assert controls.users_scene
    assert len(shapes(controls)) > 6
    assert not [shape.name for shape in shapes(controls) if shape.users_collection]
    own = controls.pose.bones["head"].custom_shape  # the user wants to draw another outline
    bpy.context.scene.collection.objects.link(own)
    bpy.context.view_layer.update()
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("new", None))
    bpy.context.view_layer.update()
    assert own.users_collection


def rig_name(path):
    with bpy.data.libraries.load(str(path)) as (held, _):
        return next(name for name in held.objects if name.endswith("_rig"))


def test_a_copy_that_is_deleted_leaves_the_outlines_to_the_face(rig, tmp_path):
    """A duplicate of a face shares the outlines; deleting the duplicate does not remove them.

    After the face itself was deleted, saving the file removes the outlines.
    """
    held = [b.custom_shape for b in scene.controls(rig).pose.bones]
    for item in bpy.context.view_layer.objects:
        item.select_set(True)
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    bpy.ops.object.delete()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "face.blend"))
    assert len([o for o in bpy.data.objects if "risorius_controls" in o]) == 1
    assert [b.custom_shape for b in scene.controls(rig).pose.bones] == held
    for item in bpy.context.view_layer.objects:
        item.select_set(True)
    bpy.ops.object.delete()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "none.blend"))
    assert not [o for o in bpy.data.objects if "_shape_" in o.name]


def test_hidden_outlines_leave_bones_and_sizes_as_they_were(rig):
    controls = scene.controls(rig)
    controls.pose.bones["neck"].custom_shape_scale_xyz = (3.0, 2.0, 1.0)
    before = {bone.name: bone.custom_shape_scale_xyz[:] for bone in controls.pose.bones}
    assert bpy.ops.risorius.hide_outlines() == {"FINISHED"}
    bpy.ops.risorius.hide_outlines()  # called twice: the stored state is not lost
    for bone in controls.pose.bones:
        assert not bone.bone.hide
        assert np.ptp(outline(controls, bone.name), axis=0).max() < 1e-6
    bpy.ops.risorius.hide_outlines(hide=False)
    assert {b.name: b.custom_shape_scale_xyz[:] for b in controls.pose.bones} == before
    bpy.ops.risorius.hide_outlines()
    controls.pose.bones["neck"].custom_shape_scale_xyz = (5.0, 5.0, 5.0)
    bpy.ops.risorius.hide_outlines(hide=False)
    assert controls.pose.bones["neck"].custom_shape_scale_xyz[:] == (5.0, 5.0, 5.0)


def test_the_key_of_frame_selected_shows_the_face_where_only_outlines_are_selected(rig):
    controls, item = scene.controls(rig), bpy.data.objects.new("lamp", None)
    bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.update()

    def pressed(*selected):
        for thing in bpy.context.view_layer.objects:
            thing.select_set(thing in selected)
        bpy.context.view_layer.objects.active = selected[0]
        return bpy.ops.risorius.frame_face(instead=True)

    assert pressed(controls) == {"FINISHED"}
    assert pressed(controls, item) == {"PASS_THROUGH"}  # Blender's own action
    assert pressed(controls, rig) == {"FINISHED"}
    bpy.ops.object.mode_set(mode="POSE")
    bpy.ops.pose.select_all(action="SELECT")
    assert bpy.ops.risorius.frame_face(instead=True) == {"FINISHED"}
    bpy.ops.pose.select_all(action="DESELECT")
    assert bpy.ops.risorius.frame_face(instead=True) == {"PASS_THROUGH"}
