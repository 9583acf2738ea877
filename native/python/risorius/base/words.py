# SPDX-License-Identifier: MIT
"""Numbers, nouns and lists for sentences."""

from __future__ import annotations

from collections.abc import Iterable

# Irregular plurals.
_PLURALS = {"vertex": "vertices", "index": "indices", "bias": "biases", "mesh": "meshes"}


def plural(noun: str) -> str:
    """E.g. "raw controls", "vertices"."""
    return _PLURALS.get(noun) or noun + "s"


def counted(number: int, noun: str, several: str | None = None) -> str:
    """A number with its noun, e.g. "1 vertex" or "1,203 vertices".

    Args:
        number: the number.
        noun: singular.
        several: plural; None: from `plural`.
    """
    return f"{number:,} {noun if number == 1 else several or plural(noun)}"


def joined(parts: Iterable[str]) -> str:
    """E.g. "a, b and c"."""
    words = list(parts)
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)
