# SPDX-License-Identifier: MIT
"""Operates Blender's search, the menu Face, dialogs and the file browser by keys and clicks."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from common import IN_VIEW
from hand import Hand, LateError


def search(hand: Hand, words: str, operator: str = "", keys: str = "Return") -> None:
    """Run an operator by Blender's search (F3).

    Args:
        hand: the pointer.
        words: text to type into the search field.
        operator: bl_idname of the operator that must have run at the end; "" for an operator that
            opens a dialog, because it has not run yet.
        keys: keys that run the first search result.

    Raises:
        LateError: the operator did not run.
    """
    hand.move(*IN_VIEW)
    hand.key("F3")
    for _ in range(3):  # the first search of a session is slow, because it builds all menus
        hand.ask("ready")
    hand.type(words)
    time.sleep(0.4)  # Blender updates the list of results after typing
    hand.ask("ready")
    hand.key(keys)
    hand.ask("ready")
    if operator:
        hand.wait(f"F3, {words}", lambda: hand.ask("state")["last"] == operator, 20.0)


def open_face_menu(hand: Hand) -> tuple[float, float]:
    """Click along the 3D viewport's header until the menu Face opens.

    Returns x and the upper edge of the menu, in pixels of the window.
    """
    hand.ask("watch", panel="RISORIUS_MT_face")
    left, top, width, height = hand.see("rectangle(header_of_view())")
    hand.do("key", "Escape")
    for x in range(left + 60, left + width // 2, 16):
        hand.see("_drawn.update(RISORIUS_MT_face=0)")
        hand.click(x, top + height / 2)
        hand.ask("ready")
        if hand.ask("drawn", panel="RISORIUS_MT_face"):
            return x, top + height
        hand.key("Escape")
        hand.move(*IN_VIEW)
    raise LateError("no menu Face in the header")


def in_menu(hand: Hand, pattern: str, x: float, top: float, high: int = 420) -> None:
    """Click on the entry of an open menu whose command matches a pattern.

    Args:
        hand: the pointer.
        pattern: regular expression of the command.
        x, top: x and the upper edge of the menu, in pixels of the window.
        high: height of the area below `top` that is searched for the entry, pixels.
    """
    area = [round(x) - 20, round(top), 200, high]
    hand.click(*hand.find(pattern, columns=(0.35,), area=area, step=9))


def accept(hand: Hand, done: Callable[[], bool]) -> None:
    """Confirm a dialog that has just opened under the pointer.

    Return over a field would edit the field, so the pointer is first moved to the title.

    Args:
        hand: the pointer.
        done: whether the dialog's operator has run.

    Raises:
        LateError: the operator did not run.
    """
    for above in (30, 55, 80):  # possible heights of the title above the pointer, pixels
        hand.move(IN_VIEW[0], IN_VIEW[1] - above)
        hand.key("Return")
        try:
            hand.wait("a dialog", done, 15.0)
        except LateError:
            hand.key("Return")  # ends editing, if the pointer was over a field
        else:
            return
    raise LateError("the dialog does nothing")


def name_file(hand: Hand, path: Path, ending: str = "Return") -> None:
    """Type a path into the upper field of the file browser and confirm.

    Args:
        hand: the pointer.
        path: path of an existing file, or of a folder.
        ending: key that confirms the file browser; with "", the path is a folder, which the file
            browser shows without being confirmed.
    """
    hand.wait("the file browser", lambda: "FILE_BROWSER" in hand.ask("state")["areas"])
    hand.still()
    _write(hand, "UI", 0.4, str(path) if ending else f"{path}/")
    if ending:
        hand.key(ending)


def save_as(hand: Hand, path: Path) -> None:
    """Type a folder and a file name into the fields of the file browser and confirm."""
    name_file(hand, path.parent, ending="")
    _write(hand, "EXECUTE", 0.3, path.name)
    hand.key("Return")
    hand.wait("the view is back", lambda: "VIEW_3D" in hand.ask("state")["areas"])


def _write(hand: Hand, region: str, column: float, text: str) -> None:
    """Type text into a field of the file browser, then move the pointer over the file list.

    Args:
        hand: the pointer.
        region: type of the file browser's region that contains the field, such as EXECUTE.
        column: horizontal place of the field, as a fraction of the region's width.
        text: the text.
    """
    left, top, width, height = hand.ask("browser_region", kind=region)
    hand.move(left + width * column, top + height / 2)
    hand.do("click", "--repeat", 2, "--delay", 60, 1)
    hand.ask("ready")
    hand.key("ctrl+a")
    hand.type(text)
    hand.key("Return")
    hand.still()
    left, top, width, height = hand.ask("browser_region", kind="WINDOW")
    hand.move(left + width * 0.5, top + height * 0.6)
