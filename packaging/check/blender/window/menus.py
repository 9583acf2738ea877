# SPDX-License-Identifier: MIT
"""Blender's search, the menu Face in the view's header, and dialogs, by keys and clicks."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from common import IN_VIEW
from hand import Hand, LateError


def search(hand: Hand, words: str, operator: str = "", keys: str = "Return") -> None:
    """F3 over the view, words, Return.

    Args:
        hand: has the window.
        words: of the entry.
        operator: what has run in the end, as Blender notes it; "" where it opens something.
        keys: what takes the entry.

    Raises:
        LateError: it has not run.
    """
    hand.move(*IN_VIEW)
    hand.key("F3")
    for _ in range(3):  # the first search of a session makes all menus
        hand.ask("ready")
    hand.type(words)
    time.sleep(0.4)  # the list follows the words
    hand.ask("ready")
    hand.key(keys)
    hand.ask("ready")
    if operator:
        hand.wait(f"F3, {words}", lambda: hand.ask("state")["last"] == operator, 20.0)


def open_face_menu(hand: Hand) -> tuple[float, float]:
    """Click on the menus of the view's header until the menu Face is drawn; returns where it is."""
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
    """Click on the entry of an open menu that runs a command."""
    area = [round(x) - 20, round(top), 200, high]
    hand.click(*hand.find(pattern, columns=(0.35,), area=area, step=9))


def accept(hand: Hand, done: Callable[[], bool]) -> None:
    """Return in a dialog that has just been opened under the pointer, which goes off its fields.

    Args:
        hand: has the window.
        done: whether it has done what it is for.

    Raises:
        LateError: it has not.
    """
    for above in (30, 55, 80):  # over its title, which lies above the first row or the second
        hand.move(IN_VIEW[0], IN_VIEW[1] - above)
        hand.key("Return")
        try:
            hand.wait("a dialog", done, 15.0)
        except LateError:
            hand.key("Return")  # it was over a field: that is left
        else:
            return
    raise LateError("the dialog does nothing")


def name_file(hand: Hand, path: Path, ending: str = "Return") -> None:
    """Write a path into the file browser's upper field, and go.

    Args:
        hand: has the window.
        path: of a file that is there, or of a folder.
        ending: the key that goes, or "".
    """
    hand.wait("the file browser", lambda: "FILE_BROWSER" in hand.ask("state")["areas"])
    hand.still()
    _write(hand, "UI", 0.4, str(path) if ending else f"{path}/")
    if ending:
        hand.key(ending)


def save_as(hand: Hand, path: Path) -> None:
    """Write a folder into the upper field, a name into the lower one, and go."""
    name_file(hand, path.parent, ending="")
    _write(hand, "EXECUTE", 0.3, path.name)
    hand.key("Return")
    hand.wait("the view is back", lambda: "VIEW_3D" in hand.ask("state")["areas"])


def _write(hand: Hand, region: str, column: float, text: str) -> None:
    """Into the field of a region of the file browser; the pointer is over its files in the end."""
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
