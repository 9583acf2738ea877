# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests Apply, Set Origin and similar steps on parts of a face: form and place stay."""

import bpy
import numpy as np
import pytest
from support import scene
from support.faces import other_face, small_face
from support.layout import drawn

NEAR = 1e-5  # tolerance as a share of the face's size
ROLL = 3e-4  # the same for bones, whose roll is rounded at each step; for empties, in metres

APPLY = bpy.ops.object.transform_apply
ORIGIN = bpy.ops.object.origin_set


def _to_deltas():
    bpy.ops.object.transforms_to_deltas(mode="ALL")
    for item in bpy.context.selected_objects:
        if not item.name.endswith("_controls"):
            continue  # with deltas Blender's next step moves its children, whatever they are
        place = item.matrix_basis.copy()
        item.delta_location, item.delta_scale = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
        item.delta_rotation_euler = (0.0, 0.0, 0.0)
        item.matrix_basis = place


OPERATIONS = {
    "apply location": lambda: APPLY(location=True, rotation=False, scale=False),
    "apply rotation": lambda: APPLY(location=False, rotation=True, scale=False),
    "apply scale": lambda: APPLY(location=False, rotation=False, scale=True),
    "apply all": lambda: APPLY(location=True, rotation=True, scale=True),
    "apply visual transform": bpy.ops.object.visual_transform_apply,
    "apply all to deltas": _to_deltas,
    "apply parent inverse": bpy.ops.object.parent_inverse_apply,
    "make instances real": bpy.ops.object.duplicates_make_real,
    "clear the parent inverse": lambda: bpy.ops.object.parent_clear(type="CLEAR_INVERSE"),
    "clear the origin": bpy.ops.object.origin_clear,
    "geometry to origin": lambda: ORIGIN(type="GEOMETRY_ORIGIN"),
    "origin to geometry": lambda: ORIGIN(type="ORIGIN_GEOMETRY", center="BOUNDS"),
    "origin to the median": lambda: ORIGIN(type="ORIGIN_GEOMETRY", center="MEDIAN"),
    "origin to the cursor": lambda: ORIGIN(type="ORIGIN_CURSOR"),
    "origin to the centre of mass": lambda: ORIGIN(type="ORIGIN_CENTER_OF_MASS"),
    "origin to the centre of volume": lambda: ORIGIN(type="ORIGIN_CENTER_OF_VOLUME"),
}
SELECTIONS = ("controls", "rig", "one mesh", "all")
# Steps of OPERATIONS that Blender refuses on data-blocks that are linked from a library.
REFUSED_ON_LINKED_DATA = ("apply all", "geometry to origin", "origin to the cursor")


@pytest.fixture
def small_file(tmp_path):
    path = tmp_path / "small.dna"
    small_face(head_grid=(6, 7)).save(str(path))
    return path


def _select(rig, selected):
    items = {
        "controls": [scene.controls(rig)],
        "rig": [rig],
        "one mesh": [scene.meshes(rig)[0]],
        "all": [rig, scene.controls(rig), *scene.meshes(rig).values()],
    }[selected]
    for item in bpy.context.view_layer.objects:
        item.select_set(item in items)
    bpy.context.view_layer.objects.active = items[0]


def _objects(rig):
    return [rig, scene.controls(rig), *scene.meshes(rig).values()]


def _parts(rig):
    """(name of an object, kind of value) -> values that the steps of OPERATIONS may change.

    The kinds are matrices, rest matrices and lengths of bones, vertices, and points of shape keys.
    """
    found = {}
    for item in _objects(rig):
        found[item.name, "matrix"] = np.array(item.matrix_basis)
        found[item.name, "parent inverse"] = np.array(item.matrix_parent_inverse)
        if item.type == "ARMATURE":
            bones = item.data.bones
            found[item.name, "rests"] = np.array([b.matrix_local for b in bones])
            found[item.name, "lengths"] = np.array([b.length for b in bones])
        else:
            found[item.name, "points"] = np.array([v.co for v in item.data.vertices])
            for block in item.data.shape_keys.key_blocks:
                found[item.name, block.name] = np.array([p.co for p in block.data])
    return found


def _update():
    bpy.context.view_layer.update()
    bpy.context.view_layer.update()


