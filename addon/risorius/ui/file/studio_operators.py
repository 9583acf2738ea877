# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""The operator that builds a studio around an existing face."""

import bpy

from ...scene.studio import build_studio
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_rig
from ..words import say

SCENE_CAMERA = bpy.props.BoolProperty(
    name="Scene Camera",
    description=(
        "Make the portrait camera the camera of the scene; the earlier camera"
        " is kept. A scene without a camera always uses it"
    ),
    default=True,
    options={"SKIP_SAVE"},
)


def add_studio(by: Operator, context: Context, scene_camera: bool) -> None:
    """Build a studio around the active face, and report it, a change of the scene's camera, and a
    marker that changes the camera later.

    Args:
        by: operator that reports.
        context: context with the scene and the face.
        scene_camera: True: the studio's camera becomes the scene's camera.
    """
    scene = context.scene
    before = scene.camera
    made = build_studio.add(context, face_rig(context), scene_camera)
    by.report({"INFO"}, say("The studio is in the collection {name}", name=made.name))
    if before is not None and scene.camera != before:
        text = "{name} was the scene's camera and is kept"
        by.report({"INFO"}, say(text, name=before.name))
    for marker in scene.timeline_markers:
        if scene_camera and marker.camera is not None:
            text = "The marker {name} gives the scene another camera from its frame on."
            by.report({"WARNING"}, say(text, name=marker.name))
            break


class RISORIUS_OT_add_studio(FaceOperator, Operator):
    """Add a portrait camera, three lights and a backdrop around the face"""

    bl_idname = "risorius.add_studio"
    bl_label = "Studio"
    baked_too = True

    use_scene_camera: SCENE_CAMERA

    def execute(self, context: Context) -> Result:
        add_studio(self, context, self.use_scene_camera)
        return {"FINISHED"}


CLASSES = (RISORIUS_OT_add_studio,)
