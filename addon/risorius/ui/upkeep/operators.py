# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators and texts for faces that are linked from other files or have lost parts."""

import bpy

from ... import native
from ...logic.base.errors import FaceError
from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.frame import evaluate
from ...scene.upkeep import library_overrides, repair
from ..blender_types import Context, Operator, Result
from ..common import usable
from ..words import of_error, say

_NOT_LINKED = "Select a linked face first."
SHAPES = (
    (
        "DRIVEN",
        "Driven Keys",
        (
            "Use the shape keys of the library file, moved by drivers; later edits "
            "of that file are shown"
        ),
    ),
    ("LOCAL", "Local Meshes", "Copy the meshes into this file: Live mode and edits are possible"),
)


def override_trouble(rig: ArmatureObject | None) -> str:
    """The reason why a face with a library override does not move.

    The result is "" if the face moves or has no library override, or if `rig` is None.
    """
    if rig is None or not rig.override_library:
        return ""
    return library_overrides.trouble(rig)


class RISORIUS_OT_make_override(Operator):
    """Make a linked face or its override ready to animate"""

    bl_idname = "risorius.make_override"
    bl_label = "Make Override"
    bl_options = {"REGISTER", "UNDO"}

    shapes: bpy.props.EnumProperty(
        name="Shapes",
        description=(
            "Source of the face's shapes: the library file, or copies of the meshes in this file"
        ),
        items=SHAPES,
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not usable(cls):
            return False
        broken = override_trouble(parts.active_rig(context))
        if library_overrides.linked_rig(context) is None and not broken:
            cls.poll_message_set(say(_NOT_LINKED))
            return False
        return True

    def execute(self, context: Context) -> Result:
        local = self.shapes == "LOCAL"
        rig, linked = parts.active_rig(context), library_overrides.linked_rig(context)
        try:
            if rig is not None and override_trouble(rig):
                done = library_overrides.repair(context, rig, local)
            elif linked is not None:
                rig, done = library_overrides.make_override(context, linked, local)
            else:
                raise FaceError(_NOT_LINKED)
        except native.user_errors() as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        rig.update_tag()
        evaluate.bring_up(context, rig)
        for sentence in done:
            self.report({"INFO"}, sentence)
        left = library_overrides.trouble(rig)
        if left:
            self.report({"WARNING"}, left)
        return {"FINISHED"}


class RISORIUS_OT_bring_back(Operator):
    """Restore deleted parts of the active face that are still in this .blend file"""

    bl_idname = "risorius.bring_back"
    bl_label = "Bring Back Deleted Parts"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: Context) -> bool:
        return usable(cls) and context.object is not None

    def execute(self, context: Context) -> Result:
        item = context.object
        back = repair.bring_back(item, context.scene) if item is not None else []
        if not back:
            self.report({"ERROR"}, say("No deleted part of this face was found in this file."))
            return {"CANCELLED"}
        context.view_layer.update()
        self.report({"INFO"}, say("Brought back: {names}", names=", ".join(o.name for o in back)))
        return {"FINISHED"}


CLASSES = (RISORIUS_OT_make_override, RISORIUS_OT_bring_back)
