# SPDX-License-Identifier: MIT
"""Shows progress of long work, on a terminal or in a log."""

from __future__ import annotations

import shutil
import sys
import time
from typing import TextIO

_REDRAW_SECONDS = 0.2
_LINE_SECONDS = 10.0


class Progress:
    """A progress bar on a terminal, otherwise a line of text at intervals.

    Nothing is shown before the first interval has passed, because quick work needs no bar.
    """

    def __init__(
        self, total: int, noun: str, *, before: int = 0, stream: TextIO | None = None
    ) -> None:
        """Start at `before` of `total` items.

        Args:
            total: number of items.
            noun: name of the items, e.g. "jobs".
            before: number of items that an earlier run has done.
            stream: where to write; None for stderr.
        """
        self.total, self.noun = total, noun
        self.done = self._before = before
        self.frames = 0
        self._stream = stream or sys.stderr
        self._terminal = self._stream.isatty()
        self._started = self._shown = time.monotonic()
        self._drawn = False

    def update(self, done: int, frames: int = 0, note: str = "") -> None:
        """Set the state; it is drawn at intervals only.

        Args:
            done: number of finished items.
            frames: number of frames so far; 0 to show no speed.
            note: text at the end of the line.
        """
        self.done, self.frames = done, frames
        now = time.monotonic()
        if now - self._shown >= (_REDRAW_SECONDS if self._terminal else _LINE_SECONDS):
            self._shown = now
            self._draw(self.text(now - self._started, note))

    def text(self, elapsed: float, note: str = "") -> str:
        """The line, e.g. "[####......] 40 of 100 jobs, 2,100 frames/s, 1:12 left".

        Args:
            elapsed: seconds since the start.
            note: text at the end of the line.
        """
        part = self.done / self.total if self.total else 1.0
        words = [f"{self.done:,} of {self.total:,} {self.noun}"]
        if self.frames and elapsed > 0:
            words.append(f"{self.frames / elapsed:,.0f} frames/s")
        new = self.done - self._before
        if new > 0 and self.done < self.total:
            words.append(f"{clock(elapsed * (self.total - self.done) / new)} left")
        if note:
            words.append(note)
        bar = "#" * int(20 * part)
        return f"[{bar:.<20}] {', '.join(words)}"

    def _draw(self, text: str) -> None:
        if self._terminal:
            width = shutil.get_terminal_size().columns - 1
            self._stream.write("\r" + text[:width].ljust(width))
            self._drawn = True
        else:
            self._stream.write(f"risorius: {text}\n")
        self._stream.flush()

    def say(self, text: str) -> None:
        """Remove the bar and print a permanent line."""
        self.close()
        self._stream.write(f"risorius: {text}\n")
        self._stream.flush()

    def close(self) -> None:
        """Remove the bar."""
        if self._drawn:
            width = shutil.get_terminal_size().columns - 1
            self._stream.write("\r" + " " * width + "\r")
            self._stream.flush()
            self._drawn = False


def clock(seconds: float) -> str:
    """A time as text, e.g. 0:07, 12:40, 3:05:09."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
