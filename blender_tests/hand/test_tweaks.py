# SPDX-License-Identifier: GPL-3.0-or-later
"""While a tweak is active, all moves and keys of the face go into it; the keys below stay."""

import bpy
import pytest
from mathutils import Euler, Quaternion
from support import scene
from support.editors import editor
from support.layout import drawn

PREFIX = "CTRL_expressions."
JAW, LEFT, RIGHT = "jawOpen", "mouthCornerPullL", "mouthCornerPullR"


def path_of(name):
    return f'pose.bones["face"]["{PREFIX}{name}"]'


@pytest.fixture
def rig(dna_file):
    """A face with jaw keys at frames 1, 15 and 40, and a tweak of frames 10 to 30.

    The first key has a free handle.
    """
    rig = scene.load(dna_file)
    for frame, value in ((1, 0.2), (15, 0.3), (40, 0.6)):
        scene.face(rig)[PREFIX + JAW] = value
        scene.controls(rig).keyframe_insert(path_of(JAW), frame=frame, keytype="EXTREME")
    points = scene.curves(scene.controls(rig))[0].keyframe_points
    points[0].handle_right_type = "FREE"
    points[0].handle_right = (6.0, 0.9)
    scene.curves(scene.controls(rig))[0].update()
    go(rig, 20)
    assert bpy.ops.risorius.tweak(first=10, last=30, fade=4) == {"FINISHED"}
    return rig


def go(rig, frame):
    bpy.context.scene.frame_set(frame)
    bpy.context.view_layer.update()


def action_of(rig):
    data = scene.controls(rig).animation_data
    return data.action if data is not None else None


def below(rig):
    """Data path, place, handles and types of all keys in the face's action, without the tweak."""
    if action_of(rig) is None:
        return []
    return [
        (c.data_path, *k.co, *k.handle_left, *k.handle_right, k.type, k.handle_right_type)
        for c in scene.curves(scene.controls(rig))
        for k in c.keyframe_points
    ]


def shown(rig, frame=None, name=JAW):
    """The value of a raw control at a frame, after tweaks and layers, as the evaluator gets it.

    Args:
        rig: the face.
        frame: the frame; None: the current frame.
        name: short name of the raw control.
    """
    if frame is not None:
        go(rig, frame)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    seen = scene.controls(rig).evaluated_get(depsgraph)
    live = scene.submodule("scene.character.runtime").of(rig)
    values = scene.submodule("scene.frame.inputs").read_inputs(seen, live, depsgraph)[0]
    return float(values[live.labels.index(PREFIX + name)])


def press_i(rig, name=JAW, frame=20):
    """Insert a keyframe on a slider, as Blender does if the user presses I over the slider."""
    scene.controls(rig).keyframe_insert(path_of(name), frame=frame)
    bpy.context.view_layer.update()


def ask(rig, wanted, name=JAW):
    """Move a slider until the face shows the wanted value."""
    offset = shown(rig, name=name) - scene.face(rig)[PREFIX + name]
    scene.set_controls(rig, **{name: wanted - offset})


def test_a_key_over_a_slider_goes_into_the_tweak(rig):
    """A key that is inserted on a slider goes into the tweak.

    This holds between keys, at the frame of a key, twice at a frame, and on a slider without keys.
    """
    before, base = below(rig), {f: shown(rig, f) for f in (1, 9, 31, 40)}
    for frame, wanted in ((20, 0.8), (15, 0.5), (20, 0.7)):
        go(rig, frame)
        ask(rig, wanted)
        press_i(rig, frame=frame)
        assert below(rig) == before
        assert shown(rig) == pytest.approx(wanted, abs=1e-4)
    scene.set_controls(rig, mouthCornerPullL=0.4)
    press_i(rig, LEFT)
    assert below(rig) == before
    assert [shown(rig, f, LEFT) for f in (20, 40)] == pytest.approx([0.4, 0.0], abs=1e-5)
    assert {f: shown(rig, f) for f in base} == pytest.approx(base, abs=1e-6)
    assert [shown(rig, f) for f in (15, 20)] == pytest.approx([0.5, 0.7], abs=1e-4)
    assert bpy.ops.risorius.tweak(enable=False) == {"FINISHED"}
    assert shown(rig, 20) == pytest.approx(0.7, abs=1e-4)
    assert len(bpy.data.actions) == 2  # the tweak's action is removed
    press_i(rig)
    assert len(below(rig)) == len(before) + 1  # keys go to the action again


