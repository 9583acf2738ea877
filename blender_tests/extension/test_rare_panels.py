# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels in states that other tests do not reach, and refusals of operators."""

import bpy
import pytest
from support import scene
from support.layout import Recorder, drawn


def ui(name):
    return scene.submodule(f"ui.{name}")


@pytest.fixture
def rig(dna_file):
    return scene.load(dna_file)


def test_without_a_face_the_panel_offers_one():
    layout = drawn(bpy.types.RISORIUS_PT_character)
    assert layout.operators == [
        *("risorius.add_character", "risorius.import_dna", "risorius.make_rig_from_head"),
        "risorius.key",
        *("risorius.import_animation", "risorius.speak"),
    ]
    steps = [text for text in layout.labels if text[:1].isdigit()]
    assert steps == ["1. Get a face", "2. Move it", "3. Animate it"]
    assert "No face is selected" not in layout.text()


def test_of_two_faces_the_panel_says_that_none_is_selected(rig, dna_file):
    scene.load(dna_file)
    bpy.context.view_layer.objects.active = None
    layout = drawn(bpy.types.RISORIUS_PT_character)
    assert "No face is selected: click on one." in layout.text()


def test_a_face_has_a_hint_until_it_is_dismissed(rig):
    def says():
        return "pulls at the skin" in drawn(bpy.types.RISORIUS_PT_character).text()

    addons = bpy.context.preferences.addons
    entry = addons.new()  # tests enable the add-on without an entry
    entry.module = scene.MODULE
    assert says()
    scene.set_controls(rig, jawOpen=0.3)
    assert says()  # the hints stay, so that sliders do not move under the mouse
    assert bpy.ops.risorius.hide_hints() == {"FINISHED"}
    assert not says()
    addons[scene.MODULE].preferences.hints = True
    assert says()
    addons.remove(addons[scene.MODULE])


def test_without_the_native_module_the_panel_says_so(rig, monkeypatch):
    monkeypatch.setattr(ui("face.panel").native, "problem", lambda: "It is missing.")
    layout = drawn(bpy.types.RISORIUS_PT_character)
    assert layout.text() == "It is missing."
    assert layout.operators == []


def test_a_list_has_a_line_for_each_layer_and_a_warped_one_its_points(rig):
    controls = scene.controls(rig)
    scene.face(rig).keyframe_insert('["CTRL_expressions.jawOpen"]', frame=1)
    bpy.ops.risorius.layer_add(kind="ACTION", source=controls.animation_data.action.name)
    layer = controls.risorius_layers[-1]
    line = Recorder()
    ui("layers.lists").RISORIUS_UL_layers.draw_item(
        None, bpy.context, line, controls, layer, 0, controls, ""
    )
    assert line.properties == ["name", "weight", "solo", "mute"]
    plain, warped = Recorder(), Recorder()
    ui("layers.panel")._draw_time(plain, layer)
    for frame in (1, 20):
        bpy.context.scene.frame_set(frame)
        bpy.ops.risorius.layer_warp()
    ui("layers.panel")._draw_time(warped, layer)
    assert plain.properties[:3] == ["start", "trim_start", "trim_end"]
    points = len(layer.warp)
    assert points >= 2
    assert warped.properties == ["frame", "source"] * points + ["extend", "fade_in", "fade_out"]


def test_a_face_that_follows_the_camera_shows_its_distances(rig, monkeypatch):
    panel, lods = ui("face.panel"), scene.submodule("scene.lod.lods")
    lods.follow_camera(rig, True, 0.25)
    del rig["risorius_lod_distances"]
    rig["risorius_lod_distances"] = [1.5, 3.0]
    monkeypatch.setattr(panel.lods, "built", lambda _rig: [0, 1, 2])
    layout = Recorder()
    panel._draw_detail(layout, rig)
    assert layout.properties == ['["risorius_lod_distances"]'] * 2


@pytest.mark.parametrize("works", [True, False])
def test_the_preferences_show_whether_it_works(works, monkeypatch):
    about = ui("about.preferences")
    monkeypatch.setattr(about, "self_test", lambda: (works, "as it is"))
    layout = Recorder()
    drawn_by = type("Panel", (), {"layout": layout, "sides": "SEEN"})()
    monkeypatch.setattr(Recorder, "prop", lambda self, _owner, path, **_o: self.labels.append(path))
    about.RISORIUS_Preferences.draw(drawn_by, bpy.context)
    assert layout.labels[0] == "as it is"
    assert "sides" in layout.labels
    assert ("risorius.install_speech" in layout.operators or "ready" in layout.text()) == works


def test_what_has_no_other_side_and_what_was_not_copied_is_said(rig, capfd):
    ui("face.side_operators")._copied.clear()
    with pytest.raises(RuntimeError, match="No controls were copied yet"):
        bpy.ops.risorius.paste_pose()
    assert bpy.ops.risorius.copy_side(region="tongue") == {"FINISHED"}
    assert "No control here has two sides that are free." in capfd.readouterr().out


def test_pasting_says_which_way_it_goes():
    paste = ui("face.side_operators").RISORIUS_OT_paste_pose
    for flipped in (False, True):
        properties = type("Properties", (), {"flipped": flipped})()
        assert ("left for right" in paste.description(bpy.context, properties)) == flipped
