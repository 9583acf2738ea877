# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's vertices equal an independent skinning and morph of the same pose."""

import bpy
import numpy as np
import pytest
from support import scene
from support.faces import CONTROLS, small_face


@pytest.fixture(params=["AUTO", "LIVE", "KEYS"])
def mode(request):
    """The mode of the face: Direct mode, or posed bones with one of two kinds of shape keys.

    LIVE has one live shape key per mesh, KEYS has a shape key for each channel.
    """
    return request.param


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_vertices_equal_the_oracle_for_random_controls(mode, dna_file, seed):
    rig = scene.load(dna_file, mode)
    raw = np.random.default_rng(seed).random(len(CONTROLS)).astype(np.float32)
    bone = scene.face(rig)
    labels = scene.submodule("logic.base.names").unique_labels(CONTROLS)
    for label, value in zip(labels, raw, strict=True):
        bone[label] = float(value)
    scene.update(scene.controls(rig))
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_the_oracle_notices_a_wrong_pose(mode, dna_file):
    rig = scene.load(dna_file, mode)
    scene.set_controls(rig, jawOpen=1.0)
    raw = scene.raw_of(rig, dna_file)
    raw[0] = 0.98
    assert scene.error_against_oracle(rig, dna_file, raw) > scene.TOLERANCE


@pytest.mark.parametrize(
    "conventions",
    [
        {"axes": ("right", "front", "up")},
        {"axes": ("left", "up", "front"), "rotation_signs": (1, -1, 1)},
        {"axes": ("front", "left", "up"), "rotation_sequence": "zyx"},
        {"axes": ("right", "up", "back"), "rotation_sequence": "yzx", "rotation_unit": "radians"},
        {"translation_unit": "m"},
    ],
)
def test_every_convention_of_the_file(tmp_path, conventions):
    path = tmp_path / "other.dna"
    small_face(**conventions).save(str(path))
    rig = scene.load(path)
    scene.set_controls(rig, jawOpen=0.7, mouthCornerPullL=0.4, eyeLookUpL=0.6)
    assert scene.error_against_oracle(rig, path, scene.raw_of(rig, path)) < scene.TOLERANCE


def test_a_scene_in_centimetres(mode, dna_file):
    bpy.context.scene.unit_settings.scale_length = 0.01
    rig = scene.load(dna_file, mode)
    scene.set_controls(rig, jawOpen=0.7, mouthCornerPullR=1.0)
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw, unit_scale=0.01) < scene.TOLERANCE


def test_switching_the_mode_changes_no_vertex_and_keeps_edits(dna_file):
    rig = scene.load(dna_file, "KEYS")
    head = scene.meshes(rig)[0]
    block = head.data.shape_keys.key_blocks["pull_l"]
    block.points[5].co.x += 0.01
    scene.set_controls(rig, jawOpen=0.5, mouthCornerPullL=0.8)
    before = scene.snapshot(rig)
    for mode in ("LIVE", "KEYS", "LIVE"):
        assert bpy.ops.risorius.set_shape_mode(mode=mode) == {"FINISHED"}
        np.testing.assert_allclose(scene.snapshot(rig), before, atol=2e-6)
        scene.set_controls(rig, mouthCornerPullL=0.1)
        scene.set_controls(rig, mouthCornerPullL=0.8)
        np.testing.assert_allclose(scene.snapshot(rig), before, atol=2e-6)
    names = [k.name for k in head.data.shape_keys.key_blocks]
    assert names == ["Basis", "pull_l", "<channel sum>"]


def test_levels_of_detail(mode, dna_file):
    lods = (True, True) + (False,) * 6
    rig = scene.load(dna_file, mode, lods=lods)
    hidden = {i: m.hide_render for i, m in scene.meshes(rig).items()}
    assert hidden == {0: False, 1: False, 2: True}
    scene.set_controls(rig, jawOpen=0.8, mouthCornerPullL=0.5)
    assert bpy.ops.risorius.set_lod(lod=1) == {"FINISHED"}
    hidden = {i: m.hide_viewport for i, m in scene.meshes(rig).items()}
    assert hidden == {0: True, 1: True, 2: False}
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw, lod=1) < scene.TOLERANCE
    assert bpy.ops.risorius.set_lod(lod=0) == {"FINISHED"}
    assert scene.error_against_oracle(rig, dna_file, raw, lod=0) < scene.TOLERANCE


def test_faces_point_outwards_in_mirrored_files(tmp_path):
    for number, axes in enumerate((("right", "up", "front"), ("left", "up", "front"))):
        path = tmp_path / f"{number}.dna"
        small_face(axes=axes).save(str(path))
        head = scene.meshes(scene.load(path))[0]
        # In the coordinates of the file, the polygons of the head are counter-clockwise seen from
        # outside. If the file's axes are left-handed, the polygons are clockwise in space, and the
        # import must reverse them.
        normal = np.mean([p.normal[:] for p in head.data.polygons], axis=0)
        assert normal[1] < -0.3
