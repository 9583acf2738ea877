# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that frame the face and hide or move the outlines of its control bones."""

import bpy

from ...scene.base import parts, session
from ...scene.base.blender_types import current_context
from ...scene.character import outlines
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_controls, face_rig
from ..words import say
from . import framing

_keys: list[tuple[bpy.types.KeyMap, bpy.types.KeyMapItem]] = session.keep(
    "framing_operators.keys", list, ("unregister",)
)


class RISORIUS_OT_frame_face(FaceOperator, Operator):
    """Fit the whole head into the view; outlines and face board may be outside the view"""

    bl_idname = "risorius.frame_face"
    bl_label = "Frame Face"
    bl_options = {"REGISTER"}
    whole_face = False
    baked_too = True

    instead: bpy.props.BoolProperty(
        name="Instead of Frame Selected",
        description="Frame the face only if nothing except outlines of the face is selected",
        options={"SKIP_SAVE"},
    )

    def execute(self, context: Context) -> Result:
        if self.instead and not _only_outlines(context):
            return {"PASS_THROUGH"}
        if not framing.show_whole(context, face_rig(context)):
            text = "No view can be moved: each one follows an object or the 3D cursor."
            self.report({"WARNING"}, say(text))
            return {"CANCELLED"}
        return {"FINISHED"}


def _only_outlines(context: Context) -> bool:
    """Whether only control bones or armatures of the active face are selected, and at least one."""
    rig = face_rig(context)
    controls = parts.controls_of(rig)
    if context.mode == "POSE":
        bones = context.selected_pose_bones or []
        return bool(bones) and all(b.id_data == controls and parts.PART in b.bone for b in bones)
    return bool(context.selected_objects) and set(context.selected_objects) <= {rig, controls}


class RISORIUS_OT_hide_outlines(FaceOperator, Operator):
    """Hide or show the outlines of head, neck and eyes; the editors still show their keys"""

    bl_idname = "risorius.hide_outlines"
    bl_label = "Hide Outlines"
    baked_too = True

    hide: bpy.props.BoolProperty(name="Hide", default=True, options={"SKIP_SAVE"})

    def execute(self, context: Context) -> Result:
        controls = face_controls(context)
        if self.hide:
            outlines.hide(controls)
        else:
            outlines.show(controls)
        return {"FINISHED"}


class RISORIUS_OT_move_outlines(FaceOperator, Operator):
    """Move outlines that an older Risorius placed on the eyes to the side of the face"""

    bl_idname = "risorius.move_outlines"
    bl_label = "Move Outlines Beside Face"
    baked_too = True

    def execute(self, context: Context) -> Result:
        count = outlines.stand_beside(face_rig(context))
        if not count:
            self.report({"INFO"}, say("The outlines are beside the face already."))
            return {"CANCELLED"}
        self.report({"INFO"}, say("{count} outlines moved", count=count))
        return {"FINISHED"}


def register() -> None:
    """Bind the numpad key "." of Blender's Frame Selected to the operator Frame Face.

    The operator frames the face if only outlines are selected; otherwise Blender's operator runs.
    """
    config = current_context().window_manager.keyconfigs.addon
    if config is None:
        return  # in background mode there is no key configuration
    keymap = config.keymaps.new("3D View", space_type="VIEW_3D")
    item = keymap.keymap_items.new(RISORIUS_OT_frame_face.bl_idname, "NUMPAD_PERIOD", "PRESS")
    item.properties.instead = True  # pyright: ignore  each operator has its own
    _keys.append((keymap, item))


def unregister() -> None:
    """Remove the shortcut."""
    while _keys:
        keymap, item = _keys.pop()
        keymap.keymap_items.remove(item)


CLASSES = (RISORIUS_OT_frame_face, RISORIUS_OT_hide_outlines, RISORIUS_OT_move_outlines)
