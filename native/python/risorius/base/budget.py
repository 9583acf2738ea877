# SPDX-License-Identifier: MIT
"""Limits on memory and work for reading a file, in proportion to its size.

A few bytes of a file may demand gigabytes: arrays that unfold a thousand times, a thousand curves
that share one array, two frames a year apart. Therefore each reader counts bytes and steps before
it takes them. No clock is involved, so that the same file gives the same result on every machine.
"""

from __future__ import annotations

from .errors import RisoriusError

BASE_BYTES = 256 << 20
"""Limit for any file, even a tiny one: enough for an hour of a face's curves."""
BYTES_PER_BYTE = 32
BASE_STEPS = 20_000_000
STEPS_PER_BYTE = 64


class BudgetError(RisoriusError):
    """The file demands more memory or work than a file of its size may."""

    code = "limit"


class Budget:
    """The bytes and steps that are left while one file is read.

    Args:
        bytes_: largest number of bytes that may be held in total.
        steps: largest number of steps, about one per number that is read (some nanoseconds).
        name: name of the file, which begins error messages; "": the caller adds it.
    """

    def __init__(self, bytes_: int, steps: int, name: str = "") -> None:
        self._name = f"{name}: " if name else ""
        self.bytes = self._bytes = bytes_
        self.steps = self._steps = steps

    @classmethod
    def of(cls, size: int, name: str = "") -> Budget:
        """The budget for a file of `size` bytes with this name."""
        return cls(BASE_BYTES + BYTES_PER_BYTE * size, BASE_STEPS + STEPS_PER_BYTE * size, name)

    def hold(self, count: float, place: str) -> None:
        """Take `count` bytes of the budget, before they are held.

        Args:
            count: bytes.
            place: the object that needs the bytes, for the error.

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
            place: the object that needs the steps, for the error.

        Raises:
            BudgetError: fewer are left.
        """
        self.steps = _left(
            self.steps, self._steps, count, f"{self._name}{place}: {_amount(count)} steps", "done"
        )


def _amount(count: float) -> str:
    """The amount as text; a file may state integers beyond float."""
    return f"{min(count, 1 << 80) if isinstance(count, int) else count:,.0f}"


def _left(left: int, most: int, count: float, wanted: str, done: str) -> int:
    """The rest after `count` is taken. Raises: BudgetError: less is left."""
    if not count <= left:  # also of NaN
        raise BudgetError(
            f"{wanted} more than the {most - left:,} {done} before would be needed, "
            f"at most {most:,} in total were expected for this size"
        )
    return left - int(count)
