# SPDX-License-Identifier: GPL-3.0-or-later
"""Left and right: names as the viewer sees them, mirroring, copying, linking, pasting flipped."""

import bpy
import pytest
from support import scene
from support.measured import Part, drawn

PREFIX = "CTRL_expressions."


def ui(name):
    return scene.submodule(f"ui.{name}")


@pytest.fixture
def rig(dna_file):
    return scene.load(dna_file)


def value(rig, name):
    return scene.face(rig)[PREFIX + name]


def test_mirror_swaps_the_sliders_and_the_eyes(rig):
    scene.set_controls(rig, mouthCornerPullL=0.8, mouthCornerPullR=0.1, jawOpen=0.5)
    bones = scene.controls(rig).pose.bones
    bones["eye_L"].rotation_mode = bones["eye_R"].rotation_mode = "XYZ"
    bones["eye_L"].rotation_euler = (0.1, 0.0, 0.3)
    assert bpy.ops.risorius.mirror() == {"FINISHED"}
    assert value(rig, "mouthCornerPullL") == pytest.approx(0.1)
    assert value(rig, "mouthCornerPullR") == pytest.approx(0.8)
    assert value(rig, "jawOpen") == pytest.approx(0.5)
    assert tuple(bones["eye_L"].rotation_euler) == pytest.approx((0, 0, 0), abs=1e-5)
    assert tuple(bones["eye_R"].rotation_euler) == pytest.approx((0.1, 0, -0.3), abs=1e-5)


def test_a_mirrored_region_leaves_the_others(rig):
    scene.set_controls(rig, mouthCornerPullL=0.8, eyeLookUpL=0.4)
    assert bpy.ops.risorius.mirror(region="eye") == {"FINISHED"}
    assert value(rig, "mouthCornerPullL") == pytest.approx(0.8)


@pytest.mark.parametrize("from_left", [True, False])
def test_one_side_is_copied_to_the_other(rig, from_left):
    scene.set_controls(rig, mouthCornerPullL=0.8, mouthCornerPullR=0.1)
    assert bpy.ops.risorius.copy_side(from_left=from_left) == {"FINISHED"}
    wanted = 0.8 if from_left else 0.1
    assert value(rig, "mouthCornerPullL") == pytest.approx(wanted)
    assert value(rig, "mouthCornerPullR") == pytest.approx(wanted)


def test_a_region_is_copied_and_pasted_flipped(rig):
    scene.set_controls(rig, mouthCornerPullL=0.7, jawOpen=0.5)
    assert bpy.ops.risorius.copy_pose(region="mouth") == {"FINISHED"}
    scene.set_controls(rig, mouthCornerPullL=0.0, mouthCornerPullR=0.2, jawOpen=0.9)
    assert bpy.ops.risorius.paste_pose(flipped=True) == {"FINISHED"}
    assert value(rig, "mouthCornerPullR") == pytest.approx(0.7)
    assert value(rig, "mouthCornerPullL") == pytest.approx(0.0)
    assert value(rig, "jawOpen") == pytest.approx(0.9)  # a control of another region
    assert bpy.ops.risorius.paste_pose() == {"FINISHED"}
    assert value(rig, "mouthCornerPullL") == pytest.approx(0.7)


def test_copied_and_saved_is_the_pose_that_is_seen_with_its_layers(rig):
    scene.set_controls(rig, browDownL=0.4)
    bpy.ops.risorius.layer_add(kind="EXPRESSION", source="joy")
    bpy.context.view_layer.update()
    assert value(rig, "mouthCornerPullL") == 0.0
    assert bpy.ops.risorius.copy_pose() == {"FINISHED"}
    assert bpy.ops.risorius.save_expression(label="Seen", group="own") == {"FINISHED"}
    bpy.ops.risorius.layer_remove()
    bpy.ops.risorius.reset()
    for bring in (
        bpy.ops.risorius.paste_pose,
        lambda: bpy.ops.risorius.expression(expression="seen"),
    ):
        assert bring() == {"FINISHED"}
        assert value(rig, "mouthCornerPullL") > 0.5
        assert value(rig, "browDownL") == pytest.approx(0.4)
        bpy.ops.risorius.reset()


