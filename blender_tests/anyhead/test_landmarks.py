# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of landmarks of a head in Blender: finding, moving, placing, saving and undo."""

import bpy
import numpy as np
import pytest
from mathutils import Euler
from support import scene
from support.layout import drawn
from support.plain_head import PLACES, Package, plain_head, to_blender

risorius = bpy.ops.risorius


@pytest.fixture
def package(monkeypatch):
    return Package(monkeypatch)


@pytest.fixture
def head(package):
    return plain_head()


def shown(head):
    """The landmarks that the scene contains for a head: name -> Point."""
    return scene.submodule("scene.anyhead.points").of(head)


def world(head, name):
    return np.array(shown(head)[name].item.matrix_world.translation)


def panel_text():
    return drawn(scene.submodule("ui.anyhead.panel").RISORIUS_PT_head).text()


def test_they_stand_on_a_head_that_is_turned_and_scaled(head, package):
    head.location, head.rotation_euler = (1.0, 2.0, 0.5), Euler((0.2, 0.1, 0.9))
    head.scale = (1.5, 1.5, 1.5)
    bpy.context.view_layer.update()
    # The add-on passes the mesh to the package with y up, in centimetres, and with the rotation and
    # scale of the object applied.
    axes = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]) * 100.0
    turn = axes @ np.array(head.matrix_world.to_3x3())
    package.places = {name: turn @ to_blender(place) for name, place in PLACES.items()}
    assert risorius.find_landmarks() == {"FINISHED"}
    (seen,) = package.heads
    np.testing.assert_allclose(
        seen.parts[0].mesh.positions[0], turn @ np.array(head.data.vertices[0].co), atol=1e-4
    )
    assert set(shown(head)) == set(PLACES)
    for name, place in PLACES.items():
        wanted = head.matrix_world @ head.data.vertices[0].co.__class__(to_blender(place))
        np.testing.assert_allclose(world(head, name), wanted, atol=1e-5)
        item = shown(head)[name].item
        assert (item.type, item.name, item.show_name) == ("EMPTY", name, False)
        (group,) = item.users_collection
        assert group.name == "Egg Landmarks"
    head.location.x += 1.0
    bpy.context.view_layer.update()
    assert {point.state for point in shown(head).values()} == {"FOUND"}


def test_vertex_groups_tell_the_package_where_the_head_is(monkeypatch):
    item, asked = plain_head(), []
    for name, first, weight in (("DEF-head", 40, 0.9), ("DEF-jaw", 20, 0.4), ("hat", 0, 1.0)):
        item.vertex_groups.new(name=name).add(range(first, 100), weight, "REPLACE")
    part = scene.submodule("native").part
    found = part("anyhead.landmarks.marks").Landmarks()
    found.points.update({name: np.array(place) for name, place in PLACES.items()})

    def find(_surface, hints, _progress):
        asked.append(hints)
        return found

    monkeypatch.setattr(part("anyhead.landmarks.find"), "find_landmarks", find)
    assert risorius.find_landmarks() == {"FINISHED"}
    head = scene.submodule("scene.anyhead.finding").read(bpy.context, item, ())
    own = head.parts[0].mesh.positions[40:100]
    assert {name: rows.tolist() for name, rows in head.parts[0].groups.items()} == {
        "DEF-head": own.tolist()
    }
    low, high = asked[0].box
    assert (low < own.min(axis=0)).all()
    assert (high > own.max(axis=0)).all()
    assert (high - low).max() < 2 * np.ptp(own, axis=0).max()


def test_what_is_moved_by_hand_stays_and_is_told_to_the_package(head, package):
    risorius.find_landmarks()
    point = shown(head)["eye_inner_L"].item
    point.location.x += 0.01
    bpy.context.view_layer.objects.active = point  # the user moves a selected empty
    bpy.context.view_layer.update()
    assert shown(head)["eye_inner_L"].state == "MOVED"
    package.places = {name: (x, y + 0.3, z) for name, (x, y, z) in PLACES.items()}
    assert risorius.find_landmarks() == {"FINISHED"}
    assert list(package.heads[-1].fixed) == ["eye_inner_L"]
    np.testing.assert_allclose(package.heads[-1].fixed["eye_inner_L"], [3.0, 3.0, 9.0], atol=1e-4)
    np.testing.assert_allclose(world(head, "eye_inner_L"), [0.03, -0.09, 0.03], atol=1e-6)
    np.testing.assert_allclose(world(head, "eye_inner_R"), [-0.02, -0.09, 0.033], atol=1e-6)


