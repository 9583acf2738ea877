# SPDX-License-Identifier: GPL-3.0-or-later
"""Replacing the DNA file of a face: the user's additions stay, removed parts are listed."""

import bpy
import numpy as np
import pytest
from support import scene
from support.faces import other_face, renumbered, small_face

PREFIX = "CTRL_expressions."


def _save(dna, folder, name="other.dna"):
    path = folder / name
    dna.save(str(path))
    return path


@pytest.fixture
def other_file(tmp_path):
    return _save(other_face(), tmp_path)


def _replace(path):
    assert bpy.ops.risorius.replace_dna(filepath=str(path)) == {"FINISHED"}


def _report(name="Small"):
    return bpy.data.texts[f"{name} replace report"].as_string()


def _right(rig, path, seed=5):
    """Check that a face shows the poses of the DNA file `path`, and that no driver is broken.

    The sliders get random values, except those of the gaze, which keep their values.
    """
    bone = scene.face(rig)
    random = np.random.default_rng(seed)
    labels = [k for k in bone.keys() if k.startswith(PREFIX)]  # noqa: SIM118
    for label in labels:
        if "eyeLook" not in label:
            bone[label] = float(random.random())
    scene.update(scene.controls(rig))
    lod = rig["risorius_lod"]
    raw = scene.raw_of(rig, path)
    assert scene.error_against_oracle(rig, path, raw, lod=lod) < scene.TOLERANCE
    bad, seen = scene.invalid_drivers()
    assert not bad
    assert seen


def _points(block):
    flat = np.empty(len(block.points) * 3, np.float32)
    block.points.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def _keys(rig, mesh=0):
    return scene.meshes(rig)[mesh].data.shape_keys.key_blocks


def test_a_file_with_other_numbers_everywhere(mode, dna_file, other_file):
    rig = scene.load(dna_file, mode)
    controls, there = scene.controls(rig), scene.meshes(rig)
    pointers = [o.as_pointer() for o in (rig, controls, *there.values())]
    data = [o.data.as_pointer() for o in (rig, controls, *there.values())]
    scene.face(rig).keyframe_insert(f'["{PREFIX}jawOpen"]', frame=1)
    _replace(other_file)
    assert bpy.data.objects["Small_rig"] == rig
    there = scene.meshes(rig)
    assert [o.as_pointer() for o in (rig, scene.controls(rig), *there.values())] == pointers
    assert [o.data.as_pointer() for o in (rig, controls, *there.values())] == data
    _clear_action(controls)
    _right(rig, other_file)
    assert len(rig["channels"]) == 5
    assert not [o for o in bpy.data.objects if ".001" in o.name]
    assert len(bpy.data.armatures) == 2
    assert not [c for c in bpy.data.collections if c.name != "Small"]


def _clear_action(controls):
    """Remove the action of the controls, because `_right` cannot set sliders that have keys."""
    assert controls.animation_data.action is not None
    controls.animation_data.action = None


def test_the_report_lists_what_is_gone_and_what_is_new(mode, dna_file, other_file):
    rig = scene.load(dna_file, mode)
    scene.face(rig).keyframe_insert('["twice"]', frame=1)
    _replace(other_file)
    report = _report()
    for words in (
        "The joint user_joint.001 is gone.",
        "New joints: new_joint.",
        "The control CTRL_expressions.browDownL is gone.",
        "The control twice.001 is gone.",
        "New controls: CTRL_expressions.tongueUp.",
        "The blend shape yyyy",
        "New blend shapes: new_shape.",
        "New animated maps: new_map.",
    ):
        assert words in report
    assert "The control twice is" not in report
    assert f"{PREFIX}tongueUp" in scene.face(rig)
    assert f"{PREFIX}browDownL" not in scene.face(rig)


def test_keys_of_a_control_that_is_gone_stay(dna_file, other_file):
    rig = scene.load(dna_file)
    path = f'pose.bones["face"]["{PREFIX}browDownL"]'
    scene.face(rig).keyframe_insert(f'["{PREFIX}browDownL"]', frame=1)
    action = scene.controls(rig).animation_data.action
    _replace(other_file)
    curves = scene.submodule("scene.base.compat").curves_of(action)
    assert path in [c.data_path for c in curves]
    assert f"{PREFIX}browDownL" in scene.face(rig)
    assert "browDownL is gone; its keys and drivers are kept" in _report()


def test_actions_nla_and_drivers_move_the_new_face(mode, dna_file, other_file):
    rig = scene.load(dna_file, mode)
    controls, face = scene.controls(rig), scene.face(rig)
    label = f'["{PREFIX}jawOpen"]'
    face[f"{PREFIX}jawOpen"] = 0.25
    face.keyframe_insert(label, frame=1)
    data = controls.animation_data
    strip = data.nla_tracks.new().strips.new("jaw", 1, data.action)
    strip.extrapolation = "HOLD"
    data.action = None
    curve = face.driver_add(f'["{PREFIX}mouthCornerPullL"]')
    curve.driver.expression = "0.75"
    _replace(other_file)
    bpy.context.scene.frame_set(2)
    bpy.context.view_layer.update()
    raw = scene.raw_of(rig, other_file)
    raw[3], raw[1] = 0.25, 0.75  # jawOpen and mouthCornerPullL in the new file
    assert scene.error_against_oracle(rig, other_file, raw) < scene.TOLERANCE


