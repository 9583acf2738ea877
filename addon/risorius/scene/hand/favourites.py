# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and changes the favourite sliders of a face.

A character may have its own list. Without this list, the list in the user's preferences is used."""

from __future__ import annotations

from collections.abc import Collection

from ..base import parts
from ..base.blender_types import ArmatureObject

_LIST = "risorius_favourites"  # on the control armature: names of sliders, one per line


def of(controls: ArmatureObject, users: str) -> list[str]:
    """The names of the favourite sliders that exist on a face.

    Args:
        controls: its control armature.
        users: the user's favourites, one name per line, for a face without its own list.
    """
    text = controls.get(_LIST)
    face = controls.pose.bones[parts.FACE]
    names = (text if isinstance(text, str) else users).split("\n")
    return [name for name in dict.fromkeys(names) if name in face]


def toggle(controls: ArmatureObject, names: Collection[str], users: str) -> str:
    """Add sliders to the favourites of a face, or remove them if all are favourites already.

    Args:
        controls: control armature of the face.
        names: names of the sliders.
        users: the user's favourites, one name per line, for a face without its own list.

    Returns:
        The new list, one name per line.
    """
    there = of(controls, users)
    if all(name in there for name in names):
        there = [name for name in there if name not in names]
    else:
        there += [name for name in names if name not in there]
    controls[_LIST] = "\n".join(there)
    controls.property_overridable_library_set(f'["{_LIST}"]', True)
    return controls[_LIST]