def test_dots_have_the_color_of_the_state_and_selected_ones_a_name(head, package):
    dots = scene.submodule("ui.anyhead.overlay").dots
    assert dots(bpy.context) == []
    risorius.find_landmarks()
    moved, hidden = (shown(head)[name].item for name in ("eye_inner_L", "eye_inner_R"))
    moved.location.x += 0.01
    hidden.hide_viewport = True
    moved.select_set(True)
    bpy.context.view_layer.update()
    drawn_dots = dots(bpy.context)
    assert len(drawn_dots) == len(PLACES) - 1
    (named,) = [dot for dot in drawn_dots if dot.label]
    assert named.label == "the inner corner of the left eye"
    place, color, radius = named.mark
    np.testing.assert_allclose(place, world(head, "eye_inner_L"))
    assert color[0] > color[1] > color[2]  # orange: moved by hand
    others = [dot.mark for dot in drawn_dots if not dot.label]
    assert all(c[1] > c[0] and r < radius for _place, c, r in others)  # green: found
    head.select_set(False)
    moved.select_set(False)
    bpy.context.view_layer.objects.active = None
    assert dots(bpy.context) == []


def test_what_is_missing_is_asked_for_by_name(head, package, capfd):
    risorius.find_landmarks()
    assert "Not found: the chin." in capfd.readouterr().out
    text = panel_text()
    assert "3 found, 0 moved, 0 placed" in text
    assert "1 missing" in text
    assert "the chin" in text
    bpy.context.scene.cursor.location = (0.0, -0.08, -0.1)
    assert risorius.place_landmark(landmark="chin", way="CURSOR") == {"FINISHED"}
    np.testing.assert_allclose(world(head, "chin"), [0.0, -0.08, -0.1], atol=1e-6)
    assert shown(head)["chin"].state == "PLACED"
    assert "missing" not in panel_text()
    with pytest.raises(RuntimeError, match="There is no landmark nose_hair"):
        risorius.place_landmark(landmark="nose_hair", way="CURSOR")
    bpy.data.objects.remove(shown(head)["eye_inner_R"].item)
    assert "the inner corner of the right eye" in panel_text()


def test_they_are_saved_with_the_scene_and_as_a_file(head, package, tmp_path):
    risorius.find_landmarks()
    path = tmp_path / "egg.json"
    assert risorius.save_landmarks(filepath=str(path)) == {"FINISHED"}
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "egg.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "egg.blend"))
    head = bpy.data.objects["Egg"]
    before = {name: point.place for name, point in shown(head).items()}
    assert set(before) == set(PLACES)
    assert risorius.landmark_names(enable=True) == {"FINISHED"}
    assert all(point.item.show_name for point in shown(head).values())
    assert risorius.landmark_names(enable=False) == {"FINISHED"}
    assert not any(point.item.show_name for point in shown(head).values())
    assert risorius.clear_landmarks() == {"FINISHED"}
    assert shown(head) == {}
    assert "Egg Landmarks" not in bpy.data.collections
    assert not risorius.save_landmarks.poll()
    assert risorius.load_landmarks(filepath=str(path)) == {"FINISHED"}
    assert set(shown(head)) == set(before)
    for name, point in shown(head).items():
        np.testing.assert_allclose(point.place, before[name], atol=1e-6)
    path.write_text("[1, 2", encoding="utf-8")
    with pytest.raises(RuntimeError, match=r"egg\.json"):
        risorius.load_landmarks(filepath=str(path))


def test_undo_takes_them_away(head, package):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="before")
    risorius.find_landmarks()
    bpy.ops.ed.undo_push(message="after")
    assert shown(head)
    bpy.ops.ed.undo()
    assert shown(bpy.data.objects["Egg"]) == {}


def test_an_error_leaves_nothing(head, package, monkeypatch):
    finding = scene.submodule("scene.anyhead.finding")
    error = scene.submodule("logic.base.errors").FaceError("Egg: no face was found.")

    def fail(_head, _progress):
        raise error

    monkeypatch.setattr(finding, "_search", fail)
    before = scene.counts()
    with pytest.raises(RuntimeError, match="Egg: no face was found"):
        risorius.find_landmarks()
    assert scene.counts() == before


def test_a_cube_and_a_face_get_no_panel(head, package, dna_file):
    panel = scene.submodule("ui.anyhead.panel").RISORIUS_PT_head
    assert panel.poll(bpy.context)
    bpy.ops.object.select_all(action="DESELECT")
    bpy.ops.mesh.primitive_cube_add()
    assert not panel.poll(bpy.context)
    assert risorius.find_landmarks.poll()  # the operator itself works without the panel
    bpy.ops.object.select_all(action="DESELECT")
    rig = scene.load(dna_file)
    bpy.ops.object.select_all(action="DESELECT")
    bpy.context.view_layer.objects.active = scene.meshes(rig)[0]
    assert not panel.poll(bpy.context)
    assert not risorius.find_landmarks.poll()
