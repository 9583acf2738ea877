# SPDX-License-Identifier: GPL-3.0-or-later
"""Tests of breakdowns, of tweaks, and of the keys that operators on controls insert."""

import bpy
import numpy as np
import pytest
from support import scene
from support.layout import drawn

PREFIX = "CTRL_expressions."
JAW, LEFT, RIGHT, BROW = "jawOpen", "mouthCornerPullL", "mouthCornerPullR", "browDownL"


@pytest.fixture
def rig(dna_file):
    rig = scene.load(dna_file)
    bpy.context.view_layer.objects.active = scene.controls(rig)
    return rig


@pytest.fixture
def auto():
    """Switch auto-key on at frame 10, without preferences that would suppress some keys."""
    tools, edit = bpy.context.scene.tool_settings, bpy.context.preferences.edit
    names = ("use_auto_keyframe_insert_needed", "use_keyframe_insert_needed")
    names += ("use_keyframe_insert_available", "keyframe_new_interpolation_type")
    before = {name: getattr(edit, name) for name in names}
    for name in names[:3]:
        setattr(edit, name, False)
    tools.use_keyframe_insert_auto = True
    bpy.context.scene.frame_set(10)
    yield tools
    tools.use_keyframe_insert_auto = False
    for name, value in before.items():
        setattr(edit, name, value)


def value(rig, name):
    return scene.face(rig)[PREFIX + name]


def path_of(name):
    return f'pose.bones["face"]["{PREFIX}{name}"]'


def keys(rig, name):
    """Frame -> value, for the keys of a slider; empty without keys."""
    if (
        scene.controls(rig).animation_data is None
        or scene.controls(rig).animation_data.action is None
    ):
        return {}
    found = [c for c in scene.curves(scene.controls(rig)) if c.data_path == path_of(name)]
    return {k.co.x: round(k.co.y, 5) for c in found for k in c.keyframe_points}


def curve(rig, name):
    return next(c for c in scene.curves(scene.controls(rig)) if c.data_path == path_of(name))


def key(rig, name, **values):
    """Insert keys on a slider. The argument f5=0.3, for example, is the value 0.3 at frame 5."""
    for frame, number in values.items():
        scene.face(rig)[PREFIX + name] = number
        scene.controls(rig).keyframe_insert(path_of(name), frame=int(frame[1:]))


def select_keys(rig, *frames):
    for one in scene.curves(scene.controls(rig)):
        for point in one.keyframe_points:
            point.select_control_point = point.co.x in frames


def _start(rig):
    """Set the two corners of the mouth to different values, and open the jaw."""
    scene.set_controls(rig, mouthCornerPullL=0.8, mouthCornerPullR=0.1, jawOpen=0.5)


def _paste(rig, **flags):
    bpy.ops.risorius.copy_pose(region="mouth")
    scene.set_controls(rig, mouthCornerPullL=0.3, mouthCornerPullR=0.2)
    return bpy.ops.risorius.paste_pose(**flags)


def _paste_blenders(rig):
    bpy.ops.object.mode_set(mode="POSE")
    bpy.ops.pose.copy()
    done = bpy.ops.risorius.paste_pose_flipped()
    bpy.ops.object.mode_set(mode="OBJECT")
    return done


def _asset(rig, operator):
    """Call an operator on the asset Face Joy, with the properties that an asset shelf sets."""
    bpy.ops.risorius.make_pose_assets()
    place = {"asset_library_type": "LOCAL", "relative_asset_identifier": "Action/Face Joy"}
    return operator("EXEC_DEFAULT", **place)