def test_sliders_that_move_go_into_it_when_the_frame_changes_and_when_it_ends(rig):
    before = below(rig)
    ask(rig, 0.8)
    scene.set_controls(rig, mouthCornerPullL=0.4)
    go(rig, 25)
    ask(rig, 0.1)
    scene.set_controls(rig, mouthCornerPullR=0.3)
    press_i(rig, RIGHT, 25)  # a control without keys is tweaked too
    assert shown(rig) == pytest.approx(0.1, abs=1e-4)
    assert shown(rig, 20) == pytest.approx(0.8, abs=1e-4)
    assert shown(rig, name=LEFT) == pytest.approx(0.4, abs=1e-4)
    ask(rig, 0.75)
    assert bpy.ops.risorius.tweak(enable=False) == {"FINISHED"}
    assert shown(rig) == pytest.approx(0.75, abs=1e-4)
    assert shown(rig, 25, RIGHT) == pytest.approx(0.3, abs=1e-4)
    assert below(rig) == before
    for frame in range(1, 41):
        go(rig, frame)  # playing keeps the tweak
    assert shown(rig, 20) == pytest.approx(0.75, abs=1e-4)


def test_undo_and_redo_know_the_keys_below(rig):
    before = below(rig)
    bpy.ops.ed.undo_push(message="tweak")
    ask(rig, 0.8)
    scene.controls(rig).keyframe_insert(path_of(JAW), frame=20)
    bpy.ops.ed.undo_push(message="key")  # as Blender: before its graph is brought up
    bpy.context.view_layer.update()
    name = rig.name
    bpy.ops.ed.undo()
    rig = bpy.data.objects[name]
    bpy.context.view_layer.update()
    assert below(rig) == before
    assert shown(rig) < 0.5
    bpy.ops.ed.redo()
    rig = bpy.data.objects[name]
    bpy.context.view_layer.update()
    bpy.context.view_layer.update()
    assert below(rig) == before
    assert shown(rig) == pytest.approx(0.8, abs=1e-4)


def test_outside_of_it_a_key_goes_nowhere_and_edits_of_keys_stay(rig):
    before, guard = below(rig), scene.submodule("scene.animation.tweak_guard")
    go(rig, 35)
    scene.set_controls(rig, jawOpen=0.9)
    press_i(rig, frame=35)
    assert below(rig) == before
    assert "between the frames 10 and 30" in guard.trouble(scene.controls(rig))
    curve = scene.curves(scene.controls(rig))[0]
    curve.keyframe_points[2].co = (44.0, 0.7)
    curve.update()
    action_of(rig).update_tag()
    bpy.context.view_layer.update()
    go(rig, 20)
    ask(rig, 0.8)
    press_i(rig)
    assert (44.0, pytest.approx(0.7)) == tuple(
        scene.curves(scene.controls(rig))[0].keyframe_points[2].co
    )
    assert shown(rig) == pytest.approx(0.8, abs=1e-4)
    assert guard.trouble(scene.controls(rig)) == ""


def test_of_a_face_without_keys_and_of_its_board(dna_file):
    rig = scene.load(dna_file)
    bpy.ops.risorius.tweak(first=10, last=30, fade=0)
    go(rig, 20)
    scene.set_controls(rig, mouthCornerPullL=0.4)
    press_i(rig, LEFT)
    assert below(rig) == []
    assert [shown(rig, f, LEFT) for f in (20, 5)] == pytest.approx([0.4, 0.0], abs=1e-5)
    bpy.ops.risorius.tweak(enable=False)
    scene.add_board()
    bpy.ops.risorius.lead(by="BOARD")
    assert bpy.ops.risorius.tweak(first=10, last=30, fade=0) == {"FINISHED"}
    assert not bpy.ops.risorius.lead.poll()
    bone = next(
        b
        for b in scene.controls(rig).pose.bones
        if b.name not in ("board", "board_frames") and "risorius_board" in b.bone
    )
    go(rig, 20)
    names = [n for n in (JAW, LEFT, RIGHT)]
    base = {n: shown(rig, 5, n) for n in names}
    go(rig, 20)
    axis = next(i for i, locked in enumerate(bone.lock_location) if not locked)
    bone.location[axis] = 1.0
    scene.update(scene.controls(rig))
    asked = {n: shown(rig, None, n) for n in names}
    assert asked != base
    bone.keyframe_insert("location", frame=20)
    bpy.context.view_layer.update()
    assert below(rig) == []
    assert tuple(bone.location) == (0.0, 0.0, 0.0)
    assert {n: shown(rig, 20, n) for n in names} == pytest.approx(asked, abs=1e-4)
    assert {n: shown(rig, 5, n) for n in names} == pytest.approx(base, abs=1e-6)


