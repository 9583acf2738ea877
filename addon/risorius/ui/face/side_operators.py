# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that mirror, copy and link the sides of a face, and copy and paste poses."""

from collections.abc import Collection

import bpy

from ... import native
from ...logic.character import slider_rows
from ...scene.base import session
from ...scene.character import sides
from ...scene.frame import evaluate, inputs
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_controls, face_rig
from ..hand.base import HandOperator
from ..words import say

# Slider -> value of the pose that was copied last, from any face.
_copied: dict[str, float] = session.table("side_operators.copied", ("unregister",))


def _only_region() -> object:
    return bpy.props.StringProperty(
        name="Region",
        description="Region to change; empty: all regions",
        options={"SKIP_SAVE"},
    )


def _from_left() -> object:
    return bpy.props.BoolProperty(
        name="From the Character's Left",
        description="Copy the left side of the character; off: its right side",
        default=True,
        options={"SKIP_SAVE"},
    )


class RISORIUS_OT_mirror(HandOperator, Operator):
    """Swap left and right of the face, as in a mirror"""

    bl_idname = "risorius.mirror"
    bl_label = "Mirror Face"

    region: _only_region()

    def move(self, context: Context) -> Collection[str]:
        rig = face_rig(context)
        sides.mirror(rig, self.region)
        return sides.values_of(rig, self.region)


class RISORIUS_OT_copy_side(HandOperator, Operator):
    """Make one side of the face like the other; the direction of the gaze does not change"""

    bl_idname = "risorius.copy_side"
    bl_label = "Copy to Other Side"

    region: _only_region()
    from_left: _from_left()

    def move(self, context: Context) -> Collection[str]:
        rig = face_rig(context)
        count = sides.copy_across(rig, self.from_left, self.region)
        if not count:
            self.report(
                {"WARNING"},
                say(
                    "No control here has two sides that are free. A left and a right "
                    "slider that are not linked were expected."
                ),
            )
        return sides.values_of(rig, self.region) if count else ()


class RISORIUS_OT_link_sides(FaceOperator, Operator):
    """Let one slider move both sides of the face with drivers; press again to unlink the sides"""

    bl_idname = "risorius.link_sides"
    bl_label = "Link Left and Right"
    by_sliders = True

    enable: bpy.props.BoolProperty(name="Link", default=True, options={"SKIP_SAVE"})
    from_left: _from_left()

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if face_controls(context).override_library:
            cls.poll_message_set(
                say(
                    "The controls are a library override: Blender saves no drivers "
                    "in library overrides."
                )
            )
            return False
        return True

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        if self.enable:
            count = sides.link(rig, self.from_left)
            self.report({"INFO"}, say("{count} controls follow the other side", count=count))
        else:
            sides.unlink(rig)
        evaluate.bring_up(context, rig)
        return {"FINISHED"}


class RISORIUS_OT_copy_pose(FaceOperator, Operator):
    """Copy the visible pose, including layers, to paste it onto this or another face"""

    bl_idname = "risorius.copy_pose"
    bl_label = "Copy Face"
    bl_options = {"REGISTER"}
    baked_too = True

    region: _only_region()

    def execute(self, context: Context) -> Result:
        _copied.clear()
        values = inputs.seen_sliders(context, face_rig(context))
        of_slider = native.regions().of_slider
        _copied.update(
            (n, v) for n, v in values.items() if not self.region or of_slider(n) == self.region
        )
        self.report({"INFO"}, say("{count} controls copied", count=len(_copied)))
        return {"FINISHED"}


class RISORIUS_OT_paste_pose(HandOperator, Operator):
    """Paste the copied sliders"""

    bl_idname = "risorius.paste_pose"
    bl_label = "Paste Face"

    flipped: bpy.props.BoolProperty(
        name="Flipped", description="Swap left and right", options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if not _copied:
            cls.poll_message_set(say("No controls were copied yet."))
            return False
        return True

    @classmethod
    def description(
        cls, context: bpy.types.Context, properties: bpy.types.OperatorProperties
    ) -> str:
        """The tooltip. Args: context  context of the button; properties  the button's settings."""
        text = "Paste the copied sliders"
        if getattr(properties, "flipped", False):
            text = "Paste the copied sliders, swapped left for right"
        return bpy.app.translations.pgettext_tip(text) or text

    def move(self, context: Context) -> Collection[str]:
        rig, values = face_rig(context), dict(_copied)
        if self.flipped:
            values = slider_rows.flipped(values, native.regions())
        count = sides.put(rig, values)
        if not count:
            self.report({"WARNING"}, say("This face has none of the copied controls."))
        return values


CLASSES = (
    RISORIUS_OT_mirror,
    RISORIUS_OT_copy_side,
    RISORIUS_OT_link_sides,
    RISORIUS_OT_copy_pose,
    RISORIUS_OT_paste_pose,
)
