# SPDX-License-Identifier: MIT
"""Tests three tasks of animators with a real pointer: a smirk, a shot of two seconds, a gaze."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from common import (
    IN_VIEW,
    SMILE,
    Check,
    clear,
    look_at_face,
    need_section,
    put_down,
    ready_tab,
    scroll,
    slider,
    take_up,
)
from hand import Hand, difference
from menus import accept, search
from shot import go_to, key_all

BROW = ("CTRL_expressions.browRaiseOuterL", "CTRL_expressions.browRaiseOuterR")


def smirk(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Raise one corner of the mouth and one brow by sliders, and again by dragging the skin.

    Then mirror the face by an operator.
    """
    clear(hand)
    look_at_face(hand)
    ready_tab(hand)
    need_section(hand, "RISORIUS_PT_controls")
    for words, control in (("smile", SMILE[0]), ("raise outer brow", BROW[0])):
        _type_search(hand, words)
        _wheel(hand, control, 60)
    posed = hand.ask("state")["sliders"]
    yield f"sliders: search and wheel give {len(posed)}", set(posed) == {SMILE[0], BROW[0]}
    hand.picture("smirk-sliders")
    _type_search(hand, "")
    clear(hand)
    take_up(hand)
    for control, way in ((SMILE[0], (14, -14)), (BROW[0], (0, -12))):
        before = hand.ask("state")["sliders"]
        at = hand.ask("moved_by", control=control)["at"]
        hand.drag(at, (at[0] + way[0], at[1] + way[1]))
        now = hand.ask("state")["sliders"]
        moved = {k for k in {*now, *before} if abs(now.get(k, 0) - before.get(k, 0)) > 1e-4}
        told = f"a drag at {control[17:]} moves few sliders: {sorted(m[17:] for m in moved)}"
        yield told, 0 < len(moved) <= 4
    hand.picture("smirk-drag")
    put_down(hand)
    was = hand.ask("state")["sliders"]
    search(hand, "Mirror Face", "RISORIUS_OT_mirror")
    now = hand.ask("state")["sliders"]
    turned = {_other(name): value for name, value in was.items()}
    same = set(now) == set(turned) and all(abs(now[k] - v) < 1e-5 for k, v in turned.items())
    yield "F3 mirror: each side has the other's values", same
    clear(hand)


def _other(name: str) -> str:
    return name[:-1] + {"L": "R", "R": "L"}[name[-1]] if name[-1] in "LR" else name


def _type_search(hand: Hand, words: str) -> None:
    """Type words into the search field of the panel Controls; "" clears the field."""
    scroll(hand, -40)
    x, y = hand.find("risorius_search$", of_field=True, columns=(0.3,))
    hand.move(x, y)
    hand.do("click", "--repeat", 2, "--delay", 60, 1)
    hand.ask("ready")
    hand.key("ctrl+a")
    hand.key("BackSpace")
    if words:
        hand.type(words)
    hand.key("Return")
    hand.still()


def _wheel(hand: Hand, control: str, notches: int) -> None:
    """Change a slider by Ctrl and the wheel.

    Args:
        hand: the pointer.
        control: name of the control.
        notches: steps of the wheel.
    """
    pattern = control.replace(".", r"\.") + r'"\]$'
    hand.move(*hand.find(pattern, of_field=True, columns=(0.62, 0.8)))
    hand.do("keydown", "ctrl")
    hand.wheel(-notches)
    hand.do("keyup", "ctrl")
    hand.wait("the slider moved", lambda: slider(hand, control) != 0.0)


