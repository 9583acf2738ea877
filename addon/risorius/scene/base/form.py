# SPDX-License-Identifier: GPL-3.0-or-later
"""Stores the version number of a character's saved data on its control armature."""

from __future__ import annotations

from .blender_types import ArmatureObject

VERSION = "risorius_version"  # on the control armature: the version number
PRESENT = 4  # version that this add-on writes
NEEDS = "Needs Risorius"  # on the control armature: text for users who lack the add-on
WORDS = (
    "Its sliders and bones move the face by this add-on; without it the face keeps its last pose"
)


def be_born(controls: ArmatureObject) -> None:
    """Store the version number, and a text for users who lack the add-on, on a new character.

    Args:
        controls: the control armature of the character.
    """
    controls[VERSION] = PRESENT
    controls[NEEDS] = WORDS


def version_of(controls: ArmatureObject) -> int:
    """The version of a character's saved data; 0 if an add-on without version numbers saved it."""
    found = controls.get(VERSION)
    return found if isinstance(found, int) and found > 0 else 0
