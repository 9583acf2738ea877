# SPDX-License-Identifier: GPL-3.0-or-later
"""Raw controls for rotations of joints follow every rotation of head and neck."""

import bpy
import numpy as np
import pytest
import risorius
from mathutils import Euler, Matrix, Quaternion, Vector
from support import oracle, scene
from support.faces import HEAD, NECK_POSES, SIDE, TURNING, UP, neck_face

NECK = 1
NEAR = 4e-3  # tolerance: equal float32 quaternions may differ by an angle of 0.001 radians


@pytest.fixture
def face(tmp_path):
    """A function that saves and imports a face with neck poses, and returns its rig and its Dna."""

    def make(**options):
        path = tmp_path / "neck.dna"
        dna = neck_face(**options)
        dna.save(str(path))
        return scene.load(path), dna

    return make


def _axes(dna):
    return np.array([oracle._AXES[word] for word in dna.coordinate_system], np.float64).T


def _rest(dna, joint):
    """The axes of a joint at rest in the DNA file's space, as columns, float64[3, 3]."""
    return oracle._world(dna, np.zeros((len(dna.joint_names), 9)))[joint][:3, :3]


def _armature_turn(dna, joint, local):
    """Convert a rotation (x, y, z, w) about a joint's own axes to one about the armature's axes."""
    x, y, z, w = local
    turn = np.array(Quaternion((w, x, y, z)).to_matrix(), np.float64)
    basis = _axes(dna) @ _rest(dna, joint)
    return Matrix((basis @ turn @ basis.T).tolist()).to_quaternion()


def _own_turn(dna, joint, turn):
    """Convert a rotation about the armature's axes to one about a joint's own axes.

    Returns the quaternion (x, y, z, w) with w at least 0, float64[4].
    """
    basis = _axes(dna) @ _rest(dna, joint)
    local = basis.T @ np.array(turn.to_matrix(), np.float64) @ basis
    w, x, y, z = Matrix(local.tolist()).to_quaternion()
    return np.array([x, y, z, w]) * (-1 if w < 0 else 1)


def _pose(rig, bone, turn):
    """Rotate a control bone from rest by the quaternion `turn` about the armature's axes."""
    item = scene.controls(rig).pose.bones[bone]
    rest = item.bone.matrix_local.to_quaternion()
    item.rotation_mode = "QUATERNION"
    item.rotation_quaternion = rest.inverted() @ turn @ rest


def _wanted(dna, neck=None, head=None, **sliders):
    """Values of the blend shape channels by risorius.Rig, float32[channels].

    Args:
        dna: Dna of the face.
        neck, head: rotations of the joints about the armature's axes; None: at rest.
        sliders: short name of a raw control -> value.
    """
    rig = risorius.Rig(dna)
    raw = rig.initial_raw_controls.copy()
    names = list(rig.raw_control_names)
    for end, value in sliders.items():
        raw[names.index(f"CTRL_expressions.{end}")] = value
    for joint, turn in ((NECK, neck), (HEAD, head)):
        first = names.index(f"{dna.joint_names[joint]}.qx")
        if turn is not None:
            raw[first : first + 4] = _own_turn(dna, joint, turn)
    return rig.evaluate(raw).blend_shapes


def _shown(rig):
    return np.array(rig["channels"][:])


CONVENTIONS = (
    {},
    {"rotation_sequence": "zyx", "rotation_unit": "radians", "translation_unit": "m"},
    {"axes": ("left", "front", "up"), "rotation_sequence": "yxz", "rotation_signs": (1, -1, 1)},
    {"axes": ("right", "front", "up")},
)


