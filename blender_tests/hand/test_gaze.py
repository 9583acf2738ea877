# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests eyes that look at a target, lids that follow them, blinks, and rotations of a body."""

import math

import bpy
import numpy as np
import pytest
from mathutils import Vector
from support import scene
from support.faces import small_face

EYES = ("L", "R")


def two_eyed(path, shift=0.0):
    """Save the small face with a second eye.

    Args:
        path: path of the saved file.
        shift: file units by which looking left or right moves the centre of an eye.
    """
    dna = small_face()
    names = list(dna.raw_control_names)
    for place, direction in zip((8, 9, 10, 3), ("Left", "Right", "Up", "Down"), strict=True):
        names[place] = f"CTRL_expressions.eyeLook{direction}R"
    dna.raw_control_names = names
    dna.joint_names = [*dna.joint_names[:5], "FACIAL_R_Eye", *dna.joint_names[6:]]
    parents = dna.joint_parents.copy()
    parents[5] = 2
    dna.joint_parents = parents
    offsets = dna.neutral_joint_translations.copy()
    offsets[5] = offsets[4] * [-1, 1, 1]
    dna.neutral_joint_translations = offsets
    dna.neutral_joint_rotations = np.zeros_like(dna.neutral_joint_rotations)
    groups = dna.joint_groups
    eye = groups[1]
    rows = np.zeros((6, 8), np.float32)
    # Columns: left eye looks left, right, up, down; right eye looks left, right, up, down. Rows:
    # attributes of the eye joints in output_indices, in degrees or file units.
    rows[0] = [
        30,
        -28,
        3,
        0,
        0,
        0,
        0,
        0,
    ]  # about the upright axis, with a wrong part when it looks up
    rows[1] = [0, 0, -20, 22, 0, 0, 0, 0]
    rows[2] = [0, 0, 0, 0, 28, -30, 0, 0]
    rows[3] = [0, 0, 0, 0, 0, 0, -20, 22]
    rows[4] = [shift, -shift, 0, 0, 0, 0, 0, 0]
    rows[5] = [0, 0, 0, 0, shift, -shift, 0, 0]
    eye.input_indices = [4, 5, 6, 7, 8, 9, 10, 3]
    eye.output_indices = [4 * 9 + 4, 4 * 9 + 3, 5 * 9 + 4, 5 * 9 + 3, 4 * 9, 5 * 9]
    eye.values, eye.lods, eye.joint_indices = rows, [6, 6], [4, 5]
    dna.joint_groups = [groups[0], eye]
    dna.save(str(path))
    return path


@pytest.fixture
def rig(tmp_path):
    rig = scene.load(two_eyed(tmp_path / "eyes.dna", shift=0.4), "LIVE")  # with posed bones
    bpy.context.view_layer.objects.active = scene.controls(rig)
    return rig


def eye(rig, side):
    """Centre and unit direction of an eye in world space, from the deforming bone of the eye."""
    seen = rig.evaluated_get(bpy.context.evaluated_depsgraph_get())
    bone = seen.pose.bones[f"FACIAL_{side}_Eye"]
    # At rest the eye looks along -y of the armature.
    turn = bone.matrix.to_3x3() @ bone.bone.matrix_local.to_3x3().inverted()
    world = seen.matrix_world
    return world @ bone.matrix.translation, (
        world.to_3x3() @ turn @ Vector((0, -1, 0))
    ).normalized()


def yaw(rig, side):
    turn = eye(rig, side)[1]
    return math.degrees(math.atan2(turn.x, -turn.y))


def misses(rig, point):
    """For each eye, the angle between its direction and the way to a point, in degrees.

    Args:
        rig: the face.
        point: the point in world space.
    """
    found = []
    for side in EYES:
        centre, ahead = eye(rig, side)
        found.append(math.degrees(ahead.angle((Vector(point) - centre).normalized())))
    return found


def target(rig):
    return scene.controls(rig).pose.bones["eyes"]


