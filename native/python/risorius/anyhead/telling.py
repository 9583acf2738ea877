# SPDX-License-Identifier: MIT
"""Reports the progress of long work to the caller, who can stop the work."""

from __future__ import annotations

from collections.abc import Callable

from .errors import Stopped

Progress = Callable[[float], object]  # receives the finished share, 0 to 1; False stops


def telling(
    progress: Progress | None, begin: float = 0.0, end: float = 1.0
) -> Callable[[float], bool]:
    """A function that reports the progress of a part of the work.

    It raises Stopped if `progress` returns False.

    Args:
        progress: receives the finished share of the whole work, 0 to 1.
        begin, end: shares of the whole work at which the part begins and ends.
    """

    def tell(share: float) -> bool:
        if progress is not None and progress(begin + (end - begin) * share) is False:
            raise Stopped
        return True

    return tell
