# SPDX-License-Identifier: MIT
"""What reading a file may take, in proportion to the file.

A file may say in a few bytes what takes gigabytes: arrays that unfold a thousand times, a thousand
curves on one array, two frames a year apart. So each reader counts what it is about to hold and to
do, and stops before it does. No clock: the same file gives the same answer on every machine.
"""

from __future__ import annotations

from .errors import RisoriusError

BASE_BYTES = 256 << 20
"""What any file may take, however small: an hour of a face's curves that say little."""
BYTES_PER_BYTE = 32
BASE_STEPS = 20_000_000
STEPS_PER_BYTE = 64


class BudgetError(RisoriusError):
    """More memory or work would be needed than what was given can be worth."""

    code = "limit"


class Budget:
    """Bytes and steps that are left; handed through all that one file goes through.

    Args:
        bytes_: that may be held, in all.
        steps: that may be done; about one per number that is looked at, some nanoseconds each.
        name: of the file, which errors begin with; "": the caller names it.
    """

    def __init__(self, bytes_: int, steps: int, name: str = "") -> None:
        self._name = f"{name}: " if name else ""
        self.bytes = self._bytes = bytes_
        self.steps = self._steps = steps

    @classmethod
    def of(cls, size: int, name: str = "") -> Budget:
        """For what `size` bytes say, of a file of that name."""
        return cls(BASE_BYTES + BYTES_PER_BYTE * size, BASE_STEPS + STEPS_PER_BYTE * size, name)

    def hold(self, count: float, place: str) -> None:
        """Take `count` bytes of the budget, before they are held.

        Args:
            count: bytes.
            place: what the error calls what would take them.

        Raises:
            BudgetError: fewer are left.
        """
        self.bytes = _left(
            self.bytes, self._bytes, count, f"{self._name}{place}: {_amount(count)} bytes", "taken"
        )

    def work(self, count: float, place: str) -> None:
        """Take `count` steps of the budget, before they are done.

        Args:
            count: steps, about one per number that is looked at.
            place: what the error calls what would take them.

        Raises:
            BudgetError: fewer are left.
        """
        self.steps = _left(
            self.steps, self._steps, count, f"{self._name}{place}: {_amount(count)} steps", "done"
        )


def _amount(count: float) -> str:
    """A file may state whole numbers that no float holds; more than the world has is enough."""
    return f"{min(count, 1 << 80) if isinstance(count, int) else count:,.0f}"


def _left(left: int, most: int, count: float, wanted: str, done: str) -> int:
    """What is left once `count` is taken. Raises: BudgetError: there is not so much."""
    if not count <= left:  # also of NaN
        raise BudgetError(
            f"{wanted} more than the {most - left:,} {done} before would be needed, "
            f"at most {most:,} in all were expected of what has this size"
        )
    return left - int(count)