def test_linked_sides_move_together_and_are_free_again(rig):
    scene.set_controls(rig, mouthCornerPullR=0.9)
    assert bpy.ops.risorius.link_sides(from_left=True) == {"FINISHED"}
    scene.set_controls(rig, mouthCornerPullL=0.35)
    seen = scene.controls(rig).evaluated_get(bpy.context.evaluated_depsgraph_get())
    assert seen.pose.bones["face"][PREFIX + "mouthCornerPullR"] == pytest.approx(0.35)
    layout = drawn(ui("face.controls_panel").RISORIUS_PT_controls, bpy.context)
    assert "Both Sides" in _texts(layout)
    assert bpy.ops.risorius.link_sides(enable=False) == {"FINISHED"}
    assert not scene.controls(rig).animation_data.drivers
    assert value(rig, "mouthCornerPullR") == pytest.approx(0.35)
    scene.set_controls(rig, mouthCornerPullL=0.0)
    assert value(rig, "mouthCornerPullR") == pytest.approx(0.35)


def _texts(part):
    found = []
    for child in part.children:
        found += _texts(child) if isinstance(child, Part) else [child[0]]
    return found


def _pose(rig):
    bpy.context.view_layer.objects.active = scene.controls(rig)
    bpy.ops.object.mode_set(mode="POSE")
    return scene.controls(rig).pose.bones


def test_paste_pose_flipped_turns_the_sliders_over(rig):
    bones = _pose(rig)
    for bone in bones:
        (bone if hasattr(bone, "select") else bone.bone).select = True
    scene.set_controls(rig, mouthCornerPullL=0.8, mouthCornerPullR=0.1, jawOpen=0.5)
    bones["eye_L"].rotation_mode = bones["eye_R"].rotation_mode = "XYZ"
    bones["eye_L"].rotation_euler = (0.1, 0.0, 0.3)
    assert bpy.ops.pose.copy() == {"FINISHED"}
    assert bpy.ops.risorius.paste_pose_flipped() == {"FINISHED"}
    assert value(rig, "mouthCornerPullL") == pytest.approx(0.1)
    assert value(rig, "mouthCornerPullR") == pytest.approx(0.8)
    assert value(rig, "jawOpen") == pytest.approx(0.5)
    assert tuple(bones["eye_R"].rotation_euler) == pytest.approx((0.1, 0, -0.3), abs=1e-5)


def test_a_pose_without_the_sliders_leaves_them_where_they_are(rig):
    bones = _pose(rig)
    for bone in bones:
        (bone if hasattr(bone, "select") else bone.bone).select = bone.name == "head"
    scene.set_controls(rig, mouthCornerPullL=0.8)
    assert bpy.ops.pose.copy() == {"FINISHED"}
    assert bpy.ops.risorius.paste_pose_flipped() == {"FINISHED"}
    assert value(rig, "mouthCornerPullL") == pytest.approx(0.8)
    assert value(rig, "mouthCornerPullR") == pytest.approx(0.0)


def test_blenders_own_paste_is_done_once_more_with_the_sliders(rig):
    _pose(rig)
    again = ui("face.paste_flipped")._once_more
    timers = bpy.app.timers
    bpy.ops.pose.copy()
    for flipped in (False, True):
        bpy.ops.pose.paste("EXEC_DEFAULT", True, flipped=flipped)
        bpy.context.view_layer.update()
        assert timers.is_registered(again) == flipped
    timers.unregister(again)
    scene.set_controls(rig, jawOpen=0.1)
    assert not timers.is_registered(again)


