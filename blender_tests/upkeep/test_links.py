# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests that linked characters show their saved pose, and move after an override."""

import bpy
import numpy as np
import pytest
from support import scene
from support.layout import Recorder

JAW = "CTRL_expressions.jawOpen"


@pytest.fixture
def library(dna_file, tmp_path, mode):
    """The path of a .blend file with a posed character, and the character's vertices.

    The open file is a new, empty file.
    """
    rig = scene.load(dna_file, mode)
    scene.set_controls(rig, jawOpen=0.8, mouthCornerPullL=0.5, browDownL=1.0)
    path = tmp_path / f"library_{mode}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    wanted = scene.snapshot(rig)
    bpy.ops.wm.read_homefile(use_empty=True)
    return path, wanted


def _link(path, instance=True):
    """Link the character's collection from a .blend file. Returns the new active object.

    Args:
        path: path of the .blend file.
        instance: True: link it as a collection instance, which is the active object; False: link
            its objects; the control armature is the active object.
    """
    bpy.ops.wm.link(
        directory=f"{path}/Collection/", filename="Small", instance_collections=instance
    )
    context = bpy.context
    item = next(o for o in bpy.data.objects if (o.instance_collection if instance else o.library))
    if instance:
        item = [o for o in context.scene.objects if o.instance_collection][-1]
    else:
        item = next(o for o in context.scene.objects if o.name == "Small_controls")
    context.view_layer.objects.active = item
    context.view_layer.update()
    return item


def _rigs():
    return [o for o in bpy.data.objects if "risorius_controls" in o and not o.library]


def _override(shapes="DRIVEN"):
    before = _rigs()
    assert bpy.ops.risorius.make_override(shapes=shapes) == {"FINISHED"}
    return next(r for r in _rigs() if r not in before)


def _is_right(rig, dna_file):
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE
    bad, seen = scene.invalid_drivers()
    assert not bad
    assert seen


def _moves(rig, dna_file, **values):
    scene.set_controls(rig, **values)
    _is_right(rig, dna_file)


def _key(rig):
    for frame, value in ((1, 0.0), (10, 0.9)):
        scene.face(rig)[JAW] = value
        scene.face(rig).keyframe_insert(f'["{JAW}"]', frame=frame)


def _plays(rig, dna_file):
    for frame, jaw in ((10, 0.9), (1, 0.0)):
        bpy.context.scene.frame_set(frame)
        raw = scene.raw_of(rig, dna_file)
        raw[0] = jaw
        assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def _said():
    layout = Recorder()
    scene.submodule("ui.upkeep.panel").draw_trouble(layout, bpy.context)
    return layout.text()


@pytest.mark.parametrize("instance", [True, False])
def test_linked_character_stands_as_it_was_saved(library, instance, mode):
    path, wanted = library
    item = _link(path, instance)
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    channels = list(rig["channels"])
    bpy.context.scene.frame_set(7)
    near = 1e-6 if mode == "AUTO" else 0.0  # the file has posed bones, which Blender adds up
    np.testing.assert_allclose(scene.snapshot(rig), wanted, rtol=0, atol=near)
    assert list(rig["channels"]) == channels
    bpy.context.view_layer.objects.active = item
    assert "make an override" in _said()
    assert not bpy.ops.risorius.reset.poll()
    assert not bpy.ops.risorius.set_shape_mode.poll()


@pytest.mark.parametrize("mode", ["LIVE", "KEYS"])
def test_linked_character_with_keys_is_not_half_written(dna_file, tmp_path, mode):
    rig = scene.load(dna_file, mode)
    _key(rig)
    bpy.context.scene.frame_set(10)
    wanted = scene.snapshot(rig)
    path = tmp_path / "keyed.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_homefile(use_empty=True)
    _link(path)
    rig = next(o for o in bpy.data.objects if "risorius_controls" in o)
    for frame in (10, 5, 1):
        bpy.context.scene.frame_set(frame)
        np.testing.assert_array_equal(scene.snapshot(rig), wanted)


