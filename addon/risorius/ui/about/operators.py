# SPDX-License-Identifier: GPL-3.0-or-later
"""What a face is made of, as a list."""

import bpy
import numpy as np

from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import meshes, runtime
from .. import words
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_rig


def describe(rig: ArmatureObject) -> list[str]:
    """What a face is made of, a line per mesh: shapes that move nothing are named.

    Args:
        rig: its deforming armature.

    Returns:
        Lines of text.
    """
    live = runtime.there(rig)
    names = live.dna.blend_shape_channel_names
    lines = [
        words.say(
            "{controls} controls, {joints} joints, {moved} of them moved by the file, "
            "{channels} channels, {maps} maps.",
            controls=len(live.labels),
            joints=live.rig.joint_count,
            moved=len(live.owned),
            channels=len(names),
            maps=len(live.dna.animated_map_names),
        ),
        words.say("Hair, clothes and grooms are not in DNA files."),
    ]
    for item in parts.meshes_of(rig):
        targets = live.dna.meshes[item[parts.MESH]].blend_shape_targets
        real = len(meshes.real_channels(item))
        still = [
            names[t.blend_shape_channel_index] for t in targets if not np.any(np.asarray(t.deltas))
        ]
        levels = ", ".join(str(level) for level in item[parts.LODS])
        line = words.say(
            "{mesh}: level {levels}, {vertices:,} vertices, {channels} channels move it, "
            "{real} of them as real keys.",
            mesh=item.name,
            levels=levels,
            vertices=len(item.data.vertices),
            channels=len(targets),
            real=real,
        )
        lines.append(line)
        if still:
            lines.append("    " + words.say("Move nothing: {names}", names=", ".join(still)))
    return lines


class RISORIUS_OT_describe(FaceOperator, Operator):
    """List what the active face is made of, mesh by mesh"""

    bl_idname = "risorius.describe"
    bl_label = "What Is in It"
    baked_too = True
    bl_options = {"REGISTER"}

    def execute(self, context: Context) -> Result:
        lines = describe(face_rig(context))
        for line in lines:
            self.report({"INFO"}, line)
        if not bpy.app.background:
            context.window_manager.popup_menu(
                lambda menu, _context: [words.show(menu.layout, line) for line in lines],
                title=words.say("What is in this face"),
                icon="INFO",
            )
        return {"FINISHED"}


CLASSES = (RISORIUS_OT_describe,)
