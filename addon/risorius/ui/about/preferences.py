# SPDX-License-Identifier: GPL-3.0-or-later
# Blender reads the properties of a class from annotations, which a type checker takes for types:
# pyright: reportInvalidTypeForm=false
"""The preferences of the add-on, with a self-test."""

import platform
import sys

import bpy
import numpy as np

from ... import native
from ...scene.base import compat
from .. import words
from ..blender_types import AddonPreferences, Context
from ..hand import pie
from ..speech.install import draw_preferences


def self_test() -> tuple[bool, str]:
    """Test the native module with a rig of one joint.

    Returns:
        Whether the module works, and a sentence about the result.
    """
    trouble = native.problem()
    if trouble:
        return False, words.say(trouble)
    risorius = native.module()
    space = risorius.BoneSpace(np.zeros((1, 3), np.float32), [0], axes=np.eye(3), scale=2.0)
    deltas = np.array([[1, 2, 3, 0, 0, 0, 0, 0, 0]], np.float32)
    if space.evaluate(deltas)[0].tolist() != [[2.0, 4.0, 6.0]]:
        return False, words.say(
            "The native module computes wrong numbers: install the extension anew."
        )
    return True, words.say(
        "Risorius {version} works: Python {python}, {machine}",
        version=native.addon_version(),
        python=f"{sys.version_info.major}.{sys.version_info.minor}",
        machine=platform.machine(),
    )


class RISORIUS_Preferences(AddonPreferences):
    bl_idname = native.ADDON

    sides: bpy.props.EnumProperty(
        name="Left and Right",
        description="Point of view for the names and places of the left and right sliders",
        items=(
            ("SEEN", "As Seen", "Left is on your left when the face looks at you"),
            ("OWN", "The Character's", "Left is the character's own left, as in a body's bones"),
        ),
    )

    hints: bpy.props.BoolProperty(
        name="First Steps",
        description="Show the hints First Steps in the panel Face until you hide them",
        default=True,
    )

    expression_library: bpy.props.StringProperty(
        name="Expression Library",
        description="Folder of expressions for all files; empty: the folder of the extension",
        subtype="DIR_PATH",
    )
    favourites: bpy.props.StringProperty(options={"HIDDEN"})

    def draw(self, context: Context) -> None:
        works, text = self_test()
        words.show(self.layout, text, "CHECKMARK" if works else "ERROR")
        self.layout.operator("risorius.self_test", icon="CHECKMARK")
        if compat.notice():
            words.write(self.layout, compat.notice(), "INFO")
        self.layout.prop(self, "sides")
        pie.draw_preferences(self.layout, context)
        self.layout.prop(self, "hints")
        self.layout.prop(self, "expression_library")
        if works:
            draw_preferences(self.layout)


class RISORIUS_Idle(AddonPreferences):
    """The preferences of a copy of the add-on that does nothing because another copy is active."""

    bl_idname = native.ADDON

    def draw(self, context: Context) -> None:
        words.write(self.layout, twice(native.other_copy()), "ERROR")


def twice(other: str) -> str:
    """The sentence for the preferences if another copy of the add-on is active.

    Args:
        other: module name of the other copy, bl_ext.REPOSITORY.risorius.
    """
    return words.say(
        "Another copy of Risorius is in use, of the repository {name}; this one does nothing. "
        "Disable or remove one of the two.",
        name=other.removeprefix("bl_ext.").partition(".")[0],
    )


CLASSES = (RISORIUS_Preferences,)
