# SPDX-License-Identifier: MIT
"""Differences as they are found, and the words that all of them use."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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


# Plurals that are not made by adding an s.
_PLURALS = {"vertex": "vertices", "index": "indices", "bias": "biases", "mesh": "meshes"}


def plural(noun: str) -> str:
    """E.g. "raw controls", "vertices"."""
    return _PLURALS.get(noun) or noun + "s"


def counted(number: int, noun: str, several: str | None = None) -> str:
    """A number with its noun, e.g. "1 vertex" or "1,203 vertices".

    Args:
        number: how many.
        noun: in the singular.
        several: in the plural; None: as `plural` makes it.
    """
    return f"{number:,} {noun if number == 1 else several or plural(noun)}"


def joined(parts: Iterable[str]) -> str:
    """E.g. "a, b and c"."""
    words = list(parts)
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
