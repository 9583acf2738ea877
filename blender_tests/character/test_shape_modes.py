# SPDX-License-Identifier: GPL-3.0-or-later
"""Switching between shape modes keeps the face and all edits of keys; a channel can be tested."""

import bpy
import numpy as np
import pytest
from support import scene
from support.layout import drawn


def _head(rig):
    return scene.meshes(rig)[0]


def _keys(rig):
    return _head(rig).data.shape_keys.key_blocks


def _switch(mode):
    assert bpy.ops.risorius.set_shape_mode(mode=mode) == {"FINISHED"}


def _points(block):
    flat = np.empty(len(block.points) * 3, np.float32)
    block.points.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def _same_in_both_modes(rig, atol=2e-6):
    scene.set_controls(rig, jawOpen=0.6, mouthCornerPullL=0.8)
    before = scene.snapshot(rig)
    for mode in ("LIVE", "KEYS", "LIVE", "KEYS"):
        _switch(mode)
        np.testing.assert_allclose(scene.snapshot(rig), before, atol=atol)
        scene.set_controls(rig, jawOpen=0.1)
        scene.set_controls(rig, jawOpen=0.6)
        np.testing.assert_allclose(scene.snapshot(rig), before, atol=atol)


def _own_key(rig, name="own"):
    """Add a shape key as a user would: with a moved vertex, a value, a range and a vertex group."""
    head = _head(rig)
    block = head.shape_key_add(name=name, from_mix=False)
    block.points[3].co.z += 0.02
    block.value, block.slider_max, block.mute = 0.75, 3.0, False
    head.vertex_groups.new(name="mask").add([3, 4], 0.5, "REPLACE")
    block.vertex_group = "mask"
    return block


def test_own_keys_stay_as_they_are(mode, dna_file):
    rig = scene.load(dna_file, mode)
    first, second = _own_key(rig), _own_key(rig, "own too")
    second.relative_key = first
    head = _head(rig)
    curve = head.data.shape_keys.driver_add('key_blocks["own too"].value')
    curve.driver.expression = "0.25"
    held = _points(first).copy()
    _same_in_both_modes(rig)
    keys = _keys(rig)
    own = [b.name for b in keys if b.name.startswith("own")]
    assert own == ["own", "own too"]
    block = keys["own"]
    assert (block.value, block.slider_max, block.vertex_group) == (0.75, 3.0, "mask")
    assert keys["own too"].relative_key == block
    np.testing.assert_array_equal(_points(block), held)
    curves = head.data.shape_keys.animation_data.drivers
    kept = next(c for c in curves if c.data_path == 'key_blocks["own too"].value')
    assert kept.driver.expression == "0.25"


def test_an_own_key_driven_by_a_channel_is_the_users(mode, dna_file):
    rig = scene.load(dna_file, mode)
    head = _head(rig)
    block = _own_key(rig)
    block.vertex_group = ""
    curve = head.data.shape_keys.driver_add('key_blocks["own"].value')
    curve.driver.type = "SUM"
    variable = curve.driver.variables.new()
    variable.targets[0].id = rig
    variable.targets[0].data_path = '["channels"][0]'
    _same_in_both_modes(rig)
    scene.set_controls(rig, jawOpen=1.0)
    assert _keys(rig)["own"].value == pytest.approx(1.0)


def test_renamed_keys_are_found_and_keep_their_names(dna_file):
    rig = scene.load(dna_file, "KEYS")
    _keys(rig)["jaw"].name = "my jaw"
    _same_in_both_modes(rig)
    assert "my jaw" in _keys(rig)
    assert "jaw" not in _keys(rig)
    bad, seen = scene.invalid_drivers()
    assert not bad
    assert seen


def test_muted_keys_stay_muted(dna_file):
    rig = scene.load(dna_file, "KEYS")
    _keys(rig)["jaw"].mute = True
    _same_in_both_modes(rig)
    assert _keys(rig)["jaw"].mute


