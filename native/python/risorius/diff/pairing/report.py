# SPDX-License-Identifier: MIT
"""Collects the differences of two rigs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

_NAMES = 5  # most names of a list that are shown


class Difference(NamedTuple):
    """One difference between the rigs A and B."""

    layer: str
    """Name of the layer: descriptor, definition, behavior ..."""
    field: str
    """Name of the property of Dna, e.g. meshes.positions."""
    text: str
    """Description of the difference."""


class Report:
    """Collects differences.

    Attributes:
        differences: the differences, in the order in which they were added.
        everything: True: lists of names are not shortened.
    """

    def __init__(self, everything: bool = False) -> None:
        self.differences: list[Difference] = []
        self.everything = everything

    def add(self, layer: str, field: str, text: str) -> None:
        """Add a difference; for layer, field and text see `Difference`."""
        self.differences.append(Difference(layer, field, text))

    def listed(self, names: Sequence[str]) -> str:
        """Names as a list; of more than six names only five and the number of the others are
        shown, unless `everything` is True."""
        if self.everything or len(names) <= _NAMES + 1:
            return ", ".join(names)
        return f"{', '.join(names[:_NAMES])} and {len(names) - _NAMES:,} more"
