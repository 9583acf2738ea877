# SPDX-License-Identifier: GPL-3.0-or-later
"""The studio: camera, three lights and a backdrop, scaled and placed by the head."""

import bpy
import numpy as np
import pytest
from bpy_extras.object_utils import world_to_camera_view
from mathutils import Vector
from support import scene
from support.layout import drawn

OURS = ["CAMERA", "LIGHT", "LIGHT", "LIGHT", "MESH"]


@pytest.fixture
def rig(dna_file):
    rig = scene.load(dna_file)
    bpy.context.view_layer.objects.active = scene.controls(rig)
    return rig


def _add(**options):
    before = set(bpy.data.collections)
    assert bpy.ops.risorius.add_studio(**options) == {"FINISHED"}
    return next(c for c in bpy.data.collections if c not in before)


def _camera(collection):
    return next(o for o in collection.objects if o.type == "CAMERA")


def _seen(rig, camera):
    """Corners of the bounding boxes of a face's meshes as the camera sees them, float64[N, 3].

    x and y are (0, 0) at the lower left corner of the picture and (1, 1) at the upper right; z is
    the distance from the camera.
    """
    corners = [m.matrix_world @ Vector(c) for m in scene.meshes(rig).values() for c in m.bound_box]
    return np.array([world_to_camera_view(bpy.context.scene, camera, c) for c in corners])


def test_all_of_it_is_in_a_collection_of_its_own(rig):
    collection = _add()
    assert sorted(o.type for o in collection.objects) == OURS
    assert collection.name in bpy.context.scene.collection.children
    assert all(o.users_collection == (collection,) for o in collection.objects)
    assert all(o.parent is None for o in collection.objects)


def test_the_face_fills_the_picture_from_the_front(rig):
    camera = _camera(_add())
    for width, height in ((100, 100), (192, 108), (108, 192)):
        bpy.context.scene.render.resolution_x = width
        bpy.context.scene.render.resolution_y = height
        seen = _seen(rig, camera)
        assert seen[:, 1].max() < 1.0
        assert np.ptp(seen[:, 1].clip(0, 1)) > 0.4
        assert abs(seen[:, 0].mean() - 0.5) < 0.2
        assert (seen[:, 2] > camera.data.clip_start).all()


def test_it_stands_where_the_face_does(rig):
    straight = _seen(rig, _camera(_add()))
    controls = scene.controls(rig)
    controls.location, controls.rotation_euler = (3.0, -2.0, 1.0), (0.0, 0.0, 1.1)
    controls.scale = (2.0, 2.0, 2.0)
    scene.update(controls)
    moved = _add()
    assert np.abs(_seen(rig, _camera(moved))[:, :2] - straight[:, :2]).max() < 1e-3
    first = bpy.data.collections[moved.name.rpartition(".")[0]]
    watts = [sorted(o.data.energy for o in c.objects if o.type == "LIGHT") for c in (first, moved)]
    assert watts[1] == pytest.approx([4 * w for w in watts[0]], rel=1e-4)


def _own_camera():
    own = bpy.data.objects.new("own", bpy.data.cameras.new("own"))
    bpy.context.scene.collection.objects.link(own)
    bpy.context.scene.camera = own
    return own


def test_a_render_shows_the_portrait_and_the_camera_of_before_is_kept(rig, capfd):
    own = _own_camera()
    made = _camera(_add())
    assert bpy.context.scene.camera == made
    assert "own was the scene's camera and is kept" in capfd.readouterr().out
    assert own.name in bpy.context.scene.objects
    assert _camera(_add(use_scene_camera=False)) != bpy.context.scene.camera == made
    bpy.context.scene.camera = None
    taken = _camera(_add(use_scene_camera=False))
    assert bpy.context.scene.camera == taken
    bpy.context.scene.timeline_markers.new("cut", frame=5).camera = own
    _add()
    assert "The marker cut gives the scene another camera" in capfd.readouterr().out


