# SPDX-License-Identifier: MIT
"""Controls pointer and keyboard in Blender's window, reads the screen, and queries Blender."""

from __future__ import annotations

import json
import re
import subprocess
import time
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

Pixels = npt.NDArray[np.int16]  # rows, columns, red green blue
WIDTH, HEIGHT = 1440, 900
PATIENCE = 240.0  # longest wait in seconds, for busy machines; waits end once the condition holds
_PYTHON = "ctrl+c"  # over a button: copies the command that it runs
_PATH = "ctrl+shift+alt+c"  # over a field: copies the path of its value


class LateError(Exception):
    """A condition did not become true within PATIENCE, or a search found nothing."""


class Hand:
    """Moves the pointer, presses keys and takes pictures; calls functions of inside.py in Blender.
    Places are pixels of the screen from its upper left corner.

    Attributes:
        talk: folder of the files by which functions of inside.py are called.
        out: folder of the pictures.
        user: Blender's user folder.
        blender: Blender's process.
    """

    def __init__(self, talk: Path, out: Path, user: Path, blender: subprocess.Popen[bytes]) -> None:
        self.talk, self.out, self.user, self.blender = talk, out, user, blender
        self.count = 0
        self.places: dict[str, tuple[float, float]] = {}  # pattern -> last place of the button

    # ---- questions

    def ask(self, name: str, **arguments: object) -> Any:
        """Call a function of inside.py in Blender and return its result.

        Args:
            name: name of the function.
            arguments: its arguments; JSON must be able to represent them.

        Raises:
            RuntimeError: the function raised an exception, or Blender has ended.
            LateError: no answer came within PATIENCE.
        """
        number, self.count = self.count, self.count + 1
        part = self.talk / "ask.part"
        part.write_text(json.dumps({"name": name, "arguments": arguments}), encoding="utf-8")
        part.rename(self.talk / f"ask-{number}.json")
        answer = self.talk / f"answer-{number}.json"
        end = time.monotonic() + PATIENCE
        while not answer.exists():
            if self.blender.poll() is not None:
                raise RuntimeError(f"Blender ended while it was asked for {name}")
            if time.monotonic() > end:
                raise LateError(f"no answer to {name}")
            time.sleep(0.02)
        given = json.loads(answer.read_text(encoding="utf-8"))
        if "error" in given:
            raise RuntimeError(given["error"])
        return given["value"]

    def wait(self, what: str, holds: Callable[[], Any], patience: float = PATIENCE) -> Any:
        """Wait until a condition is true, and return its value.

        Args:
            what: text of the error.
            holds: function that returns a true value in the end.
            patience: longest wait in seconds.

        Raises:
            LateError: the condition stayed false.
        """
        end = time.monotonic() + patience
        while True:
            value = holds()
            if value:
                return value
            if time.monotonic() > end:
                raise LateError(what)
            time.sleep(0.1)

    # ---- the pointer

    def do(self, *words: object) -> None:
        """Run a command of xdotool."""
        subprocess.run(["xdotool", *map(str, words)], check=True)

    def move(self, x: float, y: float) -> None:
        """Move the pointer, and wait until Blender has handled the move."""
        self.do("mousemove", "--sync", round(x), round(y) - 1)
        self.do("mousemove", "--sync", round(x), round(y))
        self.ask("ready")

    def click(self, x: float, y: float, button: int = 1) -> None:
        self.move(x, y)
        self.do("click", button)
        self.ask("ready")

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 8) -> None:
        """Press the left button, move the pointer in steps, and release the button.

        Args:
            start, end: places on the screen, pixels.
            steps: number of moves.
        """
        self.begin_drag(start)
        self.go(start, end, steps)
        self.do("mouseup", 1)
        self.ask("ready")

    def begin_drag(self, start: tuple[float, float]) -> None:
        self.move(*start)
        self.do("mousedown", 1)
        self.ask("ready")

    def go(self, start: tuple[float, float], end: tuple[float, float], steps: int = 8) -> None:
        """Move the pointer in steps, and wait after each until Blender has handled it."""
        for number in range(1, steps + 1):
            share = number / steps
            at = [a + (b - a) * share for a, b in zip(start, end, strict=True)]
            self.do("mousemove", "--sync", round(at[0]), round(at[1]))
            self.ask("ready")

    def key(self, keys: str) -> None:
        self.do("key", keys)
        self.ask("ready")

    def wheel(self, notches: int) -> None:
        """Turn the wheel by `notches` steps down; negative values go up."""
        self.do("click", "--repeat", abs(notches), "--delay", 12, 5 if notches > 0 else 4)
        self.ask("ready")

    def type(self, text: str) -> None:
        self.do("type", "--delay", 30, "--", text)
        self.ask("ready")

    def see(self, code: str) -> Any:
        """The value of an expression evaluated in inside.py; JSON must be able to represent it."""
        return self.ask("see", code=code)

    # ---- buttons and fields under the pointer

    def under(self, x: float, y: float, *keys: str) -> str:
        """The text that shortcuts copy from the button at a place; "" if there is no button."""
        there = [round(x), round(y)]
        self.do("mousemove", there[0], there[1] - 1, "mousemove", *there, "key", *keys)
        self.ask("ready")
        return str(self.ask("taken")).strip()

    def is_button(self, x: float, y: float) -> bool:
        """Whether an operator button or a value field is at a place."""
        self.ask("taken")
        return bool(self.under(x, y, _PYTHON, _PATH))

    def find(self, pattern: str, of_field: bool = False, columns: tuple[float, ...] = (0.5,),
             area: list[int] | None = None, step: int = 10) -> tuple[float, float]:  # fmt: skip
        """Find the button of a command or the field of a value in the sidebar. Returns its place.

        Moves the pointer over many places. At each, Blender's shortcut copies the command of the
        button or the path of the value, so the search does not depend on the layout.

        Args:
            pattern: regular expression of the command or of the value's path.
            of_field: search for a value instead of a command.
            columns: horizontal places to search, as fractions of the width.
            area: left, top, width, height of the area to search; None: the sidebar.
            step: vertical distance of the places, pixels.

        Raises:
            LateError: no place matches.
        """
        left, top, width, height = (area or self.ask("layout")["sidebar"])[:4]
        keys = _PATH if of_field else _PYTHON
        self.ask("taken")
        before = [self.places[pattern]] if pattern in self.places and area is None else []
        for x, y in chain(before, _grid(left, top, width - 24, height, columns, step)):
            if re.search(pattern, self.under(x, y, keys)):
                self.places[pattern] = x, y
                return x, y
        raise LateError(f"no button or field {pattern!r} in the sidebar")

    # ---- the screen

    def screen(self) -> Pixels:
        """The whole screen, int16[height, width, 3]."""
        command = ["import", "-window", "root", "-depth", "8", "rgb:-"]
        raw = subprocess.run(command, stdout=subprocess.PIPE, check=True).stdout
        return np.frombuffer(raw, np.uint8).reshape(HEIGHT, WIDTH, 3).astype(np.int16)

    def still(self) -> Pixels:
        """The screen once two pictures in a row are equal.

        Blender redraws before each picture, because on a busy machine an undrawn screen is
        unchanged too.
        """
        seen = self._drawn()
        end = time.monotonic() + PATIENCE
        while True:
            time.sleep(0.4)
            now = self._drawn()
            if np.array_equal(now, seen):
                return now
            if time.monotonic() > end:
                raise LateError("the screen never stands still")
            seen = now

    def _drawn(self) -> Pixels:
        for _ in range(2):  # the second answer comes after the redraw of the first request
            self.ask("redraw")
        return self.screen()

    def picture(self, name: str, box: tuple[int, int, int, int] | None = None) -> None:
        """Save the screen as OUT/NAME.png.

        Args:
            name: name of the picture.
            box: left, top, right, bottom of the saved part; None saves the whole screen.
        """
        pixels = self.still().astype(np.uint8)
        image = Image.fromarray(pixels)
        (image.crop(box) if box else image).save(self.out / f"{name}.png")


def _grid(
    left: float, top: int, width: float, height: int, columns: tuple[float, ...], step: int
) -> Iterator[tuple[float, float]]:
    for column in columns:
        for y in range(top + 6, top + height - 4, step):
            yield left + width * column, y


def difference(one: Pixels, other: Pixels, box: list[float]) -> float:
    """The fraction of pixels in a box that differ by more than 12 of 255 in a channel.

    Args:
        one, other: pictures of the screen.
        box: left, top, right, bottom in pixels.
    """
    left, top, right, bottom = (round(max(v, 0)) for v in box)
    part = np.abs(one[top:bottom, left:right] - other[top:bottom, left:right]).max(axis=2)
    return float((part > 12).mean()) if part.size else 0.0
