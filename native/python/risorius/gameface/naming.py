# SPDX-License-Identifier: MIT
"""Names of meshes and targets that every glTF viewer and game engine accepts."""

from __future__ import annotations

import re

# three.js, Godot, Unity and Unreal read other characters as parts of a path, or drop them.
_UNSAFE = re.compile(r"[^\w+\-]")


def safe(name: str) -> str:
    """A name of letters, digits, "_", "+" and "-". Args: name: other characters become "_"."""
    return _UNSAFE.sub("_", name) or "_"


def unlike(name: str, taken: set[str]) -> str:
    """A name that is not taken, if necessary with a number; upper and lower case count as equal.

    Args:
        name: the preferred name.
        taken: names in lower case; the result is added to it.
    """
    free, number = name, 2
    while free.lower() in taken:
        free, number = f"{name}_{number}", number + 1
    taken.add(free.lower())
    return free
