# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh that cannot be in Direct mode looks as in Live mode, and the reason is named.

Afterwards it returns to Direct mode.
"""

from contextlib import contextmanager

import bmesh
import bpy
import numpy as np
import pytest
from support import animation, both_ways, scene


@pytest.fixture
def pair(dna_file):
    pair = both_ways.Pair(dna_file)
    pair.set(jawOpen=0.6, mouthCornerPullL=0.5, eyeLookUpL=0.4)
    assert both_ways.is_direct(pair.direct)
    assert pair.apart() < both_ways.NEAR
    return pair


def _armature(head):
    return next(m for m in head.modifiers if m.type == "ARMATURE")


def _live_key(head):
    return scene.submodule("scene.character.meshes").live_block(head)


def _smooth(head, place):
    modifier = head.modifiers.new("Smooth", "SMOOTH")
    head.modifiers.move(len(head.modifiers) - 1, place)
    return lambda: head.modifiers.remove(modifier)


def before(_rig, head):
    """Add a modifier above the face's armature modifier."""
    return _smooth(head, 0)


def before_in_renders(_rig, head):
    back = _smooth(head, 0)
    head.modifiers[0].show_viewport = False
    return back


def moved_down(_rig, head):
    """Move the face's armature modifier below another modifier."""
    modifier = head.modifiers.new("Mirror", "MIRROR")
    head.modifiers.move(0, 1)

    def back():
        head.modifiers.move(1, 0)
        head.modifiers.remove(modifier)

    return back


def doubled(rig, head):
    second = head.modifiers.new("Again", "ARMATURE")
    second.object = rig
    return lambda: head.modifiers.remove(second)


def doubled_before(rig, head):
    second = head.modifiers.new("Again", "ARMATURE")
    second.object = rig
    head.modifiers.move(len(head.modifiers) - 1, 0)
    return lambda: head.modifiers.remove(head.modifiers["Again"])


def removed(rig, head):
    name = _armature(head).name
    head.modifiers.remove(_armature(head))

    def back():
        made = head.modifiers.new(name, "ARMATURE")
        made.object = rig
        head.modifiers.move(len(head.modifiers) - 1, 0)

    return back


def of_another(rig, head):
    """Let the control armature, not the deforming armature, be the object of the modifier."""
    modifier = _armature(head)
    modifier.object = rig["risorius_controls"]

    def back():
        modifier.object = rig

    return back


def _set(owner, name, value):
    was = getattr(owner, name)
    setattr(owner, name, value)
    return lambda: setattr(owner, name, was)


def volume(_rig, head):
    return _set(_armature(head), "use_deform_preserve_volume", True)


def envelopes(_rig, head):
    return _set(_armature(head), "use_bone_envelopes", True)


def masked(_rig, head):
    head.vertex_groups.new(name="mask").add(range(40), 1.0, "REPLACE")
    return _set(_armature(head), "vertex_group", "mask")


def _own_key(head):
    block = head.shape_key_add(name="mine", from_mix=False)
    block.value = 0.0  # Blender 5 sets new keys to 1
    for point in block.points[:30]:
        point.co.x += 0.02
    return block


def own_key(_rig, head):
    block = _own_key(head)
    block.value = 0.7
    return lambda: head.shape_key_remove(block)


def driven_key(rig, head):
    block = _own_key(head)
    curve = block.driver_add("value")
    curve.driver.expression = "0.4"

    def back():
        block.driver_remove("value")
        block.value = 0.0

    return back


def keyed_key(_rig, head):
    block = _own_key(head)
    block.value = 0.5
    block.keyframe_insert("value", frame=1)

    def back():
        head.data.shape_keys.animation_data_clear()
        block.value = 0.0

    return back


def pinned_key(_rig, head):
    _own_key(head)
    head.active_shape_key_index = len(head.data.shape_keys.key_blocks) - 1
    head.show_only_shape_key = True

    def back():
        head.show_only_shape_key = False

    return back


def absolute_keys(_rig, head):
    return _set(head.data.shape_keys, "use_relative", False)


def live_value(_rig, head):
    return _set(_live_key(head), "value", 0.5)


def live_muted(_rig, head):
    return _set(_live_key(head), "mute", True)


def live_masked(_rig, head):
    head.vertex_groups.new(name="part").add(range(40), 1.0, "REPLACE")
    return _set(_live_key(head), "vertex_group", "part")


