# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests characters in several scenes, hidden or excluded collections, instances, renders."""

import bpy
import numpy as np
import pytest
from support import scene

JAW = "CTRL_expressions.jawOpen"
HEAD = "head"


@pytest.fixture
def rig(dna_file, mode):
    """A face with keyframes of the jaw control and of the head bone at frames 1 and 10."""
    made = scene.load(dna_file, mode)
    bone, head = scene.face(made), scene.controls(made).pose.bones[HEAD]
    head.rotation_mode = "XYZ"
    for frame, value in ((1, 0.0), (10, 1.0)):
        bone[JAW] = value
        bone.keyframe_insert(f'["{JAW}"]', frame=frame)
        head.rotation_euler.x = value / 2
        head.keyframe_insert("rotation_euler", frame=frame)
    return made


def _play(rig, *frames):
    found = []
    for frame in frames:
        bpy.context.scene.frame_set(frame)
        found.append(scene.snapshot(rig))
    return found


@pytest.mark.parametrize("how", ["hide_viewport", "hide_set", "collection", "layer"])
def test_hidden_controls_still_move_the_face(rig, how):
    """A hidden control armature still moves the face, however it is hidden.

    Blender evaluates a hidden object only if a visible object depends on it.
    """
    wanted = _play(rig, 10, 1, 5)
    controls = scene.controls(rig)
    if how in ("collection", "layer"):
        home = bpy.data.collections.new("controls")
        bpy.context.scene.collection.children.link(home)
        for old in controls.users_collection:
            old.objects.unlink(controls)
        home.objects.link(controls)
        home.hide_viewport = how == "collection"
        bpy.context.view_layer.layer_collection.children["controls"].exclude = how == "layer"
    elif how == "hide_set":
        controls.hide_set(True)
    else:
        controls.hide_viewport = True
    for points, before in zip(_play(rig, 10, 1, 5), wanted, strict=True):
        np.testing.assert_allclose(points, before, atol=1e-6)


def _small_render(setup):
    setup.render.engine = "CYCLES"
    setup.cycles.samples, setup.cycles.device = 1, "CPU"
    setup.cycles.use_denoising = False
    setup.render.resolution_x = setup.render.resolution_y = 16
    setup.frame_start, setup.frame_end, setup.frame_step = 4, 10, 3
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    setup.collection.objects.link(camera)
    setup.camera = camera


def _rendered(rig, folder, setup):
    """Render frames, and read the blend shape channels meanwhile: frame -> values."""
    found = {}
    meshes = [m for _, m in sorted(scene.meshes(rig).items())]

    def look(_scene, depsgraph):
        joined = []
        for item in meshes:
            seen = item.evaluated_get(depsgraph)
            mesh = seen.to_mesh()
            flat = np.empty(len(mesh.vertices) * 3, np.float32)
            mesh.vertices.foreach_get("co", flat)
            seen.to_mesh_clear()
            world = np.array(seen.matrix_world)
            joined.append(flat.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3])
        channels.append((_scene.frame_current, list(rig["channels"])))
        found[_scene.frame_current] = np.concatenate(joined)

    channels = []
    setup.render.filepath = str(folder / "f_")
    bpy.app.handlers.frame_change_post.append(look)
    try:
        bpy.ops.render.render(animation=True, scene=setup.name)
    finally:
        bpy.app.handlers.frame_change_post.remove(look)
    return dict(channels)


def test_controls_hidden_in_renders_still_move_the_face(rig, tmp_path):
    setup = bpy.context.scene
    _small_render(setup)
    scene.controls(rig).hide_render = True
    channels = _rendered(rig, tmp_path, setup)
    assert channels[10][0] == pytest.approx(1.0)
    assert 0.1 < channels[4][0] < 0.5


def test_render_of_a_scene_that_is_not_open(rig, tmp_path):
    here = bpy.context.scene
    _small_render(here)
    bpy.context.window.scene = bpy.data.scenes.new("other")
    bpy.context.view_layer.update()
    channels = _rendered(rig, tmp_path, here)
    assert channels[10][0] == pytest.approx(1.0)
    assert 0.1 < channels[4][0] < 0.5


def test_saved_with_another_scene_open(rig, dna_file, tmp_path):
    """A character in a scene that is not shown is not updated; it is right when shown again."""
    wanted = _play(rig, 1, 10)
    bpy.context.window.scene = bpy.data.scenes.new("A other")
    bpy.context.view_layer.update()
    bpy.context.scene.frame_set(5)
    path = tmp_path / "two.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=str(path))
    bpy.context.scene.frame_set(3)
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    home = next(s for s in bpy.data.scenes if rig.name in s.objects)
    bpy.context.window.scene = home
    for points, before in zip(_play(rig, 1, 10), wanted, strict=True):
        np.testing.assert_allclose(points, before, atol=1e-6)
    raw = scene.raw_of(rig, dna_file)
    assert raw[0] == pytest.approx(1.0)


def test_one_character_in_two_scenes(rig):
    wanted = _play(rig, 1, 10)
    here, there = bpy.context.scene, bpy.data.scenes.new("there")
    there.collection.children.link(here.collection.children[0])
    for open_scene in (there, here, there):
        bpy.context.window.scene = open_scene
        bpy.context.view_layer.update()
        for points, before in zip(_play(rig, 1, 10), wanted, strict=True):
            np.testing.assert_allclose(points, before, atol=1e-6)


def test_two_view_layers(rig):
    wanted = _play(rig, 10, 1)
    layer = bpy.context.scene.view_layers.new("second")
    layer.layer_collection.children[0].exclude = True
    for points, before in zip(_play(rig, 10, 1), wanted, strict=True):
        np.testing.assert_allclose(points, before, atol=1e-6)


def test_excluded_and_back(rig):
    wanted = _play(rig, 1)[0]
    _play(rig, 10)
    layer = bpy.context.view_layer.layer_collection.children[0]
    layer.exclude = True
    bpy.context.scene.frame_set(1)
    layer.exclude = False
    bpy.context.view_layer.update()
    np.testing.assert_allclose(scene.snapshot(rig), wanted, atol=1e-6)


def test_instance_of_the_collection_shows_the_face(rig):
    wanted = {f: p for f, p in zip((1, 10), _play(rig, 1, 10), strict=True)}
    instance = bpy.data.objects.new("instance", None)
    instance.instance_type = "COLLECTION"
    instance.instance_collection = bpy.context.scene.collection.children[0]
    instance.location.x = 2.0
    bpy.context.scene.collection.objects.link(instance)
    bpy.context.view_layer.layer_collection.children[0].exclude = True
    names = [m.name for _, m in sorted(scene.meshes(rig).items())]
    for frame in (10, 1):
        bpy.context.scene.frame_set(frame)
        shown = {}
        for one in bpy.context.evaluated_depsgraph_get().object_instances:
            if one.is_instance and one.object.original.name in names:
                mesh = one.object.to_mesh()
                points = np.array([v.co[:] for v in mesh.vertices])
                world = np.array(one.matrix_world)
                shown[one.object.original.name] = points @ world[:3, :3].T + world[:3, 3]
        points = np.concatenate([shown[n] for n in names])
        np.testing.assert_allclose(points - [2.0, 0.0, 0.0], wanted[frame], atol=1e-5)
