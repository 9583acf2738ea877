# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Chooses the faces, frames and level of detail of a bake or an export."""

import bpy

from ...logic.base.sentences import told
from ...scene.bake import bake_face
from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import runtime
from .. import words
from ..blender_types import Context, OperatorBase, UILayout
from ..common import FaceOperator, usable

RANGES = (
    ("SCENE", "Scene", "The frame range of the scene"),
    ("PREVIEW", "Preview", "The preview range if it is set, otherwise the range of the scene"),
    ("CUSTOM", "Custom", "First and last frame of your choice"),
)


def selected_rigs(context: Context, every: bool = False) -> list[ArmatureObject]:
    """The deforming armatures of all selected faces, or of the active face if none is selected.

    Faces that lack their control armature or their DNA data are left out, and so are selected
    linked faces.

    Args:
        context: context with the scene and the selection.
        every: True: the armatures of all faces of the scene.
    """
    items = context.scene.objects if every else context.selected_objects
    rigs = [parts.rig_of(item) for item in items]
    found = list(dict.fromkeys(r for r in rigs if r is not None and r.library is None))
    active = parts.active_rig(context)
    if not found and active is not None:
        found = [active]
    return [r for r in found if parts.controls_of(r) is not None and runtime.of(r) is not None]


class FacesOperator(FaceOperator):
    """Base of operators on all selected faces."""

    every: bpy.props.BoolProperty(
        name="All Faces",
        description="All faces of the scene, not only selected ones",
        options={"SKIP_SAVE"},
    )

    def faces(self, context: Context) -> list[ArmatureObject]:
        """The deforming armatures of the faces that the operator changes or exports.

        Raises:
            BakeError: no face is selected.
        """
        found = selected_rigs(context, self.every)
        if not found:
            raise bake_face.BakeError(told("No face is selected."))
        return found

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not usable(cls):
            return False
        if not (selected_rigs(context) or selected_rigs(context, every=True)):
            cls.poll_message_set(words.say("Select a face first."))
            return False
        return True


class FrameRange(OperatorBase):
    """Properties for the range of frames and the level of detail of an operator."""

    range: bpy.props.EnumProperty(name="Range", items=RANGES)
    start: bpy.props.FloatProperty(name="Start", default=1)
    end: bpy.props.FloatProperty(name="End", default=250)
    step: bpy.props.FloatProperty(
        name="Step",
        description="Distance between two keys in frames",
        default=1,
        min=0.01,
        soft_min=1,
    )
    lod: bpy.props.IntProperty(
        name="Detail",
        description="Level of detail: 0 is the finest, -1 the level that the viewport shows",
        default=-1,
        min=-1,
        max=31,
    )

    def frames(self, context: Context) -> tuple[float, float]:
        """The chosen first and last frame."""
        scene = context.scene
        if self.range == "CUSTOM":
            return self.start, self.end
        if self.range == "PREVIEW" and scene.use_preview_range:
            return scene.frame_preview_start, scene.frame_preview_end
        return scene.frame_start, scene.frame_end

    def draw_lod(self, layout: UILayout) -> None:
        """Draw the property `lod`; its value -1 means the level that the viewport shows."""
        words.prop_or(layout, self, "lod", -1, "-1: as in the viewport")

    def draw_range(self, layout: UILayout) -> None:
        """Draw the frame range in a dialog."""
        layout.prop(self, "range")
        if self.range == "CUSTOM":
            layout.prop(self, "start")
            layout.prop(self, "end")
        layout.prop(self, "step")