@pytest.mark.parametrize("options", CONVENTIONS, ids=["usual", "zyx radians", "signs", "mirrored"])
def test_control_bones_fire_the_files_neck_poses(face, options):
    rig, dna = face(**options)
    assert _shown(rig)[4:] == pytest.approx([0, 0], abs=1e-6)
    for pose, channel in ((UP, 4), (SIDE, 5)):
        for bone, joint, part in (("neck", NECK, slice(0, 4)), ("head", HEAD, slice(4, 8))):
            _pose(rig, bone, _armature_turn(dna, joint, NECK_POSES[pose][part]))
        scene.set_controls(rig, jawOpen=0.5)
        shown = _shown(rig)
        assert shown[channel] == pytest.approx(1.0, abs=NEAR)
        assert shown[9 - channel] == pytest.approx(0.0, abs=1e-4)
        assert shown[2] == pytest.approx(0.5 if pose == UP else 0.0, abs=NEAR)


def test_any_turn_gives_what_the_evaluator_gives_for_it(face):
    rig, dna = face()
    random = np.random.default_rng(3)
    for _ in range(6):
        turns = [Euler(random.uniform(-0.5, 0.5, 3)).to_quaternion() for _ in range(2)]
        _pose(rig, "neck", turns[0])
        _pose(rig, "head", -turns[1])  # q and -q are the same rotation
        scene.set_controls(rig, jawOpen=0.3)
        wanted = _wanted(dna, *turns, jawOpen=0.3)
        np.testing.assert_allclose(_shown(rig), wanted, atol=1e-5)
    half = Quaternion((0.0, 0.0, 1.0), np.pi)
    for turn in (half, -half):
        _pose(rig, "head", turn)
        scene.update(scene.controls(rig))
        np.testing.assert_allclose(
            _shown(rig), _wanted(dna, turns[0], half, jawOpen=0.3), atol=1e-4
        )


def test_layers_frames_and_renders_have_them_in_time(face, tmp_path):
    rig, dna = face()
    clip = risorius.Clip(["head.pitch", "head.yaw"], [[0, 0.4, 0.4], [0, 0, 0.2]], 24.0)
    clip.save(tmp_path / "nod.rzc")
    bpy.context.view_layer.objects.active = scene.controls(rig)
    assert bpy.ops.risorius.import_animation(filepath=str(tmp_path / "nod.rzc"), start=1) == {
        "FINISHED"
    }
    seen, reader = {}, bpy.data.objects.new("reader", None)
    bpy.context.scene.collection.objects.link(reader)
    for place in (4, 5):  # an object of the user that reads the channels
        curve = reader.driver_add("location", place - 4)
        variable = curve.driver.variables.new()
        variable.name = curve.driver.expression = "channel"
        variable.targets[0].id = rig
        variable.targets[0].data_path = f'["channels"][{place}]'
    bpy.context.view_layer.update()

    def look(_scene, depsgraph):
        seen["pre"] = np.array(reader.evaluated_get(depsgraph).location[:2])

    bpy.app.handlers.frame_change_post.insert(0, look)  # sees the frame itself
    try:
        for frame in (2, 3, 1):
            bpy.context.scene.frame_set(frame)
            bone = scene.controls(rig).pose.bones["head"]
            rest = bone.bone.matrix_local.to_quaternion()
            turn = rest @ bone.matrix_basis.to_quaternion() @ rest.inverted()
            wanted = _wanted(dna, head=turn)
            np.testing.assert_allclose(_shown(rig), wanted, atol=1e-5)
            np.testing.assert_allclose(seen["pre"], wanted[4:], atol=1e-5)
    finally:
        bpy.app.handlers.frame_change_post.remove(look)
    assert abs(_wanted(dna)[4] - wanted[4]) < 1e-6  # frame 1 is at rest
    bpy.context.scene.frame_set(2)
    assert _shown(rig)[4:].max() > 0.01


