# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that attach a face to a body's armature and detach it."""

from typing import TypeGuard

import bpy

from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import rig_placement
from ...scene.frame import evaluate
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_controls, face_rig
from ..words import say


def _is_body(item: bpy.types.Object) -> TypeGuard[ArmatureObject]:
    return item.type == "ARMATURE" and not (item.get(parts.CONTROLS) or item.get(parts.RIG))


class RISORIUS_OT_attach_body(FaceOperator, Operator):
    """Attach the face to the armature of a body: the face follows the neck and head of the body"""

    bl_idname = "risorius.attach_body"
    bl_label = "Attach to Body"

    body: bpy.props.StringProperty(name="Body", description="The body's armature")
    base: bpy.props.StringProperty(
        name="Base",
        description=(
            "Bone that moves the whole face; empty: the bone Neck, or else the bone "
            "Head. If all three bones are empty, they are found by name"
        ),
    )
    neck: bpy.props.StringProperty(
        name="Neck",
        description=(
            "Bone that turns the neck of the face; empty: none. If all three bones are "
            "empty, they are found by name"
        ),
    )
    head: bpy.props.StringProperty(
        name="Head",
        description=(
            "Bone that turns the head of the face; empty: none. If all three bones are "
            "empty, they are found by name"
        ),
    )
    fit: bpy.props.EnumProperty(
        name="Place",
        items=(
            (
                "MOVE",
                "On the Head",
                ("Move the face so that its head joint meets the head bone of the body"),
            ),
            (
                "SCALE",
                "On the Head, Scaled",
                (
                    "Move the face to the head bone of the body, and scale the face so that "
                    "its neck is as long as the neck of the body"
                ),
            ),
            ("NONE", "Where It Is", "Keep the place of the face"),
        ),
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        bodies = [o for o in context.scene.objects if _is_body(o)]
        if not self.body and bodies:
            chosen = next((o for o in bodies if o.select_get()), bodies[0])
            self.body = chosen.name
            self.base, self.neck, self.head = rig_placement.find_bones(chosen)
        return context.window_manager.invoke_props_dialog(self)

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop_search(self, "body", context.scene, "objects")
        body = bpy.data.objects.get(self.body)
        if body is not None and body.type == "ARMATURE":
            for name in ("base", "neck", "head"):
                layout.prop_search(self, name, body.data, "bones")
        layout.prop(self, "fit")

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        body = bpy.data.objects.get(self.body)
        if body is None or not _is_body(body):
            self.report({"ERROR"}, say("'{name}' is no armature of a body.", name=self.body))
            return {"CANCELLED"}
        found = rig_placement.find_bones(body)
        base, neck, head = (
            given or (auto if not (self.base or self.neck or self.head) else "")
            for given, auto in zip((self.base, self.neck, self.head), found, strict=True)
        )
        base = base or neck or head
        missing = [n for n in (base, neck, head) if n and n not in body.data.bones]
        if not base:
            text = "'{body}' has no bone named head or neck: choose the bones."
            self.report({"ERROR"}, say(text, body=body.name))
            return {"CANCELLED"}
        if missing:
            text = "'{body}' has no bone '{bone}': choose the bones."
            self.report({"ERROR"}, say(text, body=body.name, bone=missing[0]))
            return {"CANCELLED"}
        rig_placement.attach(face_controls(context), body, base, neck, head, self.fit)
        evaluate.bring_up(context, rig)
        self.report(
            {"INFO"},
            say(
                "The face follows {body}: {bones}",
                body=body.name,
                bones=", ".join((base, neck, head)),
            ),
        )
        return {"FINISHED"}


class RISORIUS_OT_detach_body(FaceOperator, Operator):
    """Detach the face from its body; the face keeps its place"""

    bl_idname = "risorius.detach_body"
    bl_label = "Detach from Body"

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if rig_placement.body_of(face_controls(context)) is None:
            cls.poll_message_set(say("This face is not attached to a body."))
            return False
        return True

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        rig_placement.detach(face_controls(context))
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


CLASSES = (RISORIUS_OT_attach_body, RISORIUS_OT_detach_body)