def _decorate(rig):
    """Add many kinds of data that a user may add to a character. Returns the head mesh object."""
    head = scene.meshes(rig)[0]
    head.modifiers.new("Subdivision", "SUBSURF").levels = 0
    head.modifiers.new("First", "SMOOTH").factor = 0.0
    head.modifiers.move(2, 0)
    head.vertex_groups.new(name="mine").add([3, 4, 5], 0.5, "REPLACE")
    head.modifiers["First"].vertex_group = "mine"
    head.data.uv_layers.new(name="second").uv[7].vector = (0.25, 0.75)
    colour = head.data.color_attributes.new("paint", "FLOAT_COLOR", "POINT")
    colour.data[9].color = (1.0, 0.5, 0.25, 1.0)
    head.data.materials.append(bpy.data.materials.new("own"))
    head.data.polygons[2].material_index = 1
    head["note"] = "mine"
    head.constraints.new("LIMIT_SCALE")
    head.data.shape_keys or head.shape_key_add(name="Basis", from_mix=False)
    own = head.shape_key_add(name="own", from_mix=False)
    own.points[11].co.z += 0.02
    own.value = 0.5
    empty = bpy.data.objects.new("hat", None)
    bpy.context.scene.collection.objects.link(empty)
    empty.parent, empty.parent_type, empty.parent_bone = rig, "BONE", "head"
    pin = bpy.data.objects.new("pin", None)
    bpy.context.scene.collection.objects.link(pin)
    pin.parent, pin.parent_type, pin.parent_vertices = head, "VERTEX", (20, 0, 0)
    rig.pose.bones["user_joint"].constraints.new("COPY_ROTATION")
    rig.pose.bones["user_joint"].location.x = 0.01
    rig.pose.bones["head"]["note"] = 7
    scene.controls(rig).location.x = 2.0
    scene.meshes(rig)[1].hide_render = True
    return head


def _still_decorated(rig):
    head = scene.meshes(rig)[0]
    assert [m.name for m in head.modifiers] == ["First", "Armature", "Subdivision"]
    assert head.modifiers["First"].vertex_group == "mine"
    assert head.modifiers["Armature"].object == rig
    assert "second" in head.data.uv_layers
    assert "paint" in head.data.color_attributes
    assert [m.name for m in head.data.materials] == ["Small_head", "own"]
    assert (head["note"], head.constraints[0].type) == ("mine", "LIMIT_SCALE")
    assert head.data.shape_keys.key_blocks["own"].value == pytest.approx(0.5)
    hat = bpy.data.objects["hat"]
    assert (hat.parent, hat.parent_bone) == (rig, "head")
    bone = rig.pose.bones["user_joint"]
    assert bone.constraints[0].type == "COPY_ROTATION"
    assert bone.location.x == pytest.approx(0.01)
    assert rig.pose.bones["head"]["note"] == 7
    assert scene.controls(rig).location.x == 2.0
    assert rig.location.x == 2.0
    assert scene.meshes(rig)[1].hide_render
    return head


def _weights(item, name):
    index = item.vertex_groups[name].index
    return {v.index: g.weight for v in item.data.vertices for g in v.groups if g.group == index}


def test_what_users_add_stays(mode, dna_file, other_file):
    rig = scene.load(dna_file, mode)
    head = _decorate(rig)
    key = _points(head.data.shape_keys.key_blocks["own"]).copy()
    _replace(other_file)
    head = _still_decorated(rig)
    assert _weights(head, "mine") == {3: 0.5, 4: 0.5, 5: 0.5}
    assert tuple(head.data.uv_layers["second"].uv[7].vector) == (0.25, 0.75)
    assert tuple(head.data.color_attributes["paint"].data[9].color) == (1.0, 0.5, 0.25, 1.0)
    assert head.data.polygons[2].material_index == 1
    np.testing.assert_array_equal(_points(head.data.shape_keys.key_blocks["own"]), key)
    assert tuple(bpy.data.objects["pin"].parent_vertices) == (20, 0, 0)


