# SPDX-License-Identifier: MIT
"""Names that every client and engine takes."""

from __future__ import annotations

import re

# To three.js, Godot, Unity and Unreal the others are parts of a path, or of nothing.
_UNSAFE = re.compile(r"[^\w+\-]")


def safe(name: str) -> str:
    """A name of letters, digits, "_", "+" and "-". Args: name: any; other signs become "_"."""
    return _UNSAFE.sub("_", name) or "_"


def unlike(name: str, taken: set[str]) -> str:
    """A name that is not taken, with a number where it must be; small letters count as large ones.

    Args:
        name: that is wished.
        taken: of lower case; gets it.
    """
    free, number = name, 2
    while free.lower() in taken:
        free, number = f"{name}_{number}", number + 1
    taken.add(free.lower())
    return free
