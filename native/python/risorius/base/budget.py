# SPDX-License-Identifier: MIT
"""Limits on memory and work for reading a file: a constant plus a part in proportion to its size.

A few bytes of a file may demand gigabytes: compressed arrays, a thousand curves that share one
array, two frames a year apart. Therefore each reader takes bytes and steps from the budget before
it uses them. The budget does not depend on time, so the same file gives the same result on every
machine.
"""

from __future__ import annotations

from .errors import RisoriusError

BASE_BYTES = 256 << 20
"""Budget in bytes for a file of size 0: enough for an hour of a face's curves."""
BYTES_PER_BYTE = 32
BASE_STEPS = 20_000_000
STEPS_PER_BYTE = 64


class BudgetError(RisoriusError):
    """The file demands more memory or work than a file of its size may."""

    code = "limit"


class Budget:
    """The bytes and steps that remain while one file is read.

    Args:
        bytes_: largest number of bytes to allocate in total.
        steps: largest number of steps; a step is about one number that is read, some nanoseconds.
        name: name of the file, with which error messages begin; "": the caller adds it.
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
        """Take `count` bytes from the budget, before they are allocated.

        Args:
            count: number of bytes.
            place: the object that needs the bytes, for the error.

        Raises:
            BudgetError: fewer bytes remain.
        """
        self.bytes = _left(
            self.bytes, self._bytes, count, f"{self._name}{place}: {_amount(count)} bytes", "taken"
        )

    def work(self, count: float, place: str) -> None:
        """Take `count` steps from the budget, before they are done.

        Args:
            count: number of steps, about one per number that is read.
            place: the object that needs the steps, for the error.

        Raises:
            BudgetError: fewer steps remain.
        """
        self.steps = _left(
            self.steps, self._steps, count, f"{self._name}{place}: {_amount(count)} steps", "done"
        )


def _amount(count: float) -> str:
    """The amount as text, capped at 2**80, because larger integers of a file may overflow float."""
    return f"{min(count, 1 << 80) if isinstance(count, int) else count:,.0f}"


def _left(left: int, most: int, count: float, wanted: str, done: str) -> int:
    """`left` minus `count`. Raises BudgetError if `left` is smaller than `count`.

    Args:
        left: the rest of the budget.
        most: the whole budget.
        count: amount to take.
        wanted: begin of the error text, with the place and the amount.
        done: verb for the used part in the error text.
    """
    if not count <= left:  # True for NaN too
        raise BudgetError(
            f"{wanted} more than the {most - left:,} {done} before would be needed, "
            f"but at most {most:,} in total are allowed for input of this size"
        )
    return left - int(count)
