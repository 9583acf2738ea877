# SPDX-License-Identifier: MIT
"""Tests the face board and the pictures of expressions with a real pointer."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from common import JAW, SMILE, Check, clear, look_at_face, open_section, ready_tab, scroll, slider
from hand import WIDTH, Hand, difference

HANDLES = """[b.name for b in rig()["risorius_controls"].data.bones if b.get("risorius_board")
and "FRAMES" not in b.name.upper() and b.name != "board"]"""
JOY = r"risorius\.expression\(.*expression=.joy."
BLEND_JOY = r"risorius\.blend_expression\(.*expression=.joy."


def board(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Add a board, move a handle, switch to sliders and back, and remove the board."""
    clear(hand)
    look_at_face(hand)
    open_section(hand, "RISORIUS_PT_options", "RISORIUS_PT_board")
    scroll(hand)
    hand.click(*hand.find(r"risorius\.add_board\(.*PRIMARY"))
    handles = hand.wait("a board is there", lambda: hand.see(HANDLES))
    hand.still()
    told = f"{len(handles)} handles and the face are in the view, in pose mode"
    yield told, hand.ask("state")["mode"] == "POSE" and hand.ask("board_in_view", names=handles)
    travel = hand.ask("least_travel", names=handles)
    yield f"each handle has at least 40 pixels of travel ({travel:.1f})", travel >= 40.0
    hand.picture("board-added")
    yield from _smirk(hand)
    handle = next(name for name in handles if name.lower().split("_")[-1] == "jaw")
    before, box = hand.still(), hand.ask("face_box")
    at = hand.ask("bone_at", bone=handle)
    hand.click(*at)
    yield "a click selects the handle of the jaw", hand.ask("active_bone") == handle
    hand.move(at[0] + 2, at[1])
    hand.key("g")
    hand.go(at, (at[0], at[1] + 60))
    hand.picture("board")
    led = hand.ask("given_by_board", control=JAW)
    hand.do("click", 1)
    hand.wait("the move has ended", lambda: not hand.ask("is_modal"))
    after = hand.still()
    yield f"G and a move of the pointer: the jaw opens ({led:.2f})", led > 0.1
    yield "and the face moves with it", difference(before, after, box) > 0.02
    ready_tab(hand)
    scroll(hand)
    hand.click(*hand.find(r"risorius\.lead\(.*SLIDERS", columns=(0.3, 0.2, 0.4)))
    hand.wait("the sliders lead", lambda: not hand.ask("board_leads"))
    yield "Sliders: the pose has gone over", abs(slider(hand) - led) < 0.01
    yield "and the face stays as it is", difference(after, hand.still(), box) < 0.02
    hand.move(WIDTH * 0.3, HEIGHT_OF_NOTHING)
    hand.key("ctrl+z")
    hand.wait("the board leads again", lambda: hand.ask("board_leads"))
    given = hand.ask("given_by_board", control=JAW)
    yield "Ctrl-Z: the board leads again", abs(given - led) < 0.01
    scroll(hand)
    hand.click(*hand.find(r"risorius\.remove_board"))
    hand.wait("the board is gone", lambda: not hand.see(HANDLES))
    yield "removed, the sliders keep what it gave", abs(slider(hand) - led) < 0.01
    hand.ask("run", code="bpy.ops.object.mode_set(mode='OBJECT')")
    clear(hand)


def _smirk(hand: Hand) -> Iterator[Check]:
    """Raise one corner of the mouth and one brow by their handles."""
    for handle, way in (("face_L_mouth_corner", (14, -26)), ("face_L_brow_outer", (0, -40))):
        at = hand.ask("bone_at", bone=handle)
        hand.click(*at)
        hand.move(at[0] + 2, at[1])
        hand.key("g")
        hand.go((at[0] + 2, at[1]), (at[0] + 2 + way[0], at[1] + way[1]))
        hand.do("click", 1)
        hand.wait("the move has ended", lambda: not hand.ask("is_modal"))
    pulled = hand.ask("given_by_board", control=SMILE[0])
    yield f"a smirk by two handles ({pulled:.2f})", pulled > 0.1
    ready_tab(hand)
    hand.picture("board-smirk")


HEIGHT_OF_NOTHING = 500  # y of a point in the view beside the face, pixels


def grid(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Test the pictures of expressions: click and undo, blend by dragging, and cancel by Esc."""
    clear(hand)
    look_at_face(hand)
    open_section(hand, "RISORIUS_PT_animation", "RISORIUS_PT_expressions")
    hand.ask("run", code="bpy.context.window_manager.risorius_expressions.search = 'joy'")
    scroll(hand)
    hand.wait("pictures are drawn", lambda: hand.ask("pictures_drawn", expression="joy"))
    hand.still()
    before, box = hand.still(), hand.ask("face_box")
    place = hand.find(JOY, columns=(0.25, 0.4))
    hand.click(*place)
    hand.wait("joy", lambda: hand.ask("state")["sliders"])
    after = hand.still()
    yield "a click on an expression sets it", difference(before, after, box) > 0.02
    hand.picture("grid")
    hand.move(WIDTH * 0.3, HEIGHT_OF_NOTHING)
    hand.key("ctrl+z")
    hand.wait("undone", lambda: not hand.ask("state")["sliders"])
    yield "Ctrl-Z takes it back", difference(before, hand.still(), box) < 0.01
    arrow = hand.find(BLEND_JOY, columns=(0.97, 0.93, 1.0))
    hand.click(*arrow)
    hand.go(arrow, (arrow[0] - 120, arrow[1]))
    hand.go((arrow[0] - 120, arrow[1]), (arrow[0] + 40, arrow[1]))
    half = hand.ask("state")["sliders"]
    hand.picture("grid-blend")
    hand.key("Escape")
    hand.wait("as before", lambda: not hand.ask("state")["sliders"])
    yield "the double arrow and a move blend it in", len(half) > 0
    yield "Esc gives all back", difference(before, hand.still(), box) < 0.01
    hand.ask("run", code="bpy.context.window_manager.risorius_expressions.search = ''")