def test_a_face_with_other_topology(mode, dna_file, tmp_path):
    """After a replacement by a file with a finer head mesh, the user's data are still there.

    They move to new vertices near their old places.
    """
    path = _save(small_face(head_grid=(19, 21)), tmp_path)
    rig = scene.load(dna_file, mode)
    head = _decorate(rig)
    pointer, key = head.data.as_pointer(), head.data.shape_keys.as_pointer()
    curve = head.data.shape_keys.driver_add('key_blocks["own"].value')
    curve.driver.expression = "0.5"
    head.data.uv_layers.active = head.data.uv_layers["second"]
    spot = np.array(head.data.vertices[11].co)
    pinned = np.array(head.data.vertices[20].co)
    _replace(path)
    head = _still_decorated(rig)
    assert (head.data.as_pointer(), head.data.shape_keys.as_pointer()) == (pointer, key)
    assert len(head.data.vertices) == 19 * 21
    keys = head.data.shape_keys.key_blocks
    assert head.data.uv_layers.active.name == "second"
    moved = np.linalg.norm(_points(keys["own"]) - _points(keys["Basis"]), axis=1)
    place = _points(keys["Basis"])[np.argmax(moved)]
    assert 0.01 < moved.max() <= 0.0201
    assert np.linalg.norm(place - spot) < 0.015
    assert np.count_nonzero(moved > 1e-6) < 40
    assert len(_weights(head, "mine")) > 3
    assert {p.material_index for p in head.data.polygons} == {0, 1}
    pin = head.data.vertices[bpy.data.objects["pin"].parent_vertices[0]].co
    assert np.linalg.norm(np.array(pin) - pinned) < 0.015
    kept = bpy.data.meshes["Small_head_lod0_mesh before replace"]
    assert len(kept.vertices) == 12 * 14
    assert len(kept.shape_keys.key_blocks["own"].points) == 12 * 14
    assert kept.use_fake_user
    assert "Small_head_lod0_mesh before replace" in _report()
    keys["own"].driver_remove("value")
    keys["own"].value = 0.0
    scene.controls(rig).location.x = 0.0
    rig.pose.bones["user_joint"].location.x = 0.0
    for owner in (rig.pose.bones["user_joint"], head):
        owner.constraints.remove(owner.constraints[0])
    _right(rig, path)


def test_an_untouched_mesh_leaves_no_copy(mode, dna_file, tmp_path):
    path = _save(small_face(head_grid=(19, 21)), tmp_path)
    rig = scene.load(dna_file, mode)
    before = len(bpy.data.meshes)
    _replace(path)
    assert len(bpy.data.meshes) == before
    _right(rig, path)


def test_edits_lie_on_top_of_the_new_file(dna_file, tmp_path):
    """Edits of the user stay after a replacement: their offsets are added to the new vertices.

    The user has edited a shape key and the basis.
    """
    dna = other_face()
    dna.meshes[0].positions = dna.meshes[0].positions * np.float32(1.02)
    for target in dna.meshes[0].blend_shape_targets:
        target.deltas = target.deltas * np.float32(1.5)
    path = _save(dna, tmp_path)
    clean = scene.load(path, "KEYS")
    wanted = _points(_keys(clean)["jaw"]).astype(float)
    basis = _points(_keys(clean)["Basis"]).astype(float)
    rig = scene.load(dna_file, "KEYS")
    _keys(rig)["jaw"].points[5].co.x += 0.01
    move = np.array([0.0, 0.002, 0.0])
    for block in _keys(rig):
        block.points[40].co.y += 0.002
    bpy.context.view_layer.objects.active = rig
    _replace(path)
    wanted[5, 0] += 0.01
    wanted[40] += move
    basis[40] += move
    np.testing.assert_allclose(_points(_keys(rig)["jaw"]), wanted, atol=3e-7)
    np.testing.assert_allclose(_points(_keys(rig)["Basis"]), basis, atol=3e-7)
    untouched = np.setdiff1d(np.arange(len(basis)), [40])
    clean_basis = _points(_keys(clean)["Basis"])
    np.testing.assert_array_equal(_points(_keys(rig)["Basis"])[untouched], clean_basis[untouched])


def test_an_edited_key_of_a_channel_that_is_gone_becomes_the_users(mode, dna_file, tmp_path):
    path = _save(renumbered(small_face(), channels=[0, 2, 3, 4, 5]), tmp_path)
    rig = scene.load(dna_file, "KEYS")
    block = _keys(rig)["pull_l"]
    block.points[5].co.x += 0.01
    held = _points(block).copy()
    bpy.ops.risorius.set_shape_mode(mode=mode)
    _replace(path)
    block = _keys(rig)["pull_l"]
    np.testing.assert_array_equal(_points(block), held)
    assert block.value == 0.0
    drivers = scene.meshes(rig)[0].data.shape_keys.animation_data.drivers
    assert 'key_blocks["pull_l"].value' not in [c.data_path for c in drivers]
    assert "your edited key stays" in _report()
    assert "jaw" in _keys(rig) or mode != "KEYS"
    _right(rig, path)