# Operator that moves controls -> (function that calls it, {slider: its value afterwards}). The
# function is called in the pose of `_start`. The value None stands for any value.
HANDS = {
    "risorius.reset": (lambda rig: bpy.ops.risorius.reset(), {LEFT: 0.0, RIGHT: 0.0, JAW: 0.0}),
    "risorius.mirror": (lambda rig: bpy.ops.risorius.mirror(), {LEFT: 0.1, RIGHT: 0.8}),
    "risorius.copy_side": (lambda rig: bpy.ops.risorius.copy_side(), {RIGHT: 0.8}),
    "risorius.paste_pose": (lambda rig: _paste(rig, flipped=True), {LEFT: 0.1, RIGHT: 0.8}),
    "risorius.paste_pose_flipped": (_paste_blenders, {LEFT: 0.1, RIGHT: 0.8}),
    "risorius.expression": (
        lambda rig: bpy.ops.risorius.expression(expression="joy"),
        {JAW: None, LEFT: None, RIGHT: None},
    ),
    "risorius.blend_expression": (
        lambda rig: bpy.ops.risorius.blend_expression("EXEC_DEFAULT", expression="joy"),
        {JAW: None, LEFT: None, RIGHT: None},
    ),
    "risorius.apply_pose_asset": (
        lambda rig: _asset(rig, bpy.ops.risorius.apply_pose_asset),
        {JAW: None, LEFT: None, RIGHT: None},
    ),
    "risorius.blend_pose_asset": (
        lambda rig: _asset(rig, bpy.ops.risorius.blend_pose_asset),
        {JAW: None, LEFT: None, RIGHT: None},
    ),
    "risorius.rest_others": (
        lambda rig: bpy.ops.risorius.rest_others(),
        {LEFT: 0.0, RIGHT: 0.0, JAW: 0.0},
    ),
    "risorius.breakdown": (
        lambda rig: bpy.ops.risorius.breakdown(kind="REST", factor=0.5),
        {LEFT: 0.4, RIGHT: 0.05, JAW: 0.25},
    ),
}

# Operators that set every slider, because they set sliders to rest that are not in the expression.
WHOLE = [name for name in HANDS if "express" in name or "asset" in name]

# Reason why the test of automatic keys leaves operators out -> these operators. They move no slider
# and no control bone, or insert keys themselves.
OTHERS = {
    "files, faces and what is shown of them": "add_character add_studio attach_body bake "
    "bake_physics bring_back describe detach_body export_animation export_dna export_web "
    "export_game_face "
    "import_dna install_speech make_override make_rig mix_add mix_add_scene mix_preview "
    "mix_remove mix_write reload replace_dna separate self_test set_lod set_lod_by_distance "
    "set_shape_mode test_channel unbake",
    "makes an action or keys of its own": "import_animation import_arkit_rig speak blink "
    "curves_from_mesh",
    "what a voice says; its own keys follow": "sound_set sound_insert sound_remove word_set "
    "speech_markers speech_update",
    "what the eyes' target hangs on": "gaze_target",
    "what is shown, and where edits go": "next_key tweak colour_curves favourite shortcut",
    "keys what stands": "key key_handles",
    "a hand on the skin, and a key at its end by keying.by_hand": "drag",
    "the tool in the hand, and what is shown of it": "drag_tool drag_hover",
    "the range of sliders: keys are cut as well": "set_overdrive",
    "drivers; each side shows what it showed": "link_sides",
    "what is shown, and why": "frame_board frame_face heat hide_hints hide_joints hide_outlines "
    "mask_renders move_outlines mute set_strands show_all solo why_vertex",
    "landmarks of a head, and faces that are made of it": "find_landmarks place_landmark "
    "clear_landmarks landmark_names save_landmarks load_landmarks make_rig_from_head conform_face",
    "names of shape keys and of curves": "assign_curve assign_shape_key choose_curve "
    "choose_shape_key load_shape_key_names save_curve_mapping save_shape_key_names "
    "select_shape_key shape_key_pictures",
    "reads the controls": "copy_pose make_pose_assets save_expression update_expression "
    "render_thumbnails",
    "files of expressions": "rename_expression delete_expression star_expression "
    "export_expressions import_expressions",
    "how the skin is deformed": "prepare_for_export",
    "who leads; the pose stays": "add_board remove_board lead",
    "selects, pins, hides": "select_board pin clear_pins select_handle hide_handles show_handles",
    "lies above the sliders": "layer_add layer_remove layer_move layer_duplicate layer_warp "
    "layers_to_nla fire unfire",
    "how captures become values of controls; nothing moves": "learn_range learn_range_live "
    "load_range save_range forget_range",
    "a hand of its own, without keys; at its end all stands as before": "live_start live_stop "
    "live_record live_finish live_discard live_neutral live_subject",
}

