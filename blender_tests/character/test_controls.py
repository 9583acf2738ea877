# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of a face's sliders and control bones: names, keys and effects."""

import math

import bpy
import numpy as np
import pytest
import risorius
from support import oracle, scene
from support.faces import CONTROLS, EYE, HEAD, JOINTS, UNOWNED, small_face


def test_controls_are_floats_with_limits(dna_file):
    bone = scene.face(scene.load(dna_file))
    for name in CONTROLS[:8]:
        assert isinstance(bone[name], float)
        words = bone.id_properties_ui(name).as_dict()
        assert (words["min"], words["max"], words["default"]) == (0.0, 1.0, 0.0)
        assert words["description"]


def test_control_bones_are_told_apart_by_outline_and_colour(dna_file):
    bones = scene.controls(scene.load(dna_file)).pose.bones
    outlines, colours = {}, set()
    for bone in bones:
        line = bone.custom_shape.data
        # The outline is a closed line, so each of its corners is in two edges.
        ends = [v for edge in line.edges for v in edge.vertices]
        assert sorted(ends) == sorted([*range(len(line.vertices))] * 2)
        far = max(vertex.co.length for vertex in line.vertices)
        assert 0.9 < far < 1.4
        outlines[bone.name] = tuple(round(c, 4) for v in line.vertices for c in v.co)
        assert bone.color.palette == "CUSTOM"
        colours.add(tuple(round(c, 3) for c in bone.color.custom.normal))
    assert len(colours) == len(bones) == 6
    assert outlines.pop("eye_R") == outlines["eye_L"]  # the same shape in another colour
    assert len(set(outlines.values())) == 5


def test_long_and_repeated_names_are_cut_and_numbered(dna_file):
    rig = scene.load(dna_file, "KEYS")
    labels = [k for k in scene.face(rig).keys() if k not in CONTROLS[:8]]  # noqa: SIM118
    assert labels == [("CTRL_expressions." + "x" * 90)[:63], "twice", "twice.001"]
    assert [b.name for b in rig.data.bones if b["dna_joint"] >= 5] == [
        "user_joint",
        "user_joint.001",
    ]
    assert sorted(b["dna_joint"] for b in rig.data.bones) == list(range(len(JOINTS)))
    keys = [k.name for k in scene.meshes(rig)[0].data.shape_keys.key_blocks]
    assert keys == ["Basis", "jaw", "pull_l", "pull_r", "y" * 63, "same", "same.001"]


def test_a_control_with_a_cut_name_works(mode, dna_file):
    rig = scene.load(dna_file, mode)
    bone = scene.face(rig)
    bone[("CTRL_expressions." + "x" * 90)[:63]] = 0.9
    bone["twice.001"] = 0.4
    bone["twice"] = 0.7
    scene.update(scene.controls(rig))
    raw = np.zeros(11, np.float32)
    raw[8], raw[9], raw[10] = 0.9, 0.7, 0.4
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_renamed_parts_still_find_each_other(mode, dna_file):
    rig = scene.load(dna_file, mode)
    rig.name, scene.controls(rig).name = "a", "b"
    scene.meshes(rig)[0].name = "c"
    scene.set_controls(rig, jawOpen=0.6)
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_an_integer_becomes_a_float_again(dna_file):
    rig = scene.load(dna_file)
    name = "CTRL_expressions.jawOpen"
    scene.face(rig)[name] = 1
    scene.update(scene.controls(rig))
    assert isinstance(scene.face(rig)[name], float)
    assert scene.face(rig).id_properties_ui(name).as_dict()["max"] == 1.0
    assert rig["maps"][0] == pytest.approx(1.0)