def test_painted_weights_stay(dna_file, tmp_path):
    dna = other_face()
    mesh = dna.meshes[0]
    mesh.skin_weights = np.roll(mesh.skin_weights.reshape(-1, 5), 1, axis=1).ravel()
    path = _save(dna, tmp_path)
    rig = scene.load(dna_file)
    head = scene.meshes(rig)[0]
    head.vertex_groups["FACIAL_C_Jaw"].add([6], 0.125, "REPLACE")
    others = {n: _weights(head, n).get(6) for n in ("head", "neck_01", "FACIAL_L_Eye")}
    _replace(path)
    assert _weights(head, "FACIAL_C_Jaw")[6] == 0.125
    assert {n: _weights(head, n).get(6) for n in others} == others
    clean = scene.meshes(scene.load(path))[0]
    for name in ("head", "neck_01", "FACIAL_C_Jaw", "FACIAL_L_Eye"):
        ours, theirs = _weights(head, name), _weights(clean, name)
        ours.pop(6)
        theirs.pop(6)
        assert ours == theirs
    assert "keeps your weights at 1 vertices" in _report()


def test_renamed_bones_stay_renamed(mode, dna_file, other_file):
    rig = scene.load(dna_file, mode)
    rig.data.bones["FACIAL_C_Jaw"].name = "kiefer"
    _replace(other_file)
    assert "kiefer" in rig.data.bones
    assert "FACIAL_C_Jaw" not in rig.data.bones
    assert rig.data.bones["kiefer"]["dna_joint"] == 6
    assert "keeps your weights" not in _report()
    _right(rig, other_file)


def test_own_bones_follow_their_joints(dna_file, other_file):
    rig = scene.load(dna_file)
    armatures = scene.submodule("scene.character.armatures")
    with armatures.edit_armature(bpy.context, rig.data) as bones:
        for name, parent in (("horn", "head"), ("tail", "user_joint.001")):
            bone = bones.new(name)
            bone.head, bone.tail = (0.0, -0.1, 1.7), (0.0, -0.1, 1.8)
            bone.parent = bones[parent]
    before = rig.data.bones["head"].matrix_local.inverted() @ rig.data.bones["horn"].matrix_local
    _replace(other_file)
    assert rig.data.bones["horn"].parent.name == "head"
    assert rig.data.bones["tail"].parent.name == "user_joint"
    after = rig.data.bones["head"].matrix_local.inverted() @ rig.data.bones["horn"].matrix_local
    np.testing.assert_allclose(np.array(after), np.array(before), atol=2e-6)


def test_a_bone_that_the_user_connected_stays_where_it_was_put(dna_file, other_file):
    rig = scene.load(dna_file)
    armatures = scene.submodule("scene.character.armatures")
    with armatures.edit_armature(bpy.context, rig.data) as bones:
        bones["FACIAL_L_Eye"].use_connect = True  # its head jumps to the parent's tail

    def local():
        bones = rig.data.bones
        return np.array(bones["head"].matrix_local.inverted() @ bones["FACIAL_L_Eye"].matrix_local)

    put = local()
    _replace(other_file)
    assert not rig.data.bones["FACIAL_L_Eye"].use_connect
    np.testing.assert_allclose(local(), put, atol=1e-5)


def test_a_bones_copy_bears_no_joint_that_is_gone(dna_file, other_file):
    rig = scene.load(dna_file)
    joints = {bone.name: bone["dna_joint"] for bone in rig.data.bones}
    armatures = scene.submodule("scene.character.armatures")
    with armatures.edit_armature(bpy.context, rig.data) as bones:
        for name in joints:
            bone = bones.new(f"copy_{name}")
            bone.head, bone.tail = (0.0, 0.0, 1.0), (0.0, 0.0, 1.1)
    for name, joint in joints.items():
        rig.data.bones[f"copy_{name}"]["dna_joint"] = joint
    _replace(other_file)
    gone = {name for name in joints if name not in rig.data.bones}
    assert gone
    for name in joints:
        copy = rig.data.bones[f"copy_{name}"]
        if name in gone:
            assert "dna_joint" not in copy
        else:
            assert copy["dna_joint"] == rig.data.bones[name]["dna_joint"]


def test_a_mesh_without_faces_lends_nothing_and_breaks_nothing():
    transfer = scene.submodule("scene.file.transfer")
    bare, whole = bpy.data.meshes.new("bare"), bpy.data.meshes.new("whole")
    bare.from_pydata([(0, 0, 0), (1, 0, 0)], [(0, 1)], [])
    bare.attributes.new("mine", "FLOAT", "POINT")
    whole.from_pydata([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [], [(0, 1, 2)])
    points = np.zeros((2, 3), np.float32)
    old = transfer.OldSurface(bare, points)
    assert not old.usable
    old.give(whole, np.zeros((3, 3), np.float32), transfer.SameVertices())
    assert "mine" not in whole.attributes


@pytest.mark.parametrize("skinning", ["AUTO", "LIVE"])
def test_joints_that_the_new_file_does_not_move_go_back_to_rest(skinning, dna_file, tmp_path):
    dna = small_face()
    dna.joint_groups = dna.joint_groups[:1]  # without the eye's group
    path = _save(dna, tmp_path)
    rig = scene.load(dna_file, skinning)
    scene.set_controls(rig, eyeLookUpL=1.0, jawOpen=0.5)
    bone = rig.pose.bones["FACIAL_L_Eye"]
    assert (bone.rotation_quaternion.angle > 0.1) == (skinning == "LIVE")
    _replace(path)
    _right(rig, path)
    scene.pose_bones(rig)
    assert bone.rotation_quaternion.angle == 0.0
    _right(rig, path)


def test_a_control_that_is_gone_but_drives_something_stays(dna_file, other_file):
    rig = scene.load(dna_file)
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "POINT"))
    bpy.context.scene.collection.objects.link(lamp)
    variable = lamp.driver_add("location", 0).driver.variables.new()
    variable.targets[0].id = scene.controls(rig)
    variable.targets[0].data_path = f'pose.bones["face"]["{PREFIX}browDownL"]'
    _replace(other_file)
    assert f"{PREFIX}browDownL" in scene.face(rig)