def two_seconds(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Insert keyframes: neutral, blink, surprise, neutral. Check that the editors show them.

    The keyframes of surprise are then moved.
    """
    clear(hand)
    look_at_face(hand)
    ready_tab(hand)
    go_to(hand, 1)
    key_all(hand)
    go_to(hand, 12)
    search(hand, "Blink", "RISORIUS_OT_blink")
    go_to(hand, 24)
    search(hand, "Expressions Surprise", "RISORIUS_OT_expression")
    key_all(hand)
    go_to(hand, 48)
    search(hand, "Reset Face", "RISORIUS_OT_reset")
    search(hand, "Key All", "RISORIUS_OT_key")
    frames = hand.ask("keyed_frames")
    yield f"keys at 1, 12, 24, 48 ({frames})", {1, 12, 24, 48} <= set(frames)
    yield "the timeline shows them", hand.ask("seen_keys") == frames
    yield from _in_editors(hand, frames)
    clear(hand)


def _in_editors(hand: Hand, frames: list[int]) -> Iterator[Check]:
    """Check that the dope sheet and the graph editor show the keyframes.

    In the dope sheet, the keyframes at frame 24 are moved by four frames. Each editor fills the
    window.

    Args:
        hand: the pointer.
        frames: frames that have keyframes.
    """
    area = hand.ask("ready")["areas"]["DOPESHEET_EDITOR"]
    over_keys = (area[0] + area[2] * 0.7, area[1] + area[3] * 0.6)
    hand.ask("run", code=KEEP_EDITOR)
    hand.move(*over_keys)
    hand.key("shift+F12")
    hand.key("ctrl+space")
    hand.wait("large", lambda: len(hand.ask("state")["areas"]) == 1)
    hand.key("Home")
    hand.still()
    yield "the dope sheet shows them", hand.ask("seen_keys") == frames
    hand.picture("dope-sheet")
    at = hand.see(SUMMARY.format(24))
    hand.click(*at)
    per_frame = hand.see(SUMMARY.format(25))[0] - at[0]
    hand.key("g")
    hand.go((at[0], at[1]), (at[0] + per_frame * 4, at[1]))
    hand.do("click", 1)
    hand.wait("the move has ended", lambda: not hand.ask("is_modal"))
    moved = hand.ask("keyed_frames")
    yield f"surprise moved to 28 ({moved})", 28 in moved and 24 not in moved
    hand.key("shift+F6")
    hand.wait("graph editor", lambda: "GRAPH_EDITOR" in hand.ask("state")["areas"])
    hand.move(1000, 400)
    hand.key("Home")
    hand.still()
    yield "the graph editor shows them", hand.ask("seen_keys", editor="GRAPH_EDITOR") == moved
    hand.picture("graph-editor")
    hand.key("ctrl+space")
    hand.wait("small", lambda: len(hand.ask("state")["areas"]) > 1)
    hand.ask("run", code=TIMELINE)
    hand.still()


SUMMARY = """(lambda r: [rectangle(r)[0] + r.view2d.view_to_region({}, 0, clip=False)[0],
rectangle(r)[1] + 34])(next(r for r in window().screen.areas[0].regions if r.type == "WINDOW"))"""
KEEP_EDITOR = """
bpy.app.driver_namespace["editor"] = next(
    a.ui_type for a in window().screen.areas if a.type == "DOPESHEET_EDITOR")
"""
TIMELINE = """
for area in window().screen.areas:
    if area.type == "GRAPH_EDITOR":
        area.ui_type = bpy.app.driver_namespace["editor"]
"""


def gaze(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Let the eyes follow a moving Empty, turn the head the other way, and add a blink."""
    clear(hand)
    look_at_face(hand)
    ready_tab(hand)
    hand.ask("run", code=EMPTY)
    hand.still()
    hand.move(*IN_VIEW)
    for frame, way in ((1, "-0.2"), (24, "0.5")):
        go_to(hand, frame)
        hand.move(*IN_VIEW)
        for key in ("g", "x"):
            hand.key(key)
        hand.type(way)
        hand.key("Return")
        hand.key("i")
    frames = hand.see("[list(p.co) for p in curves_of_empty()[0].keyframe_points]")
    yield f"the Empty has two keys ({frames})", [round(f[0]) for f in frames] == [1, 24]
    search(hand, "Eyes Follow Object")
    hand.picture("gaze-dialog")
    accept(hand, lambda: hand.see(TARGET) != "")
    yield "Eyes Follow > Object proposes the Empty in hand", hand.see(TARGET) == "Look Here"
    look_at_face(hand)
    box = hand.ask("face_box")
    go_to(hand, 1)
    hand.move(*IN_VIEW)
    first = hand.still()
    go_to(hand, 24)
    hand.move(*IN_VIEW)
    second = hand.still()
    eyes = [box[0], box[1] + (box[3] - box[1]) * 0.25, box[2], (box[1] + box[3]) / 2]
    yield "and the eyes move with it", difference(first, second, eyes) > 0.003
    yield from _turn(hand)
    hand.ask("run", code=NO_EMPTY)
    clear(hand)


def _turn(hand: Hand) -> Iterator[Check]:
    """Select the head bone by its outline, turn it at two frames by R, Z and I, and add a blink."""
    hand.ask("center", zoom=0.6)
    hand.still()
    hand.click(*hand.ask("outline_at", bone="head"))
    hand.move(*IN_VIEW)
    hand.key("ctrl+Tab")
    hand.wait("pose mode", lambda: hand.ask("state")["mode"] == "POSE")
    hand.click(*hand.ask("outline_at", bone="head"))
    yield "clicks on its outline take the head", hand.ask("active_bone") == "head"
    for frame, way in ((1, "-8"), (24, "16")):
        go_to(hand, frame)
        hand.move(*IN_VIEW)
        for key in ("r", "z"):
            hand.key(key)
        hand.type(way)
        hand.key("Return")
        hand.key("i")
    keys = [c for c in hand.ask("curves_below") if '"head"' in c[0]]
    frames = {round(x) for c in keys for x, _y in c[2]}
    yield f"the head turns against it, keyed by I ({sorted(frames)})", frames == {1, 24}
    yield "those keys are seen in the timeline", set(hand.ask("seen_keys")) == frames
    go_to(hand, 12)
    search(hand, "Blink", "RISORIUS_OT_blink")
    yield "Blink on the turn", 15 in hand.ask("keyed_frames")
    go_to(hand, 16)
    hand.move(*IN_VIEW)
    hand.picture("gaze-blink")
    hand.key("ctrl+Tab")
    hand.wait("object mode", lambda: hand.ask("state")["mode"] == "OBJECT")


TARGET = """getattr(module('scene.gaze.gaze_target').holder_of(rig()['risorius_controls']),
'name', '')"""
EMPTY = """
made = bpy.data.objects.new("Look Here", None)
spots = points()
made.location = (spots.min(axis=0) + spots.max(axis=0)) / 2 + np.array((0.0, -0.6, 0.0))
bpy.context.scene.collection.objects.link(made)
for item in bpy.context.view_layer.objects:
    item.select_set(item == made)
bpy.context.view_layer.objects.active = made
bpy.app.driver_namespace["empty"] = made
"""
NO_EMPTY = """
with over(*view()[:2]):
    bpy.ops.risorius.gaze_target(mode="HEAD")
bpy.data.objects.remove(bpy.data.objects["Look Here"])
"""
