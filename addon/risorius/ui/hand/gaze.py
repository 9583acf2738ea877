# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""The panel Eyes and Head, and its operators: blinks, and the target that the eyes follow."""

import bpy

from ...scene.animation import keying, tweaks
from ...scene.base import parts
from ...scene.character import board, rig_placement, runtime
from ...scene.frame import evaluate, joint_turns
from ...scene.gaze import gaze_target
from ...scene.hand import blinks
from .. import words
from ..blender_types import Context, Operator, Panel, Result
from ..common import FaceOnlyPanel, FaceOperator, face_controls, face_rig
from ..words import say
from .base import MOMENTS

TARGETS = (
    ("HEAD", "Head", "The target turns with the head"),
    ("WORLD", "World", "The target stays where it is while the head turns"),
    ("OBJECT", "Object", "Let the eyes look at an object, such as the camera"),
)


def proposed(context: Context) -> str:
    """The name of the most likely target of the eyes; "" if there is none.

    The proposal is the active object or another selected object, unless it is a part of a face;
    empties come first. Without such an object, the proposal is the scene's camera.

    Args:
        context: context with the selection and the scene.
    """
    chosen = [context.object, *context.selected_objects]
    free = [item for item in chosen if item is not None and parts.rig_of(item) is None]
    free.sort(key=lambda item: item.type != "EMPTY")  # empties first; the sort is stable
    item = free[0] if free else context.scene.camera
    return item.name if item is not None else ""


class RISORIUS_OT_gaze_target(FaceOperator, Operator):
    """Choose what the target of the eyes follows: the head, the world or an object"""

    bl_idname = "risorius.gaze_target"
    bl_label = "Eyes Follow"

    mode: bpy.props.EnumProperty(name="Follow", items=TARGETS, options={"SKIP_SAVE"})
    target: bpy.props.StringProperty(
        name="Object",
        description="Object that the eyes look at; empty: the camera of the scene",
        options={"SKIP_SAVE"},
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if self.mode != "OBJECT":
            return self.execute(context)
        self.target = self.target or proposed(context)
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context: Context) -> None:
        self.layout.prop_search(self, "target", context.scene, "objects")

    def execute(self, context: Context) -> Result:
        rig, controls = face_rig(context), face_controls(context)
        if "eyes" not in controls.pose.bones:
            self.report(
                {"ERROR"}, say("The bone for the target of the eyes is missing from the controls.")
            )
            return {"CANCELLED"}
        if self.mode == "HEAD":
            gaze_target.follow_head(context, controls)
        elif self.mode == "WORLD":
            gaze_target.follow_world(context, controls)
        else:
            camera = context.scene.camera
            item = bpy.data.objects.get(self.target) if self.target else camera
            if item is None:
                text = "There is no object {name}." if self.target else "The scene has no camera."
                self.report({"ERROR"}, say(text, name=self.target))
                return {"CANCELLED"}
            if parts.rig_of(item) == rig:
                self.report({"ERROR"}, say("The eyes cannot follow a part of their own face."))
                return {"CANCELLED"}
            gaze_target.follow_object(context, controls, item)
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


class RISORIUS_OT_blink(FaceOperator, Operator):
    """Blink: the lids close quickly and open more slowly"""

    bl_idname = "risorius.blink"
    bl_label = "Blink"

    at: bpy.props.EnumProperty(
        name="At", description="First frame of the blink", items=MOMENTS, options={"SKIP_SAVE"}
    )
    kind: bpy.props.EnumProperty(
        name="As",
        items=(
            (
                "KEYS",
                "Keys",
                ("Insert keys on the sliders of the lids; keys within the blink are replaced"),
            ),
            ("LAYER", "Layer", "Put the blink into a layer above the sliders; no key changes"),
        ),
    )
    close: bpy.props.FloatProperty(name="Close", description="Frames", default=3.0, min=0.5)
    hold: bpy.props.FloatProperty(name="Hold Shut", description="Frames", default=1.0, min=0.0)
    open: bpy.props.FloatProperty(name="Open", description="Frames", default=5.0, min=0.5)
    strength: bpy.props.FloatProperty(
        name="Strength", default=1.0, min=0.0, max=1.0, subtype="FACTOR"
    )
    offset: bpy.props.FloatProperty(
        name="Right Eye Later",
        description=(
            "Delay of the character's right eye after the left eye in frames; "
            "negative: the right eye moves first"
        ),
    )
    sides: bpy.props.EnumProperty(
        name="Eyes",
        items=(
            ("LR", "Both", "Both eyes"),
            ("L", "The Character's Left", "Only this eye"),
            ("R", "The Character's Right", "Only this eye"),
        ),
    )

    def execute(self, context: Context) -> Result:
        rig, controls = face_rig(context), face_controls(context)
        if not blinks.sliders(runtime.there(rig), self.sides):
            self.report({"ERROR"}, say("This face has no control that closes an eye."))
            return {"CANCELLED"}
        if self.kind == "KEYS" and board.leads(controls, runtime.there(rig)):
            text = "The board leads this face: choose As Layer, or Sliders in the panel Controls."
            self.report({"ERROR"}, say(text))
            return {"CANCELLED"}
        frames = [float(context.scene.frame_current)]
        if self.at == "SELECTED":
            frames = keying.selected_frames(controls)
        if not frames:
            text = "Select keys of this face first: there is no selected key."
            self.report({"ERROR"}, say(text))
            return {"CANCELLED"}
        blink = blinks.Blink(
            self.close, self.hold, self.open, self.strength, self.offset, self.sides
        )
        above = self.kind == "LAYER" or tweaks.of(controls) is not None
        for frame in frames:
            if above:
                blinks.add_to_layer(rig, frame, blink, words.name_of_new("Blinks"))
            else:
                blinks.key(rig, frame, blink, keying.rules_of(context, auto=False, exact=True))
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


class RISORIUS_PT_gaze(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_gaze"
    bl_label = "Eyes and Head"
    bl_parent_id = "RISORIUS_PT_animation"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        layout, controls = self.layout, face_controls(context)
        holder = gaze_target.holder_of(controls)
        row = layout.row(align=True)
        row.operator("risorius.blink", icon="HIDE_ON").kind = "KEYS"
        row.operator("risorius.blink", text="As Layer").kind = "LAYER"
        layout.label(text="Eyes Follow", text_ctxt=words.CONTEXT)
        row = layout.row(align=True)
        now = "HEAD" if holder is None else "WORLD" if gaze_target.is_own(holder) else "OBJECT"
        for mode, text, _description in TARGETS:
            row.operator("risorius.gaze_target", text=text, depress=mode == now).mode = mode
        if holder is not None:
            words.show(layout, holder.name, "OBJECT_DATA")
        column = layout.column(align=True)
        column.prop(controls, "risorius_converge", slider=True)
        column.prop(controls, "risorius_lids", slider=True)
        if rig_placement.body_of(controls) is not None:
            layout.prop(controls, "risorius_body_turn", slider=True)
        if joint_turns.has_any(face_rig(context)):
            layout.prop(controls, "risorius_neck_poses")


CLASSES = (RISORIUS_OT_gaze_target, RISORIUS_OT_blink, RISORIUS_PT_gaze)
