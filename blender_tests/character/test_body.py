# SPDX-License-Identifier: GPL-3.0-or-later
"""A face follows its control armature, which may be attached to a body."""

import itertools

import bpy
import numpy as np
import pytest
from mathutils import Matrix, Quaternion, Vector
from support import pictures, scene
from support.layout import drawn

NAMES = {
    "unreal": ("spine_05", "neck_01", "neck_02", "head"),
    "mixamo": ("mixamorig:Spine2", "mixamorig:Neck", "", "mixamorig:Head"),
    "vicon": ("Bip01 Spine", "Bip01 Neck1", "", "Bip01 Head"),
    "rigify": ("chest", "neck", "", "head"),
}


def _body(names, scale=1.0, turn=0.0):
    """An armature that stands for a body: a chain of bones with rolls.

    The chain is upright in world space, whatever the scale and rotation of the object.

    Args:
        names: names of the bones from the lowest to the highest; an empty name makes no bone.
        scale: scale of the object.
        turn: rotation of the object about x, in radians.
    """
    data = bpy.data.armatures.new("body")
    body = bpy.data.objects.new("body", data)
    bpy.context.scene.collection.objects.link(body)
    bpy.context.view_layer.objects.active = body
    bpy.ops.object.mode_set(mode="EDIT")
    inner = Matrix.Rotation(-turn, 3, "X")
    parent = None
    for number, name in enumerate(n for n in names if n):
        bone = data.edit_bones.new(name)
        bone.head = inner @ Vector((0.0, 0.0, 1.2 + 0.1 * number)) / scale
        bone.tail = inner @ Vector((0.0, 0.01, 1.3 + 0.1 * number)) / scale
        bone.roll = 0.7 * number
        bone.parent = parent
        parent = bone
    bpy.ops.object.mode_set(mode="OBJECT")
    body.scale = (scale,) * 3
    body.rotation_euler.x = turn
    bpy.context.view_layer.update()
    return body


def _attach(rig, body, **options):
    bpy.context.view_layer.objects.active = scene.controls(rig)
    assert bpy.ops.risorius.attach_body(body=body.name, **options) == {"FINISHED"}


def _moved(points, matrix):
    m = np.array(matrix)
    return points @ m[:3, :3].T + m[:3, 3]


def _world(body, name):
    return body.matrix_world @ body.pose.bones[name].matrix


def test_the_face_goes_where_its_controls_go(mode, dna_file):
    rig = scene.load(dna_file, mode)
    scene.set_controls(rig, jawOpen=0.6)
    before = scene.snapshot(rig)
    controls = scene.controls(rig)
    matrix = Matrix.LocRotScale((1, 2, 3), Quaternion((1, 2, 3), 0.8), (2, 2, 2))
    controls.matrix_world = matrix
    scene.update(controls)
    bpy.context.view_layer.update()
    np.testing.assert_allclose(scene.snapshot(rig), _moved(before, matrix), atol=2e-6)


def test_a_parent_of_the_users_own_is_left_alone(dna_file):
    rig = scene.load(dna_file)
    empty = bpy.data.objects.new("empty", None)
    bpy.context.scene.collection.objects.link(empty)
    rig.parent = empty
    empty.location.x = 5.0
    scene.controls(rig).location.x = 1.0
    scene.update(empty, scene.controls(rig))
    assert rig.matrix_world.translation.x == pytest.approx(5.0)


@pytest.mark.parametrize("names", NAMES.values(), ids=NAMES.keys())
@pytest.mark.parametrize(("scale", "turn"), [(1.0, 0.0), (0.01, np.pi / 2), (3.0, 0.4)])
def test_head_and_neck_of_a_body_of_any_name_and_scale(dna_file, names, scale, turn):
    rig = scene.load(dna_file)
    body = _body(names, scale, turn)
    _attach(rig, body)
    bpy.context.view_layer.update()
    controls = scene.controls(rig)
    base, neck, head = names[0], names[1], names[-1]
    place = controls.matrix_world @ controls.data.bones["head"].head_local
    np.testing.assert_allclose(place, _world(body, head).translation, atol=1e-5)
    rest = scene.snapshot(rig)
    joint = next(b.name for b in rig.pose.bones if b.bone["dna_joint"] == 2)
    straight = _world(rig, joint).to_quaternion()
    before = _world(body, head).to_quaternion()
    # The lowest bone of the body moves the whole face.
    body.pose.bones[base].matrix_basis = Matrix.Rotation(0.5, 4, "Y")
    scene.update(body)
    bpy.context.view_layer.update()
    rest_base = body.matrix_world @ body.data.bones[base].matrix_local
    motion = _world(body, base) @ rest_base.inverted()
    np.testing.assert_allclose(scene.snapshot(rig), _moved(rest, motion), atol=2e-5)
    for name, angle in ((neck, 0.3), (head, -0.4)):
        body.pose.bones[name].rotation_mode = "QUATERNION"
        body.pose.bones[name].rotation_quaternion = Quaternion((1, 0.4, 0.2), angle)
    scene.update(body)
    bpy.context.view_layer.update()
    turned_direct = scene.snapshot(rig)
    scene.pose_bones(rig)
    np.testing.assert_allclose(scene.snapshot(rig), turned_direct, atol=1e-5)
    turned = _world(rig, joint).to_quaternion() @ straight.inverted()
    wanted = _world(body, head).to_quaternion() @ before.inverted()
    assert turned.rotation_difference(wanted).angle < 2e-3
    assert wanted.angle > 0.3


