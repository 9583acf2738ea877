# SPDX-License-Identifier: MIT
"""Runs a long step beside a caller that reports progress and may stop the work meanwhile."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")
_EVERY = 0.5  # seconds between two questions


def patiently(work: Callable[[], T], go_on: Callable[[], object]) -> T:
    """The result of a function that runs in another thread; its exceptions are raised here.

    If `go_on` raises an exception, it is raised here at once. The other thread cannot be stopped:
    it runs to its end, and its result is lost.

    Args:
        work: the function; it must not change anything that the caller still uses after a stop.
        go_on: called twice a second while the function runs; an exception that it raises stops
            the waiting.
    """
    results: list[T] = []
    errors: list[BaseException] = []

    def run() -> None:
        try:
            results.append(work())
        except BaseException as error:  # noqa: BLE001  raised again by the caller
            errors.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(_EVERY)
        if thread.is_alive():
            go_on()
    if errors:
        raise errors[0]
    return results[0]
