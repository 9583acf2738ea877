# SPDX-License-Identifier: GPL-3.0-or-later
"""The form of a character's saved data in a .blend, as a number on its control armature."""

from __future__ import annotations

from .blender_types import ArmatureObject

VERSION = "risorius_version"  # on the control armature: the number of its form
PRESENT = 4
NEEDS = "Needs Risorius"  # on the same: words for those who open the file without the add-on
WORDS = (
    "Its sliders and bones move the face by this add-on; without it the face keeps its last pose"
)


def be_born(controls: ArmatureObject) -> None:
    """Give a new character the present form. Args: controls  its control armature."""
    controls[VERSION] = PRESENT
    controls[NEEDS] = WORDS


def version_of(controls: ArmatureObject) -> int:
    """The number of a character's form; 0 from before there were numbers."""
    found = controls.get(VERSION)
    return found if isinstance(found, int) and found > 0 else 0