def test_a_body_that_is_posed_when_it_is_attached_carries_the_face_along(dna_file):
    rig = scene.load(dna_file)
    rest = scene.snapshot(rig)
    body = _body(NAMES["rigify"])
    body.pose.bones["chest"].matrix_basis = Matrix.Translation((0.3, 0, 0))
    scene.update(body)
    _attach(rig, body, fit="NONE")
    bpy.context.view_layer.update()
    rest_base = body.matrix_world @ body.data.bones["chest"].matrix_local
    motion = _world(body, "chest") @ rest_base.inverted()
    np.testing.assert_allclose(scene.snapshot(rig), _moved(rest, motion), atol=1e-5)
    assert motion.translation.length == pytest.approx(0.3)


def test_the_face_stays_when_it_is_detached(dna_file):
    rig = scene.load(dna_file)
    body = _body(NAMES["rigify"])
    _attach(rig, body, fit="NONE")
    body.pose.bones["chest"].matrix_basis = Matrix.Translation((0.3, 0, 0))
    scene.update(body)
    bpy.context.view_layer.update()
    before = scene.snapshot(rig)
    assert bpy.ops.risorius.detach_body() == {"FINISHED"}
    assert not bpy.ops.risorius.detach_body.poll()  # disabled, because the face has no body
    body.pose.bones["chest"].matrix_basis.identity()
    scene.update(body)
    np.testing.assert_allclose(scene.snapshot(rig), before, atol=1e-6)
    assert not scene.controls(rig).constraints


def test_what_is_no_body_is_refused(dna_file):
    rig = scene.load(dna_file)
    bpy.context.view_layer.objects.active = scene.controls(rig)
    for name in ("nothing", rig.name, scene.controls(rig).name):
        with pytest.raises(RuntimeError, match="no armature of a body"):
            bpy.ops.risorius.attach_body(body=name)
    body = _body(("a", "b"))
    bpy.context.view_layer.objects.active = scene.controls(rig)
    with pytest.raises(RuntimeError, match="choose the bones"):
        bpy.ops.risorius.attach_body(body=body.name)
    with pytest.raises(RuntimeError, match="no bone 'wrong'"):
        bpy.ops.risorius.attach_body(body=body.name, base="wrong")


def test_the_place_is_a_function_of_the_frame_to_the_last_bit(dna_file):
    rig = scene.load(dna_file)
    controls = scene.controls(rig)
    places = []
    for x in (0.3, 0.3 + 2e-7, 0.3, 5.0, 0.3):
        controls.location.x = x
        scene.update(controls)
        bpy.context.view_layer.update()
        places.append(np.array(rig.matrix_world))
    for again in (2, 4):
        np.testing.assert_array_equal(places[again], places[0])
    assert np.abs(places[1] - places[0]).max() > 0


def test_a_walking_body_renders_the_same_in_any_order(mode, dna_file, tmp_path):
    rig = scene.load(dna_file, mode)
    body = _body(NAMES["unreal"])
    _attach(rig, body, fit="NONE")
    for frame, x in ((1, 0.0), (5, 0.1)):
        body.pose.bones["spine_05"].location.x = x
        body.pose.bones["spine_05"].keyframe_insert("location", frame=frame)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler = (0, -0.6, 1.58), (np.pi / 2, 0, 0)
    bpy.context.scene.collection.objects.link(camera)
    setup = pictures.small_render(camera)
    found = {}
    for order in ((1, 3, 5), (5, 3, 1)):
        for frame in order:
            setup.frame_set(frame)
            found.setdefault(frame, []).append(pictures.render(tmp_path / f"{frame}.png"))
    for one, other in found.values():
        np.testing.assert_array_equal(one, other)
    assert np.abs(found[1][0] - found[5][0]).max() > 0.05


