# SPDX-License-Identifier: MIT
"""Does the steps of docs/animator.md with a real pointer, and takes the pictures of that page."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

from common import (
    SMILE,
    Check,
    add_idle_life,
    clear,
    look_at_face,
    open_section,
    put_down,
    ready_tab,
    scroll,
    take_up,
)
from hand import WIDTH, Hand, difference

LAST = 240  # last frame; ten seconds


def go_to(hand: Hand, frame: int) -> None:
    """Go to a frame by a click into the timeline."""
    hand.click(*hand.ask("timeline_at", frame=frame))
    hand.wait(f"frame {frame}", lambda: hand.ask("state")["frame"] == frame)


def key_all(hand: Hand) -> None:
    """Click on Key All at the top of the tab."""
    scroll(hand, -40)
    hand.click(*hand.find(r"risorius\.key\(", columns=(0.85, 0.75)))


def expression(hand: Hand, name: str) -> None:
    """Search for an expression and click on its picture. Its section of the tab must be open."""
    hand.ask("run", code=f"bpy.context.window_manager.risorius_expressions.search = {name!r}")
    hand.wait("its picture is drawn", lambda: hand.ask("pictures_drawn", expression=name))
    scroll(hand)
    hand.click(*hand.find(rf"risorius\.expression\(.*expression=.{name}.", columns=(0.25, 0.4)))
    hand.wait(name, lambda: hand.ask("state")["sliders"])


def shot(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Animate ten seconds, starting at the neutral pose: steps 3 to 12 of docs/animator.md."""
    clear(hand)
    look_at_face(hand)
    ready_tab(hand)
    yield from _smirk(hand)
    key_all(hand)
    open_section(hand, "RISORIUS_PT_animation", "RISORIUS_PT_expressions")
    for frame, name in ((60, "joy"), (110, "surprise")):
        go_to(hand, frame)
        expression(hand, name)
        key_all(hand)
    scroll(hand)
    hand.picture("animator-expressions")
    scroll(hand, -40)
    go_to(hand, 170)
    hand.click(*hand.find(r"risorius\.reset\(", columns=(0.5, 0.45)))
    key_all(hand)
    keyed = hand.ask("keyed_frames")
    yield f"Key All at four frames: {keyed}", keyed == [1, 60, 110, 170]
    yield from _blink(hand)
    yield from _idle(hand)
    yield from _play(hand)
    put_down(hand)
    clear(hand)


def _smirk(hand: Hand) -> Iterator[Check]:
    take_up(hand)
    at = hand.ask("moved_by", control=SMILE[0])["at"]
    hand.begin_drag(at)
    hand.go(at, (at[0] + 12, at[1] - 12))
    hand.picture("animator-drag")
    hand.do("mouseup", 1)
    hand.ask("ready")
    yield "the corner of the mouth is dragged up", len(hand.ask("state")["sliders"]) > 0


def _blink(hand: Hand) -> Iterator[Check]:
    open_section(hand, "RISORIUS_PT_animation", "RISORIUS_PT_gaze")
    go_to(hand, 140)
    scroll(hand)
    hand.click(*hand.find(r"risorius\.blink\("))
    keyed = hand.ask("keyed_frames")
    yield "Blink keys the lids", 143 in keyed


def _idle(hand: Hand) -> Iterator[Check]:
    add_idle_life(hand)
    yield "idle life lies over it", len(hand.ask("state")["layers"]) == 1


def _play(hand: Hand) -> Iterator[Check]:
    """Type the scene's last frame, and play the animation.

    Before playing, check that the pixels of the face differ between successive poses.
    """
    header = hand.ask("timeline_header")
    columns = tuple(1.0 - 0.015 * step for step in range(40))
    place = hand.find("frame_end", of_field=True, columns=columns, area=header)
    hand.move(place[0] - 30, place[1])  # away from the arrow at the field's end, which adds 1
    hand.do("click", "--repeat", 2, "--delay", 60, 1)
    hand.key("ctrl+a")
    hand.type(str(LAST))
    hand.key("Return")
    hand.wait("the scene's end", lambda: hand.ask("timeline_header")[4] == LAST)
    yield "240 typed into End", place[0] > 0
    look_at_face(hand)
    box = hand.ask("face_box")
    go_to(hand, 30)
    seen = [hand.still()]
    for frame in (60, 110, 143, 200):
        go_to(hand, frame)
        hand.move(WIDTH * 0.3, 500)
        seen.append(hand.still())
        if frame == 110:
            hand.picture("animator-shot")
    moved = [difference(a, b, box) for a, b in pairwise(seen)]
    yield "the face differs from beat to beat", min(moved) > 0.01
    hand.move(WIDTH * 0.3, 500)
    hand.key("space")
    hand.wait("it plays", lambda: hand.ask("state")["frame"] not in (200, 201))
    hand.key("space")
    yield "it plays", True