def live_relative(_rig, head):
    return _set(_live_key(head), "relative_key", _own_key(head))


def key_edited_on_live(_rig, head):
    """Add a shape key of the user that is relative to the live shape key."""
    block = _own_key(head)
    block.relative_key = _live_key(head)
    block.value = 0.5
    return lambda: head.shape_key_remove(block)


def basis_edited(_rig, head):
    """Move vertices of the basis shape key, which stores the neutral form."""
    points = head.data.shape_keys.reference_key.points
    for point in points[:20]:
        point.co.y -= 0.03
    head.data.update_tag()


def moved(_rig, head):
    """Move the head mesh; the add-on moves it back, because the meshes of a face must fit."""
    return _set(head, "location", (0.1, 0.0, 0.2))


def turned(_rig, head):
    head.delta_rotation_euler = (0.0, 0.3, 0.0)

    def back():
        head.delta_rotation_euler = (0.0, 0.0, 0.0)

    return back


def orphan(_rig, head):
    rig = head.parent
    head.parent = None

    def back():
        head.parent = rig

    return back


def on_a_bone(_rig, head):
    head.parent_bone = "head"
    return _set(head, "parent_type", "BONE")


def constrained(rig, head):
    hold = head.constraints.new("LIMIT_LOCATION")
    hold.use_min_x, hold.min_x = True, rig.matrix_world.translation.x + 0.2
    return lambda: head.constraints.remove(hold)


def place_keyed(_rig, head):
    head.keyframe_insert("location", frame=1)
    return head.animation_data_clear


def cloth(_rig, head):
    modifier = head.modifiers.new("Cloth", "CLOTH")
    return lambda: head.modifiers.remove(modifier)


def rest_position(rig, _head):
    return _set(rig.data, "pose_position", "REST")


def other_inheritance(rig, _head):
    return _set(rig.data.bones["FACIAL_C_Jaw"], "inherit_scale", "NONE")


def bone_constraint(rig, _head):
    jaw = rig.pose.bones["FACIAL_C_Jaw"]
    hold = jaw.constraints.new("LIMIT_ROTATION")
    return lambda: jaw.constraints.remove(hold)


NOT_DIRECT = [
    before, before_in_renders, moved_down, doubled, doubled_before, removed, of_another, volume,
    envelopes, masked, own_key, driven_key, keyed_key, pinned_key, absolute_keys, live_value,
    live_muted, live_masked, live_relative, key_edited_on_live, orphan, on_a_bone,
    constrained, place_keyed, cloth,
]  # fmt: skip
WHOLE_FACE = [rest_position, other_inheritance, bone_constraint]


@contextmanager
def _row(change):
    """Context manager that adds the name of the tested change to the text of a failed assertion.

    One test makes all changes in one scene, and undoes each change before the next one.
    """
    try:
        yield
    except AssertionError as error:
        raise AssertionError(f"{change.__name__}: {error}") from error


def test_one_mesh_is_live_while_it_must_be(pair):
    for change in NOT_DIRECT:
        with _row(change):
            _is_live_for_a_while(pair, change)


def _is_live_for_a_while(pair, change):
    backs = pair.edit(change)
    head = scene.meshes(pair.direct)[0]
    plan = both_ways.plan(pair.direct)
    assert head.session_uid not in plan.direct
    assert any(head.name in str(why) for why in plan.why), plan.why
    assert both_ways.is_direct(pair.direct, 1), "its neighbour is Direct all the same"
    assert pair.apart() < both_ways.NEAR
    pair.check()
    for back in backs:
        back()
    both_ways.settle()
    assert both_ways.is_direct(pair.direct), both_ways.plan(pair.direct).why
    assert not both_ways.plan(pair.direct).posed
    pair.check()


def test_a_whole_face_is_live_while_it_must_be(pair):
    for change in WHOLE_FACE:
        with _row(change):
            backs = pair.edit(change)
            assert not both_ways.plan(pair.direct).direct
            pair.check()
            for back in backs:
                back()
            both_ways.settle()
            assert both_ways.is_direct(pair.direct)
            pair.check()


def after(kind):
    def change(_rig, head):
        modifier = head.modifiers.new(kind, kind)
        return lambda: head.modifiers.remove(modifier)

    change.__name__ = f"{kind.lower()} after"
    return change


def disabled_before(_rig, head):
    back = _smooth(head, 0)
    head.modifiers[0].show_viewport = head.modifiers[0].show_render = False
    return back