def _hang(parent, bone=""):
    """Add an empty, such as a hat of a user, whose parent is an object or a bone of it.

    Args:
        parent: an object of the face.
        bone: name of a bone of `parent`; "": the object itself is the parent.
    """
    hat = bpy.data.objects.new("Hat", None)
    bpy.context.scene.collection.objects.link(hat)
    hat.parent, hat.parent_type, hat.parent_bone = parent, "BONE" if bone else "OBJECT", bone
    hat.location = (0.0, 0.1, 0.2)
    return hat


def _put(rig, jaw):
    """Set the jaw slider and update twice, so that work that the add-on delays is done."""
    scene.set_controls(rig, jawOpen=jaw)
    scene.update(scene.controls(rig))


def _far(before, now):
    return max(float(np.abs(now[key] - value).max()) for key, value in before.items())


def _try(rigs, hats, steps):
    """Do steps on the first face, and check that all is as before after each step.

    Args:
        rigs: the faces whose vertices and data are compared.
        hats: empties that are attached to the first face and must stay in place.
        steps: (key of SELECTIONS, key of OPERATIONS).
    """
    first = rigs[0]
    wanted, whole = {}, {}
    for jaw in (0.2, 0.7):
        _put(first, jaw)
        wanted[jaw] = np.concatenate([scene.snapshot(rig) for rig in rigs])
        whole[jaw] = [_parts(rig) for rig in rigs]
    size = np.ptp(scene.snapshot(first), axis=0).max()
    places = [np.array(hat.matrix_world) for hat in hats]
    for number, (selected, name) in enumerate(steps):
        _select(first, selected)
        OPERATIONS[name]()
        bpy.context.view_layer.update()
        jaw = (0.2, 0.7)[number % 2]
        _put(first, jaw)
        now = np.concatenate([scene.snapshot(rig) for rig in rigs])
        assert np.abs(now - wanted[jaw]).max() < NEAR * size, (selected, name)
        for rig, before in zip(rigs, whole[jaw], strict=True):
            assert _far(before, _parts(rig)) < ROLL * size, (selected, name)
        for hat, place in zip(hats, places, strict=True):
            assert np.abs(np.array(hat.matrix_world) - place).max() < ROLL, (selected, name, hat)


def _replaced(rig, tmp_path):
    """Replace the DNA file of a face on which steps were done, and compare it with the oracle."""
    path = tmp_path / "other.dna"
    other_face(head_grid=(6, 7)).save(str(path))
    bpy.context.view_layer.objects.active = scene.controls(rig)
    assert bpy.ops.risorius.replace_dna(filepath=str(path)) == {"FINISHED"}
    scene.set_controls(rig, jawOpen=0.4, mouthCornerPullL=0.9)
    raw = scene.raw_of(rig, path)
    assert scene.error_against_oracle(rig, path, raw) < scene.TOLERANCE


def test_every_step_on_every_part_of_a_turned_face_beside_another(small_file, tmp_path, capsys):
    other, rig = scene.load(small_file, "KEYS"), scene.load(small_file, "LIVE")
    controls = scene.controls(rig)
    controls.rotation_euler, controls.scale = (0.2, 0.1, 0.5), (2.0, 2.0, 2.0)
    scene.set_controls(rig, mouthCornerPullL=0.3)
    hats = [_hang(controls), _hang(controls, "head"), _hang(rig, "head"), _hang(rig)]
    bpy.context.scene.cursor.location = (0.3, 0.2, 0.1)
    _try([rig, other], hats, [(part, name) for part in SELECTIONS for name in OPERATIONS])
    said = capsys.readouterr().out
    assert "Small.001_rig (+3): Blender's step was taken back" in said
    assert "Small.001_head_lod0_mesh: Blender's step was taken back" in said
    _replaced(rig, tmp_path)


MAIN = ("apply all", "apply visual transform", "geometry to origin", "origin to the cursor")


def test_the_main_steps_on_a_face_on_a_body_with_keys_of_its_own(small_file, tmp_path):
    rig, controls = _on_a_body(small_file)
    for frame, place in ((1, (0.0, 0.0, 0.0)), (9, (0.3, 0.2, 0.1))):
        controls.location = place
        controls.keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_set(5)
    _try([rig], [], [(part, name) for part in ("rig", "one mesh") for name in MAIN])
    controls.animation_data_clear()
    scene.update(controls)
    steps = [(part, name) for part in ("controls", "all") for name in MAIN if "visual" not in name]
    _try([rig], [], steps)
    _replaced(rig, tmp_path)


