# SPDX-License-Identifier: GPL-3.0-or-later
"""Wrong weights, bones and values give the same result in Direct mode as in Live mode."""

import bpy
import numpy as np
import pytest
from support import both_ways, scene
from support.faces import small_face


def _pair(dna, tmp_path):
    dna.save(str(tmp_path / "face.dna"))
    pair = both_ways.Pair(tmp_path / "face.dna")
    pair.set(jawOpen=0.5, eyeLookUpL=0.4)
    return pair


def test_weights_that_do_not_sum_to_one(tmp_path):
    """Weights that do not sum to 1 have the same effect in both modes.

    The DNA file or the user may set such weights; Blender divides them by their sum.
    """
    dna = small_face()
    mesh = dna.meshes[0]
    weights = np.array(mesh.skin_weights)
    weights[:60] *= 0.3
    weights[60:120] *= 1.7
    mesh.skin_weights = weights
    pair = _pair(dna, tmp_path)
    assert both_ways.is_direct(pair.direct)
    pair.check()

    def paint(_rig, head):
        head.vertex_groups[1].add(range(30), 0.05, "REPLACE")
        head.vertex_groups[0].add(range(20, 60), 1.0, "ADD")
        head.data.update_tag()

    pair.edit(paint)
    assert both_ways.is_direct(pair.direct)
    pair.check()


def test_vertices_without_weights(tmp_path):
    pair = _pair(small_face(), tmp_path)

    def clear(_rig, head):
        for group in head.vertex_groups:
            group.remove(range(25))
        for group in head.vertex_groups:
            group.add(range(25, 40), 0.0, "REPLACE")
        head.data.update_tag()

    pair.edit(clear)
    assert both_ways.is_direct(pair.direct)
    pair.check()


def test_groups_of_no_bone_and_of_a_bone_that_does_not_deform(tmp_path):
    pair = _pair(small_face(), tmp_path)

    def add(rig, head):
        head.vertex_groups.new(name="mine").add(range(50), 1.0, "REPLACE")
        rig.data.bones["user_joint"].use_deform = False

    pair.edit(add)
    pair.check()


@pytest.mark.parametrize("scale", [(0.0, 0.0, 0.0), (1.0, 0.0, 2.0), (1e-9, 1e-9, 1e-9)])
def test_a_bone_of_no_size(tmp_path, scale):
    """A script scales a joint that no control moves to 0 along one or all axes, or nearly to 0."""
    pair = _pair(small_face(), tmp_path)
    for rig in pair.each():
        rig.pose.bones["user_joint"].scale = scale
        rig.update_tag()
    both_ways.settle()
    pair.check()
    assert np.isfinite(scene.snapshot(pair.direct)).all()


def test_a_joint_that_the_file_gives_no_size(tmp_path):
    """The DNA file scales the jaw joint to 0 if the control jawOpen is 1."""
    dna = small_face()
    group = dna.joint_groups[0]
    values = np.array(group.values)
    values[6:] = 0.0
    values[6:, 0] = -1.0
    group.values = values
    pair = _pair(dna, tmp_path)
    pair.set(jawOpen=1.0)
    assert pair.apart() < both_ways.NEAR
    assert np.isfinite(scene.snapshot(pair.direct)).all()
    pair.check()


def test_a_slider_that_is_no_number(tmp_path):
    pair = _pair(small_face(), tmp_path)
    for value in (float("nan"), float("inf"), float("-inf"), -3.0):
        pair.set(jawOpen=value)
        for points in (scene.snapshot(rig) for rig in pair.each()):
            assert np.isfinite(points).all(), value
        assert pair.apart() < both_ways.NEAR, value
    pair.check()
    assert both_ways.is_direct(pair.direct)


def test_an_added_and_a_renamed_bone(tmp_path):
    """After bones were added or renamed, both modes use the bones' present names for weights."""
    pair = _pair(small_face(), tmp_path)
    for rig in pair.each():
        rig.hide_viewport = False
        rig.hide_set(False)
        bpy.context.view_layer.objects.active = rig
        bpy.ops.object.mode_set(mode="EDIT")
        added = rig.data.edit_bones.new("aaa")
        added.head, added.tail = (0.0, 0.0, 1.0), (0.0, 0.1, 1.0)
        added.parent = rig.data.edit_bones[0]
        bpy.ops.object.mode_set(mode="OBJECT")
        rig.data.bones["user_joint"].name = "renamed"
        rig.select_set(False)
        bpy.context.view_layer.objects.active = None
        both_ways.settle()
    pair.check()
