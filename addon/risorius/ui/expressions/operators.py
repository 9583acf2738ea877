# SPDX-License-Identifier: GPL-3.0-or-later
# Blender takes properties where Python has annotations:
# pyright: reportInvalidTypeForm=false
"""Operators that set the sliders to an expression, and make pose assets of expressions."""

from collections.abc import Collection

import bpy

from ...scene.animation import expressions, keying
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_rig
from ..hand.base import HandOperator
from ..words import say


class RISORIUS_OT_expression(HandOperator, Operator):
    """Move the sliders to an expression"""

    bl_idname = "risorius.expression"
    bl_label = "Expression"

    expression: bpy.props.StringProperty(name="Expression")
    strength: bpy.props.FloatProperty(
        name="Strength", default=1.0, min=0.0, max=1.0, subtype="FACTOR"
    )
    only: bpy.props.BoolProperty(name="Rest of the Face at Rest", default=True)
    key: bpy.props.BoolProperty(name="Key", description="At the current frame")

    def move(self, context: Context) -> Collection[str] | None:
        rig = face_rig(context)
        found = expressions.all_expressions().get(self.expression)
        if found is None:
            self.report({"ERROR"}, say("There is no expression {name}.", name=self.expression))
            return None
        names = expressions.apply(rig, found, self.strength, self.only)
        if self.key and self.at == "NOW":
            keying.key(context, rig, names)
        return names


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
