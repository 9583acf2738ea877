# SPDX-License-Identifier: GPL-3.0-or-later
# Blender takes properties where Python has annotations:
# pyright: reportInvalidTypeForm=false
"""Operators that set the sliders to an expression, and make pose assets of expressions."""

import bpy

from ...scene.animation import expressions
from ...scene.frame import evaluate
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_rig
from ..words import say


class RISORIUS_OT_expression(FaceOperator, Operator):
    """Move the sliders to an expression"""

    bl_idname = "risorius.expression"
    bl_label = "Expression"

    expression: bpy.props.StringProperty(name="Expression")
    strength: bpy.props.FloatProperty(
        name="Strength", default=1.0, min=0.0, max=1.0, subtype="FACTOR"
    )
    only: bpy.props.BoolProperty(name="Rest of the Face at Rest", default=True)
    key: bpy.props.BoolProperty(name="Key", description="At the current frame")

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        found = expressions.all_expressions().get(self.expression)
        if found is None:
            self.report({"ERROR"}, say("There is no expression {name}.", name=self.expression))
            return {"CANCELLED"}
        names = expressions.apply(rig, found, self.strength, self.only)
        if self.key:
            expressions.key(rig, names, context.scene.frame_current)
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


class RISORIUS_OT_make_pose_assets(FaceOperator, Operator):
    """Make a pose asset of every expression, for Blender's pose library"""

    bl_idname = "risorius.make_pose_assets"
    bl_label = "Expressions as Pose Assets"

    def execute(self, context: Context) -> Result:
        made, notes = expressions.make_assets(face_rig(context))
        for note in notes:
            self.report({"WARNING"}, note)
        self.report({"INFO"}, say("{count} pose assets", count=len(made)))
        return {"FINISHED"}


CLASSES = (RISORIUS_OT_expression, RISORIUS_OT_make_pose_assets)