def test_with_linked_sides_both_are_tweaked(dna_file):
    rig = scene.load(dna_file)
    assert bpy.ops.risorius.link_sides() == {"FINISHED"}
    bpy.ops.risorius.tweak(first=10, last=30, fade=0)
    go(rig, 20)
    scene.set_controls(rig, mouthCornerPullL=0.4)
    press_i(rig, LEFT)
    assert [shown(rig, 20, n) for n in (LEFT, RIGHT)] == pytest.approx([0.4, 0.4], abs=1e-5)
    assert [shown(rig, 5, n) for n in (LEFT, RIGHT)] == pytest.approx([0.0, 0.0], abs=1e-5)


BONES = {
    "head": ("rotation_quaternion", Quaternion((0.0, 0.0, 1.0), 0.3)),
    "neck": ("rotation_euler", Euler((0.2, 0.0, 0.1))),
    "eye_L": ("rotation_quaternion", Quaternion((1.0, 0.0, 0.0), 0.2)),
    "eyes": ("location", (0.01, 0.0, 0.02)),
}


def pose_bone(rig, name):
    return scene.controls(rig).pose.bones[name]


def seen(rig, frame):
    """The evaluator's inputs at a frame: raw controls, and quaternions of head and neck."""
    go(rig, frame)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    controls = scene.controls(rig).evaluated_get(depsgraph)
    live = scene.submodule("scene.character.runtime").of(rig)
    raw, turns = scene.submodule("scene.frame.inputs").read_inputs(controls, live, depsgraph)
    return [*raw, *(x for name in ("head", "neck") for x in turns.get(name, Quaternion()))]


def turn(rig, name):
    """Set a control bone to its value in BONES, without a key.

    Returns the name of the set property, such as "location".
    """
    bone, (channel, value) = pose_bone(rig, name), BONES[name]
    if channel == "rotation_euler":
        bone.rotation_mode = "XYZ"
    setattr(bone, channel, value)
    scene.update(scene.controls(rig))
    return channel


@pytest.fixture
def turning(dna_file):
    """A face with keys of the head at frames 1 and 40, and a tweak of frames 10 to 30.

    The rotation mode of the neck is XYZ Euler.
    """
    rig = scene.load(dna_file)
    pose_bone(rig, "neck").rotation_mode = "XYZ"
    for frame, angle in ((1, 0.1), (40, 0.3)):
        pose_bone(rig, "head").rotation_quaternion = Quaternion((1.0, 0.0, 0.0), angle)
        pose_bone(rig, "head").keyframe_insert("rotation_quaternion", frame=frame)
    go(rig, 20)
    assert bpy.ops.risorius.tweak(first=10, last=30, fade=4) == {"FINISHED"}
    return rig


