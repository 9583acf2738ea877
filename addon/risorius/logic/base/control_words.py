# SPDX-License-Identifier: GPL-3.0-or-later
"""Descriptions and search words of controls, from a table in which * stands for L and R."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypedDict

PREFIX = "CTRL_expressions."  # prefix of raw controls in a standard DNA file


class WrittenRow(TypedDict):
    """A row of the table that describes controls.

    Attributes:
        does: a sentence: the effect of the control.
        words: words by which the control is found.
    """

    does: str
    words: list[str]


@dataclass(frozen=True)
class Row:
    """The description and the search words of one control.

    Attributes:
        does: a sentence: the effect of the control.
        words: words by which the control is found.
        side: a sentence that names the side of the control; "" for a control without a side.
    """

    does: str
    words: tuple[str, ...]
    side: str = ""


@dataclass(frozen=True)
class ControlWords:
    """The table's rows: name of a control without its prefix -> description and search words."""

    rows: Mapping[str, Row]

    def tooltip(self, control: str) -> str:
        """The effect of a control and its side; "" if the table lacks the control.

        Blender writes the slider's name before the text and a full stop after it.

        Args:
            control: name of the control, with or without its prefix.
        """
        row = self.rows.get(control.removeprefix(PREFIX))
        if row is None:
            return ""
        return f"{row.does} {row.side}".rstrip(" .")

    def searched(self, control: str) -> str:
        """The search words of a control, joined with spaces."""
        row = self.rows.get(control.removeprefix(PREFIX))
        return " ".join(row.words) if row is not None else ""


def expand(table: Mapping[str, WrittenRow], sides: Mapping[str, str]) -> ControlWords:
    """Make two rows, for L and R, of each row with a * in its name.

    Args:
        table: name of a control without its prefix -> row.
        sides: the sentences for L and R that name the side.
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
