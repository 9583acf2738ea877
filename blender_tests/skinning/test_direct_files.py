# SPDX-License-Identifier: GPL-3.0-or-later
"""Saved files have the form of Live mode.

Faces return to Direct mode after undo, after copying, and in files that Blender writes by itself.
"""

import addon_utils
import bpy
import numpy as np
import pytest
from support import both_ways, scene


@pytest.fixture
def pair(dna_file):
    pair = both_ways.Pair(dna_file)
    pair.set(jawOpen=0.6, mouthCornerPullL=0.5, eyeLookUpL=0.4)
    assert both_ways.is_direct(pair.direct)
    return pair


def _opened():
    """The Pair of the two faces in the open .blend file."""
    pair = object.__new__(both_ways.Pair)
    pair.direct, pair.live = bpy.data.objects["Small_rig"], bpy.data.objects["Small.001_rig"]
    return pair


def _keys(rig):
    """Index of a mesh -> points of all its shape keys, float64[keys, V, 3]."""
    found = {}
    for number, item in scene.meshes(rig).items():
        blocks = item.data.shape_keys.key_blocks
        found[number] = np.array([[p.co for p in block.points] for block in blocks])
    return found


def _has_live_form(pair):
    """Check that bones, keys and modifiers equal those of a face in Live mode."""
    assert pair.bones_apart() < 1e-5
    for item in scene.meshes(pair.direct).values():
        assert "risorius_finished" not in item
        assert item.modifiers[0].show_viewport
        assert item.modifiers[0].show_render
    for number, points in _keys(pair.live).items():
        np.testing.assert_allclose(_keys(pair.direct)[number], points, atol=1e-6)
    assert pair.apart() < both_ways.NEAR


def _open_without_addon(blend):
    addon_utils.disable(scene.MODULE)
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    return _opened()


def test_a_save_stores_the_live_form_and_leaves_the_face_alone(pair, tmp_path):
    shown, keys = scene.snapshot(pair.direct), _keys(pair.direct)
    blend = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    assert both_ways.is_direct(pair.direct)
    for number, points in _keys(pair.direct).items():
        np.testing.assert_array_equal(points, keys[number])
    np.testing.assert_array_equal(scene.snapshot(pair.direct), shown)
    pair.check()
    assert both_ways.is_direct(pair.direct)
    there = _open_without_addon(blend)
    _has_live_form(there)
    np.testing.assert_allclose(scene.snapshot(there.direct), shown, atol=1e-6)


def test_a_save_in_edit_mode_of_a_mesh(pair, tmp_path):
    head = scene.meshes(pair.direct)[0]
    bpy.context.view_layer.objects.active = head
    bpy.ops.object.mode_set(mode="EDIT")
    both_ways.settle()
    blend = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True)
    assert head.mode == "EDIT"
    assert both_ways.is_direct(pair.direct, 1)
    bpy.ops.object.mode_set(mode="OBJECT")
    both_ways.settle()
    assert both_ways.is_direct(pair.direct)
    pair.check()
    pair.set(jawOpen=0.6, mouthCornerPullL=0.5)
    there = _open_without_addon(blend)
    if bpy.data.objects["Small_head_lod0_mesh"].mode == "EDIT":
        bpy.context.view_layer.objects.active = bpy.data.objects["Small_head_lod0_mesh"]
        bpy.ops.object.mode_set(mode="OBJECT")
    _has_live_form(there)


def test_a_save_that_fails(pair, tmp_path):
    shown = scene.snapshot(pair.direct)
    with pytest.raises(RuntimeError):
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "nowhere" / "saved.blend"))
    assert both_ways.is_direct(pair.direct)
    np.testing.assert_array_equal(scene.snapshot(pair.direct), shown)
    both_ways.settle()
    pair.check()
    assert both_ways.is_direct(pair.direct)


def test_a_save_between_undo_and_the_next_update(pair, tmp_path):
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="one")
    pair.set(jawOpen=0.1)
    bpy.ops.ed.undo_push(message="two")
    assert bpy.ops.ed.undo() == {"FINISHED"}
    scene.submodule("scene.base.session").end("undo")  # a window evaluates only what it draws
    blend = tmp_path / "saved.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True)
    there = _opened()
    there.check()
    assert both_ways.is_direct(there.direct)
    there = _open_without_addon(blend)
    _has_live_form(there)


def test_a_file_that_blender_writes_by_itself(pair, tmp_path):
    """A face in a file of bpy.data.libraries.write is in Direct mode after the file is opened.

    The file stores the armature modifiers as Direct mode has them: disabled.
    """
    shown = scene.snapshot(pair.direct)
    blend = tmp_path / "copied.blend"
    bpy.data.libraries.write(str(blend), {bpy.context.scene})
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    there = _opened()
    np.testing.assert_allclose(scene.snapshot(there.direct), shown, atol=1e-6)
    assert there.apart() < both_ways.NEAR
    there.check()
    assert both_ways.is_direct(there.direct)


def test_append_of_a_face_in_direct_mode(pair, tmp_path):
    blend = tmp_path / "copied.blend"
    bpy.data.libraries.write(str(blend), {bpy.context.scene})
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(blend)) as (source, target):
        target.collections = [c for c in source.collections if c.startswith("Small")]
    for found in target.collections:
        if found.name not in bpy.context.scene.collection.children_recursive:
            bpy.context.scene.collection.children.link(found)
    both_ways.settle()
    there = _opened()
    assert there.apart() < both_ways.NEAR
    there.check()
    assert both_ways.is_direct(there.direct)


