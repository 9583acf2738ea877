# SPDX-License-Identifier: MIT
"""Differences as they are found."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

_NAMES = 5  # so many names of a list are spelled out


class Difference(NamedTuple):
    """One thing that differs between the rigs A and B."""

    layer: str
    """descriptor, definition, behavior ...: where a person would look for it."""
    field: str
    """The property of Dna that it is about, e.g. meshes.positions."""
    text: str
    """In words."""


class Report:
    """Collects differences. everything: lists of names are not shortened."""

    def __init__(self, everything: bool = False) -> None:
        self.differences: list[Difference] = []
        self.everything = everything

    def add(self, layer: str, field: str, text: str) -> None:
        """Add a difference; the layer, field and text are those of `Difference`."""
        self.differences.append(Difference(layer, field, text))

    def listed(self, names: Sequence[str]) -> str:
        """E.g. "jaw, brow and 40 more"."""
        if self.everything or len(names) <= _NAMES + 1:
            return ", ".join(names)
        return f"{', '.join(names[:_NAMES])} and {len(names) - _NAMES:,} more"