def test_a_constraint_on_a_joints_bone_fires_them(face):
    rig, dna = face()
    bone = rig.pose.bones["head"]
    hold = bone.constraints.new("LIMIT_ROTATION")
    hold.owner_space = "LOCAL"
    hold.use_limit_x = True
    hold.min_x = hold.max_x = np.radians(30)
    for _ in range(2):  # known after Blender has evaluated the bone
        scene.update(rig, scene.controls(rig))
    local = Quaternion((1.0, 0.0, 0.0), np.radians(30))
    basis = np.array(rig.data.bones["head"].matrix_local.to_3x3(), np.float64)
    turn = Matrix((basis @ np.array(local.to_matrix()) @ basis.T).tolist()).to_quaternion()
    np.testing.assert_allclose(_shown(rig), _wanted(dna, head=turn), atol=1e-4)


def test_hand_keyed_values_lead_when_the_user_says_so(face):
    rig, _dna = face()
    _pose(rig, "head", Quaternion((1.0, 0.0, 0.0), 0.4))
    bone = scene.face(rig)
    for name, value in zip(TURNING, NECK_POSES[SIDE], strict=True):
        bone[name] = float(value)
    scene.update(scene.controls(rig))
    assert _shown(rig)[5] < 0.5
    scene.controls(rig).risorius_neck_poses = False
    scene.update(scene.controls(rig))
    assert _shown(rig)[5] == pytest.approx(1.0, abs=NEAR)


@pytest.mark.parametrize("keyed", [False, True], ids=["at rest", "keyed"])
def test_in_an_older_file_sliders_that_were_keyed_go_on_leading(face, keyed):
    rig, _dna = face()
    controls = scene.controls(rig)
    if keyed:
        scene.face(rig).keyframe_insert('["head.qx"]', frame=1)
    form = scene.submodule("scene.base.form")
    controls[form.VERSION] = 2
    said = scene.submodule("scene.upkeep.migrations").bring_up_all()
    assert controls.risorius_neck_poses is not keyed
    assert bool(said) is keyed


def test_a_scaled_turned_parent_changes_nothing_and_two_faces_keep_apart(face):
    rig, dna = face()
    turn = Euler((0.3, -0.1, 0.2)).to_quaternion()
    _pose(rig, "head", turn)
    parent = bpy.data.objects.new("parent", None)
    bpy.context.scene.collection.objects.link(parent)
    parent.scale, parent.rotation_euler = (-2.0, 2.0, 2.0), (0.4, 1.0, 0.2)
    scene.controls(rig).parent = parent
    other, _ = face(name="Other")
    scene.update(scene.controls(rig), scene.controls(other), parent)
    np.testing.assert_allclose(_shown(rig), _wanted(dna, head=turn), atol=1e-5)
    np.testing.assert_allclose(_shown(other), _wanted(dna), atol=1e-6)


def test_see_why_names_neck_poses_and_solo_shows_them_alone(face):
    rig, dna = face()
    for bone, joint, part in (("neck", NECK, slice(0, 4)), ("head", HEAD, slice(4, 8))):
        _pose(rig, bone, _armature_turn(dna, joint, NECK_POSES[UP][part]))
    scene.set_controls(rig, jawOpen=0.5)
    causes = scene.submodule("scene.see_why.causes")
    firing = {cause.name: cause for cause in causes.strongest(rig)}
    assert firing["neck_up"].value == pytest.approx(1.0, abs=NEAR)
    assert firing["neck_up"].now > 0.1
    assert "neck_side" not in firing
    alone = causes.sliders_of(rig, firing["neck_up"].control)
    assert set(alone) == set(TURNING)
    corrective = firing["pull_r"]  # named by its channel
    assert set(causes.sliders_of(rig, corrective.control)) == {*TURNING, "CTRL_expressions.jawOpen"}
    scene.submodule("scene.frame.look_masks").solo(rig, alone)
    scene.update(scene.controls(rig))
    shown = _shown(rig)
    assert shown[4] == pytest.approx(1.0, abs=NEAR)
    assert shown[[0, 1, 2]] == pytest.approx([0, 0, 0], abs=1e-6)