def muted_key(_rig, head):
    block = _own_key(head)
    block.value, block.mute = 0.8, True
    return lambda: head.shape_key_remove(block)


def unused_key(_rig, head):
    block = _own_key(head)
    return lambda: head.shape_key_remove(block)


def live_renamed(_rig, head):
    return _set(_live_key(head), "name", "my name")


def live_moved(_rig, head):
    """Move the live shape key down in the list, below a new shape key of the user."""
    _own_key(head)
    bpy.context.view_layer.objects.active = head
    head.active_shape_key_index = len(head.data.shape_keys.key_blocks) - 1
    assert bpy.ops.object.shape_key_move(type="UP") == {"FINISHED"}


def live_deleted(_rig, head):
    head.shape_key_remove(_live_key(head))


def enabled(_rig, head):
    """Enable the face's armature modifier, which Direct mode has disabled."""
    _armature(head).show_viewport = True


def modifier_renamed(_rig, head):
    _armature(head).name = "my armature"


def group_renamed(_rig, head):
    head.vertex_groups[0].name = "nothing"


def weights_scripted(_rig, head):
    head.vertex_groups[0].add(range(60), 0.9, "REPLACE")
    head.data.update_tag()


STAYS = [
    after("MIRROR"), after("SUBSURF"), after("SMOOTH"), after("TRIANGULATE"), disabled_before,
    muted_key, unused_key, live_renamed, live_moved, enabled, modifier_renamed, moved, turned,
    weights_scripted, group_renamed,
]  # fmt: skip


def test_a_mesh_stays_direct_through_an_edit(pair):
    for change in STAYS:
        with _row(change):
            backs = pair.edit(change)
            assert both_ways.is_direct(pair.direct), both_ways.plan(pair.direct).why
            assert pair.apart() < both_ways.NEAR
            pair.check()
            assert both_ways.is_direct(pair.direct)
            for back in filter(None, backs):
                back()
            both_ways.settle()
            assert pair.apart() < both_ways.NEAR


def test_an_edited_rest_form(pair):
    """A script's edit of the basis shape key shows after the next update, as in Live mode."""
    pair.edit(basis_edited)
    pair.check()
    assert both_ways.is_direct(pair.direct)


def test_sliders_and_frames_look_at_nothing_again(pair, monkeypatch):
    """Only edits make the add-on read the conditions of Direct mode and the weights again.

    Reading takes longer than a frame may take. A moved slider causes at most `look_quickly`, and a
    new frame causes no reading.
    """
    conditions, skins = (scene.submodule(f"scene.skinning.{n}") for n in ("conditions", "skins"))
    animation.animate(pair.direct)
    bpy.context.scene.frame_set(2)
    read = []
    for module, name in ((conditions, "look"), (conditions, "look_quickly"), (skins, "_read_skin"),
                         (skins, "_mark")):  # fmt: skip
        monkeypatch.setattr(module, name, _noted(getattr(module, name), read))
    for frame in range(3, 8):
        bpy.context.scene.frame_set(frame)
    assert not read
    for step in range(1, 5):
        pair.set(jawOpen=step / 5, eyeLookUpL=step / 6)
    assert set(read) <= {"look_quickly"}


def _noted(function, read):
    def noting(*given):
        read.append(function.__name__)
        return function(*given)

    return noting


def test_a_deleted_live_key(pair):
    """After the live shape key was deleted, both modes show the same: joints move the mesh.

    The blend shape channels have no effect then.
    """
    pair.edit(live_deleted)
    pair.check()


def test_another_object_with_the_same_data_keeps_the_rest_form(pair):
    """If another object shares the mesh data of the face, this object shows the rest form.

    The face's mesh gets a copy of the data, as in Live mode.
    """
    others = []

    def share(_rig, head):
        others.append(bpy.data.objects.new("other", head.data))
        bpy.context.scene.collection.objects.link(others[-1])

    pair.edit(share)
    assert both_ways.is_direct(pair.direct)
    places = np.array([[v.co for v in other.data.vertices] for other in others])
    np.testing.assert_allclose(places[0], places[1], atol=1e-6)
    np.testing.assert_allclose(*[_local(other) for other in others], atol=1e-6)
    pair.check()


def _local(item):
    return scene.evaluated(item) - np.array(item.matrix_world.translation)


def _mode(head, mode):
    bpy.context.view_layer.objects.active = head
    assert bpy.ops.object.mode_set(mode=mode) == {"FINISHED"}


