# SPDX-License-Identifier: GPL-3.0-or-later
# Blender takes properties where Python has annotations:
# pyright: reportInvalidTypeForm=false
"""A studio around a face that is there."""

import bpy

from ...scene.studio import build_studio
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_rig
from ..words import say

SCENE_CAMERA = bpy.props.BoolProperty(
    name="Scene Camera",
    description="Make the studio's camera the scene's; a scene without a camera takes it anyway",
    default=False,
)


class RISORIUS_OT_add_studio(FaceOperator, Operator):
    """Add a portrait camera, three lights and a backdrop around the face"""

    bl_idname = "risorius.add_studio"
    bl_label = "Studio"
    baked_too = True

    use_scene_camera: SCENE_CAMERA

    def execute(self, context: Context) -> Result:
        made = build_studio.add(context, face_rig(context), self.use_scene_camera)
        self.report({"INFO"}, say("The studio is in the collection {name}", name=made.name))
        return {"FINISHED"}


CLASSES = (RISORIUS_OT_add_studio,)