def test_a_linked_face_shows_what_a_live_one_shows(pair, tmp_path):
    shown = scene.snapshot(pair.direct)
    blend = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    bpy.ops.wm.read_homefile(use_empty=True)
    with bpy.data.libraries.load(str(blend), link=True) as (_source, target):
        target.collections = ["Small"]
    bpy.context.scene.collection.children.link(target.collections[0])
    both_ways.settle()
    np.testing.assert_allclose(scene.snapshot(bpy.data.objects["Small_rig"]), shown, atol=1e-6)
    made = target.collections[0].override_hierarchy_create(
        bpy.context.scene, bpy.context.view_layer
    )
    both_ways.settle()
    rig = next(o for o in made.all_objects if "risorius_controls" in o)
    np.testing.assert_allclose(scene.snapshot(rig), shown, atol=1e-6)


def test_undo_and_redo_across_changes_of_mode(pair):
    edit = bpy.context.preferences.edit
    edit.use_global_undo, edit.undo_steps = True, 32

    def select(there):
        there.direct.select_set(True)

    def choose_live(there):
        there.direct["risorius_skinning"] = "LIVE"
        scene.update(scene.controls(there.direct))

    def smooth(there):
        for rig in there.each():
            head = scene.meshes(rig)[0]
            head.modifiers.new("Smooth", "SMOOTH")
            head.modifiers.move(len(head.modifiers) - 1, 0)

    def paint(there):
        for rig in there.each():
            head = scene.meshes(rig)[0]
            head.modifiers.remove(head.modifiers["Smooth"])
            head.vertex_groups[0].add(range(60), 0.9, "REPLACE")
            head.data.update_tag()
        there.direct.pop("risorius_skinning", None)
        scene.update(scene.controls(there.direct))

    bpy.ops.ed.undo_push(message="start")
    seen = [(both_ways.is_direct(pair.direct), scene.snapshot(pair.direct))]
    for step in (select, choose_live, smooth, paint):
        there = _opened()
        step(there)
        both_ways.settle()
        bpy.ops.ed.undo_push(message=step.__name__)
        assert there.apart() < both_ways.NEAR, step.__name__
        seen.append((both_ways.is_direct(there.direct), scene.snapshot(there.direct)))
    assert [direct for direct, _points in seen] == [True, True, False, False, True]
    last = len(seen) - 1
    order = [("undo", n) for n in range(last - 1, -1, -1)]
    order += [("redo", n) for n in range(1, last + 1)]
    for way, place in order:
        assert getattr(bpy.ops.ed, way)() == {"FINISHED"}
        both_ways.settle()
        there = _opened()
        assert both_ways.is_direct(there.direct) == seen[place][0], (way, place)
        np.testing.assert_allclose(scene.snapshot(there.direct), seen[place][1], atol=1e-6)
        assert there.apart() < both_ways.NEAR, (way, place)
    there.check()


def _duplicate(names, linked=False):
    bpy.ops.object.select_all(action="DESELECT")
    for name in names:
        bpy.data.objects[name].hide_set(False)
        bpy.data.objects[name].select_set(True)
    bpy.context.view_layer.objects.active = bpy.data.objects[names[0]]
    before = set(bpy.data.objects)
    assert bpy.ops.object.duplicate(linked=linked) == {"FINISHED"}
    made = [o for o in bpy.data.objects if o not in before]
    bpy.ops.object.select_all(action="DESELECT")
    both_ways.settle()
    return made


@pytest.mark.parametrize("linked", [False, True], ids=["Shift-D", "Alt-D"])
def test_a_duplicated_character(pair, linked):
    whole = [o.name for o in (pair.direct, scene.controls(pair.direct))]
    whole += [m.name for m in scene.meshes(pair.direct).values()]
    made = _duplicate(whole, linked)
    other = next(o for o in made if "risorius_controls" in o)
    both_ways.settle()
    assert both_ways.is_direct(pair.direct)
    pair.check()
    first = pair.direct
    pair.direct = other
    pair.check()
    assert both_ways.is_direct(other)
    scene.set_controls(other, jawOpen=1.0)
    pair.direct = first
    assert pair.apart() < both_ways.NEAR


@pytest.mark.parametrize("linked", [False, True], ids=["Shift-D", "Alt-D"])
def test_a_duplicated_mesh(pair, linked):
    """A copy of the head mesh is deformed by the armature, as in Live mode.

    As long as the copy exists, the bones are posed.
    """
    made = [_duplicate([scene.meshes(rig)[0].name], linked)[0] for rig in pair.each()]
    pair.check()
    copies = [scene.evaluated(item) for item in made]
    size = np.ptp(copies[1], axis=0).max()
    assert np.abs(copies[0] - copies[1]).max() / size < both_ways.NEAR
    assert pair.bones_apart() < 1e-5
    for item in made:
        bpy.data.objects.remove(item)
    both_ways.settle()
    pair.check()
    assert both_ways.is_direct(pair.direct)
    assert not both_ways.plan(pair.direct).posed


def test_disabling_gives_the_live_form(pair):
    shown = scene.snapshot(pair.direct)
    addon_utils.disable(scene.MODULE)
    bpy.context.view_layer.update()
    _has_live_form(pair)
    np.testing.assert_allclose(scene.snapshot(pair.direct), shown, atol=1e-6)
