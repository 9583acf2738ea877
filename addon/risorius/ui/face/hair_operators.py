# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""The operator that makes renders show hair as strands instead of cards."""

import bpy

from ...scene.character import runtime
from ...scene.hair import strands
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_rig
from ..words import say


class RISORIUS_OT_set_strands(FaceOperator, Operator):
    """Render hair as strands that follow the hair cards; the viewport shows the cards"""

    bl_idname = "risorius.set_strands"
    bl_label = "Strands in Renders"
    bl_options = {"REGISTER", "UNDO"}

    enable: bpy.props.BoolProperty(name="Strands in Renders", default=True, options={"SKIP_SAVE"})

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        if not self.enable:
            strands.hide(rig)
            return {"FINISHED"}
        unit = runtime.unit_of(rig)
        if not strands.show(rig, unit):
            self.report({"ERROR"}, say("This face has no cards of hair that strands could follow."))
            return {"CANCELLED"}
        return {"FINISHED"}


CLASSES = (RISORIUS_OT_set_strands,)
