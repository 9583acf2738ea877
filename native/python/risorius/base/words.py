# SPDX-License-Identifier: MIT
"""Plurals, counts and lists for sentences."""

from __future__ import annotations

from collections.abc import Iterable

# Irregular plurals.
_PLURALS = {"vertex": "vertices", "index": "indices", "bias": "biases", "mesh": "meshes"}


def plural(noun: str) -> str:
    """The plural of a noun, e.g. "raw controls", "vertices"."""
    return _PLURALS.get(noun) or noun + "s"


def counted(number: int, noun: str, several: str | None = None) -> str:
    """A count with its noun, e.g. "1 vertex" or "1,203 vertices".

    Args:
        number: the count.
        noun: noun in the singular.
        several: noun in the plural; None: from `plural`.
    """
    return f"{number:,} {noun if number == 1 else several or plural(noun)}"


def joined(parts: Iterable[str]) -> str:
    """A list as text, e.g. "a, b and c"."""
    words = list(parts)
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
