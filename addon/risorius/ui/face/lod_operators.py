# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that choose the level of detail in the viewport and in renders."""

import bpy

from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.frame import evaluate
from ...scene.lod import lods
from ...scene.skinning import conditions
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_rig
from ..words import say


class RISORIUS_OT_set_lod(FaceOperator, Operator):
    """Show the meshes of one level of detail"""

    bl_idname = "risorius.set_lod"
    bl_label = "Level of Detail"

    lod: bpy.props.IntProperty(
        name="Level",
        description=(
            "0 is the finest level; -1, for renders only: the same level as in the viewport"
        ),
        min=-1,
        max=31,
        options={"SKIP_SAVE"},
    )
    target: bpy.props.EnumProperty(
        name="Where",
        items=(
            ("BOTH", "Everywhere", "In the viewport and in renders"),
            ("VIEWPORT", "Viewport", "In the viewport; renders keep their own level"),
            ("RENDER", "Render", "In renders only"),
        ),
        options={"SKIP_SAVE"},
    )

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        follows = self.lod == lods.SAME and self.target == "RENDER"
        if not follows and self.lod not in lods.built(rig):
            self.report(
                {"ERROR"},
                say("Level {level} was not built for this face.", level=self.lod),
            )
            return {"CANCELLED"}
        lods.follow_camera(rig, False)
        if self.target == "BOTH":
            lods.show(rig, self.lod, lods.SAME)
        elif self.target == "RENDER":
            lods.show(rig, render=self.lod)
        else:
            lods.show(rig, self.lod, lods.render_level(rig))
        for item in parts.meshes_of(rig):
            conditions.note_written(item)  # evaluated vertices are no edit
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


class RISORIUS_OT_set_lod_by_distance(FaceOperator, Operator):
    """Let the distance to the scene's camera choose the level of detail"""

    bl_idname = "risorius.set_lod_by_distance"
    bl_label = "By Distance"

    enable: bpy.props.BoolProperty(name="By Distance", default=True, options={"SKIP_SAVE"})

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        if self.enable and context.scene.camera is None:
            self.report(
                {"WARNING"},
                say(
                    "The scene has no camera: the level of detail does not change "
                    "until you add a camera."
                ),
            )
        lods.follow_camera(rig, self.enable, _size(rig))
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


def _size(rig: ArmatureObject) -> float:
    """The longest side among the bounding boxes of a face's meshes, in Blender units."""
    return max((max(m.dimensions[:]) for m in parts.meshes_of(rig)), default=0.25)


CLASSES = (RISORIUS_OT_set_lod, RISORIUS_OT_set_lod_by_distance)