def test_a_mesh_that_is_worked_on_is_live(pair):
    for mode in ("EDIT", "SCULPT", "WEIGHT_PAINT", "VERTEX_PAINT"):
        for rig in pair.each():
            _work(rig, mode, named=rig == pair.direct)
        assert both_ways.is_direct(pair.direct), mode
        pair.check()


def _work(rig, mode, named):
    """Enter a mode of Blender with the head mesh, and leave the mode.

    Args:
        rig: the face.
        mode: the mode, such as "SCULPT".
        named: True: the plan must say that the head mesh is not in Direct mode in this mode.
    """
    head = scene.meshes(rig)[0]
    _mode(head, mode)
    both_ways.settle()
    if named:
        plan = both_ways.plan(rig)
        assert head.session_uid not in plan.direct
        assert any(head.name in str(why) for why in plan.why)
        assert _armature(head).show_viewport
    if mode != "EDIT":
        scene.set_controls(rig, jawOpen=0.2)
    _mode(head, "OBJECT")
    bpy.context.view_layer.objects.active = None
    both_ways.settle()


def test_vertices_moved_in_edit_mode(pair):
    """Vertices that are moved in edit mode are stored in the basis shape key in both modes."""
    for rig in pair.each():
        head = scene.meshes(rig)[0]
        head.active_shape_key_index = 0
        _mode(head, "EDIT")
        both_ways.settle()
        edit = bmesh.from_edit_mesh(head.data)
        edit.verts.ensure_lookup_table()
        for vertex in edit.verts[:25]:
            vertex.co.z += 0.03
        bmesh.update_edit_mesh(head.data)
        _mode(head, "OBJECT")
        both_ways.settle()
    assert both_ways.is_direct(pair.direct)
    pair.check()
    rests = []
    for rig in pair.each():
        points = scene.meshes(rig)[0].data.shape_keys.reference_key.points
        rests.append(np.array([p.co for p in points]))
    np.testing.assert_array_equal(*rests)


def test_painted_weights_are_seen_while_and_after(pair):
    shown = pair.apart()
    heads = [scene.meshes(rig)[0] for rig in pair.each()]
    for head in heads:
        _mode(head, "WEIGHT_PAINT")
        both_ways.settle()
        head.vertex_groups["FACIAL_C_Jaw"].add(range(80), 1.0, "REPLACE")
        head.data.update_tag()
        both_ways.settle()
        if head == heads[0]:
            assert pair.apart() > 100 * both_ways.NEAR > shown
    assert pair.apart() < both_ways.NEAR
    for head in heads:
        _mode(head, "OBJECT")
    both_ways.settle()
    assert both_ways.is_direct(pair.direct)
    pair.check()


def test_another_number_of_vertices(pair):
    def cut(_rig, head):
        _mode(head, "EDIT")
        edit = bmesh.from_edit_mesh(head.data)
        edit.verts.ensure_lookup_table()
        bmesh.ops.delete(edit, geom=edit.verts[:9], context="VERTS")
        bmesh.update_edit_mesh(head.data)
        _mode(head, "OBJECT")

    pair.edit(cut)
    head = scene.meshes(pair.direct)[0]
    plan = both_ways.plan(pair.direct)
    assert head.session_uid not in plan.direct
    assert any(head.name in str(why) for why in plan.why)
    pair.set(jawOpen=0.1)  # the live keys stay as they were cut
    assert np.isfinite(scene.evaluated(head)).all()
    assert pair.apart() < both_ways.NEAR


def test_a_modifier_that_was_disabled_before_direct_mode(pair):
    """An armature modifier that the user disabled stays disabled when the face gets Direct mode.

    The modifier's mesh is left out of Direct mode, and the plan's reason names the mesh. When the
    user enables the modifier again, the mesh is in Direct mode.
    """
    rig, head = pair.live, scene.meshes(pair.live)[0]
    _armature(head).show_viewport = False
    both_ways.settle()
    del rig["risorius_skinning"]
    scene.update(scene.controls(rig))
    both_ways.settle()
    assert head.session_uid not in both_ways.plan(rig).direct
    assert any(head.name in str(why) for why in both_ways.plan(rig).why)
    scene.set_controls(rig, jawOpen=0.4)
    assert not _armature(head).show_viewport
    _armature(head).show_viewport = True
    both_ways.settle()
    assert both_ways.is_direct(rig)
