# SPDX-License-Identifier: GPL-3.0-or-later
"""What is there: the self-test of the preferences, the list of what a face is made of."""

import platform
import sys

import bpy
import numpy as np

from .. import native
from ..scene.base import parts
from ..scene.character import meshes, runtime
from . import speech_operators
from .operators import FaceOperator


def self_test():
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


class RISORIUS_Preferences(bpy.types.AddonPreferences):
    bl_idname = __package__.rpartition(".")[0]

    def draw(self, _context):
        works, text = self_test()
        self.layout.label(text=text, icon="CHECKMARK" if works else "ERROR")
        if works:
            speech_operators.draw_preferences(self.layout)


def describe(rig):
    """What a face is made of, a line per mesh: shapes that move nothing are named.

    Args:
        rig: its deforming armature.

    Returns:
        Lines of text.
    """
    live = runtime.of(rig)
    names = live.dna.blend_shape_channel_names
    lines = [
        f"{len(live.labels)} controls, {live.rig.joint_count} joints, {len(live.owned)} of them "
        f"moved by the file, {len(names)} channels, {len(live.dna.animated_map_names)} maps.",
        "Hair, clothes and grooms are not in DNA files.",
    ]
    for item in parts.meshes_of(rig):
        targets = live.dna.meshes[item[parts.MESH]].blend_shape_targets
        real = len(meshes.real_channels(item))
        still = [
            names[t.blend_shape_channel_index] for t in targets if not np.any(np.asarray(t.deltas))
        ]
        levels = ", ".join(str(level) for level in item[parts.LODS])
        lines.append(
            f"{item.name}: level {levels}, {len(item.data.vertices):,} vertices, "
            f"{len(targets)} channels move it, {real} of them as real keys."
        )
        if still:
            lines.append(f"    Move nothing: {', '.join(still)}")
    return lines


class RISORIUS_OT_describe(FaceOperator, bpy.types.Operator):
    """List what the active face is made of, mesh by mesh"""

    bl_idname = "risorius.describe"
    bl_label = "What Is in It"
    baked_too = True
    bl_options = {"REGISTER"}

    def execute(self, context):
        lines = describe(parts.active_rig(context))
        for line in lines:
            self.report({"INFO"}, line)
        if not bpy.app.background:
            context.window_manager.popup_menu(
                lambda menu, _context: [menu.layout.label(text=line) for line in lines],
                title="What is in this face",
                icon="INFO",
            )
        return {"FINISHED"}


CLASSES = (RISORIUS_Preferences, RISORIUS_OT_describe)