@pytest.mark.parametrize("shapes", ["DRIVEN", "LOCAL"])
@pytest.mark.parametrize("instance", [True, False])
def test_override_moves_and_survives_save(library, dna_file, tmp_path, instance, shapes):
    _link(library[0], instance)
    rig = _override(shapes)
    assert _said() == ""
    _is_right(rig, dna_file)
    _moves(rig, dna_file, jawOpen=0.35, mouthCornerPullL=0.9)
    assert [o for o in bpy.context.scene.objects if o.library or o.instance_collection] == []
    _key(rig)
    _plays(rig, dna_file)
    name = rig.name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    rig = next(r for r in _rigs() if r.name == name)
    _is_right(rig, dna_file)
    _plays(rig, dna_file)
    _moves(rig, dna_file, mouthCornerPullR=0.7, browDownL=0.4)


def _edit_library(path):
    """Change the colours of two materials in the library file, and return to the open file."""
    here = bpy.data.filepath
    bpy.ops.wm.open_mainfile(filepath=str(path))
    bpy.data.materials["Small_head"].diffuse_color = (0.1, 0.9, 0.2, 1.0)
    bpy.data.materials["Small_teeth"].diffuse_color = (0.1, 0.9, 0.2, 1.0)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.open_mainfile(filepath=here)


def _skins(rig):
    items = scene.meshes(rig)
    return [items[i].material_slots[0].material for i in (0, 1)]


@pytest.mark.parametrize("shapes", ["DRIVEN", "LOCAL"])
def test_edit_of_the_library_reaches_the_override(library, dna_file, tmp_path, shapes, mode):
    path = library[0]
    _link(path)
    rig = _override(shapes)
    _key(rig)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    _edit_library(path)
    rig = _rigs()[0]
    _plays(rig, dna_file)
    _moves(rig, dna_file, mouthCornerPullL=0.2)
    local = [not m.override_library and not m.library for m in _skins(rig)]
    assert local == [shapes == "LOCAL" or mode != "KEYS", False]
    for material, own in zip(_skins(rig), local, strict=True):
        assert own or tuple(material.diffuse_color)[:2] == pytest.approx((0.1, 0.9))
    bpy.data.libraries[0].reload()
    bpy.context.view_layer.update()
    _plays(_rigs()[0], dna_file)


@pytest.mark.parametrize("shapes", ["DRIVEN", "LOCAL"])
def test_two_overrides_of_one_character_are_independent(library, dna_file, tmp_path, shapes):
    _link(library[0])
    first = _override(shapes)
    _link(library[0])
    second = _override(shapes)
    _moves(first, dna_file, jawOpen=0.2, browDownL=0.0)
    still, maps = scene.snapshot(first), list(first["maps"])
    _moves(second, dna_file, jawOpen=1.0, browDownL=0.7)
    np.testing.assert_array_equal(scene.snapshot(first), still)
    assert list(first["maps"]) == maps
    for rig in (first, second):
        material = _skins(rig)[0]
        targets = {
            v.targets[0].id
            for c in material.node_tree.animation_data.drivers
            for v in c.driver.variables
        }
        assert targets == {m for m in scene.meshes(rig).values() if "maps" in m}
    names = first.name, second.name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    for name in names:
        _is_right(next(r for r in _rigs() if r.name == name), dna_file)


def test_live_meshes_become_local_and_it_is_said(library, dna_file, mode):
    _link(library[0])
    rig = _override("DRIVEN")
    locked = [m.data.override_library or m.data.library for m in scene.meshes(rig).values()]
    assert all(locked) == (mode == "KEYS")
    assert any(locked) == (mode == "KEYS")


def test_shape_mode_of_an_override_is_switched(library, dna_file):
    _link(library[0])
    rig = _override()
    for wanted in ("LIVE", "KEYS", "LIVE"):
        assert bpy.ops.risorius.set_shape_mode(mode=wanted) == {"FINISHED"}
        _moves(rig, dna_file, jawOpen=0.6, mouthCornerPullR=0.3)


def test_override_stands_where_the_instance_stood(library, dna_file):
    item = _link(library[0])
    item.location = (1.0, 2.0, 3.0)
    bpy.context.view_layer.update()
    rig = _override()
    shift = rig.matrix_world.translation
    assert tuple(shift) == pytest.approx((1.0, 2.0, 3.0))
    assert tuple(scene.controls(rig).matrix_world.translation) == pytest.approx(tuple(shift))


