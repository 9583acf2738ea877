# SPDX-License-Identifier: GPL-3.0-or-later
"""Each frame depends only on its controls: playback, scrubbing, rendering, NLA, drivers."""

import bpy
import numpy as np
import pytest
import risorius
from support import pictures, scene
from support.animation import animate

FRAMES = (1, 4, 7, 10)


@pytest.fixture(params=["AUTO", "LIVE", "KEYS"])
def mode(request):
    """The mode of the face: Direct mode, or posed bones with one of two kinds of shape keys.

    LIVE has one live shape key per mesh, KEYS has a shape key for each channel.
    """
    return request.param


def _play(rig, frames):
    found = {}
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        found[frame] = scene.snapshot(rig)
    return found


def _curves(action):
    if hasattr(action, "fcurves") and len(getattr(action, "fcurves", ())):
        return list(action.fcurves)
    return list(action.layers[0].strips[0].channelbags[0].fcurves)


def test_playback_follows_the_curves(mode, dna_file):
    rig = scene.load(dna_file, mode)
    controls = animate(rig, with_head=False)
    for frame in FRAMES:
        bpy.context.scene.frame_set(frame)
        raw = np.zeros(len(risorius.load(str(dna_file)).raw_control_names), np.float32)
        for curve in _curves(controls.animation_data.action):
            for index, end in ((0, "jawOpen"), (1, "mouthCornerPullL"), (6, "eyeLookUpL")):
                if curve.data_path.endswith(f'.{end}"]'):
                    raw[index] = curve.evaluate(frame)
        assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_backwards_equals_forwards(mode, dna_file):
    rig = scene.load(dna_file, mode)
    animate(rig)
    forwards, backwards = _play(rig, FRAMES), _play(rig, reversed(FRAMES))
    for frame in FRAMES:
        np.testing.assert_array_equal(forwards[frame], backwards[frame])
    assert np.abs(forwards[1] - forwards[4]).max() > 1e-3


def test_two_characters_do_not_disturb_each_other(mode, dna_file):
    first, second = scene.load(dna_file, mode), scene.load(dna_file, mode)
    animate(first)
    alone = scene.snapshot(second)
    played = _play(first, FRAMES)
    np.testing.assert_array_equal(scene.snapshot(second), alone)
    scene.set_controls(second, jawOpen=1.0)
    assert np.abs(scene.snapshot(second) - alone).max() > 1e-3
    np.testing.assert_array_equal(scene.snapshot(first), played[10])


def test_nla_strip_on_the_controls(mode, dna_file):
    rig = scene.load(dna_file, mode)
    controls = animate(rig)
    wanted = _play(rig, FRAMES)
    data = controls.animation_data
    action = data.action
    strip = data.nla_tracks.new().strips.new("strip", 1, action)
    if hasattr(strip, "action_slot") and strip.action_slot is None:
        strip.action_slot = action.slots[0]
    data.action = None
    for name in scene.face(rig).keys():  # noqa: SIM118
        scene.face(rig)[name] = 0.0
    for frame, points in _play(rig, FRAMES).items():
        np.testing.assert_allclose(points, wanted[frame], atol=1e-6)


def test_driver_on_a_control(mode, dna_file):
    rig = scene.load(dna_file, mode)
    empty = bpy.data.objects.new("hand", None)
    bpy.context.collection.objects.link(empty)
    curve = scene.face(rig).driver_add('["CTRL_expressions.jawOpen"]')
    curve.driver.type = "SUM"
    variable = curve.driver.variables.new()
    variable.targets[0].id, variable.targets[0].data_path = empty, "location.x"
    empty.location.x = 0.75
    scene.update(empty)
    raw = np.zeros(11, np.float32)
    raw[0] = 0.75
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_action_of_one_character_plays_on_another(mode, dna_file, tmp_path):
    rig = scene.load(dna_file, mode)
    controls = animate(rig)
    wanted = _play(rig, FRAMES)
    other = scene.load(dna_file, mode)
    data = scene.controls(other).animation_data_create()
    data.action = controls.animation_data.action
    if hasattr(data, "action_slot"):
        data.action_slot = controls.animation_data.action_slot
    scene.controls(other).pose.bones["head"].rotation_mode = "XYZ"
    beside = np.array(scene.controls(other).location)
    for frame, points in _play(other, FRAMES).items():
        np.testing.assert_allclose(points - beside, wanted[frame], atol=1e-6)


def test_key_on_a_joint_of_the_users_survives(mode, dna_file):
    rig = scene.load(dna_file, mode)
    animate(rig)
    bone = next(b for b in rig.pose.bones if b.bone["dna_joint"] == 5)
    euler = next(b for b in rig.pose.bones if b.bone["dna_joint"] == 6)
    euler.rotation_mode = "XYZ"
    for frame, x in ((1, 0.0), (10, 0.09)):
        bone.location = (x, 0, 0)
        bone.keyframe_insert("location", frame=frame)
        euler.rotation_euler = (x, 0, 0)
        euler.keyframe_insert("rotation_euler", frame=frame)
    curves = {c.data_path: c for c in _curves(rig.animation_data.action) if c.array_index == 0}
    for frame in (1, 6, 10, 3):
        bpy.context.scene.frame_set(frame)
        seen = rig.evaluated_get(bpy.context.evaluated_depsgraph_get()).pose.bones
        wanted = [c.evaluate(frame) for p, c in sorted(curves.items())]
        assert seen[bone.name].location.x == pytest.approx(wanted[0], abs=1e-6)
        assert seen[euler.name].rotation_euler.x == pytest.approx(wanted[1], abs=1e-6)


def test_what_the_user_poses_by_hand_survives_a_slider(dna_file):
    rig = scene.load(dna_file)
    bone = next(b for b in rig.pose.bones if b.bone["dna_joint"] == 5)
    bone.location.x = 0.07
    scene.update(rig)
    scene.set_controls(rig, jawOpen=0.5)
    assert bone.location.x == pytest.approx(0.07)


def _render_scene():
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler = (0, -0.6, 1.58), (np.pi / 2, 0, 0)
    bpy.context.scene.collection.objects.link(camera)
    setup = pictures.small_render(camera)
    setup.frame_start, setup.frame_end = 1, 10
    return setup


def test_rendered_animation_equals_single_frames(mode, dna_file, tmp_path):
    rig = scene.load(dna_file, mode)
    animate(rig)
    setup = _render_scene()
    setup.frame_step = 3
    setup.render.filepath = str(tmp_path / "all_")
    bpy.ops.render.render(animation=True)
    animated = {f: pictures.pixels(tmp_path / f"all_{f:04d}.png") for f in FRAMES}
    for frame in reversed(FRAMES):
        setup.frame_set(frame)
        alone = pictures.render(tmp_path / f"one_{frame}.png")
        np.testing.assert_allclose(alone, animated[frame], atol=1.5 / 255)
    assert np.abs(animated[1] - animated[4]).max() > 0.05


def test_maps_reach_the_materials(mode, dna_file):
    rig = scene.load(dna_file, mode)
    scene.set_controls(rig, jawOpen=0.6, browDownL=0.5)
    np.testing.assert_allclose(list(rig["maps"]), [0.6, 0.25], atol=1e-6)
    bpy.context.view_layer.update()
    material = scene.meshes(rig)[0].data.materials[0]
    seen = material.evaluated_get(bpy.context.evaluated_depsgraph_get()).node_tree.nodes
    values = [seen[f"risorius_map_{i:03d}"].outputs[0].default_value for i in range(2)]
    np.testing.assert_allclose(values, [0.6, 0.25], atol=1e-6)
