# SPDX-License-Identifier: MIT
"""Tests that keyframes are visible in the timeline, and that new ones go into an open tweak."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from common import JAW, Check, clear, look_at_face, need_section, ready_tab, scroll, slider
from hand import Hand
from shot import go_to, key_all

FIELD = r'CTRL_expressions\.jawOpen"\]$'


def keyed(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Test three ways to insert keyframes, and the button Done, which ends a tweak.

    Keyframes are inserted by Key All while the head mesh is selected, by I over a slider, and by
    I over a slider during a tweak.
    """
    clear(hand)
    look_at_face(hand)
    ready_tab(hand)
    need_section(hand, "RISORIUS_PT_controls")
    hand.ask("run", code=HEAD_IN_HAND)
    key_all(hand)
    yield "Key All with the head in hand: its keys are seen", hand.ask("seen_keys") == [1]
    hand.ask("run", code="bpy.context.window_manager.risorius_search = 'jawOpen'")
    hand.still()
    _press_i(hand, 20, 12)
    yield "I over a slider: its key is seen", hand.ask("seen_keys") == [1, 20]
    below = slider(hand)
    hand.ask("run", code=TWEAK)
    hand.still()
    hand.picture("tweak")
    _press_i(hand, 20, 12)
    state = hand.ask("state")
    yield "I over a slider during a tweak makes a layer", len(state["layers"]) == 1
    kept = hand.ask("keyed_frames") == [1, 20] and abs(slider(hand) - below) < 1e-4
    yield "and leaves the keys below as they were", kept
    scroll(hand, -40)
    hand.click(*hand.find(r"risorius\.tweak\(.*False", columns=(0.85, 0.9, 0.8)))
    hand.wait("the tweak is done", lambda: not hand.ask("tweaks"))
    yield "Done at the top of the tab ends it", True
    hand.ask("run", code="bpy.context.window_manager.risorius_search = ''")
    clear(hand)


def _press_i(hand: Hand, frame: int, notches: int) -> None:
    """Go to a frame, change the jaw's slider by Ctrl and the wheel, and press I over it.

    Args:
        hand: the pointer.
        frame: the frame.
        notches: steps of the wheel.
    """
    go_to(hand, frame)
    place = hand.find(FIELD, of_field=True, columns=(0.62, 0.8))
    before = slider(hand, JAW)
    # The wheel is used because Blender moves the pointer back during a drag.
    hand.move(*place)
    hand.do("keydown", "ctrl")
    hand.wheel(-notches)
    hand.do("keyup", "ctrl")
    hand.wait("the slider moved", lambda: slider(hand, JAW) != before)
    hand.move(*place)
    hand.key("i")
    hand.still()


HEAD_IN_HAND = """
c = rig()["risorius_controls"]
for bone in c.pose.bones:
    (bone if hasattr(bone, "select") else bone.bone).select = bone.name == "head"
for item in bpy.context.view_layer.objects:
    item.select_set(item == head())
bpy.context.view_layer.objects.active = head()
"""
TWEAK = """
with over(*view()[:2]):
    bpy.ops.risorius.tweak(first=5, last=40)
"""
