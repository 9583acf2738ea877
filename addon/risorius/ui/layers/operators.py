# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators on the layers and the reactions of a face."""

import bpy

from ...scene.animation import layer_properties, layers, layers_nla
from ...scene.base.blender_types import ArmatureObject
from ...scene.expressions import assets
from ...scene.frame import evaluate
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_controls, face_rig
from ..words import name_of_new, say


class LayerOperator(FaceOperator):
    """Base of all operators on the active layer."""

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if not len(layers.of(face_controls(context))):
            cls.poll_message_set(say("This face has no layers."))
            return False
        return True

    @staticmethod
    def place(controls: ArmatureObject) -> int:
        """The index of the active layer, or of the highest layer if none is active."""
        place, count = controls.risorius_layers_index, len(layers.places(controls))
        if 0 <= place < count and not layers.places(controls)[place].removed:
            return place
        return layers.place_of(controls, layers.of(controls)[-1])


class RISORIUS_OT_layer_add(FaceOperator, Operator):
    """Add a layer on top: an action at its first frame, another source at the current frame"""

    bl_idname = "risorius.layer_add"
    bl_label = "Add Layer"

    kind: bpy.props.EnumProperty(
        name="Source", items=layer_properties.KINDS, options={"SKIP_SAVE"}, default="ACTION"
    )
    source: bpy.props.StringProperty(
        name="Name",
        description=(
            "Name of the action or expression; empty: the active action, "
            "which then plays only in the layer"
        ),
        options={"SKIP_SAVE"},
    )

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        controls, frame = face_controls(context), context.scene.frame_current
        if self.kind == "ACTION":
            return self._add_action(context, rig, controls)
        if self.kind == "EXPRESSION":
            known = assets.all_expressions()
            if self.source not in known:
                self.report({"ERROR"}, say("There is no expression {name}.", name=self.source))
                return {"CANCELLED"}
            label, when = (
                name_of_new(known[self.source].label),
                {"start": frame, "extend": "HOLD_FORWARD"},
            )
            layers.add(controls, "EXPRESSION", label, expression=self.source, **when)
        else:
            layers.add(controls, "IDLE", name_of_new("Idle Life"), start=frame, blend="MAXIMUM")
        evaluate.bring_up(context, rig)
        return {"FINISHED"}

    def _add_action(
        self, context: Context, rig: ArmatureObject, controls: ArmatureObject
    ) -> Result:
        action = bpy.data.actions.get(self.source) if self.source else None
        data = controls.animation_data
        if action is None and not self.source and data is not None:
            action, data.action = data.action, None
            layers.keep_weights(controls, action)
        if action is None:
            self.report(
                {"ERROR"},
                say("There is no action {name}.", name=self.source)
                if self.source
                else say("There is no active action to make a layer from."),
            )
            return {"CANCELLED"}
        layers.add_action(controls, action)
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


class RISORIUS_OT_layer_remove(LayerOperator, Operator):
    """Remove the active layer and the keys of its weight; its action stays"""

    bl_idname = "risorius.layer_remove"
    bl_label = "Remove Layer"

    def execute(self, context: Context) -> Result:
        controls = face_controls(context)
        layers.remove(controls, self.place(controls))
        evaluate.bring_up(context, face_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_layer_move(LayerOperator, Operator):
    """Move the active layer up or down; a higher layer is applied after the lower layers"""

    bl_idname = "risorius.layer_move"
    bl_label = "Move Layer"

    up: bpy.props.BoolProperty(name="Up", options={"SKIP_SAVE"})

    def execute(self, context: Context) -> Result:
        controls = face_controls(context)
        if not layers.move(controls, self.place(controls), self.up):
            return {"CANCELLED"}
        evaluate.bring_up(context, face_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_layer_duplicate(LayerOperator, Operator):
    """Add a copy of the active layer above it"""

    bl_idname = "risorius.layer_duplicate"
    bl_label = "Duplicate Layer"

    def execute(self, context: Context) -> Result:
        controls = face_controls(context)
        layers.duplicate(controls, self.place(controls))
        evaluate.bring_up(context, face_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_layer_warp(LayerOperator, Operator):
    """Pin the current time of the active layer to the current frame, or remove all pins"""

    bl_idname = "risorius.layer_warp"
    bl_label = "Warp Point"

    clear: bpy.props.BoolProperty(name="Clear", options={"SKIP_SAVE"})

    def execute(self, context: Context) -> Result:
        controls = face_controls(context)
        layer = layers.places(controls)[self.place(controls)]
        if self.clear:
            layer.warp.clear()
        elif layer.kind != "ACTION" or layer.action is None:
            self.report(
                {"ERROR"}, say("Only a layer with an action has a time that can be warped.")
            )
            return {"CANCELLED"}
        else:
            layers.add_warp_point(layer, context.scene.frame_current_final)
        controls.update_tag()
        evaluate.bring_up(context, face_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_fire(FaceOperator, Operator):
    """Fire a reaction at the current frame"""

    bl_idname = "risorius.fire"
    bl_label = "Fire"

    reaction: bpy.props.StringProperty(name="Reaction", default="flash", options={"SKIP_SAVE"})
    strength: bpy.props.FloatProperty(
        name="Strength", default=1.0, min=0.0, max=1.0, subtype="FACTOR"
    )

    def execute(self, context: Context) -> Result:
        if self.reaction not in layers.known_reactions():
            self.report({"ERROR"}, say("There is no reaction {name}.", name=self.reaction))
            return {"CANCELLED"}
        frame = context.scene.frame_current_final
        layers.fire(face_controls(context), self.reaction, frame, self.strength)
        evaluate.bring_up(context, face_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_unfire(FaceOperator, Operator):
    """Remove the active reaction"""

    bl_idname = "risorius.unfire"
    bl_label = "Remove Reaction"

    @classmethod
    def poll(cls, context: Context) -> bool:
        return super().poll(context) and bool(len(layers.reactions_of(face_controls(context))))

    def execute(self, context: Context) -> Result:
        controls = face_controls(context)
        count = len(layers.reactions_of(controls))
        layers.unfire(controls, min(max(controls.risorius_reactions_index, 0), count - 1))
        evaluate.bring_up(context, face_rig(context))
        return {"FINISHED"}


class RISORIUS_OT_layers_to_nla(LayerOperator, Operator):
    """Convert layers to NLA strips, up to the first layer that the NLA cannot represent"""

    bl_idname = "risorius.layers_to_nla"
    bl_label = "Push Layers to NLA"

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        count, notes = layers_nla.push(context.scene, rig)
        evaluate.bring_up(context, rig)
        for note in notes:
            self.report({"WARNING"}, note)
        self.report({"INFO"}, say("{count} layers are NLA strips now", count=count))
        return {"FINISHED"} if count else {"CANCELLED"}


CLASSES = (
    RISORIUS_OT_layer_add,
    RISORIUS_OT_layer_remove,
    RISORIUS_OT_layer_move,
    RISORIUS_OT_layer_duplicate,
    RISORIUS_OT_layer_warp,
    RISORIUS_OT_fire,
    RISORIUS_OT_unfire,
    RISORIUS_OT_layers_to_nla,
)