def test_a_bake_has_what_the_frames_had(face):
    rig, _dna = face()
    controls = scene.controls(rig)
    bone = controls.pose.bones["head"]
    bone.rotation_mode = "XYZ"
    for frame, angle in ((1, 0.0), (5, 0.5)):
        bone.rotation_euler = (angle, 0.1, 0.0)
        bone.keyframe_insert("rotation_euler", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 5
    live = {}
    for frame in (1, 3, 5):
        bpy.context.scene.frame_set(frame)
        live[frame] = scene.snapshot(rig)
    bpy.context.view_layer.objects.active = controls
    assert bpy.ops.risorius.bake() == {"FINISHED"}
    for frame, wanted in live.items():
        bpy.context.scene.frame_set(frame)
        np.testing.assert_allclose(scene.snapshot(rig), wanted, atol=2e-5)


def test_undo_and_redo_take_the_poses_along(face):
    rig, dna = face()
    bpy.ops.ed.undo_push(message="straight")
    turn = Euler((0.3, -0.1, 0.2)).to_quaternion()
    _pose(rig, "head", turn)
    scene.update(scene.controls(rig))
    bpy.ops.ed.undo_push(message="turned")
    for step, head in ((bpy.ops.ed.undo, None), (bpy.ops.ed.redo, turn)):
        assert step() == {"FINISHED"}
        rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
        bpy.context.view_layer.update()
        np.testing.assert_allclose(_shown(rig), _wanted(dna, head=head), atol=1e-5)


def test_an_override_of_a_linked_face_fires_them(face, tmp_path):
    rig, dna = face(name="Linked")
    path = tmp_path / "library.blend"
    collection = rig.users_collection[0].name
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.link(directory=f"{path}/Collection/", filename=collection)
    bpy.context.view_layer.objects.active = next(
        o for o in bpy.context.scene.objects if o.instance_collection
    )
    assert bpy.ops.risorius.make_override() == {"FINISHED"}
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o and not o.library)
    turn = Euler((0.3, -0.1, 0.2)).to_quaternion()
    _pose(rig, "head", turn)
    scene.update(scene.controls(rig))
    np.testing.assert_allclose(_shown(rig), _wanted(dna, head=turn), atol=1e-5)


def _nods(rig):
    """Animate the head's control bone, and limit the rotation of the head joint by a constraint."""
    bone = scene.controls(rig).pose.bones["head"]
    bone.rotation_mode = "XYZ"
    for frame, angle in ((1, 0.0), (5, 0.8)):
        bone.rotation_euler = (angle, 0.1, 0.2)
        bone.keyframe_insert("rotation_euler", frame=frame)
    hold = rig.pose.bones["head"].constraints.new("LIMIT_ROTATION")
    hold.owner_space, hold.use_limit_x, hold.use_limit_y = "LOCAL", True, True
    hold.min_x, hold.max_x = -0.1, 0.1
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 5


def _seen_turn(rig):
    """The rotation of the head's joint from rest that Blender shows, about the armature's axes."""
    seen = rig.evaluated_get(bpy.context.evaluated_depsgraph_get())
    bone = seen.pose.bones["head"]
    local = seen.convert_space(
        pose_bone=bone, matrix=bone.matrix, from_space="POSE", to_space="LOCAL"
    )
    rest = bone.bone.matrix_local.to_quaternion()
    return rest @ local.to_quaternion() @ rest.inverted()


def test_a_frame_under_a_constraint_depends_on_no_frame_before_it(face):
    rig, dna = face()
    _nods(rig)
    stage, seen = bpy.context.scene, {}
    for frame in (1, 5, 2, 5, 1, 3):
        stage.frame_set(frame)
        wanted = _wanted(dna, head=_seen_turn(rig))
        np.testing.assert_allclose(_shown(rig), wanted, atol=1e-5)
        seen.setdefault(frame, wanted)
        np.testing.assert_allclose(wanted, seen[frame], atol=1e-6)
    assert np.abs(seen[5] - seen[1]).max() > 0.01
    bpy.context.view_layer.objects.active = scene.controls(rig)
    live = {}
    for frame in seen:
        stage.frame_set(frame)
        live[frame] = scene.snapshot(rig)
    assert bpy.ops.risorius.bake() == {"FINISHED"}
    for frame, wanted in live.items():
        stage.frame_set(frame)
        np.testing.assert_allclose(scene.snapshot(rig), wanted, atol=2e-5)