def target_point(rig):
    seen = scene.controls(rig).evaluated_get(bpy.context.evaluated_depsgraph_get())
    return seen.matrix_world @ seen.pose.bones["eyes"].matrix.translation


def move_target(rig, x, y, z):
    """Move the eyes' target from rest by (x, y, z) along the control armature's axes.

    The unit is the distance of the target from the eyes at rest.
    """
    bone = target(rig)
    rest = bone.bone.matrix_local.to_3x3()
    far = abs(bone.bone.head_local.y - scene.controls(rig).data.bones["eye_L"].head_local.y)
    bone.location = rest.inverted() @ Vector((x * far, y * far, z * far))
    scene.update(scene.controls(rig))


def test_at_rest_the_eyes_look_ahead(rig):
    for side in EYES:
        assert math.degrees(eye(rig, side)[1].angle(Vector((0, -1, 0)))) < 0.01


@pytest.mark.parametrize(
    "place", [(0.25, 0, 0), (-0.2, 0, 0.2), (0.1, 0.3, 0.15), (0, 0.6, 0), (-0.3, -0.5, -0.05)]
)
def test_both_eyes_look_at_the_target(rig, place):
    move_target(rig, *place)
    assert max(misses(rig, target_point(rig))) < 0.05


def test_without_steps_the_moving_centres_leave_an_angle(rig, monkeypatch):
    monkeypatch.setattr(scene.submodule("scene.gaze.gaze"), "STEPS", 1)
    move_target(rig, 0.25, 0, 0.2)
    assert max(misses(rig, target_point(rig))) > 0.3


def test_eyes_that_do_not_meet_go_as_far_as_the_target(rig):
    scene.controls(rig).risorius_converge = 0.0
    move_target(rig, 0, 0.6, 0)
    own = scene.controls(rig).data.bones
    near = target_point(rig)
    for side in EYES:
        centre = own[f"eye_{side}"].head_local
        before, after = own["eyes"].head_local - centre, near - centre
        wanted = math.atan2(after.x, -after.y) - math.atan2(before.x, -before.y)
        assert yaw(rig, side) == pytest.approx(math.degrees(wanted), abs=0.05)


def test_a_small_move_gives_no_jump(rig):
    before = [eye(rig, side)[1].copy() for side in EYES]
    move_target(rig, 0.002, 0, 0)
    after = [eye(rig, side)[1] for side in EYES]
    assert max(math.degrees(a.angle(b)) for a, b in zip(before, after, strict=True)) < 0.2


def test_a_target_out_of_reach_stops_at_the_controls_ends(rig):
    move_target(rig, 3.0, 0, 0)
    for side in EYES:
        assert yaw(rig, side) == pytest.approx({"L": 30, "R": 28}[side], abs=0.1)


def test_what_the_animator_set_is_added_to_the_gaze(rig):
    move_target(rig, 0.1, 0, 0)
    before = yaw(rig, "L")
    scene.set_controls(rig, eyeLookLeftL=0.2)
    assert yaw(rig, "L") - before == pytest.approx(0.2 * 30, abs=0.1)


def test_the_same_controls_give_the_same_gaze_from_anywhere(rig):
    move_target(rig, 0.2, 0.1, 0.1)
    first = [tuple(eye(rig, side)[1]) for side in EYES]
    move_target(rig, -0.3, 0.5, -0.2)
    move_target(rig, 0.2, 0.1, 0.1)
    assert [tuple(eye(rig, side)[1]) for side in EYES] == first


def _turn_head(rig, degrees):
    bone = scene.controls(rig).pose.bones["head"]
    bone.rotation_mode = "XYZ"
    bone.rotation_euler = (0.0, math.radians(degrees), 0.0)  # about the upright axis
    scene.update(scene.controls(rig))


def test_a_target_on_the_head_turns_with_it(rig):
    move_target(rig, 0.2, 0, 0.2)
    _turn_head(rig, 30)
    assert max(misses(rig, target_point(rig))) < 0.05