def test_everything_visible_selected_and_duplicated_is_a_face(mode, dna_file):
    rig = scene.load(dna_file, mode)
    scene.set_controls(rig, jawOpen=0.5)
    still = scene.snapshot(rig)
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.duplicate()
    bpy.context.view_layer.update()
    copy = next(o for o in bpy.context.selected_objects if "risorius_controls" in o)
    assert copy != rig
    scene.set_controls(copy, jawOpen=0.9, mouthCornerPullL=0.4)
    raw = scene.raw_of(copy, dna_file)
    assert scene.error_against_oracle(copy, dna_file, raw) < scene.TOLERANCE
    np.testing.assert_array_equal(scene.snapshot(rig), still)


def test_faces_are_imported_side_by_side(dna_file):
    rigs = [scene.load(dna_file, "LIVE") for _ in range(3)]
    rigs += [scene.load(dna_file, "KEYS", lods=(False, True, *[False] * 6))]
    spans = []
    for rig in rigs:
        points = scene.snapshot(rig)
        spans.append((points[:, 0].min(), points[:, 0].max()))
        middle = scene.controls(rig).matrix_world.translation
        assert tuple(middle)[1:] == (0.0, 0.0)
        raw = scene.raw_of(rig, dna_file)
        lod = next(iter(scene.meshes(rig).values()))["dna_lods"][0]
        assert scene.error_against_oracle(rig, dna_file, raw, lod) < scene.TOLERANCE
    assert tuple(scene.controls(rigs[0]).location) == (0.0, 0.0, 0.0)
    for (_left, right), (left, _right) in itertools.pairwise(spans):
        assert left > right
    # After the face at the origin was moved away, the next imported face gets this place.
    scene.controls(rigs[0]).location = (0.0, 5.0, 0.0)
    bpy.context.view_layer.update()
    assert tuple(scene.controls(scene.load(dna_file, "LIVE")).location) == (0.0, 0.0, 0.0)


def _rests(controls):
    return np.array([bone.matrix_local for bone in controls.data.bones])


def test_a_moved_face_and_edited_bones_stay_as_they_were_put(dna_file):
    rig = scene.load(dna_file, "LIVE")
    controls = scene.controls(rig)
    controls.data.transform(Matrix.Scale(0.5, 4))
    scene.update(controls)
    bones = _rests(controls)
    controls.scale = (2.0, 2.0, 2.0)
    scene.update(controls)
    controls.location.x = 1.0
    scene.update(controls)
    np.testing.assert_array_equal(_rests(controls), bones)
    assert tuple(controls.scale) == (2.0, 2.0, 2.0)


def test_a_face_is_made_as_large_as_the_body_it_is_put_on(dna_file):
    rig = scene.load(dna_file)
    controls, body = scene.controls(rig), _body(NAMES["rigify"], 2.0, 0.3)
    _attach(rig, body, fit="SCALE")
    bpy.context.view_layer.update()
    for own, name in (("head", "head"), ("neck", "neck")):
        there = body.matrix_world @ body.data.bones[name].head_local
        here = controls.matrix_world @ controls.data.bones[own].head_local
        if own == "head":
            assert (here - there).length < 1e-5
            head, heads = here, there
        else:
            assert (here - head).length == pytest.approx((there - heads).length, rel=1e-4)


def test_the_panel_says_that_keys_on_joints_lead_and_that_a_parent_shears(dna_file):
    rig = scene.load(dna_file, "LIVE")
    controls = scene.controls(rig)
    assert "lead" not in drawn(bpy.types.RISORIUS_PT_character).text()
    rig.pose.bones["user_joint"].keyframe_insert("location", frame=1)
    assert "lead" not in drawn(bpy.types.RISORIUS_PT_character).text()
    rig.pose.bones["FACIAL_C_Jaw"].keyframe_insert("location", frame=1)
    shown = drawn(bpy.types.RISORIUS_PT_character).text()
    assert "Keys on joints of Small_rig lead" in shown
    assert "shears" not in shown
    rig.animation_data.action = None
    parents = [bpy.data.objects.new(name, None) for name in ("Long", "Turned")]
    for item in parents:
        bpy.context.scene.collection.objects.link(item)
    parents[0].scale, parents[1].rotation_euler = (1.0, 2.0, 0.5), (0.6, 0.4, 0.7)
    parents[1].parent, controls.parent = parents[0], parents[1]
    scene.update(controls)
    shown = drawn(bpy.types.RISORIUS_PT_character).text()
    assert "The parent of Small_controls shears it" in shown
    assert "lead" not in shown