def test_an_edited_joint_stays_edited(dna_file, other_file):
    clean = scene.load(other_file)
    rig = scene.load(dna_file)
    armatures = scene.submodule("scene.character.armatures")
    with armatures.edit_armature(bpy.context, rig.data) as bones:
        bones["FACIAL_L_Eye"].head.x += 0.01
        bones["FACIAL_L_Eye"].tail.x += 0.01

    def local(of):
        bones = of.data.bones
        return np.array(bones["head"].matrix_local.inverted() @ bones["FACIAL_L_Eye"].matrix_local)

    moved = local(rig)
    _replace(other_file)
    np.testing.assert_allclose(local(rig), moved, atol=1e-5)  # tolerance of a roll angle in float32
    assert np.abs(local(rig) - local(clean)).max() > 0.004
    head = np.array(rig.data.bones["head"].matrix_local)
    np.testing.assert_allclose(head, np.array(clean.data.bones["head"].matrix_local), atol=1e-6)
    assert "Your edit of the joint FACIAL_L_Eye was carried over" in _report("Small.001")


def test_control_bones_go_with_the_new_face_unless_the_user_moved_them(dna_file, other_file):
    clean = scene.controls(scene.load(other_file)).data.bones
    rig = scene.load(dna_file)
    data = scene.controls(rig).data
    armatures = scene.submodule("scene.character.armatures")
    with armatures.edit_armature(bpy.context, data) as bones:
        bones["neck"].head.x += 0.01
        bones["neck"].tail.x += 0.01
    moved, before = data.bones["neck"].head_local.copy(), data.bones["head"].head_local.copy()
    other = bpy.data.objects.new("other", data)  # another object that shares the bones
    _replace(other_file)
    assert (other.data.bones["head"].head_local - before).length == 0
    data = scene.controls(rig).data
    assert (data.bones["neck"].head_local - moved).length < 1e-6
    assert (data.bones["head"].head_local - clean["head"].head_local).length < 1e-6
    assert (clean["head"].head_local - before).length > 1e-4
    assert (clean["neck"].head_local - moved).length > 1e-3


def _uvs(item):
    flat = np.empty(len(item.data.loops) * 2, np.float32)
    item.data.uv_layers["UVMap"].uv.foreach_get("vector", flat)
    return flat.reshape(-1, 2)


def test_a_file_with_another_uv_map_brings_it_and_leaves_nothing_of_its_own(dna_file, tmp_path):
    other = small_face()
    other.meshes[0].texture_coordinates = other.meshes[0].texture_coordinates * np.float32(0.5)
    path = _save(other, tmp_path)
    rig, clean = scene.load(dna_file), scene.load(path)
    before, meshes = _uvs(scene.meshes(rig)[0]), set(bpy.data.meshes)
    bpy.context.view_layer.objects.active = rig
    _replace(path)
    assert np.abs(_uvs(scene.meshes(clean)[0]) - before).max() > 0.2
    np.testing.assert_array_equal(_uvs(scene.meshes(rig)[0]), _uvs(scene.meshes(clean)[0]))
    assert set(bpy.data.meshes) == meshes


def test_drivers_of_users_follow_names_not_numbers(mode, dna_file, other_file):
    rig = scene.load(dna_file, mode)
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "POINT"))
    bpy.context.scene.collection.objects.link(lamp)
    for axis, path in enumerate(('["channels"][0]', '["maps"][0]', '["channels"][3]')):
        curve = lamp.driver_add("location", axis)
        curve.driver.type = "SUM"
        variable = curve.driver.variables.new()
        variable.targets[0].id, variable.targets[0].data_path = rig, path
    bpy.context.view_layer.update()
    _replace(other_file)
    scene.set_controls(rig, jawOpen=0.5)
    bpy.context.view_layer.update()
    shown = lamp.evaluated_get(bpy.context.evaluated_depsgraph_get()).location
    assert tuple(shown) == pytest.approx((0.5, 0.5, 0.0))
    bad, seen = scene.invalid_drivers()
    assert not bad
    assert seen
    assert ": what it drove reads 0 now" in _report()
    _replace(_save(small_face(), other_file.parent, "back.dna"))
    paths = [c.driver.variables[0].targets[0].data_path for c in lamp.animation_data.drivers]
    assert paths == ['["channels"][0]', '["maps"][0]', '["channels"][3]']