def test_a_target_in_the_world_stays_there(rig):
    assert bpy.ops.risorius.gaze_target(mode="WORLD") == {"FINISHED"}
    before = target_point(rig).copy()
    _turn_head(rig, 12)
    assert (target_point(rig) - before).length < 1e-5
    assert max(misses(rig, before)) < 0.05
    assert bpy.ops.risorius.gaze_target(mode="HEAD") == {"FINISHED"}
    assert not target(rig).constraints
    assert not [o for o in bpy.data.objects if o.type == "EMPTY"]


def test_an_object_is_looked_at_where_it_goes(rig):
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.context.scene.collection.objects.link(camera)
    centre = scene.controls(rig).matrix_world @ target(rig).bone.head_local
    camera.location = centre + Vector((0.04, 0.0, 0.03))
    assert bpy.ops.risorius.gaze_target(mode="OBJECT", target="camera") == {"FINISHED"}
    assert max(misses(rig, camera.location)) < 0.05
    camera.location = centre + Vector((-0.04, -0.05, -0.02))
    bpy.context.view_layer.update()
    assert max(misses(rig, camera.location)) < 0.05


def test_an_object_that_is_not_there_is_named(rig):
    with pytest.raises(RuntimeError, match="There is no object nothing"):
        bpy.ops.risorius.gaze_target(mode="OBJECT", target="nothing")


@pytest.fixture
def body(rig):
    """A body to which the face is attached.

    The neck and head bones of the body start at the places of the face's neck and head bones.
    """
    data = bpy.data.armatures.new("body")
    body = bpy.data.objects.new("body", data)
    bpy.context.scene.collection.objects.link(body)
    bpy.context.view_layer.objects.active = body
    own = scene.controls(rig).data.bones
    bpy.ops.object.mode_set(mode="EDIT")
    last = None
    for name, head in (
        ("spine", own["neck"].head_local - Vector((0, 0, 0.2))),
        ("neck", own["neck"].head_local),
        ("head", own["head"].head_local),
    ):
        bone = data.edit_bones.new(name)
        bone.head, bone.tail = head, head + Vector((0, 0, 0.1))
        bone.parent, last = last, bone
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = scene.controls(rig)
    assert bpy.ops.risorius.attach_body(body="body") == {"FINISHED"}
    return body


def _bend(body, bone, degrees):
    bone = body.pose.bones[bone]
    bone.rotation_mode = "XYZ"
    bone.rotation_euler = (0.0, math.radians(degrees), 0.0)
    scene.update(body)


def head_yaw(rig):
    seen = rig.evaluated_get(bpy.context.evaluated_depsgraph_get())
    bone = seen.pose.bones["head"]
    turn = bone.matrix.to_3x3() @ bone.bone.matrix_local.to_3x3().inverted()
    ahead = turn @ Vector((0, -1, 0))
    return math.degrees(math.atan2(ahead.x, -ahead.y))


@pytest.mark.parametrize("share", [1.0, 0.5, 0.0])
def test_the_face_takes_its_share_of_the_bodys_turn_and_adds_its_own(rig, body, share):
    _bend(body, "head", 20)
    turned = head_yaw(rig)
    assert abs(turned) == pytest.approx(20, abs=0.01)
    scene.controls(rig).risorius_body_turn = share
    bpy.context.view_layer.update()
    assert head_yaw(rig) == pytest.approx(share * turned, abs=0.01)
    _turn_head(rig, math.copysign(10, turned))
    assert head_yaw(rig) == pytest.approx(share * turned + math.copysign(10, turned), abs=0.01)


def test_eyes_stay_on_a_point_of_the_world_while_the_body_turns(rig, body):
    bpy.ops.risorius.gaze_target(mode="WORLD")
    point = target_point(rig).copy()
    _bend(body, "neck", 5)
    _bend(body, "head", -12)
    assert max(misses(rig, point)) < 0.05
    scene.controls(rig).risorius_body_turn = 0.4
    bpy.context.view_layer.update()
    assert max(misses(rig, point)) < 0.05


