# SPDX-License-Identifier: MIT
"""Prints the progress of a long rendering, such as "frame 12 of 240, about 1 min 20 s left"."""

from __future__ import annotations

import time
from collections.abc import Callable

EVERY = 5.0  # seconds between two lines


class Progress:
    """Prints a line after the first picture, after the last, and every EVERY seconds in between.

    Args:
        total: number of pictures.
        what: noun for one picture, for example "frame".
        clock: function that returns the time in seconds.
        say: function that prints a line.
    """

    def __init__(
        self,
        total: int,
        what: str,
        clock: Callable[[], float] = time.monotonic,
        say: Callable[[str], None] = lambda line: print(f"    {line}", flush=True),
    ) -> None:
        self._total, self._what, self._clock, self._say = total, what, clock, say
        self._done = 0
        self._began = self._said = clock()

    def step(self) -> None:
        """Count one finished picture, and print a line if one is due."""
        self._done += 1
        now = self._clock()
        if 1 < self._done < self._total and now - self._said < EVERY:
            return
        self._said = now
        left = (now - self._began) / self._done * (self._total - self._done)
        tail = f", about {duration(left)} left" if self._done < self._total else ""
        self._say(f"{self._what} {self._done} of {self._total}{tail}")


def duration(seconds: float) -> str:
    """The duration as text, for example "45 s", "1 min 20 s" or "1 h 05 min"."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02} min"