@pytest.mark.parametrize("keyed", [True, False])
def test_bones_of_head_neck_and_eyes_go_into_the_tweak(turning, keyed):
    """Motions of control bones go into the tweak, whether keyframes are inserted or not.

    A bake contains the motions with keyframes.
    """
    before, base = below(turning), {f: seen(turning, f) for f in (5, 35)}
    stood = {n: tuple(getattr(pose_bone(turning, n), BONES[n][0])) for n in BONES if n != "head"}
    go(turning, 20)
    turn(turning, "eyes")
    asked_gaze = seen_now(turning)
    for name in BONES:
        channel = turn(turning, name)
    asked = seen_now(turning)
    assert asked != pytest.approx(asked_gaze, abs=1e-3)
    for name in BONES if keyed else ():
        pose_bone(turning, name).keyframe_insert(BONES[name][0], frame=20)
        bpy.context.view_layer.update()
    assert below(turning) == before
    assert seen(turning, 20) == pytest.approx(asked, abs=1e-4)
    assert channel == "location"
    for name, place in stood.items():
        assert tuple(getattr(pose_bone(turning, name), BONES[name][0])) == pytest.approx(place)
    assert {f: seen(turning, f) for f in base} == {f: pytest.approx(v) for f, v in base.items()}
    assert bpy.ops.risorius.tweak(enable=False) == {"FINISHED"}
    assert below(turning) == before
    if keyed:
        assert bpy.ops.risorius.bake(start=19, end=21) == {"FINISHED"}
        assert seen(turning, 20) == pytest.approx(asked, abs=1e-4)


def seen_now(rig):
    return seen(rig, bpy.context.scene.frame_current)


def test_a_turn_too_far_for_the_fade_is_told_and_put_back(turning):
    guard = scene.submodule("scene.animation.tweak_guard")
    before, base = below(turning), seen(turning, 11)
    bone = pose_bone(turning, "head")
    bone.rotation_quaternion = Quaternion((0.0, 0.0, 1.0), 1.5)
    bone.keyframe_insert("rotation_quaternion", frame=11)
    bpy.context.view_layer.update()
    assert below(turning) == before
    assert seen_now(turning) == pytest.approx(base, abs=1e-6)
    assert "only 25 %" in guard.trouble(scene.controls(turning))


def test_key_all_and_whole_character_and_keys_in_channels_go_into_the_tweak(turning):
    """Keys that are inserted in different ways go into the tweak.

    The ways are Key All, the keying set Whole Character, and the Graph Editor. A key on a control
    that was not moved stores the tweaked value at its frame.
    """
    controls, before = scene.controls(turning), below(turning)
    turn(turning, "head")
    assert bpy.ops.risorius.key() == {"FINISHED"}
    turned = seen(turning, 20)
    bpy.context.view_layer.objects.active = controls
    bpy.ops.object.mode_set(mode="POSE")
    go(turning, 22)
    held, frame = seen_now(turning), 22
    scene.set_controls(turning, jawOpen=0.5)
    with editor("VIEW_3D"):
        bpy.ops.anim.keyframe_insert_by_name(type="WholeCharacter")
    bpy.context.view_layer.update()
    assert below(turning) == before
    assert shown(turning, frame) == pytest.approx(0.5, abs=1e-4)
    assert seen(turning, frame)[-8:] == pytest.approx(held[-8:], abs=1e-4)
    scene.submodule("scene.base.compat").select_bone(pose_bone(turning, "head"))
    go(turning, 24)
    with editor("GRAPH_EDITOR"):
        bpy.ops.graph.keyframe_insert(type="ALL")
    bpy.context.view_layer.update()
    assert below(turning) == before
    layer = scene.submodule("scene.animation.layers").of(controls)[0]
    curves = scene.submodule("scene.base.compat").curves_for(layer.action, controls)
    frames = {k.co.x for c in curves if "head" in c.data_path for k in c.keyframe_points}
    assert frames == {10, 20, 22, 24, 30}
    assert seen(turning, 20)[-8:] == pytest.approx(turned[-8:], abs=1e-4)


def test_pasted_keys_go_into_the_tweak_and_moved_ones_stay(rig):
    """Keys that are pasted in the Graph Editor become tweaks at their frames.

    A key that is moved in the Graph Editor stays a key of the action.
    """
    before = below(rig)
    curve = scene.curves(scene.controls(rig))[0]
    for point in curve.keyframe_points:
        point.select_control_point = point.co.x < 20
    go(rig, 14)  # the key at 1 is pasted at 14, the key at 15 at 28
    with editor("GRAPH_EDITOR"):
        assert bpy.ops.graph.copy() == {"FINISHED"}
        assert bpy.ops.graph.paste(offset="START") == {"FINISHED"}
    action_of(rig).update_tag()
    bpy.context.view_layer.update()
    assert below(rig) == before
    assert [shown(rig, f) for f in (14, 28)] == pytest.approx([0.2, 0.3], abs=1e-4)
    curve = scene.curves(scene.controls(rig))[0]
    curve.keyframe_points[1].co.y = 0.9
    action_of(rig).update_tag()
    bpy.context.view_layer.update()
    go(rig, 20)
    assert below(rig) != before