def test_a_render_and_a_bake_have_the_gaze_of_the_view(rig):
    bone = target(rig)
    for frame, place in ((1, (0.0, 0, 0)), (10, (0.25, 0.2, 0.1))):
        move_target(rig, *place)
        bone.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(10)
    at_ten = [tuple(eye(rig, side)[1]) for side in EYES]
    bpy.context.scene.frame_end = 10
    assert bpy.ops.risorius.bake() == {"FINISHED"}
    bpy.context.scene.frame_set(3)
    bpy.context.scene.frame_set(10)
    np.testing.assert_allclose([tuple(eye(rig, side)[1]) for side in EYES], at_ten, atol=1e-5)


@pytest.fixture
def blinking(tmp_path):
    """A face with the controls eyeBlinkL and eyeBlinkR."""
    dna = small_face()
    names = list(dna.raw_control_names)
    names[1], names[2] = "CTRL_expressions.eyeBlinkL", "CTRL_expressions.eyeBlinkR"
    dna.raw_control_names = names
    dna.save(str(tmp_path / "blink.dna"))
    rig = scene.load(tmp_path / "blink.dna")
    bpy.context.view_layer.objects.active = scene.controls(rig)
    return rig


def lid_keys(rig, side):
    """Frame -> value, for the keys of the blink control of one side ("L" or "R")."""
    path = f'pose.bones["face"]["CTRL_expressions.eyeBlink{side}"]'
    found = [c for c in scene.curves(scene.controls(rig)) if c.data_path == path]
    return {round(k.co.x, 3): round(k.co.y, 4) for c in found for k in c.keyframe_points}


def test_a_blink_closes_quickly_holds_and_opens_slowly(blinking):
    bpy.context.scene.frame_set(20)
    assert bpy.ops.risorius.blink(offset=1.0) == {"FINISHED"}
    assert lid_keys(blinking, "L") == {20: 0, 23: 1, 24: 1, 29: 0}
    assert lid_keys(blinking, "R") == {21: 0, 24: 1, 25: 1, 30: 0}
    assert scene.face(blinking)["CTRL_expressions.eyeBlinkL"] == 0.0


def test_the_target_that_is_proposed_is_what_the_hand_chose(rig, monkeypatch):
    """The active object is proposed as target, unless it is a part of the face.

    Then a selected object is proposed, an empty before other objects, and without selected objects
    the scene's camera.
    """
    operators = scene.submodule("ui.hand.gaze")
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    empty = bpy.data.objects.new("empty", None)
    thing = bpy.data.objects.new("thing", camera.data)
    for item in (camera, thing, empty):
        bpy.context.scene.collection.objects.link(item)
    bpy.context.scene.camera = camera
    assert operators.proposed(bpy.context) == "camera"
    for item in (thing, empty):
        item.select_set(True)
        assert operators.proposed(bpy.context) == item.name  # the face stays active
    empty.select_set(False)
    bpy.context.view_layer.objects.active = empty
    assert operators.proposed(bpy.context) == "empty"


def test_a_blink_during_a_tweak_touches_no_key(blinking):
    bpy.ops.risorius.blink()
    before = {
        c.data_path: [*k.co]
        for c in scene.curves(scene.controls(blinking))
        for k in c.keyframe_points
    }
    bpy.ops.risorius.tweak(first=10, last=30)
    bpy.context.scene.frame_set(20)
    assert bpy.ops.risorius.blink() == {"FINISHED"}
    now = scene.curves(scene.controls(blinking))
    assert {c.data_path: [*k.co] for c in now for k in c.keyframe_points} == before
    assert [y.name for y in scene.controls(blinking).risorius_layers] == ["Blinks"]