def test_nothing_else_of_the_scene_changes(rig):
    def others():
        view, world = bpy.context.scene.view_settings, bpy.context.scene.world
        found = {k: v for k, v in scene.counts().items() if k not in made}
        return found, world, view.view_transform, bpy.context.scene.render.engine, _state(rig)

    made = ("objects", "collections", "cameras", "lights", "meshes", "materials")
    before = others()
    _add()
    assert others() == before


def _state(rig):
    active = bpy.context.view_layer.objects.active
    return active.name, [o.name for o in bpy.context.selected_objects], scene.snapshot(rig).sum()


def test_one_undo_takes_it_away(rig):
    own = _own_camera().name
    before = scene.counts()
    bpy.ops.ed.undo_push(message="before")
    _add()
    bpy.ops.ed.undo_push(message="studio")
    bpy.ops.ed.undo()
    assert scene.counts() == before
    assert bpy.context.scene.camera.name == own


def test_with_a_new_face_only_where_it_is_wanted(monkeypatch, dna_file):
    native = scene.submodule("native")
    monkeypatch.setattr(native, "bundled_sample", lambda person: dna_file)
    _own_camera()
    assert bpy.ops.risorius.add_character() == {"FINISHED"}
    assert [o.name for o in bpy.data.objects if o.type in {"CAMERA", "LIGHT"}] == ["own"]
    assert bpy.ops.risorius.add_character(use_studio=True) == {"FINISHED"}
    made = [c for c in bpy.data.collections if c.name.endswith("_studio")]
    assert [sorted(o.type for o in c.objects) for c in made] == [OURS]
    assert bpy.context.scene.camera == _camera(made[0])
    assert len([o for o in bpy.data.objects if "risorius_controls" in o]) == 2


def test_the_menus_offer_each_person_with_a_studio_and_without():
    menus = scene.submodule("ui.file.import_operators")
    people = bpy.ops.risorius.add_character.get_rna_type().properties["person"].enum_items
    with_studio = drawn(menus.RISORIUS_MT_sample_studio)
    assert with_studio.operators == ["risorius.add_character"] * len(people)
    assert with_studio.labels == [person.name for person in people]
    assert "risorius.add_studio" in drawn(menus.RISORIUS_MT_sample).operators


def test_the_backdrop_lies_behind_the_face(rig):
    collection = _add()
    wall = next(o for o in collection.objects if o.type == "MESH")
    camera = _camera(collection)
    far = [world_to_camera_view(bpy.context.scene, camera, c).z for c in _corners(wall)]
    assert min(far) > _seen(rig, camera)[:, 2].max()


def _corners(item):
    return [item.matrix_world @ Vector(c) for c in item.bound_box]


def test_no_shirt_ends_in_the_picture(rig):
    """The hem of a shirt is below the picture of the studio's camera.

    The hem is higher in the middle than at the sides, as on a child's shirt.
    """
    bpy.ops.risorius.add_character()
    man = next(
        o for o in bpy.data.objects if o.name.startswith("Sample") and o.name.endswith("_rig")
    )
    shirt = next(m for m in scene.meshes(man).values() if "shirt" in m.name)
    end = scene.controls(man).data.bones["eye_L"].head_local.z - 0.2
    raised = [v.index for v in shirt.data.vertices if abs(v.co.x) < 0.07 and v.co.z < end]
    basis = shirt.data.shape_keys.reference_key
    for number in raised:
        shirt.data.vertices[number].co.z = basis.points[number].co.z = end
    shirt.data.update()
    bpy.context.view_layer.update()
    bpy.context.view_layer.objects.active = scene.controls(man)
    camera = _camera(_add())
    bpy.context.scene.render.resolution_x = bpy.context.scene.render.resolution_y = 100
    bpy.context.view_layer.update()
    places = [shirt.data.vertices[number].co for number in raised]
    ends = [shirt.matrix_world @ place for place in places if place.y < 0]
    assert len(ends) > 20
    assert max(world_to_camera_view(bpy.context.scene, camera, end).y for end in ends) <= 0.0