ON_BOARD = {"risorius.reset_board"}  # operators for a leading face board; see test_board.py


def _all_operators():
    words = scene.submodule("registration").CLASSES
    return {c.bl_idname for c in words if issubclass(c, bpy.types.Operator)}


def test_every_operator_is_known_to_move_controls_or_not():
    others = {f"risorius.{name}" for names in OTHERS.values() for name in names.split()}
    assert sorted(_all_operators()) == sorted(others | set(HANDS) | ON_BOARD)
    base = scene.submodule("ui.hand.base").HandOperator
    classes = scene.submodule("registration").CLASSES
    assert {c.bl_idname for c in classes if issubclass(c, base)} == set(HANDS) | ON_BOARD


@pytest.mark.parametrize("name", HANDS)
def test_auto_key_keys_what_an_operator_moved(rig, auto, name):
    _start(rig)
    call, wanted = HANDS[name]
    assert call(rig) == {"FINISHED"}
    for slider, number in wanted.items():
        found = keys(rig, slider)
        assert list(found) == [10.0], (slider, found)
        assert found[10.0] == pytest.approx(value(rig, slider), abs=1e-5)
        if number is not None:
            assert found[10.0] == pytest.approx(number, abs=1e-5)
    assert keys(rig, BROW) == {} or name in WHOLE


@pytest.mark.parametrize("name", HANDS)
def test_without_auto_key_nothing_is_keyed(rig, auto, name):
    auto.use_keyframe_insert_auto = False
    _start(rig)
    assert HANDS[name][0](rig) == {"FINISHED"}
    assert scene.controls(rig).animation_data is None


def test_the_active_keying_set_says_what_is_keyed(rig, auto):
    _start(rig)
    made = bpy.context.scene.keying_sets.new(idname="mouth", name="mouth")
    made.paths.add(scene.controls(rig), path_of(LEFT))
    auto.use_keyframe_insert_keyingset = True
    assert bpy.ops.risorius.mirror() == {"FINISHED"}
    assert (list(keys(rig, LEFT)), keys(rig, RIGHT)) == ([10.0], {})
    auto.use_keyframe_insert_keyingset = False
    assert bpy.ops.risorius.mirror() == {"FINISHED"}
    assert list(keys(rig, RIGHT)) == [10.0]


def test_blenders_own_keying_sets_say_it_by_their_names(rig, auto):
    _start(rig)
    scene.controls(rig).pose.bones["head"].rotation_quaternion = (0.9, 0.2, 0.3, 0.1)
    auto.use_keyframe_insert_keyingset = True
    sets = bpy.context.scene.keying_sets_all
    sets.active = sets["Rotation"]
    bpy.ops.risorius.mirror()
    assert {c.data_path for c in scene.curves(scene.controls(rig))} == {
        'pose.bones["head"].rotation_quaternion'
    }
    sets.active = sets["Whole Character"]
    bpy.ops.risorius.mirror()
    assert list(keys(rig, LEFT)) == [10.0]


def test_replace_changes_keys_that_are_there_and_adds_none(rig, auto):
    key(rig, LEFT, f10=0.3)
    key(rig, RIGHT, f1=0.2)
    _start(rig)
    auto.auto_keying_mode = "REPLACE_KEYS"
    bpy.ops.risorius.mirror()
    auto.auto_keying_mode = "ADD_REPLACE_KEYS"
    assert keys(rig, LEFT) == {10.0: 0.1}
    assert keys(rig, RIGHT) == {1.0: 0.2}


