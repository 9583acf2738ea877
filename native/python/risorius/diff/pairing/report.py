# SPDX-License-Identifier: MIT
"""The collected differences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

_NAMES = 5  # number of names of a list that are shown


class Difference(NamedTuple):
    """One difference between the rigs A and B."""

    layer: str
    """descriptor, definition, behavior ...: the layer."""
    field: str
    """The property of Dna, e.g. meshes.positions."""
    text: str
    """The description."""


class Report:
    """Collects differences. everything: do not shorten lists of names."""

    def __init__(self, everything: bool = False) -> None:
        self.differences: list[Difference] = []
        self.everything = everything

    def add(self, layer: str, field: str, text: str) -> None:
        """Add a difference with the layer, field and text of `Difference`."""
        self.differences.append(Difference(layer, field, text))

    def listed(self, names: Sequence[str]) -> str:
        """E.g. "jaw, brow and 40 more"."""
        if self.everything or len(names) <= _NAMES + 1:
            return ", ".join(names)
        return f"{', '.join(names[:_NAMES])} and {len(names) - _NAMES:,} more"
