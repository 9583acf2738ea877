# SPDX-License-Identifier: GPL-3.0-or-later
"""A line at the top of the tab names the active mode, and the panels below stay in place."""

from types import SimpleNamespace

import bpy
import pytest
from support import scene
from support.heights import lines_of
from support.layout import Recorder, drawn

JAW = "CTRL_expressions.jawOpen"
# Name of a mode of the face -> function that starts the mode, and text of the banner in the mode.
MODES = {
    "tweak": (lambda: bpy.ops.risorius.tweak(first=1, last=20), "Tweak 1-20"),
    "tweak elsewhere": (
        lambda: bpy.ops.risorius.tweak(first=5, last=20),
        "Not Here: Tweak 5-20",
    ),
    "solo": (lambda: bpy.ops.risorius.solo(control=JAW), "Solo: Jaw Open"),
    "mute": (lambda: bpy.ops.risorius.mute(kind="JOINTS"), "Muted"),
    "heat": (lambda: bpy.ops.risorius.heat(kind="POSE"), "Heat Map"),
    "baked": (bpy.ops.risorius.bake, "Baked"),
    "board": (lambda: bpy.ops.risorius.lead(by="BOARD"), "The Board Leads"),
    "linked": (bpy.ops.risorius.link_sides, "Sides Linked"),
}


@pytest.fixture
def rig(dna_file):
    rig = scene.load(dna_file)
    scene.add_board()
    bpy.ops.risorius.lead(by="SLIDERS")
    bpy.context.scene.frame_set(2)
    bpy.context.scene.frame_end = 3
    return rig


def _banner(rig):
    banner = scene.submodule("ui.face.banner")
    return banner.modes(bpy.context, rig, scene.controls(rig))


def _done(mode):
    """Run the operator that the banner's button Done runs in this mode."""
    return getattr(bpy.ops.risorius, mode.operator.partition(".")[2])(**mode.settings)


def _heights():
    panels = ("face.panel.RISORIUS_PT_character", "face.controls_panel.RISORIUS_PT_controls")
    panels += ("hand.panel.RISORIUS_PT_hand", "see_why.panel.RISORIUS_PT_why")
    found = []
    for place in panels:
        module, _, name = place.rpartition(".")
        found.append(lines_of(getattr(scene.submodule(f"ui.{module}"), name)))
    return found


def test_each_mode_is_named_ends_with_done_and_moves_nothing(rig):
    top = bpy.types.RISORIUS_PT_character
    assert _banner(rig) == []
    assert drawn(top).labels[0] == "Small"
    before = _heights()
    for name, (turn_on, text) in MODES.items():
        bpy.context.scene.frame_set(2)
        assert turn_on() == {"FINISHED"}, name
        found = _banner(rig)
        assert [mode.text for mode in found] == [text]
        assert drawn(top).labels[:2] == [text, "Done"]
        baked = name == "baked"  # then See Why shows no controls
        assert _heights()[: 2 if baked else 4] == before[: 2 if baked else 4], name
        assert _done(found[0]) == {"FINISHED"}, name
        assert _banner(rig) == [], name
    scene.set_controls(rig, jawOpen=0.3)
    assert _heights() == before
    bpy.ops.risorius.reset()
    assert _heights() == before


def test_two_modes_are_counted_and_two_faces_told_apart(rig, dna_file):
    def header():
        layout = Recorder()
        top = scene.submodule("ui.face.panel").RISORIUS_PT_character
        top.draw_header_preset(SimpleNamespace(layout=layout), bpy.context)
        return layout.labels

    assert header() == []
    bpy.ops.risorius.heat(kind="POSE")
    bpy.ops.risorius.solo(control=JAW)
    assert drawn(bpy.types.RISORIUS_PT_character).labels[0] == "Solo: Jaw Open and 1 more"
    assert header() == ["Small"]
    bpy.ops.risorius.show_all()
    bpy.ops.risorius.heat(kind="OFF")
    rig.name = "Anna_rig.001"
    assert drawn(bpy.types.RISORIUS_PT_character).labels[0] == "Anna.001"
    scene.load(dna_file)
    assert header() == ["Small.001"] == [drawn(bpy.types.RISORIUS_PT_character).labels[0]]


def test_a_capture_and_its_recording_are_named(rig, monkeypatch):
    sessions = scene.submodule("scene.live.sessions")
    session = SimpleNamespace(recording=None)
    monkeypatch.setattr(sessions, "of", lambda _controls: session)
    assert [(m.text, m.operator) for m in _banner(rig)] == [("Live Capture", "risorius.live_stop")]
    session.recording = object()
    assert [(m.text, m.operator) for m in _banner(rig)] == [("Recording", "risorius.live_record")]
    with pytest.raises(RuntimeError, match="Live capture moves the sliders"):
        bpy.ops.risorius.tweak(first=1, last=20)