def test_renamed_keys_keep_their_channel(dna_file, other_file):
    rig = scene.load(dna_file, "KEYS")
    _keys(rig)["pull_r"].name = "mein"
    _replace(other_file)
    assert "mein" in _keys(rig)
    assert "pull_r" not in _keys(rig)
    _right(rig, other_file)


def test_names_given_to_keys_outlast_live_mode_and_another_file(dna_file, other_file):
    rig = scene.load(dna_file, "KEYS")
    _keys(rig)["pull_r"].name = "mein"
    bpy.ops.risorius.set_shape_mode(mode="LIVE")
    _replace(other_file)
    assert [b.name for b in _keys(rig)] == ["Basis", "<channel sum>"]
    bpy.ops.risorius.set_shape_mode(mode="KEYS")
    assert "mein" in _keys(rig)
    assert "pull_r" not in _keys(rig)
    _right(rig, other_file)


def _duplicate(rig, linked):
    for item in (rig, scene.controls(rig), *scene.meshes(rig).values()):
        item.select_set(True)
    bpy.ops.object.duplicate(linked=linked)
    bpy.context.view_layer.update()
    return next(o for o in bpy.context.selected_objects if "risorius_controls" in o)


@pytest.mark.parametrize("linked", [False, True])
def test_only_one_of_two_copies_is_replaced(mode, dna_file, other_file, linked):
    rig = scene.load(dna_file, mode)
    copy = _duplicate(rig, linked)
    bpy.context.view_layer.objects.active = scene.controls(copy)
    _replace(other_file)
    _right(copy, other_file)
    _right(rig, dna_file)


def test_a_file_without_the_level_that_was_built(mode, dna_file, tmp_path):
    rig = scene.load(dna_file, mode, lods=(False, True) + (False,) * 6)
    dna = small_face()
    dna.lod_mesh_mapping = [[0, 1], []]
    path = _save(dna, tmp_path)
    _replace(path)
    assert sorted(scene.meshes(rig)) == [0, 1]
    assert not any(m.hide_render for m in scene.meshes(rig).values())
    _right(rig, path)


def test_a_failure_while_building_changes_nothing(
    mode, dna_file, other_file, monkeypatch, tracebacks
):
    rig = scene.load(dna_file, mode)
    before = _whole(rig)

    def fail(*_arguments):
        raise MemoryError("planted")

    monkeypatch.setattr(scene.submodule("scene.character.meshes"), "set_mode", fail)
    with pytest.raises(RuntimeError, match="planted"):
        bpy.ops.risorius.replace_dna(filepath=str(other_file))
    assert [text.splitlines()[-1] for text in tracebacks] == ["MemoryError: planted"]
    tracebacks.clear()
    assert _whole(rig) == before


@pytest.mark.parametrize(
    "conventions",
    [
        {"axes": ("left", "up", "front"), "rotation_signs": (1, -1, 1)},
        {"axes": ("front", "left", "up"), "rotation_sequence": "zyx", "rotation_unit": "radians"},
        {"translation_unit": "m"},
    ],
)
def test_another_unit_or_axes(mode, dna_file, tmp_path, conventions):
    path = _save(other_face(**conventions), tmp_path)
    rig = scene.load(dna_file, mode)
    _replace(path)
    _right(rig, path)


def test_the_unit_of_the_import_stays(dna_file, other_file):
    rig = scene.load(dna_file)
    bpy.context.scene.unit_settings.scale_length = 0.01
    _replace(other_file)
    assert rig["risorius_unit"] == 1.0
    _right(rig, other_file)


def test_levels_of_detail(mode, dna_file, tmp_path):
    lods = (True, True) + (False,) * 6
    rig = scene.load(dna_file, mode, lods=lods)
    bpy.ops.risorius.set_lod(lod=1)
    dna = other_face()
    dna.mesh_names = ["head_lod0_mesh", "tongue_lod0_mesh", "head_lod1_mesh"]
    path = _save(dna, tmp_path)
    _replace(path)
    assert sorted(scene.meshes(rig)) == [0, 1, 2]
    tongue = scene.meshes(rig)[1]
    assert tongue.name == "Small_tongue_lod0_mesh"
    assert (tongue.parent, tongue.modifiers[0].object, tongue["risorius_rig"]) == (rig,) * 3
    assert scene.meshes(rig)[1].users_collection == scene.meshes(rig)[0].users_collection
    assert "teeth_lod0_mesh" not in "".join(o.name for o in bpy.data.objects)
    assert "The mesh Small_teeth_lod0_mesh is gone." in _report()
    assert [m.hide_render for _, m in sorted(scene.meshes(rig).items())] == [True, True, False]
    _right(rig, path)
    bpy.ops.risorius.set_lod(lod=0)
    _right(rig, path)


