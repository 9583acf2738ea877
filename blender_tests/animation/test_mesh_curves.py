# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that a moving mesh with the vertices of a face gives curves of the face's controls."""

import bpy
import numpy as np
import pytest
import risorius
from support import oracle, scene

FRAMES = range(1, 9)
MOVED = {"jawOpen": 0.8, "mouthCornerPullL": 0.6}


@pytest.fixture
def rig(dna_file):
    return scene.load(dna_file, "LIVE")


def wanted(path, frame):
    """The head's vertices in Blender's space at a frame; the controls of MOVED rise from 0."""
    dna = risorius.load(str(path))
    raw = np.zeros(len(dna.raw_control_names), np.float32)
    for name, most in MOVED.items():
        raw[dna.raw_control_names.index(f"CTRL_expressions.{name}")] = most * (frame - 1) / 7
    return oracle.vertices(dna, 0, risorius.Rig(dna).evaluate(raw))


def add_mesh(points, name="Take"):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(points, [], [])
    item = bpy.data.objects.new(name, mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


def performer(path, change=lambda points: points):
    """An object that shows the vertices of `wanted` at each frame by a shape key for each frame.

    Args:
        path: path of the DNA file.
        change: function that changes the vertices of each frame, such as a rotation.
    """
    rest = change(wanted(path, 1))
    item = add_mesh(rest)
    item.shape_key_add(name="Basis")
    for frame in FRAMES:
        block = item.shape_key_add(name=f"frame {frame}")
        block.data.foreach_set("co", change(wanted(path, frame)).astype(np.float32).ravel())
        for key, value in ((frame - 1, 0.0), (frame, 1.0), (frame + 1, 0.0)):
            block.value = value
            block.keyframe_insert("value", frame=key)
    return item


def solve(rig, **options):
    bpy.context.view_layer.objects.active = scene.controls(rig)
    given = {"source": "Take", "first": 1, "last": 8, **options}
    return bpy.ops.risorius.curves_from_mesh(**given)


def shown(rig, frame):
    bpy.context.scene.frame_set(frame)
    return scene.evaluated(scene.meshes(rig)[0])


def test_shape_keys_become_curves_that_repeat_them(rig, dna_file):
    performer(dna_file)
    assert solve(rig, use_colour=True) == {"FINISHED"}
    for frame in (1, 4, 8):
        assert np.abs(shown(rig, frame) - wanted(dna_file, frame)).max() < 1e-4  # 0.1 mm
        for name, most in MOVED.items():
            value = scene.face(rig)[f"CTRL_expressions.{name}"]
            assert value == pytest.approx(most * (frame - 1) / 7, abs=0.02)
    report = scene.controls(rig).animation_data.action["risorius_report"]
    assert "Left over: 0.00" in report
    colours = scene.meshes(rig)[0].data.color_attributes["risorius_residual"]
    found = np.empty(len(colours.data) * 4, np.float32)
    colours.data.foreach_get("color", found)
    cold = found.reshape(-1, 4)
    assert np.ptp(cold, axis=0).max() < 0.05  # no residual remains
    assert cold[0, 2] > cold[0, 1]


def test_what_cannot_be_repeated_is_told_and_hot(rig, dna_file):
    def bumped(points):
        points = points.copy()
        points[5] += (0.0, 0.0, 0.02)
        return points

    performer(dna_file, bumped)
    assert solve(rig, use_colour=True) == {"FINISHED"}
    report = scene.controls(rig).animation_data.action["risorius_report"]
    assert float(report.partition("at most ")[2].split()[0]) == pytest.approx(20, abs=4)
    colours = scene.meshes(rig)[0].data.color_attributes["risorius_residual"]
    red = [point.color[0] for point in colours.data]
    assert int(np.argmax(red)) == 5


def test_another_face_gives_its_movement_as_a_layer(rig, dna_file):
    rest = wanted(dna_file, 1)

    def other(points):
        return points - rest + rest * (1.0, 1.1, 1.0)

    performer(dna_file, other)
    assert solve(rig, use_relative=True, target="LAYER") == {"FINISHED"}
    apart = np.abs(shown(rig, 8) - wanted(dna_file, 8)).max()
    assert apart < 0.05 * np.abs(wanted(dna_file, 8) - rest).max()


def test_the_scene_stays_where_it_was(rig, dna_file):
    performer(dna_file)
    bpy.context.scene.frame_set(3)
    assert solve(rig) == {"FINISHED"}
    assert bpy.context.scene.frame_current == 3


def test_an_empty_scene_says_what_is_missing(rig):
    bpy.context.view_layer.objects.active = scene.controls(rig)
    assert not bpy.ops.risorius.curves_from_mesh.poll()
    add_mesh([(0, 0, 0), (1, 0, 0)])
    assert not bpy.ops.risorius.curves_from_mesh.poll()


def test_a_modifier_that_adds_vertices_is_one_sentence(rig, dna_file):
    item = performer(dna_file)
    item.modifiers.new("Array", "ARRAY")
    with pytest.raises(RuntimeError, match="Take: a modifier changes its number of vertices"):
        solve(rig)
    assert scene.controls(rig).animation_data is None
    with pytest.raises(RuntimeError, match="1 to 20000 frames were expected, found 0"):
        solve(rig, first=5, last=4)


def test_a_solve_ends_when_it_is_told_to(rig, dna_file):
    item = performer(dna_file)
    curves = scene.submodule("scene.animation.mesh_curves")
    frames = np.tile(wanted(dna_file, 4).astype(np.float32), (40, 1, 1))
    options = {"relative": False, "sparse": 1.0, "smooth": 1.0}
    task = curves.MeshCurvesTask(rig, item, frames, 24.0, **options)
    task.cancel()
    task.run()
    assert task.result is None
    assert "cancelled" in str(task.error)