def test_only_what_is_in_use_is_listed(rig):
    panel = ui("face.controls_panel").RISORIUS_PT_controls
    manager = bpy.context.window_manager
    manager.risorius_only_used = True
    try:
        assert "Open" not in _texts(drawn(panel, bpy.context))
        scene.set_controls(rig, jawOpen=0.2)
        assert "Open" in _texts(drawn(panel, bpy.context))
        scene.set_controls(rig, jawOpen=0.0)
        scene.face(rig).keyframe_insert(f'["{PREFIX}jawOpen"]', frame=1)
        assert "Open" in _texts(drawn(panel, bpy.context))
        assert "Corner Pull" not in _texts(drawn(panel, bpy.context))
        scene.set_controls(rig, mouthCornerPullR=0.2)  # its partner is in the same row
        assert "Corner Pull" in _texts(drawn(panel, bpy.context))
    finally:
        manager.risorius_only_used = False


def test_search_finds_words_of_animators(rig):
    panel = ui("face.controls_panel").RISORIUS_PT_controls
    manager = bpy.context.window_manager
    try:
        manager.risorius_search = "open mouth"
        found = _texts(drawn(panel, bpy.context))
    finally:
        manager.risorius_search = ""
    assert "Open" in found
    assert "Corner Pull" not in found


def test_a_tooltip_says_what_the_control_does(rig):
    words = scene.face(rig).id_properties_ui(PREFIX + "mouthCornerPullL").as_dict()["description"]
    assert "smile" in words
    assert "your right" in words
    assert not words.endswith(".")  # Blender adds the full stop
    other = scene.face(rig).id_properties_ui("twice").as_dict()["description"]
    assert other == "Twice (twice)"  # an unknown control has no description


def test_left_is_where_one_sees_it_or_the_characters_own(rig):
    rows = scene.submodule("logic.character.slider_rows")
    regions = scene.submodule("native").regions()
    pair = [PREFIX + "mouthCornerPullL", PREFIX + "mouthCornerPullR"]
    (seen,) = rows.rows_of(pair, "mouth", regions, True)
    (own,) = rows.rows_of(pair, "mouth", regions, False)
    assert [name[-1] for name in seen.sliders] == ["R", "L"]
    assert [name[-1] for name in own.sliders] == ["L", "R"]


def test_linked_sliders_have_keys_on_the_side_that_leads(rig):
    assert bpy.ops.risorius.link_sides(from_left=True) == {"FINISHED"}
    assert bpy.ops.risorius.key(region="mouth") == {"FINISHED"}
    curves = scene.submodule("scene.base.compat").curves_of
    keyed = {c.data_path.split('"')[-2] for c in curves(scene.controls(rig).animation_data.action)}
    assert PREFIX + "mouthCornerPullL" in keyed
    assert PREFIX + "mouthCornerPullR" not in keyed


def test_a_driver_of_ones_own_is_left_alone(rig):
    path = scene.submodule("scene.base.parts").property_path(PREFIX + "mouthCornerPullR")
    curve = scene.controls(rig).driver_add(path)
    curve.driver.expression = "0.5"
    bpy.ops.risorius.link_sides(from_left=True)
    bpy.ops.risorius.link_sides(enable=False)
    found = scene.controls(rig).animation_data.drivers.find(path)
    assert found is not None
    assert found.driver.expression == "0.5"


def test_the_rest_of_a_region_stands_under_more_which_counts_what_is_moved(rig):
    face, labels = scene.face(rig), [f"{PREFIX}mouth{name}" for name in ("Press", "Dimple")]
    panel = ui("face.controls_panel")
    names = [f"{PREFIX}mouthCornerPullL", *labels]
    part = panel._Part(bpy.context, face, "mouth", names, {}, {})

    def lines(moved):
        face[labels[0]], face[labels[1]] = moved, 0.0
        layout = Part()
        panel._draw_parted(layout, part, dict.fromkeys(names, 0.0))
        return _texts(layout)

    assert lines(0.0).index("Corner Pull R") < lines(0.0).index("More") < lines(0.0).index("Press")
    assert "More: 1 moved" in lines(0.4)