def test_a_mesh_that_is_gone_but_bears_something_stays_hidden(dna_file, tmp_path):
    rig = scene.load(dna_file)
    teeth = scene.meshes(rig)[1]
    teeth.modifiers.new("Bevel", "BEVEL")
    dna = small_face()
    dna.mesh_names = ["head_lod0_mesh", "other_lod0_mesh", "head_lod1_mesh"]
    path = _save(dna, tmp_path)
    _replace(path)
    assert bpy.data.objects["Small_teeth_lod0_mesh"].hide_render
    assert "stays, hidden, for Bevel" in _report()
    _right(rig, path)


def test_a_deleted_mesh_stays_away(dna_file, other_file):
    rig = scene.load(dna_file)
    bpy.data.objects.remove(scene.meshes(rig)[1])
    _replace(other_file)
    assert sorted(scene.meshes(rig)) == [0]
    assert "was deleted here and stays away" in _report()


def test_reloading_the_same_file_changes_no_bit(mode, dna_file):
    rig = scene.load(dna_file, mode)
    head = _decorate(rig)
    if mode == "KEYS":
        _keys(rig)["pull_l"].points[5].co.x += 0.01
    for block in _keys(rig):
        block.points[40].co.y += 0.002
    scene.set_controls(rig, jawOpen=0.5, mouthCornerPullL=0.7)
    scene.update(scene.controls(rig))

    def state():
        bones = [b.matrix_local.copy() for b in rig.data.bones]
        keys = {b.name: _points(b).tobytes() for b in _keys(rig) if b.name != "<channel sum>"}
        return bones, keys, {n: _weights(head, n) for n in ("mine", "head", "neck_01")}

    before, counts = state(), scene.counts()
    shown = scene.snapshot(rig)
    assert bpy.ops.risorius.reload() == {"FINISHED"}
    assert state() == before
    assert scene.counts() == counts
    np.testing.assert_allclose(scene.snapshot(rig), shown, atol=1e-6)
    _still_decorated(rig)


def _whole(rig):
    return (
        scene.counts(),
        {p.identifier: sorted(getattr(bpy.data, p.identifier).keys()) for p in _collections()},
        scene.snapshot(rig).tobytes(),
        rig["risorius_dna"].name,
        rig["risorius_source"],
        list(scene.face(rig).keys()),
        bpy.context.view_layer.objects.active.name,
        bpy.context.mode,
    )


def _collections():
    return [p for p in bpy.data.bl_rna.properties if p.type == "COLLECTION"]