def test_only_insert_needed_and_only_available(rig, auto):
    key(rig, JAW, f1=0.5, f20=0.5)
    key(rig, LEFT, f1=0.0, f20=0.0)
    _start(rig)
    edit = bpy.context.preferences.edit
    edit.use_auto_keyframe_insert_needed = edit.use_keyframe_insert_available = True
    bpy.ops.risorius.mirror()
    assert list(keys(rig, LEFT)) == [1.0, 10.0, 20.0]
    assert list(keys(rig, JAW)) == [1.0, 20.0]  # handled, and already at this value
    assert keys(rig, RIGHT) == {}  # without a curve
    edit.use_auto_keyframe_insert_needed = edit.use_keyframe_insert_available = False
    bpy.ops.risorius.mirror()
    assert list(keys(rig, JAW)) == [1.0, 10.0, 20.0]  # values that are handled are keyed
    assert list(keys(rig, RIGHT)) == [10.0]


def test_keys_are_of_the_chosen_kind_and_interpolation(rig, auto):
    bpy.context.preferences.edit.keyframe_new_interpolation_type = "CONSTANT"
    auto.keyframe_type = "EXTREME"
    _start(rig)
    bpy.ops.risorius.mirror()
    auto.keyframe_type = "KEYFRAME"
    point = curve(rig, LEFT).keyframe_points[0]
    assert (point.interpolation, point.type) == ("CONSTANT", "EXTREME")


def test_what_a_driver_leads_is_not_keyed(rig, auto):
    _start(rig)
    scene.controls(rig).driver_add(path_of(RIGHT))
    bpy.ops.risorius.reset()
    assert keys(rig, RIGHT) == {}
    assert list(keys(rig, LEFT)) == [10.0]


def test_bones_are_keyed_where_they_were_turned(rig, auto):
    bones = scene.controls(rig).pose.bones
    bones["head"].rotation_quaternion = (0.9, 0.2, 0.3, 0.1)
    bones["eyes"].location = (0.1, 0.0, 0.0)
    bpy.ops.risorius.reset()
    paths = {c.data_path for c in scene.curves(scene.controls(rig))}
    assert paths == {'pose.bones["head"].rotation_quaternion', 'pose.bones["eyes"].location'}


def test_an_operator_works_at_the_frames_of_selected_keys(rig):
    key(rig, LEFT, f1=0.8, f5=0.6, f9=0.4)
    key(rig, JAW, f1=0.2)
    scene.set_controls(rig, mouthCornerPullR=0.3)  # a slider without a curve
    select_keys(rig, 1.0, 9.0)
    bpy.context.scene.frame_set(5)
    assert bpy.ops.risorius.mirror(at="SELECTED") == {"FINISHED"}
    assert keys(rig, LEFT) == {1.0: 0.3, 5.0: 0.6, 9.0: 0.3}
    assert keys(rig, RIGHT) == {1.0: 0.8, 9.0: 0.4}
    assert keys(rig, JAW) == {1.0: 0.2}
    assert value(rig, LEFT) == pytest.approx(0.6)  # frame 5 is unchanged
    assert value(rig, RIGHT) == pytest.approx(curve(rig, RIGHT).evaluate(5.0))


def test_without_selected_keys_the_operator_says_so(rig):
    key(rig, LEFT, f1=0.8)
    select_keys(rig)
    with pytest.raises(RuntimeError, match="Select keys of this face first"):
        bpy.ops.risorius.mirror(at="SELECTED")
    assert keys(rig, LEFT) == {1.0: 0.8}


def test_new_curves_have_the_colour_of_their_region(rig, auto):
    _start(rig)
    bpy.ops.risorius.mirror()
    scene.set_controls(rig, browDownL=0.5)
    bpy.ops.risorius.reset()
    left, right, brow = (curve(rig, n) for n in (LEFT, RIGHT, BROW))
    assert (left.group.name, brow.group.name) == ("Mouth", "Brows")
    assert left.group == right.group
    assert left.group.color_set == "CUSTOM"
    assert tuple(left.group.colors.normal) != tuple(brow.group.colors.normal)
    assert left.color_mode == "CUSTOM"
    assert tuple(left.color) != tuple(right.color)  # different colours within the region