def _system_override(path, editable):
    """Make a library override by Blender, without the add-on. Returns the deforming armature.

    Args:
        path: path of the library file.
        editable: True: all parts are editable; False: no part is.
    """
    item = _link(path)
    item.instance_collection.override_hierarchy_create(
        bpy.context.scene, bpy.context.view_layer, reference=item, do_fully_editable=editable
    )
    bpy.data.objects.remove(item)
    rig = _rigs()[0]
    bpy.context.view_layer.objects.active = scene.controls(rig)
    return rig


def test_system_override_is_noticed_and_repaired(library, dna_file):
    rig = _system_override(library[0], editable=False)
    before = list(rig["channels"])
    scene.set_controls(rig, jawOpen=0.1)
    assert "cannot be written" in _said()
    assert "Small_rig" in _said()
    assert list(rig["channels"]) == before
    assert bpy.ops.risorius.make_override() == {"FINISHED"}
    assert _said() == ""
    _moves(rig, dna_file, jawOpen=0.35, mouthCornerPullL=0.9)


def test_refused_live_key_is_noticed_and_repaired(library, dna_file, mode):
    """If the meshes of an override are read-only, the panel says so, and its button repairs it.

    Blender's own menu makes such overrides, with editable armatures.
    """
    rig = _system_override(library[0], editable=False)
    for item in (rig, scene.controls(rig)):
        item.override_library.is_system_override = False
    scene.set_controls(rig, jawOpen=0.1)
    assert ("cannot be written" in _said()) == (mode != "KEYS")
    if mode != "KEYS":
        assert bpy.ops.risorius.make_override() == {"FINISHED"}
    assert _said() == ""
    _moves(rig, dna_file, jawOpen=0.35, mouthCornerPullL=0.9)


@pytest.mark.parametrize("linked", [False, True])
def test_duplicate_of_an_override_is_independent(library, dna_file, linked):
    _link(library[0])
    rig = _override("LOCAL")
    for item in bpy.context.view_layer.objects:
        item.hide_set(False)
        item.select_set(True)
    bpy.ops.object.duplicate(linked=linked)
    bpy.context.view_layer.update()
    copy = next(r for r in _rigs() if r != rig)
    still = scene.snapshot(rig)
    _moves(copy, dna_file, jawOpen=0.1, browDownL=0.3)
    np.testing.assert_array_equal(scene.snapshot(rig), still)
    _moves(rig, dna_file, jawOpen=0.7)
    assert _skins(rig)[0] != _skins(copy)[0]


def test_objects_linked_without_their_collection(library, dna_file):
    with bpy.data.libraries.load(str(library[0]), link=True) as (source, target):
        target.objects = [n for n in source.objects if n.endswith(("rig", "controls", "mesh"))]
    for item in target.objects:
        bpy.context.scene.collection.objects.link(item)
    bpy.context.view_layer.objects.active = bpy.context.scene.objects["Small_controls"]
    bpy.context.view_layer.update()
    rig = _override()
    _moves(rig, dna_file, jawOpen=0.4, mouthCornerPullL=0.8)


@pytest.mark.parametrize("shapes", ["DRIVEN", "LOCAL"])
def test_every_operator_does_its_work_on_an_override_or_says_why_not(
    library, dna_file, shapes, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)  # an export without a folder writes here
    _link(library[0])
    rig = _override(shapes)
    name = rig.name
    for cls in scene.submodule("registration").CLASSES:
        if not issubclass(cls, bpy.types.Operator) or cls.bl_idname in (
            "risorius.add_character",  # would download
            "risorius.import_dna",
        ):
            continue
        rig = bpy.data.objects[name]
        bpy.context.view_layer.objects.active = scene.controls(rig)
        group, _, verb = cls.bl_idname.partition(".")
        operator = getattr(getattr(bpy.ops, group), verb)
        if not operator.poll():
            continue
        try:
            operator()
        except RuntimeError as error:
            assert "Traceback" not in str(error), cls.bl_idname
    rig = bpy.data.objects[name]
    _moves(rig, dna_file, jawOpen=0.25, browDownL=0.5)
