# SPDX-License-Identifier: MIT
"""Tests tasks on a captured take with a real pointer: import it, add a layer and a tweak."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from common import (
    Check,
    clear,
    look_at_face,
    need_section,
    ready_tab,
    scroll,
    slider,
)
from hand import Hand
from menus import accept, name_file, search
from shot import go_to

RATE, ROWS = 60, 180  # three seconds
FIELD = r'CTRL_expressions\.jawOpen"\]$'


def capture(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Import a Live Link take, add a smile as a layer, tweak the jaw; the take must not change."""
    clear(hand)
    look_at_face(hand)
    ready_tab(hand)
    need_section(hand, "RISORIUS_PT_controls")
    hand.ask("run", code="face()['CTRL_expressions.eyePupilWideL'] = 0.38; rig().update_tag()")
    path = hand.user / "take.csv"
    path.write_text(take(), encoding="ascii")
    search(hand, "Import Animation")
    hand.wait("the file browser", lambda: "FILE_BROWSER" in hand.ask("state")["areas"])
    hand.still()
    hand.picture("capture-dialog")
    name_file(hand, path)
    hand.wait("the view is back", lambda: "VIEW_3D" in hand.ask("state")["areas"])
    hand.wait("keys", lambda: hand.ask("keyed_frames"))
    below = hand.ask("curves_below")
    tongue = [c for c in below if "tongue" in c[0].lower() and _span(c) > 0.1]
    head = [c for c in below if '"head"' in c[0] and _span(c) > 0.05]
    yield f"the take has tongue and head ({len(tongue)}, {len(head)} curves)", bool(tongue and head)
    yield "its keys are seen", hand.ask("seen_keys") == hand.ask("keyed_frames")
    yield from _smile(hand)
    yield from _tweak(hand)
    hand.ask("run", code=REMOVE_ACTION)
    clear(hand)


def _span(curve: list) -> float:
    values = [y for _x, y in curve[2]]
    return max(values) - min(values)


def _smile(hand: Hand) -> Iterator[Check]:
    """Go to frame 36 and add a layer with a smile there, by an operator from Blender's search."""
    go_to(hand, 36)
    below = hand.ask("curves_below")
    search(hand, "Add Layer Smile Closed", "RISORIUS_OT_layer_add")
    names = hand.ask("state")["layers"]
    yield f"F3 adds a layer of a smile ({names})", len(names) == 1
    started = hand.see("[y.start for y in rig()['risorius_controls'].risorius_layers]")
    yield f"which begins at the frame of now ({started})", started == [36.0]
    yield "and leaves the take as it is", hand.ask("curves_below") == below
    hand.picture("capture-smile")


def _tweak(hand: Hand) -> Iterator[Check]:
    """Start a tweak around frame 50, and open the jaw more by the wheel and I over its slider."""
    below = hand.ask("curves_below")
    go_to(hand, 50)
    search(hand, "Tweak over a Range")
    hand.picture("tweak-dialog")
    accept(hand, lambda: hand.ask("tweaks"))
    span = hand.see("(lambda t: [t.first, t.last])(module('scene.animation.tweaks')"
                    ".of(rig()['risorius_controls']))")  # fmt: skip
    yield f"the dialog proposes frames around this one ({span})", span == [38, 62]
    hand.ask("run", code="bpy.context.window_manager.risorius_search = 'jawOpen'")
    scroll(hand, -40)
    before = slider(hand)
    hand.move(*hand.find(FIELD, of_field=True, columns=(0.62, 0.8)))
    hand.do("keydown", "ctrl")
    hand.wheel(-8)
    hand.do("keyup", "ctrl")
    hand.key("i")
    hand.still()
    hand.picture("tweak-on")
    yield "I over the slider goes into the tweak", len(hand.ask("state")["layers"]) == 2
    yield "and the take below keeps each key", hand.ask("curves_below") == below
    scroll(hand, -40)
    hand.click(*hand.find(r"risorius\.tweak\(.*False", columns=(0.85, 0.9, 0.8)))
    hand.wait("the tweak is done", lambda: not hand.ask("tweaks"))
    go_to(hand, 36)
    go_to(hand, 50)
    yield f"the slider has its own value again ({before:.3f})", abs(slider(hand) - before) < 1e-4
    hand.ask("run", code="bpy.context.window_manager.risorius_search = ''")


def take() -> str:
    """A CSV take in the format of Live Link Face, with jaw, tongue, blink and a turning head."""
    names = [*SHAPES.split(), "HeadYaw", "HeadPitch", "HeadRoll"]
    lines = ["Timecode,BlendShapeCount," + ",".join(names)]
    for row in range(ROWS):
        at = row / RATE
        has = {
            "JawOpen": 0.25 + 0.2 * math.sin(at * 7.0),
            "TongueOut": max(0.0, math.sin(at * 2.0)) * 0.6,
            "MouthFunnel": 0.2 + 0.2 * math.sin(at * 5.0 + 1.0),
            "EyeBlinkLeft": float(1.0 < at < 1.15),
            "EyeBlinkRight": float(1.0 < at < 1.15),
            "BrowInnerUp": 0.3 + 0.3 * math.sin(at * 1.5),
            "HeadYaw": 0.3 * math.sin(at * 1.2),
            "HeadPitch": 0.1 * math.sin(at * 2.1),
        }
        values = ",".join(f"{has.get(name, 0.0):.10f}" for name in names)
        lines.append(f"10:00:{row // RATE:02}:{row % RATE:02}.000,{len(names)},{values}")
    return "\n".join(lines) + "\n"


SHAPES = """EyeBlinkLeft EyeLookDownLeft EyeLookInLeft EyeLookOutLeft EyeLookUpLeft EyeSquintLeft
EyeWideLeft EyeBlinkRight EyeLookDownRight EyeLookInRight EyeLookOutRight EyeLookUpRight
EyeSquintRight EyeWideRight JawForward JawRight JawLeft JawOpen MouthClose MouthFunnel MouthPucker
MouthRight MouthLeft MouthSmileLeft MouthSmileRight MouthFrownLeft MouthFrownRight MouthDimpleLeft
MouthDimpleRight MouthStretchLeft MouthStretchRight MouthRollLower MouthRollUpper MouthShrugLower
MouthShrugUpper MouthPressLeft MouthPressRight MouthLowerDownLeft MouthLowerDownRight
MouthUpperUpLeft MouthUpperUpRight BrowDownLeft BrowDownRight BrowInnerUp BrowOuterUpLeft
BrowOuterUpRight CheekPuff CheekSquintLeft CheekSquintRight NoseSneerLeft NoseSneerRight
TongueOut"""
REMOVE_ACTION = """
data = rig()["risorius_controls"].animation_data
if data and data.action:
    bpy.data.actions.remove(data.action)
"""
