# SPDX-License-Identifier: GPL-3.0-or-later
"""Levels of detail: chosen for viewport and renders, or by distance.

Objects that the user hides stay hidden at every level.
"""

import bpy
import numpy as np
import pytest
from support import pictures, scene

BOTH = (True, True) + (False,) * 6


def _load(dna_file, mode="AUTO"):
    return scene.load(dna_file, mode, lods=BOTH)


def _shown(rig, flag="hide_viewport"):
    return {i for i, m in scene.meshes(rig).items() if not getattr(m, flag)}


def _camera(distance):
    """Add a camera for the scene at this distance, in Blender units, in front of the head bone."""
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    head = scene.controls(rig).pose.bones["head"].head
    camera.location = (head.x, head.y - distance, head.z)
    camera.rotation_euler = (np.pi / 2, 0, 0)
    bpy.context.view_layer.update()
    return camera


def test_only_the_chosen_levels_are_built(dna_file):
    assert set(scene.meshes(scene.load(dna_file, lods=(False, True) + (False,) * 6))) == {2}


def test_viewport_and_render_have_levels_of_their_own(mode, dna_file):
    rig = _load(dna_file, mode)
    scene.set_controls(rig, jawOpen=0.8, mouthCornerPullL=0.5)
    assert bpy.ops.risorius.set_lod(lod=1, target="VIEWPORT") == {"FINISHED"}
    assert (_shown(rig), _shown(rig, "hide_render")) == ({2}, {0, 1})
    assert bpy.ops.risorius.set_lod(lod=1, target="RENDER") == {"FINISHED"}
    assert bpy.ops.risorius.set_lod(lod=0, target="VIEWPORT") == {"FINISHED"}
    assert (_shown(rig), _shown(rig, "hide_render")) == ({0, 1}, {2})
    assert bpy.ops.risorius.set_lod(lod=-1, target="RENDER") == {"FINISHED"}
    assert _shown(rig, "hide_render") == {0, 1}
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_a_render_shows_its_level_and_the_viewport_keeps_its_own(mode, dna_file, tmp_path):
    rig = _load(dna_file, mode)
    scene.set_controls(rig, jawOpen=0.8, mouthCornerPullL=0.5)
    pictures.small_render(_camera(0.5))
    bpy.ops.risorius.set_lod(lod=1, target="BOTH")
    wanted = pictures.render(tmp_path / "wanted.png")
    bpy.ops.risorius.set_lod(lod=0, target="BOTH")
    other = pictures.render(tmp_path / "other.png")
    assert np.abs(wanted - other).max() > 0.05
    bpy.ops.risorius.set_lod(lod=1, target="RENDER")
    before = scene.snapshot(rig)
    found = pictures.render(tmp_path / "found.png")
    np.testing.assert_allclose(found, wanted, atol=1.5 / 255)
    np.testing.assert_array_equal(scene.snapshot(rig), before)
    assert _shown(rig) == {0, 1}
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_what_the_user_hid_stays_hidden(dna_file):
    rig = _load(dna_file)
    teeth = scene.meshes(rig)[1]
    teeth.hide_viewport = teeth.hide_render = True
    for lod in (1, 0):
        bpy.ops.risorius.set_lod(lod=lod)
    assert (_shown(rig), _shown(rig, "hide_render")) == ({0}, {0})
    teeth.hide_viewport = teeth.hide_render = False
    for lod in (1, 0):
        bpy.ops.risorius.set_lod(lod=lod)
    assert (_shown(rig), _shown(rig, "hide_render")) == ({0, 1}, {0, 1})


def test_the_distance_chooses_with_hysteresis_in_the_viewport(mode, dna_file):
    rig = _load(dna_file, mode)
    camera = _camera(1.0)
    assert bpy.ops.risorius.set_lod_by_distance(enable=True) == {"FINISHED"}
    limit = rig["risorius_lod_distances"][0]
    head = camera.location.y + 1.0
    found = []
    for share in (0.5, 1.05, 1.15, 0.95, 0.85):
        camera.location.y = head - limit * share
        scene.update(camera)
        bpy.context.view_layer.update()
        found.append(min(_shown(rig)))
    assert found == [0, 0, 2, 2, 0]
    scene.set_controls(rig, jawOpen=0.7)
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


@pytest.mark.parametrize("order", [(1, 2, 3), (3, 2, 1), (2,)])
def test_renders_take_the_level_of_the_distance_alone(dna_file, tmp_path, order):
    """The level of detail in renders depends only on the distance at the rendered frame.

    At frame 2 the distance is slightly above the limit of a level. There the viewport keeps the
    level of the frame that was shown before, but a render must not.
    """
    rig = _load(dna_file)
    camera = _camera(1.0)
    pictures.small_render(camera)
    camera.data.angle = 0.12  # the distant face fills the picture
    scene.set_controls(rig, jawOpen=0.6)
    bpy.ops.risorius.set_lod(lod=1)
    bpy.ops.risorius.set_lod_by_distance(enable=True)
    limit, head = rig["risorius_lod_distances"][0], camera.location.y + 1.0
    for frame, share in ((1, 0.5), (2, 1.05), (3, 2.0)):
        camera.location.y = head - limit * share
        camera.keyframe_insert("location", frame=frame)
    for frame in order:
        bpy.context.scene.frame_set(frame)
        found = pictures.render(tmp_path / f"{frame}.png")
        if frame == 2:
            by_distance = found
    bpy.ops.risorius.set_lod(lod=1)
    bpy.context.scene.frame_set(2)
    wanted = pictures.render(tmp_path / "wanted.png")
    np.testing.assert_allclose(by_distance, wanted, atol=1.5 / 255)
    bpy.ops.risorius.set_lod(lod=0)
    other = pictures.render(tmp_path / "other.png")
    assert np.abs(other - wanted).max() > 0.02
