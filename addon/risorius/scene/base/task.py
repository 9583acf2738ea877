# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs a function in a background thread, with progress and cancel.

The function must not use Blender data.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

Result = TypeVar("Result")
Work = Callable[[Callable[[float], None], Callable[[], bool]], Result]


def telling(
    progress: Callable[[float], None], cancelled: Callable[[], bool]
) -> Callable[[float], bool]:
    """Combine two functions into one that reports progress and returns False after a cancel.

    Args:
        progress: function that receives the progress, 0 to 1.
        cancelled: function that returns whether the task was cancelled.
    """

    def tell(share: float) -> bool:
        progress(share)
        return not cancelled()

    return tell


class Task(Generic[Result]):
    """A function that runs in a background thread, with its progress and result.

    Attributes:
        share: progress, 0 to 1.
        result: result of the work; None until it is finished.
        error: error of the work, or None.
    """

    def __init__(self, work: Work[Result]) -> None:
        """Prepare the thread without starting it.

        Args:
            work: function with two arguments: `progress`, a function that it calls with its
                progress (0 to 1), and `cancelled`, a function that returns True if the work must
                end early.
        """
        self.share = 0.0
        self.result: Result | None = None
        self.error: Exception | None = None
        self._work = work
        self._cancelled = threading.Event()
        self._thread = threading.Thread(target=self.run, daemon=True)

    def start(self) -> None:
        """Start the work in the thread."""
        self._thread.start()

    def run(self) -> None:
        """Do the work in the calling thread, and store its result or error."""
        try:
            self.result = self._work(self._progress, self._cancelled.is_set)
        except Exception as error:  # noqa: BLE001  the code that waits for the thread reports it
            self.error = error

    def _progress(self, share: float) -> None:
        self.share = float(share)

    def is_running(self) -> bool:
        """Whether the thread is running."""
        return self._thread.is_alive()

    def wait(self) -> None:
        """Wait until the thread ends."""
        if self.is_running():
            self._thread.join()

    def cancel(self) -> None:
        """Ask the work to end, and wait until the thread ends."""
        self._cancelled.set()
        self.wait()
