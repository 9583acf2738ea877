# SPDX-License-Identifier: GPL-3.0-or-later
"""After an import the 3D views of the window show the face."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector
from support import looks, scene
from support.faces import small_face


def _area():
    return next(a for a in bpy.context.window.screen.areas if a.type == "VIEW_3D")


def _view():
    return _area().spaces.active.region_3d


def _state():
    view = _view()
    return (*view.view_location, view.view_distance, *view.view_rotation)


def _on_screen(points):
    """Coordinates of points in the region of the 3D view, float64[N, 2].

    (0, 0) is the lower left corner of the region, (1, 1) the upper right corner. A temporary camera
    with the place, rotation and lens of the view projects the points.
    """
    area, view = _area(), _view()
    region = next(r for r in area.regions if r.type == "WINDOW")
    data = bpy.data.cameras.new("view")
    data.lens = area.spaces.active.lens
    data.sensor_width, data.sensor_fit = 72.0, "AUTO"  # twice a render's
    camera = bpy.data.objects.new("view", data)
    turn = view.view_rotation.to_matrix()
    camera.matrix_world = turn.to_4x4()
    camera.matrix_world.translation = view.view_location + turn @ Vector((0, 0, view.view_distance))
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = region.width, region.height
    seen = [world_to_camera_view(bpy.context.scene, camera, Vector(p)) for p in points]
    bpy.data.cameras.remove(data)
    return np.array([p[:2] for p in seen])


def _corners(item):
    return [item.matrix_world @ Vector(c) for c in item.bound_box]


@pytest.fixture
def window(monkeypatch):
    """Let the import operator believe that Blender has a window, although the test has none."""
    fake = SimpleNamespace(app=SimpleNamespace(background=False))
    monkeypatch.setattr(scene.submodule("ui.file.import_operators"), "bpy", fake)


def test_nothing_moves_in_the_background(dna_file):
    before = _state()
    scene.load(dna_file)
    assert _state() == before


@pytest.mark.parametrize("unit", [1.0, 0.01])
def test_the_head_is_whole_and_large(window, unit, tmp_path):
    bpy.context.scene.unit_settings.scale_length = unit
    face = small_face()
    body = looks.copy_mesh(face.meshes[0], (0.0, -90.0, 0.0), 6.0)
    looks.set_meshes(face, {"head_lod0_mesh": face.meshes[0], "body_lod0_mesh": body})
    path = tmp_path / "face.dna"
    face.save(str(path))
    rig = scene.load(path)
    seen = _on_screen(_corners(scene.meshes(rig)[0]))
    assert seen.min() > 0.0
    assert seen.max() < 1.0
    assert np.ptp(seen[:, 1]) > 0.4
    assert np.abs(seen.mean(axis=0) - 0.5).max() < 0.1


def test_a_view_that_shows_it_or_looks_through_a_camera_stays(window, dna_file):
    first = scene.load(dna_file)
    scene.controls(first).location.y = 50.0  # the next face is placed at its old place
    scene.update()
    view = _view()
    view.view_distance *= 1.3
    view.view_location.x += 0.01
    before = _state()
    scene.load(dna_file)
    assert _state() == before
    view.view_perspective, view.view_distance = "CAMERA", 50.0
    before = _state()
    scene.load(dna_file)
    assert _state() == before
    view.view_perspective = "ORTHO"
    scene.load(dna_file)
    assert view.view_distance < 5.0


def test_a_profile_is_shown_from_the_front_and_a_straight_view_keeps_its_direction(
    window, dna_file
):
    view = _view()
    front = Vector((0.0, -1.0, 0.0))
    for perspective, direction, kept in (
        ("PERSP", (1.0, 0.0, 0.3), False),  # the direction of a new file's view
        ("PERSP", (-0.4, -1.0, 0.3), True),
        ("ORTHO", (1.0, 0.0, 0.0), True),
    ):
        view.view_perspective, view.view_location = perspective, (50.0, 0.0, 0.0)
        view.view_rotation = Vector(direction).to_track_quat("Z", "Y")
        before = view.view_rotation @ Vector((0.0, 0.0, 1.0))
        scene.load(dna_file)
        after = view.view_rotation @ Vector((0.0, 0.0, 1.0))
        assert (after == before) is kept
        assert kept or after.dot(front) > 0.9


def test_a_solid_view_in_default_colours_shows_the_textures(window, dna_file):
    shading = _area().spaces.active.shading
    shading.type = "SOLID"
    for before, option, after in (
        ("MATERIAL", False, "MATERIAL"),
        ("OBJECT", True, "OBJECT"),
        ("MATERIAL", True, "TEXTURE"),
    ):
        shading.color_type = before
        scene.load(dna_file, use_frame_view=option)
        assert shading.color_type == after


def test_not_when_it_is_not_wanted_or_several_come(window, dna_file, tmp_path):
    before = _state()
    scene.load(dna_file, use_frame_view=False)
    assert _state() == before
    other = tmp_path / "other.dna"
    other.write_bytes(dna_file.read_bytes())
    named = [{"name": dna_file.name}, {"name": other.name}]
    bpy.ops.risorius.import_dna(directory=str(tmp_path), files=named)
    assert _state() == before


def test_undo_takes_the_face_and_leaves_the_view(window, dna_file):
    bpy.ops.ed.undo_push(message="before")
    scene.load(dna_file)
    bpy.ops.ed.undo_push(message="imported")
    framed = _state()
    bpy.ops.ed.undo()
    assert not [o for o in bpy.data.objects if "risorius_controls" in o]
    assert _state() == framed
    bpy.ops.ed.redo()
    assert _state() == framed


def test_frame_face_shows_the_head_whatever_is_selected_and_keeps_the_direction(dna_file):
    rig = scene.load(dna_file)
    view, item = _view(), scene.meshes(rig)[0]
    for perspective, direction in (("PERSP", (1.0, 0.2, 0.1)), ("ORTHO", (0.0, 0.0, 1.0))):
        for selected in (scene.controls(rig), item):
            bpy.context.view_layer.objects.active = selected
            view.view_perspective = perspective
            view.view_location, view.view_distance = (9.0, 9.0, 9.0), 70.0
            view.view_rotation = Vector(direction).to_track_quat("Z", "Y")
            turn = view.view_rotation.copy()
            assert bpy.ops.risorius.frame_face() == {"FINISHED"}
            assert view.view_rotation.rotation_difference(turn).angle < 1e-3
            if perspective == "PERSP":
                seen = _on_screen(_corners(item))
                assert seen.min() > 0.0
                assert seen.max() < 1.0
                assert np.ptp(seen, axis=0).max() > 0.4
    view.view_perspective = "CAMERA"
    assert bpy.ops.risorius.frame_face() == {"FINISHED"}
    assert view.view_perspective == "PERSP"
    _area().spaces.active.lock_object = item
    before = _state()
    assert bpy.ops.risorius.frame_face() == {"CANCELLED"}
    assert _state() == before