def test_a_blink_begins_and_ends_at_what_the_lids_show(blinking):
    bone, path = scene.face(blinking), 'pose.bones["face"]["CTRL_expressions.eyeBlinkL"]'
    for frame, value in ((10, 0.1), (22, 0.7), (30, 0.3)):
        bone["CTRL_expressions.eyeBlinkL"] = value
        scene.controls(blinking).keyframe_insert(path, frame=frame)
    curve = next(c for c in scene.curves(scene.controls(blinking)) if c.data_path == path)
    before, after = (round(curve.evaluate(f), 4) for f in (20, 29))
    bpy.context.scene.frame_set(20)
    bpy.ops.risorius.blink(sides="L", strength=0.9)
    assert lid_keys(blinking, "L") == {10: 0.1, 20: before, 23: 0.9, 24: 0.9, 29: after, 30: 0.3}
    assert lid_keys(blinking, "R") == {}


def test_blinks_at_selected_keys_in_a_layer_touch_no_key(blinking):
    path = 'pose.bones["face"]["CTRL_expressions.jawOpen"]'
    for frame in (10, 40, 60):
        scene.controls(blinking).keyframe_insert(path, frame=frame)
    for point in scene.curves(scene.controls(blinking))[0].keyframe_points:
        point.select_control_point = point.co.x != 40
    assert bpy.ops.risorius.blink(at="SELECTED", kind="LAYER") == {"FINISHED"}
    assert bpy.ops.risorius.blink(at="SELECTED", kind="LAYER") == {"FINISHED"}  # the same again
    assert len(scene.submodule("scene.animation.layers").of(scene.controls(blinking))) == 1
    assert {c.data_path for c in scene.curves(scene.controls(blinking))} == {path}
    read = scene.submodule("scene.frame.inputs").read_inputs
    live = scene.submodule("scene.character.runtime").of(blinking)
    shown = {}
    for frame in (5, 10, 13, 14, 19, 40, 63, 64, 70):
        bpy.context.scene.frame_set(frame)
        depsgraph = bpy.context.evaluated_depsgraph_get()
        seen = scene.controls(blinking).evaluated_get(depsgraph)
        shown[frame] = round(float(read(seen, live, depsgraph)[0][1]), 3)
    assert shown == {5: 0, 10: 0, 13: 1, 14: 1, 19: 0, 40: 0, 63: 1, 64: 1, 70: 0}


def test_a_face_without_lids_says_so(rig):
    with pytest.raises(RuntimeError, match="no control that closes an eye"):
        bpy.ops.risorius.blink()


def lidded(path):
    """Save the two-eyed face with raw controls that close and widen the left eye.

    Looking up or down does not move the lids of this face. Returns the path.
    """
    two_eyed(path)
    import risorius

    dna = risorius.load(str(path))
    names = list(dna.raw_control_names)
    names[1], names[2] = "CTRL_expressions.eyeBlinkL", "CTRL_expressions.eyeWidenL"
    dna.raw_control_names = names
    dna.save(str(path))
    return path


@pytest.mark.parametrize("amount", [0.0, 0.5, 1.0])
def test_lids_follow_the_gaze_as_far_as_is_asked(tmp_path, amount):
    path = lidded(tmp_path / "lids.dna")
    rig = scene.load(path)
    assert scene.controls(rig).risorius_lids == 0.5  # the lids do not follow the gaze by themselves
    scene.controls(rig).risorius_lids = amount
    scene.set_controls(rig, eyeLookDownL=0.8, eyeBlinkL=0.2)
    raw = scene.raw_of(rig, path)
    raw[1] = 0.2 + 0.5 * amount * 0.8 * (1 - 0.2)
    assert scene.error_against_oracle(rig, path, raw) < scene.TOLERANCE
    scene.set_controls(rig, eyeLookDownL=0.0, eyeLookUpL=0.6, eyeBlinkL=0.0)
    raw = scene.raw_of(rig, path)
    raw[2] = 0.5 * amount * 0.6
    assert scene.error_against_oracle(rig, path, raw) < scene.TOLERANCE


def test_a_closed_eye_stays_closed(tmp_path):
    path = lidded(tmp_path / "lids.dna")
    rig = scene.load(path)
    scene.set_controls(rig, eyeLookDownL=1.0, eyeBlinkL=1.0)
    raw = scene.raw_of(rig, path)
    assert scene.error_against_oracle(rig, path, raw) < scene.TOLERANCE