def test_a_joint_that_follows_something_else_is_seen_when_that_moves(face):
    rig, dna = face()
    target = bpy.data.objects.new("target", None)
    bpy.context.scene.collection.objects.link(target)
    hold = rig.pose.bones["head"].constraints.new("COPY_ROTATION")
    hold.target, hold.owner_space = target, "LOCAL"
    scene.update(rig)
    target.rotation_euler = (0.4, 0.0, 0.1)
    for _ in range(3):  # as redraws do
        bpy.context.view_layer.update()
    wanted = _wanted(dna, head=_seen_turn(rig))
    np.testing.assert_allclose(_shown(rig), wanted, atol=1e-5)
    assert np.abs(wanted - _wanted(dna)).max() > 0.01


def test_keys_of_a_joints_own_bone_fire_them(face):
    rig, dna = face()
    bone = rig.pose.bones["head"]
    for frame, angle in ((1, 0.0), (5, 0.5)):
        bone.rotation_quaternion = Quaternion((1.0, 0.0, 0.0), angle)
        bone.keyframe_insert("rotation_quaternion", frame=frame)
    for frame in (5, 1, 3):
        bpy.context.scene.frame_set(frame)
        np.testing.assert_allclose(_shown(rig), _wanted(dna, head=_seen_turn(rig)), atol=1e-5)
        assert _seen_turn(rig).angle == pytest.approx((frame - 1) / 8, abs=0.01)
    live = scene.snapshot(rig)
    bpy.context.view_layer.objects.active = scene.controls(rig)
    assert bpy.ops.risorius.bake() == {"FINISHED"}
    bpy.context.scene.frame_set(3)
    np.testing.assert_allclose(scene.snapshot(rig), live, atol=2e-5)


def _follow(rig, bone, by="parent"):
    """Make the head's joint copy the rotation of an object that the same armature moves.

    Args:
        rig: the deforming armature.
        bone: with "parent", the name of the bone that is the object's parent; with "driver", the
            index of the blend shape channel that drives the object's rotation.
        by: "parent" or "driver".
    """
    target = bpy.data.objects.new("target", None)
    bpy.context.scene.collection.objects.link(target)
    if by == "parent":
        target.parent, target.parent_type, target.parent_bone = rig, "BONE", bone
    else:
        driver = target.driver_add("rotation_euler", 0).driver
        variable = driver.variables.new()
        variable.targets[0].id, variable.targets[0].data_path = rig, f'["channels"][{bone}]'
        driver.expression = "var"
    target.rotation_euler.y = 0.3
    hold = rig.pose.bones["head"].constraints.new("COPY_ROTATION")
    hold.target, hold.owner_space, hold.name = target, "LOCAL", "Nod"


@pytest.mark.parametrize("follows", [("FACIAL_C_Jaw", "parent"), (4, "driver")])
def test_a_joint_that_follows_its_own_poses_is_named_once_as_circular(face, follows, capsys):
    rig, dna = face()
    _follow(rig, *follows)
    turn = Euler((0.3, -0.1, 0.2)).to_quaternion()
    _pose(rig, "head", turn)
    for frame in (2, 1, 2):
        bpy.context.scene.frame_set(frame)
        scene.update(scene.controls(rig))
        np.testing.assert_allclose(_shown(rig), _wanted(dna, head=turn), atol=1e-5)
    readings = scene.submodule("scene.frame.joint_readings")
    said = readings.words(rig)
    assert said.startswith("The constraint Nod of head is circular: it follows what the neck poses")
    assert capsys.readouterr().out.count(said) == 1
    holds = rig.pose.bones["head"].constraints
    holds.remove(holds["Nod"])
    bpy.context.scene.frame_set(1)
    assert readings.words(rig) == ""