def test_an_edit_that_is_taken_back_is_summed_again(dna_file):
    rig = scene.load(dna_file, "KEYS")
    was = _keys(rig)["jaw"].points[5].co.x
    _keys(rig)["jaw"].points[5].co.x += 0.01
    _switch("LIVE")
    assert "jaw" in _keys(rig)
    _keys(rig)["jaw"].points[5].co.x = was
    _switch("LIVE")
    assert "jaw" not in _keys(rig)
    scene.set_controls(rig, jawOpen=0.6)
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE


def test_the_order_of_keys_returns(dna_file):
    rig = scene.load(dna_file, "KEYS")
    head = _head(rig)
    head.active_shape_key_index = head.data.shape_keys.key_blocks.find("same")
    with bpy.context.temp_override(object=head, active_object=head):
        bpy.ops.object.shape_key_move(type="TOP")
    order = [b.name for b in _keys(rig)]
    assert order[1] == "same"
    _same_in_both_modes(rig)
    assert [b.name for b in _keys(rig)] == order


@pytest.mark.parametrize("name", ["jaw", "pull_l"])
def test_a_moved_basis_does_not_make_keys_edited(dna_file, name):
    """An edit of the basis in edit mode does not make other shape keys count as edited.

    Blender moves the other shape keys with the basis.
    """
    rig = scene.load(dna_file, "KEYS")
    _move_in_edit_mode(_head(rig), range(0, 100, 3))
    _same_in_both_modes(rig)
    _switch("LIVE")
    assert [b.name for b in _keys(rig)] == ["Basis", "<channel sum>"]


def _move_in_edit_mode(item, vertices):
    import bmesh

    bpy.context.view_layer.objects.active = item
    item.active_shape_key_index = 0
    bpy.ops.object.mode_set(mode="EDIT")
    edit = bmesh.from_edit_mesh(item.data)
    edit.verts.ensure_lookup_table()
    for vertex in vertices:
        edit.verts[vertex].co.x += 0.0123
    bmesh.update_edit_mesh(item.data)
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = item.parent


def test_a_basis_edited_in_live_mode_moves_the_face(dna_file):
    rig = scene.load(dna_file, "LIVE")
    scene.set_controls(rig, mouthCornerPullL=0.8)
    before = scene.snapshot(rig)
    _move_in_edit_mode(_head(rig), [5, 6])
    moved = np.abs(scene.snapshot(rig) - before).max(axis=1)
    assert set(np.flatnonzero(moved > 1e-5)) == {5, 6}
    shown = scene.snapshot(rig)
    scene.set_controls(rig, mouthCornerPullL=0.1)
    scene.set_controls(rig, mouthCornerPullL=0.8)
    np.testing.assert_allclose(scene.snapshot(rig), shown, atol=1e-6)
    _same_in_both_modes(rig)


def test_the_channel_sum_is_protected_and_found_by_any_name(dna_file):
    rig = scene.load(dna_file, "LIVE")
    block = _keys(rig)["<channel sum>"]
    assert block.lock_shape
    assert _head(rig).active_shape_key_index == 0
    block.name = "something"
    scene.set_controls(rig, jawOpen=0.5)
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE
    _switch("LIVE")
    assert [b.name for b in _keys(rig)] == ["Basis", "something"]
    _same_in_both_modes(rig)


def test_a_mesh_of_other_topology_is_left_alone(mode, dna_file):
    rig = scene.load(dna_file, mode)
    head = _head(rig)
    bpy.context.view_layer.objects.active = head
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.mesh.subdivide()
    bpy.ops.object.mode_set(mode="OBJECT")
    count, keys = len(head.data.vertices), len(_keys(rig))
    _switch("KEYS" if mode != "KEYS" else "LIVE")
    assert (len(head.data.vertices), len(_keys(rig))) == (count, keys)


