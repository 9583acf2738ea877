# SPDX-License-Identifier: GPL-3.0-or-later
"""While a tweak is on, whatever moves or keys the face goes into it; the keys below stay."""

import bpy
import pytest
from support import scene
from support.layout import drawn

PREFIX = "CTRL_expressions."
JAW, LEFT, RIGHT = "jawOpen", "mouthCornerPullL", "mouthCornerPullR"


def path_of(name):
    return f'pose.bones["face"]["{PREFIX}{name}"]'


@pytest.fixture
def rig(dna_file):
    """Keys of the jaw at 1, 15 and 40, of all kinds, and a tweak from 10 to 30."""
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
    """All that the action of the face holds."""
    if action_of(rig) is None:
        return []
    return [
        (c.data_path, *k.co, *k.handle_left, *k.handle_right, k.type, k.handle_right_type)
        for c in scene.curves(scene.controls(rig))
        for k in c.keyframe_points
    ]


def shown(rig, frame=None, name=JAW):
    """A raw control as the face takes it, with layers."""
    if frame is not None:
        go(rig, frame)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    seen = scene.controls(rig).evaluated_get(depsgraph)
    live = scene.submodule("scene.character.runtime").of(rig)
    values = scene.submodule("scene.frame.inputs").read_inputs(seen, live, depsgraph)[0]
    return float(values[live.labels.index(PREFIX + name)])


def press_i(rig, name=JAW, frame=20):
    """What I over a slider does, and auto-key after it was moved."""
    scene.controls(rig).keyframe_insert(path_of(name), frame=frame)
    bpy.context.view_layer.update()


def ask(rig, wanted, name=JAW):
    """Move a slider until the face shows the wanted pose."""
    offset = shown(rig, name=name) - scene.face(rig)[PREFIX + name]
    scene.set_controls(rig, **{name: wanted - offset})


def test_a_key_over_a_slider_goes_into_the_tweak(rig):
    """Between keys, on a key, again at the same frame, of a slider without keys."""
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
    assert len(bpy.data.actions) == 2  # what was kept has gone
    press_i(rig)
    assert len(below(rig)) == len(before) + 1  # keys are keys again


def test_sliders_that_move_go_into_it_when_the_frame_changes_and_when_it_ends(rig):
    before = below(rig)
    ask(rig, 0.8)
    scene.set_controls(rig, mouthCornerPullL=0.4)
    go(rig, 25)
    ask(rig, 0.1)
    scene.set_controls(rig, mouthCornerPullR=0.3)
    press_i(rig, RIGHT, 25)  # what has no key goes with it
    assert shown(rig) == pytest.approx(0.1, abs=1e-4)
    assert shown(rig, 20) == pytest.approx(0.8, abs=1e-4)
    assert shown(rig, name=LEFT) == pytest.approx(0.4, abs=1e-4)
    ask(rig, 0.75)
    assert bpy.ops.risorius.tweak(enable=False) == {"FINISHED"}
    assert shown(rig) == pytest.approx(0.75, abs=1e-4)
    assert shown(rig, 25, RIGHT) == pytest.approx(0.3, abs=1e-4)
    assert below(rig) == before
    for frame in range(1, 41):
        go(rig, frame)  # playing takes nothing
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


def test_the_range_that_is_proposed_lies_around_the_frame(rig):
    """All keys of a take are selected after an import: they say nothing."""
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