def test_a_joint_that_follows_a_bone_which_no_pose_moves_is_no_circle(face):
    rig, dna = face()
    _follow(rig, "spine_04")
    for frame in (2, 1):
        bpy.context.scene.frame_set(frame)
        np.testing.assert_allclose(_shown(rig), _wanted(dna, head=_seen_turn(rig)), atol=1e-5)
    assert scene.submodule("scene.frame.joint_readings").words(rig) == ""
    assert _seen_turn(rig).angle > 0.1


def test_a_layer_turns_the_neck_too(face):
    rig, dna = face()
    clips = scene.submodule("scene.animation.clip_actions")
    clip = risorius.Clip(["neck.pitch", "head.yaw"], [[0.4, 0.4], [0.2, 0.2]], 24.0)
    timing = clips.timing_of(clip, bpy.context.scene, 0.0)
    action = clips.make_action(rig, clip, timing, "Turn").action
    layers = scene.submodule("scene.animation.layers")
    layers.add(scene.controls(rig), "ACTION", "Layer").action = action
    bpy.context.scene.frame_set(0)
    neck, head = Quaternion((-1.0, 0.0, 0.0), 0.4), Quaternion((0.0, 0.0, 1.0), 0.2)
    np.testing.assert_allclose(_shown(rig), _wanted(dna, neck, head), atol=1e-5)
    assert np.abs(_shown(rig)[4:]).max() > 0.01


@pytest.mark.parametrize("mirrored", [1.0, -1.0])
def test_an_attached_body_fires_them_as_it_turns(face, mirrored):
    rig, dna = face()
    body = bpy.data.objects.new("body", bpy.data.armatures.new("body"))
    bpy.context.scene.collection.objects.link(body)
    body.scale, body.rotation_euler = (2.0 * mirrored, 2.0, 2.0), (0.3, 0.2, 1.0)
    bpy.context.view_layer.objects.active = body
    bpy.ops.object.mode_set(mode="EDIT")
    for name, parent, roll in (("spine", None, 0.1), ("neck", "spine", 0.7), ("head", "neck", 0.4)):
        bone = body.data.edit_bones.new(name)
        above = body.data.edit_bones[parent] if parent else None
        bone.head = above.tail if above else (0.0, 0.0, 1.0)
        bone.tail, bone.roll, bone.parent = bone.head + Vector((0.02, 0.05, 0.2)), roll, above
    bpy.ops.object.mode_set(mode="OBJECT")
    controls = scene.controls(rig)
    bpy.context.view_layer.objects.active = controls
    attach = scene.submodule("scene.character.rig_placement").attach
    bpy.context.view_layer.update()
    attach(controls, body, "spine", "neck", "head", "NONE")
    wanted = {}
    bpy.context.view_layer.update()
    from_face = (
        np.linalg.inv(np.array(body.matrix_world)[:3, :3]) @ np.array(controls.matrix_world)[:3, :3]
    )
    for name, angles in (("neck", (0.2, 0.3, -0.1)), ("head", (-0.3, 0.2, 0.2))):
        bone = body.pose.bones[name]
        bone.rotation_mode, bone.rotation_euler = "XYZ", angles
        rest = np.array(bone.bone.matrix_local.to_3x3())
        turn = rest @ np.array(Euler(angles).to_matrix()) @ np.linalg.inv(rest)
        own = np.linalg.inv(from_face) @ turn @ from_face
        wanted[name] = Matrix(own.tolist()).to_quaternion()
    scene.update(body)
    np.testing.assert_allclose(_shown(rig), _wanted(dna, wanted["neck"], wanted["head"]), atol=1e-5)
    assert np.abs(_shown(rig)[4:]).max() > 0.01
