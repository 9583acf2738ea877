# SPDX-License-Identifier: MIT
"""Actions in Blender's window that several steps of drive.py share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from hand import HEIGHT, WIDTH, Hand, LateError

IN_VIEW = (WIDTH * 0.3, HEIGHT * 0.55)  # a point of the 3D view beside the face, in pixels
JAW = "CTRL_expressions.jawOpen"
SMILE = ("CTRL_expressions.mouthCornerPullL", "CTRL_expressions.mouthCornerPullR")
Check = tuple[str, bool]
Step = Callable[[Hand, Path], Iterator[Check]]


class NotThereError(Exception):
    """This Blender or the extension lacks a feature that a step needs, so the step cannot run."""


def slider(hand: Hand, name: str = JAW) -> float:
    return float(hand.ask("state")["sliders"].get(name, 0.0))


def has_face(hand: Hand) -> bool:
    return bool(hand.ask("state")["face"])


def open_tab(hand: Hand) -> None:
    """Press N over the view, and click on the sidebar's tabs until the tab Risorius is open."""
    hand.move(*IN_VIEW)
    hand.key("n")
    hand.wait("the sidebar", lambda: hand.ask("layout")["sidebar"][2] > 20)
    hand.still()
    left, top, width, height = hand.ask("layout")["sidebar"]
    for y in range(top + 20, top + height, 14):
        hand.click(left + width - 10, y)
        hand.still()
        if hand.see("view()[2].active_panel_category") == "Risorius":
            return
    raise LateError("no tab Risorius in the sidebar")


def ready_tab(hand: Hand) -> None:
    hand.wait("the tab Risorius is shown", lambda: hand.ask("show_tab"))
    scroll(hand, -40)


def look_at_face(hand: Hand) -> None:
    """Show the face from the front, so that it fills the view."""
    hand.ask("settle")
    hand.ask("center")
    hand.still()


def take_up(hand: Hand) -> None:
    """Click on the button at the top of the tab that activates the tool for dragging the face."""
    hand.click(*hand.find(r"risorius\.drag_tool"))
    hand.wait("the tool is in the hand", lambda: hand.ask("drags"))


def put_down(hand: Hand) -> None:
    """Click on the button of the drag tool again, which returns to the previous tool."""
    scroll(hand, -40)
    hand.click(*hand.find(r"risorius\.drag_tool"))
    hand.wait("the tool is put down", lambda: not hand.ask("drags"))


def clear(hand: Hand) -> None:
    """Put the face into the neutral pose, and remove layers, keyframes, tweaks and heat map."""
    hand.ask("run", code=REST)
    hand.still()


REST = """
c = rig()["risorius_controls"]
if tweaks():
    with over(*view()[:2]):
        bpy.ops.risorius.tweak(enable=False)
c.animation_data_clear()
while len([y for y in c.risorius_layers if not y.removed]):
    bpy.ops.risorius.layer_remove()
with over(*view()[:2]):
    bpy.ops.risorius.heat(kind="OFF")
    bpy.ops.risorius.show_all()
    bpy.ops.risorius.reset()
    bpy.context.scene.frame_set(1)
    bpy.ops.ed.undo_push(message="At Rest")
"""


def open_section(hand: Hand, *panels: str) -> None:
    """Open a section of the tab by clicks on headers, and fold the others.

    No shortcut tells the name of a header. So all sections are folded, and headers are clicked from
    the bottom up until the wanted section is drawn. A wrong section is folded again. Buttons and
    values, which shortcuts can identify, are not clicked.

    Args:
        panels: class names of the parent section, if any, and of the section.
    """
    scroll(hand, -40)
    left, top, _width, _height = hand.ask("layout")["sidebar"]
    hand.do("keydown", "ctrl")
    hand.click(left + 60, top + 14)
    hand.do("keyup", "ctrl")
    for panel in panels:
        hand.ask("watch", panel=panel)
        if not _opened(hand, panel):
            scroll(hand)  # the section may be below the window's lower edge
            if not _opened(hand, panel):
                raise LateError(f"no section {panel}")
    hand.still()


def need_section(hand: Hand, panel: str) -> None:
    """Open the section of the tab with the class name `panel` if it is closed."""
    scroll(hand, -40)
    hand.ask("watch", panel=panel)
    hand.ask("draw_again", panel=panel)
    hand.ask("ready")
    hand.still()
    if not hand.ask("drawn", panel=panel):
        open_section(hand, panel)


def _opened(hand: Hand, panel: str) -> bool:
    """Click on possible headers from the bottom up. Returns whether the section was drawn."""
    left, top, _width, height = hand.ask("layout")["sidebar"]
    for y in range(top + height - 8, top + 8, -9):
        if hand.is_button(left + 60, y):
            continue
        hand.click(left + 60, y)
        hand.ask("draw_again", panel=panel)
        hand.ask("ready")
        if hand.ask("drawn", panel=panel):
            return True
        hand.key("Escape")  # closes a menu, if the click opened one
        hand.click(left + 60, y)
        hand.key("Escape")
    return False


def scroll(hand: Hand, notches: int = 25) -> None:
    """Turn the wheel over the sidebar by `notches` steps down; negative values go up."""
    left, top, width, height = hand.ask("layout")["sidebar"]
    hand.move(left + width - 40, top + height / 2)
    hand.wheel(notches)
    hand.still()


def add_idle_life(hand: Hand) -> None:
    """Add a layer of idle life by the menu of the layer list."""
    open_section(hand, "RISORIUS_PT_layers")
    x, y = hand.find(r"risorius\.layer_remove", columns=(0.97, 0.93, 1.0))
    hand.click(x, y - 21)  # the menu button above the minus; no shortcut identifies it
    hand.still()
    # The search starts inside the menu, because the menu closes if the pointer is above it.
    menu = [round(x) - 10, round(y) - 2, 150, 300]
    hand.click(*hand.find(r"risorius\.layer_add\(.*IDLE", columns=(0.4,), area=menu))
    hand.wait("a layer is there", lambda: hand.ask("state")["layers"])