def test_to_the_next_key_of_a_control_and_of_all(rig):
    key(rig, LEFT, f2=0.1, f8=0.2, f30=0.1)
    key(rig, JAW, f5=0.1, f12=0.2)
    scene_, go = bpy.context.scene, bpy.ops.risorius.next_key
    scene_.frame_set(4)
    frames = []
    for options in (
        {"control": PREFIX + LEFT},
        {"control": PREFIX + LEFT},
        {"control": PREFIX + JAW, "forward": False},
        {"forward": False},
        {"region": "mouth"},
        {"region": "jaw", "forward": False},
        {},
    ):
        assert go(**options) == {"FINISHED"}
        frames.append(scene_.frame_current)
    assert frames == [8, 30, 12, 8, 30, 12, 30]
    assert go(control=PREFIX + BROW) == {"CANCELLED"}


def _two_poses(rig):
    """Key two sliders and the head at frames 10 and 20, and show frame 14. Returns the head's bone.

    The third slider browDownL gets a value, but no keys.
    """
    key(rig, JAW, f10=0.2, f20=0.8)
    key(rig, LEFT, f10=0.6, f20=0.0)
    head = scene.controls(rig).pose.bones["head"]
    for frame, turn in ((10, (1, 0, 0, 0)), (20, (0.8, 0, 0.6, 0))):
        head.rotation_quaternion = turn
        head.keyframe_insert("rotation_quaternion", frame=frame)
    scene.set_controls(rig, browDownL=0.3)  # without keys
    bpy.context.scene.frame_set(14)
    return head


@pytest.mark.parametrize("factor", [0.0, 0.25, 1.0, 1.2])
def test_a_breakdown_lies_between_the_poses(rig, auto, factor):
    head = _two_poses(rig)
    assert bpy.ops.risorius.breakdown(factor=factor) == {"FINISHED"}
    jaw, left = 0.2 + 0.6 * factor, max(0.6 - 0.6 * factor, 0.0)
    assert value(rig, JAW) == pytest.approx(jaw, abs=1e-5)
    assert value(rig, LEFT) == pytest.approx(left, abs=1e-5)
    assert value(rig, BROW) == pytest.approx(0.3)
    wanted = np.array([1 - 0.2 * factor, 0, 0.6 * factor, 0])
    wanted /= np.linalg.norm(wanted)
    assert tuple(head.rotation_quaternion) == pytest.approx(tuple(wanted), abs=1e-5)
    assert keys(rig, JAW) == {10.0: 0.2, 14.0: pytest.approx(jaw, abs=1e-5), 20.0: 0.8}
    assert keys(rig, BROW) == {}


def test_a_breakdown_of_a_region_and_of_selected_curves(rig):
    _two_poses(rig)
    for one in scene.curves(scene.controls(rig)):
        one.select = one.data_path == path_of(JAW)
    before = value(rig, LEFT)
    bpy.ops.risorius.breakdown(factor=1.0, which="SELECTED")
    assert value(rig, JAW) == pytest.approx(0.8)
    assert value(rig, LEFT) == before
    bpy.ops.risorius.breakdown(factor=0.0, which="REGION", region="mouth")
    assert value(rig, JAW) == pytest.approx(0.8)
    assert value(rig, LEFT) == pytest.approx(0.6)


def test_relaxed_a_pose_lies_on_the_line_and_pushed_further_away(rig):
    _two_poses(rig)
    scene.set_controls(rig, jawOpen=0.9)
    line = 0.2 + 0.6 * 0.4
    bpy.ops.risorius.breakdown(kind="NEIGHBOURS", factor=0.5)
    assert value(rig, JAW) == pytest.approx((0.9 + line) / 2, abs=1e-5)
    scene.set_controls(rig, jawOpen=0.5)
    bpy.ops.risorius.breakdown(kind="NEIGHBOURS", factor=-0.5)
    assert value(rig, JAW) == pytest.approx(0.5 + 0.5 * (0.5 - line), abs=1e-5)


def test_towards_rest_and_away_from_it(rig):
    scene.set_controls(rig, jawOpen=0.4, browDownL=0.9)
    bpy.ops.risorius.breakdown(kind="REST", factor=0.25)
    assert value(rig, JAW) == pytest.approx(0.3)
    bpy.ops.risorius.breakdown(kind="REST", factor=-1.0)
    assert value(rig, JAW) == pytest.approx(0.6)
    assert value(rig, BROW) == 1.0  # within its limits