def test_a_bad_file_changes_nothing(mode, dna_file, tmp_path):
    rig = scene.load(dna_file, mode)
    scene.set_controls(rig, jawOpen=0.5)
    bpy.ops.object.mode_set(mode="POSE")
    flat = small_face()
    flat.coordinate_system = ("right", "right", "up")
    whole = small_face().to_bytes()
    for name, content in (("flat", flat.to_bytes()), ("cut", whole[: len(whole) // 2])):
        path = tmp_path / f"{name}.dna"
        path.write_bytes(content)
        before = _whole(rig)
        with pytest.raises(RuntimeError) as caught:
            bpy.ops.risorius.replace_dna(filepath=str(path))
        text = str(caught.value).removeprefix("Error: ").strip()
        assert "Traceback" not in text
        assert "\n" not in text
        assert _whole(rig) == before


def test_the_mode_and_selection_stay(dna_file, other_file):
    rig = scene.load(dna_file)
    bpy.ops.object.mode_set(mode="POSE")
    _replace(other_file)
    assert bpy.context.view_layer.objects.active == scene.controls(rig)
    assert bpy.context.mode == "POSE"
    assert not rig.data.collections["Joints"].is_visible
    assert rig.data.collections["Joints"].bones["new_joint"]


def test_edit_mode_is_refused(dna_file, other_file):
    rig = scene.load(dna_file)
    bpy.context.view_layer.objects.active = scene.meshes(rig)[0]
    bpy.ops.object.mode_set(mode="EDIT")
    with pytest.raises(RuntimeError, match="is in edit mode: leave that first"):
        bpy.ops.risorius.replace_dna(filepath=str(other_file))
    bpy.ops.object.mode_set(mode="OBJECT")


def test_a_source_that_moved(dna_file, tmp_path):
    rig = scene.load(dna_file)
    moved = dna_file.rename(tmp_path / "elsewhere.dna")
    with pytest.raises(RuntimeError, match=r"small\.dna is not in its place any more"):
        bpy.ops.risorius.reload()
    _replace(moved)
    assert rig["risorius_source"] == str(moved)
    assert bpy.ops.risorius.reload() == {"FINISHED"}


def test_undo_is_one_step(mode, dna_file, other_file):
    bpy.context.preferences.edit.use_global_undo = True
    rig = scene.load(dna_file, mode)
    scene.set_controls(rig, jawOpen=0.8)
    bpy.ops.ed.undo_push(message="posed")
    before = scene.snapshot(rig)
    _replace(other_file)
    bpy.ops.ed.undo_push(message="replaced")
    after = scene.snapshot(rig)
    bpy.ops.ed.undo()
    bpy.context.view_layer.update()
    rig = bpy.data.objects["Small_rig"]
    np.testing.assert_allclose(scene.snapshot(rig), before, atol=1e-6)
    _right(rig, dna_file)
    bpy.ops.ed.undo_push(message="moved")
    bpy.ops.ed.undo()
    bpy.ops.ed.redo()
    assert len(bpy.data.objects["Small_rig"]["channels"]) == 6
    bpy.ops.ed.undo()
    assert after.shape == before.shape


def test_two_faces_of_one_file_stay_two(mode, dna_file, other_file):
    first, second = scene.load(dna_file, mode), scene.load(dna_file, mode)
    bpy.context.view_layer.objects.active = first
    still = scene.snapshot(second)
    _replace(other_file)
    np.testing.assert_array_equal(scene.snapshot(second), still)
    _right(first, other_file)
    _right(second, dna_file)


def test_maps_of_materials_follow_names(tmp_path):
    first = small_face()
    first.animated_map_names = ["browsRaiseInnerL", "head_cm1_color_smile"]
    second = renumbered(small_face(), maps=[1, "new_map", 0])
    second.animated_map_names = ["head_cm1_color_smile", "new_map", "browsRaiseInnerL"]
    rig = scene.load(_save(first, tmp_path, "first.dna"))
    material = scene.meshes(rig)[0].data.materials[0]

    def entries():
        tree = material.node_tree
        return {
            tree.path_resolve(c.data_path.split(".")[0]).label: c.driver.variables[0]
            .targets[0]
            .data_path
            for c in tree.animation_data.drivers
        }

    before = entries()
    assert before
    path = _save(second, tmp_path)
    _replace(path)
    assert scene.meshes(rig)[0].data.materials[0] == material
    names = second.animated_map_names
    assert entries() == {label: f'["maps"][{list(names).index(label)}]' for label in before}
    assert entries() != before
    _right(rig, path)


def test_there_and_back_again_is_where_it_was(dna_file, other_file):
    """Edits of parts that both files have survive a replacement by another file and back."""
    rig = scene.load(dna_file, "KEYS")
    head = _decorate(rig)
    _keys(rig)["pull_l"].points[5].co.x += 0.01
    for block in _keys(rig):
        block.points[40].co.y += 0.002
    head.vertex_groups["head"].add([6], 0.75, "REPLACE")
    before = {b.name: _points(b).copy() for b in _keys(rig)}
    weights = {n: _weights(head, n) for n in ("mine", "head", "neck_01")}
    rest = {b.name: np.array(b.matrix_local) for b in rig.data.bones}
    sliders = {k for k in scene.face(rig).keys() if k.startswith(PREFIX)}  # noqa: SIM118
    for path in (other_file, dna_file, other_file, dna_file):
        _replace(path)
    after = {b.name: _points(b) for b in _keys(rig)}
    assert set(after) == set(before)
    for name, points in before.items():
        np.testing.assert_allclose(after[name], points, atol=3e-7, err_msg=name)
    assert {n: _weights(head, n) for n in weights} == weights
    assert {b.name for b in rig.data.bones} == set(rest)
    for bone in rig.data.bones:
        np.testing.assert_allclose(np.array(bone.matrix_local), rest[bone.name], atol=1e-5)
    assert sliders == {k for k in scene.face(rig).keys() if k.startswith(PREFIX)}  # noqa: SIM118
    _still_decorated(rig)
    assert not [m for m in bpy.data.meshes if "before replace" in m.name]
    bad, seen = scene.invalid_drivers()
    assert not bad
    assert seen


def test_a_replaced_face_outlasts_the_file(mode, dna_file, other_file, tmp_path):
    rig = scene.load(dna_file, mode)
    _decorate(rig)
    _replace(other_file)
    scene.set_controls(rig, jawOpen=0.4)
    before = scene.snapshot(rig)
    blend = tmp_path / "scene.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend))
    content = other_file.read_bytes()
    other_file.unlink()
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    rig = bpy.data.objects["Small_rig"]
    np.testing.assert_array_equal(scene.snapshot(rig), before)
    assert scene.submodule("scene.base.storage").content(rig["risorius_dna"]) == content
    _still_decorated(rig)


@pytest.mark.parametrize("is_edited", [False, True])
def test_an_edited_uv_map_stays_and_another_follows_the_file(dna_file, tmp_path, is_edited):
    dna = small_face()
    dna.meshes[0].texture_coordinates = dna.meshes[0].texture_coordinates / 2
    rig = scene.load(dna_file)
    head = scene.meshes(rig)[0]
    if is_edited:
        head.data.uv_layers["UVMap"].uv[3].vector = (0.9, 0.8)
    before = _uvs(head)
    _replace(_save(dna, tmp_path))
    np.testing.assert_allclose(_uvs(head), before if is_edited else before / 2, atol=1e-6)
    assert ("Small replace report" in bpy.data.texts) == is_edited
    assert not is_edited or "keeps your UV map" in _report()
