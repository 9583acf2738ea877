# SPDX-License-Identifier: GPL-3.0-or-later
"""The preferences of the add-on, with a self-test."""

import platform
import sys

import numpy as np

from ... import native
from ..blender_types import AddonPreferences, Context
from ..speech.install import draw_preferences


def self_test() -> tuple[bool, str]:
    """One line on whether the native module works: it evaluates a rig of two numbers.

    Returns:
        Whether it does, and the sentence.
    """
    trouble = native.problem()
    if trouble:
        return False, trouble
    risorius = native.module()
    space = risorius.BoneSpace(np.zeros((1, 3), np.float32), [0], axes=np.eye(3), scale=2.0)
    deltas = np.array([[1, 2, 3, 0, 0, 0, 0, 0, 0]], np.float32)
    if space.evaluate(deltas)[0].tolist() != [[2.0, 4.0, 6.0]]:
        return False, "The native module computes wrong numbers: install the extension anew."
    return True, (
        f"Risorius {native.addon_version()} works: Python {sys.version_info.major}."
        f"{sys.version_info.minor}, {platform.machine()}, {risorius.available_simd()}"
    )


class RISORIUS_Preferences(AddonPreferences):
    bl_idname = native.ADDON

    def draw(self, context: Context) -> None:
        works, text = self_test()
        self.layout.label(text=text, icon="CHECKMARK" if works else "ERROR")
        if works:
            draw_preferences(self.layout)


CLASSES = (RISORIUS_Preferences,)