def _on_a_body(path):
    """Attach a face in the mode KEYS to the only bone of a rotated body.

    Returns the deforming armature and the control armature of the face.
    """
    rig = scene.load(path, "KEYS")
    controls = scene.controls(rig)
    controls.scale = (1.5, 1.5, 1.5)
    data = bpy.data.armatures.new("Body")
    body = bpy.data.objects.new("Body", data)
    bpy.context.scene.collection.objects.link(body)
    bpy.context.view_layer.objects.active = body
    bpy.ops.object.mode_set(mode="EDIT")
    bone = data.edit_bones.new("head")
    bone.head, bone.tail = (0.0, 0.0, 1.0), (0.0, 0.0, 1.2)
    bpy.ops.object.mode_set(mode="OBJECT")
    body.rotation_euler = (0.0, 0.0, 0.7)
    placement = scene.submodule("scene.character.rig_placement")
    placement.attach(controls, body, "head", fit="NONE")
    body.location = (0.5, 0.0, 0.0)
    scene.update(body, controls)
    return rig, controls


def test_the_steps_on_an_override_change_nothing(small_file, tmp_path):
    scene.load(small_file, "KEYS")
    library = tmp_path / "library.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(library))
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.wm.link(directory=f"{library}/Collection/", filename="Small", instance_collections=True)
    context = bpy.context
    context.view_layer.objects.active = context.scene.objects[0]
    assert bpy.ops.risorius.make_override(shapes="DRIVEN") == {"FINISHED"}
    rig = next(r for r in scene.submodule("scene.base.parts").rigs())
    steps = [name for name in MAIN if name not in REFUSED_ON_LINKED_DATA]
    _try([rig], [], [(part, name) for part in ("rig", "all") for name in steps])


def test_a_part_that_was_aligned_or_scattered_comes_back_and_the_panel_says_so(small_file):
    rig = scene.load(small_file, "LIVE")
    for selected in ("rig", "one mesh"):
        _put(rig, 0.2)
        wanted = scene.snapshot(rig)
        _select(rig, selected)
        bpy.ops.object.randomize_transform(loc=(1.0, 1.0, 1.0))
        bpy.context.view_layer.update()
        shown = drawn(bpy.types.RISORIUS_PT_character).text()
        assert ("was taken back" in shown) == (selected == "one mesh")
        bpy.context.view_layer.update()
        np.testing.assert_allclose(scene.snapshot(rig), wanted, atol=1e-6)
    _put(rig, 0.3)
    assert "was taken back" not in drawn(bpy.types.RISORIUS_PT_character).text()


def test_what_the_users_own_hand_does_to_meshes_and_joints_stays(small_file):
    rig = scene.load(small_file, "LIVE")
    item = scene.meshes(rig)[0]
    _put(rig, 0.2)
    before = _parts(rig)
    for owner in (item, rig):
        bpy.context.view_layer.objects.active = owner
        bpy.ops.object.mode_set(mode="EDIT")
        if owner == rig:
            for bone in owner.data.edit_bones:
                bone.head.x, bone.tail.x = bone.head.x + 0.1, bone.tail.x + 0.1
        else:
            bpy.ops.mesh.select_all(action="SELECT")
            bpy.ops.transform.translate(value=(0.1, 0.0, 0.0))
        bpy.ops.object.mode_set(mode="OBJECT")
    item.lock_location = (False, False, False)
    item.location = (0.0, 0.2, 0.0)
    _put(rig, 0.3)
    now = _parts(rig)
    moved = (now[rig.name, "rests"] - before[rig.name, "rests"])[:, 0, 3]
    np.testing.assert_allclose(moved, 0.1, atol=1e-6)
    moved = (now[item.name, "Basis"] - before[item.name, "Basis"])[:, 0]
    np.testing.assert_allclose(moved, 0.1, atol=1e-6)
    assert tuple(item.location) == pytest.approx((0.0, 0.2, 0.0))