def test_a_driven_key_set_by_hand_is_not_stuck(dna_file):
    rig = scene.load(dna_file, "KEYS")
    _keys(rig)["jaw"].value = 1.0
    bpy.context.view_layer.update()
    assert _keys(rig)["jaw"].value == pytest.approx(0.0)


def _channel_of(rig, path, name, value):
    """Largest coordinate difference between both meshes and the oracle, in metres.

    In the oracle, the blend shape channel `name` has the weight `value`.
    """
    import risorius
    from support import oracle

    dna = risorius.load(str(path))
    pose = risorius.Rig(dna).evaluate(scene.raw_of(rig, path), 0)
    weights = pose.blend_shapes.copy()
    weights[list(dna.blend_shape_channel_names).index(name)] = value

    class Pose:
        joints, blend_shapes = pose.joints, weights

    return max(
        np.abs(scene.evaluated(scene.meshes(rig)[i]) - oracle.vertices(dna, i, Pose)).max()
        for i in (0, 1)
    )


def _is_shown(rig, path, name, value):
    return _channel_of(rig, path, name, value) < 2e-5


def test_override_shows_one_shape(mode, dna_file):
    rig = scene.load(dna_file, mode)
    scene.set_controls(rig, jawOpen=0.3)
    assert bpy.ops.risorius.test_channel(channel="1", value=0.9) == {"FINISHED"}
    assert _is_shown(rig, dna_file, "pull_l", 0.9)
    assert not _is_shown(rig, dna_file, "pull_l", 0.0)
    bpy.context.window_manager.risorius_test = 0.4
    assert _is_shown(rig, dna_file, "pull_l", 0.4)
    assert bpy.context.window_manager.risorius_test == pytest.approx(0.4)
    bpy.context.view_layer.update()
    assert _is_shown(rig, dna_file, "pull_l", 0.4)


def _end_by_frame(_rig, _folder):
    bpy.context.scene.frame_set(bpy.context.scene.frame_current + 1)


def _end_by_control(rig, _folder):
    scene.set_controls(rig, browDownL=0.5)


def _end_by_save(_rig, folder):
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "test.blend"))


def _end_by_hand(_rig, _folder):
    assert bpy.ops.risorius.test_channel(end=True) == {"FINISHED"}


def _end_by_render(_rig, _folder):
    handlers = scene.submodule("scene.events.handlers")
    ours = [h for h in bpy.app.handlers.render_init if h is handlers._end_tests]
    assert len(ours) == 1
    ours[0](bpy.context.scene)


@pytest.mark.parametrize(
    "end", [_end_by_frame, _end_by_control, _end_by_save, _end_by_hand, _end_by_render]
)
def test_override_ends_by_itself(mode, dna_file, tmp_path, end):
    rig = scene.load(dna_file, mode)
    scene.set_controls(rig, jawOpen=0.3)
    bpy.ops.risorius.test_channel(channel="1", value=0.9)
    end(rig, tmp_path)
    raw = scene.raw_of(rig, dna_file)
    assert scene.error_against_oracle(rig, dna_file, raw) < scene.TOLERANCE
    assert "risorius_test" not in rig
    assert bpy.context.window_manager.risorius_test == 0.0


def test_the_panel_draws_with_and_without_a_test(dna_file):
    scene.load(dna_file)
    panel = scene.submodule("ui.face.channel_preview").RISORIUS_PT_shape_test
    assert panel.poll(bpy.context)
    for value, buttons in ((None, 1), (0.5, 2)):
        if value is not None:
            bpy.ops.risorius.test_channel(channel="1", value=value)
        assert drawn(panel).operators == ["risorius.test_channel"] * buttons


def test_only_shapes_that_move_something_are_offered(dna_file):
    rig = scene.load(dna_file, "KEYS")
    items = scene.submodule("ui.face.channel_preview")._channels(None, bpy.context)
    assert [i[1] for i in items] == [b.name for b in _keys(rig)[1:]]
    with pytest.raises(TypeError):
        bpy.ops.risorius.test_channel(channel="17", value=1.0)