def test_beside_nla_strips_moves_and_keys_go_into_the_tweak(rig):
    """With an NLA strip, alone or below an action, moves and keys go into the tweak."""
    controls = scene.controls(rig)
    scene.submodule("scene.animation.tweaks").end(controls)
    data = controls.animation_data
    strip, data.action = data.nla_tracks.new().strips.new("Take", 1, data.action), None
    strip.extrapolation = "HOLD"
    scene.set_controls(rig, mouthCornerPullR=0.2)
    for blend, frame in (("REPLACE", 20), ("ADD", 24)):
        if blend == "ADD":
            action = bpy.data.actions.new("Above")
            scene.submodule("scene.base.compat").add_curves(action, controls)
            data.action, data.action_blend_type = action, blend
            if hasattr(data, "action_slot") and data.action_slot is None:
                data.action_slot = action.slots[0]
        go(rig, frame)
        assert bpy.ops.risorius.tweak(first=10, last=30, fade=4) == {"FINISHED"}
        base = {f: (shown(rig, f), shown(rig, f, LEFT)) for f in (5, 35)}
        before, left = below(rig), shown(rig, frame, LEFT) + 0.4
        scene.set_controls(rig, mouthCornerPullL=0.4)
        ask(rig, 0.8)
        go(rig, frame + 1)
        assert shown(rig, frame) == pytest.approx(0.8, abs=1e-4), blend
        assert shown(rig, frame, LEFT) == pytest.approx(left, abs=1e-4)
        ask(rig, 0.6)
        press_i(rig, frame=frame)
        assert below(rig) == before, blend
        assert shown(rig, frame) == pytest.approx(0.6, abs=1e-4), blend
        assert shown(rig, frame, RIGHT) == pytest.approx(0.2, abs=1e-6)
        assert {f: (shown(rig, f), shown(rig, f, LEFT)) for f in (5, 35)} == {
            f: pytest.approx(pair, abs=1e-6) for f, pair in base.items()
        }
        assert bpy.ops.risorius.tweak(enable=False) == {"FINISHED"}


def test_the_range_that_is_proposed_lies_around_the_frame(rig):
    """The proposed range is that of selected keys, the preview range, or frames around the current.

    If all keys are selected, their range is not proposed, because an import selects all keys.
    """
    proposed = scene.submodule("ui.hand.operators").proposed_range
    points = scene.curves(scene.controls(rig))[0].keyframe_points
    for chosen, wanted in (((1, 15, 40), (8, 32)), ((15, 40), (15, 40)), ((15,), (8, 32))):
        for point in points:
            point.select_control_point = round(point.co.x) in chosen
        assert proposed(bpy.context) == wanted
    bpy.context.scene.use_preview_range = True
    bpy.context.scene.frame_preview_start, bpy.context.scene.frame_preview_end = 12, 28
    assert proposed(bpy.context) == (12, 28)


HOSTILE = (
    "[]",
    "{",
    '{"first": "a", "last": 2, "fade": 0, "layer": "", "base": {}}',
    '{"first": 1, "last": NaN, "fade": 0, "layer": "", "base": {}}',
    '{"first": 1, "last": 2, "fade": 0, "layer": "", "base": {"x": "y"}}',
    '{"first": 1, "last": 2, "fade": 0, "layer": "", "base": [], "places": 3}',
    '{"first": 1, "last": 2, "fade": 0, "layer": "", "base": {}, "places": {"a": [1]}}',
)


def test_a_tweak_of_a_hostile_file_is_none(dna_file):
    rig = scene.load(dna_file)
    for count, text in enumerate(HOSTILE, 1):
        scene.controls(rig)["risorius_tweak"] = text
        scene.controls(rig)["risorius_tweak_kept"] = "text"
        scene.set_controls(rig, jawOpen=0.4)
        press_i(rig, frame=count)
        go(rig, 30)
        assert drawn(bpy.types.RISORIUS_PT_character).labels[0] == "Small", text
        assert len(below(rig)) == count