def test_selected_keys_become_breakdowns_of_those_around_them(rig):
    key(rig, JAW, f1=0.0, f5=0.9, f6=0.1, f11=1.0)
    select_keys(rig, 5.0, 6.0)
    bpy.ops.risorius.breakdown(kind="BREAKDOWN", factor=0.5, at="SELECTED")
    assert keys(rig, JAW) == {1.0: 0.0, 5.0: 0.5, 6.0: 0.5, 11.0: 1.0}


def test_a_breakdown_without_keys_says_so(rig):
    with pytest.raises(RuntimeError, match="There is no key of these controls before"):
        bpy.ops.risorius.breakdown()


def shown(rig, frame, index=0):
    """The value of the raw control `index` at a frame, after layers, as the evaluator gets it."""
    bpy.context.scene.frame_set(frame)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    seen = scene.controls(rig).evaluated_get(depsgraph)
    live = scene.submodule("scene.character.runtime").of(rig)
    return float(scene.submodule("scene.frame.inputs").read_inputs(seen, live, depsgraph)[0][index])


def test_a_tweak_shows_what_was_asked_and_touches_no_key(rig):
    key(rig, JAW, f1=0.2, f40=0.6)
    below = {f: shown(rig, f) for f in range(1, 41)}
    points = [tuple(p.co) for p in curve(rig, JAW).keyframe_points]
    assert bpy.ops.risorius.tweak(first=10, last=30, fade=4) == {"FINISHED"}
    for frame, wanted in ((18, 0.7), (25, 0.3), (11, 0.35)):
        bpy.context.scene.frame_set(frame)
        scene.set_controls(rig, jawOpen=wanted - (shown(rig, frame) - value(rig, JAW)))
        assert bpy.ops.risorius.key() == {"FINISHED"}
        assert shown(rig, frame) == pytest.approx(wanted, abs=1e-4)
        assert value(rig, JAW) == pytest.approx(below[frame], abs=1e-5)
    assert [tuple(p.co) for p in curve(rig, JAW).keyframe_points] == points
    for frame in (*range(1, 11), *range(30, 41)):
        assert shown(rig, frame) == pytest.approx(below[frame], abs=1e-6), frame
    assert bpy.ops.risorius.tweak(enable=False) == {"FINISHED"}
    bpy.context.scene.frame_set(20)
    bpy.ops.risorius.key()
    assert 20.0 in keys(rig, JAW)  # keys go to the action again
    assert shown(rig, 18) == pytest.approx(0.7, abs=1e-4)


def test_operators_go_into_the_tweak_also_of_sliders_without_keys(rig):
    scene.set_controls(rig, mouthCornerPullL=0.5, mouthCornerPullR=0.1)
    bpy.ops.risorius.tweak(first=10, last=30, fade=0)
    bpy.context.scene.frame_set(20)
    assert bpy.ops.risorius.mirror() == {"FINISHED"}
    assert [shown(rig, 20, i) for i in (1, 2)] == pytest.approx([0.1, 0.5], abs=1e-5)
    assert [shown(rig, 5, i) for i in (1, 2)] == pytest.approx([0.5, 0.1], abs=1e-5)
    assert scene.controls(rig).animation_data is None


def test_outside_the_tweak_an_operator_changes_nothing_and_says_so(rig):
    _start(rig)
    bpy.ops.risorius.tweak(first=10, last=30)
    bpy.context.scene.frame_set(40)
    with pytest.raises(RuntimeError, match="The tweak lies between the frames 10 and 30"):
        bpy.ops.risorius.mirror()
    assert value(rig, LEFT) == pytest.approx(0.8)
    with pytest.raises(RuntimeError, match="two frames or more"):
        bpy.ops.risorius.tweak(first=10, last=11)


