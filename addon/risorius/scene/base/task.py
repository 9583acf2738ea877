# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in a thread beside Blender, with progress and cancel. It uses no Blender data."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

Result = TypeVar("Result")
Work = Callable[[Callable[[float], None], Callable[[], bool]], Result]


def telling(
    progress: Callable[[float], None], cancelled: Callable[[], bool]
) -> Callable[[float], bool]:
    """A progress function that returns False to cancel the work.

    Args:
        progress: progress function of a task.
        cancelled: cancel function of the task.
    """

    def tell(share: float) -> bool:
        progress(share)
        return not cancelled()

    return tell


class Task(Generic[Result]):
    """Work that takes seconds.

    Attributes:
        share: finished share, 0 to 1.
        result: result of finished work.
        error: the error, or None.
    """

    def __init__(self, work: Work[Result]) -> None:
        """Args: work(progress, cancelled)  tells the share that is done, asks whether to end."""
        self.share = 0.0
        self.result: Result | None = None
        self.error: Exception | None = None
        self._work = work
        self._cancelled = threading.Event()
        self._thread = threading.Thread(target=self.run, daemon=True)

    def start(self) -> None:
        """Begin in a thread."""
        self._thread.start()

    def run(self) -> None:
        """Do it now, waiting in this thread."""
        try:
            self.result = self._work(self._progress, self._cancelled.is_set)
        except Exception as error:  # noqa: BLE001  a thread's error is told by who waits for it
            self.error = error

    def _progress(self, share: float) -> None:
        self.share = float(share)

    def is_running(self) -> bool:
        """Whether the thread still works."""
        return self._thread.is_alive()

    def wait(self) -> None:
        """Until the thread ends."""
        if self.is_running():
            self._thread.join()

    def cancel(self) -> None:
        """Let the work end, and wait for that."""
        self._cancelled.set()
        self.wait()