def test_head_bone_turns_the_head_joint_on_top(mode, dna_file):
    rig = scene.load(dna_file, mode)
    bone = scene.controls(rig).pose.bones["head"]
    bone.rotation_mode = "XYZ"
    bone.rotation_euler = (0.0, 0.5, 0.0)  # about the upright axis
    scene.update(scene.controls(rig))
    seen = scene.snapshot(rig)
    scene.pose_bones(rig)
    np.testing.assert_allclose(scene.snapshot(rig), seen, atol=1e-5)
    head = next(b for b in rig.pose.bones if b.bone["dna_joint"] == HEAD)
    turn = head.matrix.to_3x3() @ head.bone.matrix_local.to_3x3().inverted()
    axis, angle = turn.to_quaternion().to_axis_angle()
    assert angle == pytest.approx(0.5, abs=1e-5)
    assert abs(axis.z) == pytest.approx(1.0, abs=1e-5)
    assert np.allclose(head.matrix.translation, head.bone.matrix_local.translation, atol=1e-5)


@pytest.mark.parametrize("degrees", [5.0, 12.0, 20.0])
def test_eye_bone_turns_the_eye_by_its_own_angle(dna_file, degrees):
    # The look control's value is the wanted yaw divided by the yaw that was measured at value 1,
    # because the eye's neutral pose is oblique.
    rig = scene.load(dna_file)
    runtime = scene.submodule("scene.character.runtime").of(rig)
    bone = scene.controls(rig).pose.bones["eye_L"]
    bone.rotation_mode = "XYZ"
    _control, yaw_at_one, _pitch = next(c for c in runtime.look["L"] if c[1] > 0)
    yaw = math.radians(degrees)
    rest = bone.bone.matrix_local.to_3x3()
    from mathutils import Matrix

    turn = rest.inverted() @ Matrix.Rotation(yaw, 3, "Z") @ rest
    bone.rotation_euler = turn.to_euler()
    scene.update(scene.controls(rig))
    raw = np.zeros(11, np.float32)
    raw[4] = min(yaw / yaw_at_one, 1.0)
    assert raw[4] > 0.05
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_eye_target_moves_the_look_controls(dna_file):
    rig = scene.load(dna_file)
    target = scene.controls(rig).pose.bones["eyes"]
    target.location = (0.1, 0.0, 0.0)
    scene.update(scene.controls(rig))
    seen = scene.snapshot(rig)
    scene.pose_bones(rig)
    np.testing.assert_allclose(scene.snapshot(rig), seen, atol=1e-5)
    eye = next(b for b in rig.pose.bones if b.bone["dna_joint"] == EYE)
    assert abs(eye.rotation_quaternion.w) < 0.9999


def test_key_all_uses_groups_by_region(dna_file):
    rig = scene.load(dna_file)
    assert bpy.ops.risorius.key() == {"FINISHED"}
    action = scene.controls(rig).animation_data.action
    curves = getattr(action, "fcurves", None) or action.layers[0].strips[0].channelbags[0].fcurves
    groups = {c.data_path.split('"')[-2]: c.group.name for c in curves}
    assert groups["CTRL_expressions.jawOpen"] == "Jaw"
    assert groups["CTRL_expressions.browDownL"] == "Brows"
    assert sum(c.data_path.startswith('pose.bones["face"]') for c in curves) == len(CONTROLS)


def test_key_region_keys_only_the_region(dna_file):
    rig = scene.load(dna_file)
    assert bpy.ops.risorius.key(region="eye") == {"FINISHED"}
    action = scene.controls(rig).animation_data.action
    curves = getattr(action, "fcurves", None) or action.layers[0].strips[0].channelbags[0].fcurves
    assert {c.group.name for c in curves} == {"Eyes"}
    assert len(curves) == 4


def test_reset_brings_the_neutral_back(mode, dna_file):
    rig = scene.load(dna_file, mode)
    neutral = scene.snapshot(rig)
    scene.set_controls(rig, jawOpen=1.0, browDownL=1.0)
    scene.controls(rig).pose.bones["head"].rotation_quaternion = (0.9, 0.2, 0, 0)
    scene.update(scene.controls(rig))
    assert np.abs(scene.snapshot(rig) - neutral).max() > 1e-3
    assert bpy.ops.risorius.reset() == {"FINISHED"}
    np.testing.assert_allclose(scene.snapshot(rig), neutral, atol=1e-6)