def test_a_tweak_is_baked_like_all_else(rig):
    key(rig, JAW, f1=0.2, f40=0.6)
    bpy.ops.risorius.tweak(first=10, last=30, fade=4)
    bpy.context.scene.frame_set(20)
    scene.set_controls(rig, jawOpen=0.9)
    bpy.ops.risorius.key()
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 18, 22
    bpy.context.scene.frame_set(20)
    before = scene.snapshot(rig)
    assert bpy.ops.risorius.bake() == {"FINISHED"}
    bpy.context.scene.frame_set(18)
    bpy.context.scene.frame_set(20)
    np.testing.assert_allclose(scene.snapshot(rig), before, atol=1e-5)


def test_curves_of_before_get_groups_and_colours(rig):
    for name in (JAW, LEFT, RIGHT):
        scene.controls(rig).keyframe_insert(path_of(name), frame=1)
    assert bpy.ops.risorius.colour_curves() == {"FINISHED"}
    groups = {name: curve(rig, name).group for name in (JAW, LEFT, RIGHT)}
    assert [groups[n].name for n in (JAW, LEFT, RIGHT)] == ["Jaw", "Mouth", "Mouth"]
    colours = {n: tuple(round(c, 3) for c in curve(rig, n).color) for n in groups}
    assert len(set(colours.values())) == 3
    assert {curve(rig, n).color_mode for n in groups} == {"CUSTOM"}


@pytest.fixture
def preferences():
    """The add-on's preferences, which the test adds as an installation of the add-on would."""
    addons = bpy.context.preferences.addons
    entry = addons.new()
    entry.module = scene.MODULE
    yield entry.preferences
    addons.remove(entry)


def test_favourites_are_kept_in_the_file_and_by_the_user(rig, dna_file, preferences):
    names = "\n".join(PREFIX + n for n in (LEFT, RIGHT))
    assert bpy.ops.risorius.favourite(controls=names) == {"FINISHED"}
    of = scene.submodule("ui.hand.favourites").favourites_of
    assert of(bpy.context) == [PREFIX + LEFT, PREFIX + RIGHT]
    other = scene.load(dna_file)  # a face without favourites uses the user's
    bpy.context.view_layer.objects.active = scene.controls(other)
    assert of(bpy.context) == [PREFIX + LEFT, PREFIX + RIGHT]
    bpy.ops.risorius.favourite(controls=PREFIX + JAW)
    bpy.ops.risorius.favourite(controls=PREFIX + LEFT)  # the second call removes it
    assert of(bpy.context) == [PREFIX + RIGHT, PREFIX + JAW]
    bpy.context.view_layer.objects.active = scene.controls(rig)
    assert of(bpy.context) == [PREFIX + LEFT, PREFIX + RIGHT]
    scene.set_controls(rig, mouthCornerPullL=0.8, jawOpen=0.8)
    bpy.ops.risorius.breakdown(kind="REST", which="FAVOURITES", factor=1.0)
    assert (value(rig, LEFT), value(rig, JAW)) == pytest.approx((0.0, 0.8))


def test_the_panels_offer_it_and_no_key_is_taken(rig):
    offered = drawn(scene.submodule("ui.hand.panel").RISORIUS_PT_hand).operators
    assert {"risorius.next_key", "risorius.breakdown", "risorius.tweak"} <= set(offered)
    assert "risorius.blink" in drawn(scene.submodule("ui.hand.gaze").RISORIUS_PT_gaze).operators
    favourites = scene.submodule("ui.face.favourites_panel").RISORIUS_PT_favourites
    assert not favourites.poll(bpy.context)
    bpy.ops.risorius.favourite(controls=PREFIX + JAW)
    assert favourites.poll(bpy.context)
    drawn(favourites)
    bpy.context.window_manager.risorius_stars = True
    panel = drawn(scene.submodule("ui.face.controls_panel").RISORIUS_PT_controls)
    assert "risorius.favourite" in panel.operators
    bpy.context.window_manager.risorius_stars = False
    config = bpy.context.window_manager.keyconfigs.addon
    for keymap in config.keymaps if config is not None else ():
        assert not [i for i in keymap.keymap_items if "RISORIUS_MT_pie" in str(i.properties)]
