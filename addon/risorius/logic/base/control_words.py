# SPDX-License-Identifier: GPL-3.0-or-later
"""What a control does, in words: a table with a row for each, and * for the side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypedDict

PREFIX = "CTRL_expressions."  # of every raw control of a standard file


class WrittenRow(TypedDict):
    """A row as a table has it."""

    does: str
    words: list[str]


@dataclass(frozen=True)
class Row:
    """What is said of one control.

    Attributes:
        does: a sentence.
        words: what it is searched by.
        side: the sentence on its side, or nothing.
    """

    does: str
    words: tuple[str, ...]
    side: str = ""


@dataclass(frozen=True)
class ControlWords:
    """A table: rows by the names of controls, without their prefix."""

    rows: Mapping[str, Row]

    def tooltip(self, control: str) -> str:
        """What a control does, and its side; nothing of one that is not in the table.

        Blender puts the name before it and a full stop after it.

        Args:
            control: its name, with the prefix or without.
        """
        row = self.rows.get(control.removeprefix(PREFIX))
        if row is None:
            return ""
        return f"{row.does} {row.side}".rstrip(" .")

    def searched(self, control: str) -> str:
        """The words that a control is found by, as one text."""
        row = self.rows.get(control.removeprefix(PREFIX))
        return " ".join(row.words) if row is not None else ""


def expand(table: Mapping[str, WrittenRow], sides: Mapping[str, str]) -> ControlWords:
    """Rows for both sides of what has a * for its side.

    Args:
        table: rows by the name of the control.
        sides: a sentence each for L and R.
    """
    rows = {}
    for name, row in table.items():
        does, words = row["does"], tuple(row["words"])
        if "*" not in name:
            rows[name] = Row(does, words)
            continue
        for side in ("L", "R"):
            rows[name.replace("*", side)] = Row(does, words, sides[side])
    return ControlWords(rows)