def test_overdrive_raises_the_hard_maximum(mode, dna_file):
    rig = scene.load(dna_file, mode)
    assert bpy.ops.risorius.set_overdrive(enable=True) == {"FINISHED"}
    bone = scene.face(rig)
    name = "CTRL_expressions.mouthCornerPullL"
    assert bone.id_properties_ui(name).as_dict()["max"] == 1.5
    scene.set_controls(rig, mouthCornerPullL=1.4)
    raw = scene.raw_of(rig, dna_file)
    assert raw[1] == pytest.approx(1.4)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE
    assert bpy.ops.risorius.set_overdrive(enable=False) == {"FINISHED"}
    assert bone[name] == 1.0


def test_users_own_shape_key_stays_on_top(dna_file):
    rig = scene.load(dna_file, "LIVE")
    head = scene.meshes(rig)[0]
    key = head.shape_key_add(name="mine", from_mix=False)
    key.points[3].co.z += 0.05
    key.value = 1.0
    scene.set_controls(rig, jawOpen=0.0, mouthCornerPullL=0.3)
    dna = risorius.load(str(dna_file))
    pose = risorius.Rig(dna).evaluate(scene.raw_of(rig, dna_file))
    moved = scene.evaluated(head) - oracle.vertices(dna, 0, pose)
    assert np.linalg.norm(moved[3]) > 0.04
    assert np.abs(np.delete(moved, 3, axis=0)).max() < 1e-5


TURN = ["turn.x", "turn.y", "turn.z", "turn.w"]


@pytest.fixture
def turning(tmp_path):
    """A face with four raw controls that are the components of the quaternion of a joint."""
    dna = small_face()
    dna.raw_control_names = [*CONTROLS[:7], *TURN]
    dna.twist_swing_behavior.twists = [
        risorius.TwistSwingSetup(
            input_control_indices=[7, 8, 9, 10], output_joint_indices=[UNOWNED], blend_weights=[1.0]
        )
    ]
    dna.save(str(tmp_path / "turn.dna"))
    return scene.load(tmp_path / "turn.dna")


def test_a_rotation_rests_at_no_turn_and_reset_returns_to_it(turning):
    rig = turning
    bone = scene.face(rig)
    assert [bone[name] for name in TURN] == [0.0, 0.0, 0.0, 1.0]
    for name, default in zip(TURN, (0.0, 0.0, 0.0, 1.0), strict=True):
        words = bone.id_properties_ui(name).as_dict()
        assert (words["min"], words["max"], words["default"]) == (-1.0, 1.0, default)
    bone["turn.x"], bone["turn.w"], bone[CONTROLS[0]] = -0.6, 0.8, 0.5
    bpy.context.view_layer.objects.active = rig
    assert bpy.ops.risorius.reset() == {"FINISHED"}
    assert [bone[name] for name in TURN] == [0.0, 0.0, 0.0, 1.0]
    assert bone[CONTROLS[0]] == 0.0


def test_layers_and_expressions_leave_a_rotation_its_sign(turning):
    controls, bone = scene.controls(turning), scene.face(turning)
    for name, value in zip(TURN, (-0.48, 0.6, -0.64, -0.0), strict=True):
        bone[name] = value
    scene.update(controls)
    layers = scene.submodule("scene.animation.layers")
    layers.add(controls, "EXPRESSION", "Joy", expression="joy", weight=0.5)
    live = scene.submodule("scene.character.runtime").of(turning)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    seen = controls.evaluated_get(depsgraph)
    raw = scene.submodule("scene.frame.inputs").read_inputs(seen, live, depsgraph)[0]
    np.testing.assert_array_equal(raw[7:], np.float32([-0.48, 0.6, -0.64, 0.0]))
    assert raw[1] > 0.1  # the layer is active
    given = {"expression": "joy", "strength": 0.5, "only": True}
    assert bpy.ops.risorius.expression(**given) == {"FINISHED"}
    assert [bone[name] for name in TURN] == pytest.approx([-0.24, 0.3, -0.32, 0.5])
