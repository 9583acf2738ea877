# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that apply an expression to the sliders, by a click or by dragging."""

from collections.abc import Collection
from typing import Any, cast

import bpy

from ... import native
from ...logic.animation import expression_mix
from ...scene.animation import keying
from ...scene.character import sides
from ...scene.expressions import assets, library, poses
from ...scene.frame import evaluate
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_rig
from ..hand.base import HandOperator
from ..words import of_error, say
from .properties import choices, region_items

_REACH = 300.0  # length of a drag in pixels for a strength of 1
_MOST = 1.0


class Mixes(HandOperator):
    """Properties of operators that blend an expression."""

    expression: bpy.props.StringProperty(name="Expression")
    strength: bpy.props.FloatProperty(
        name="Strength", default=1.0, min=0.0, max=_MOST, subtype="FACTOR"
    )
    only: bpy.props.BoolProperty(name="Rest of the Face at Rest", default=True)
    flip: bpy.props.BoolProperty(name="Flip", description="Swap left and right")
    additive: bpy.props.BoolProperty(
        name="Additive", description="Add the expression to the current pose"
    )
    regions: bpy.props.EnumProperty(
        name="Regions",
        description="Move only these regions; no region: all regions",
        items=region_items,
        options={"ENUM_FLAG"},
    )
    key: bpy.props.BoolProperty(name="Key", description="Insert keys at the current frame")

    def way(self) -> expression_mix.Way:
        return expression_mix.Way(
            self.strength, self.only, self.flip, self.additive, frozenset(self.regions)
        )

    def item(self, context: Context) -> library.Item:
        """The expression. Raises: LibraryError: no expression has this name."""
        items, _ = library.all_items(library.folder(context))
        return library.find(items, self.expression)

    def move(self, context: Context) -> Collection[str] | None:
        rig = face_rig(context)
        try:
            item = self.item(context)
            names = poses.apply(rig, item, self.way())
        except native.user_errors() as error:
            self.report({"ERROR"}, of_error(error))
            return None
        choices(context).active = item.expression.name
        if self.key and self.at == "NOW":
            keying.key(context, rig, names)
        return names

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "strength")
        column = layout.column()
        column.active = not self.additive
        column.prop(self, "only")
        layout.prop(self, "flip")
        layout.prop(self, "additive")
        layout.prop(self, "key")
        layout.use_property_split = False
        layout.column_flow(columns=3, align=True).prop(self, "regions")


class Applies(Mixes):
    """Base of operators that set an expression by a click, without dragging."""

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        """Set the expression at a click.

        With Ctrl, left and right of the expression are swapped. With Shift, the expression is
        added to the current pose.

        Args:
            context: context of the operator.
            event: event with the held modifier keys.
        """
        # Ctrl flips a pose in Blender's pose library, so it flips an expression here.
        self.flip, self.additive = self.flip != event.ctrl, self.additive != event.shift
        return self.execute(context)


class Blends(Mixes):
    """Base of operators that blend an expression by moving the mouse; Esc restores the pose."""

    bl_options = {"REGISTER", "UNDO", "GRAB_CURSOR", "BLOCKING"}

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        """Begin the blend.

        Args:
            context: context of the operator.
            event: event with the place of the mouse.
        """
        rig = face_rig(context)
        try:
            self._item = self.item(context)
            poses.goals(rig, self._item, self.way())
        except native.user_errors() as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        self._before, self._held, self._shown = sides.values_of(rig), sides.hold(rig), True
        self._flip, self.strength, self._x = self.flip, 0.0, event.mouse_x
        context.window_manager.modal_handler_add(self)
        self._follow(context)
        return {"RUNNING_MODAL"}

    def modal(self, context: Context, event: bpy.types.Event) -> Result:
        """Change strength and options by mouse and keys until the user accepts or cancels.

        Args:
            context: context of the operator.
            event: the current event.
        """
        if event.type in {"ESC", "RIGHTMOUSE"}:
            self.cancel(context)
            return {"CANCELLED"}
        if event.type in {"LEFTMOUSE", "RET", "NUMPAD_ENTER"}:
            # This event accepts the blend. If the blend began with a click, the event is the next
            # press of the mouse button; if it began with a drag, the release of the button.
            context.workspace.status_text_set(None)
            return self.execute(context)
        if event.type == "MOUSEMOVE":
            step = expression_mix.dragged(event.mouse_x - self._x, _REACH, event.shift)
            self.strength, self._x = self.strength + step, event.mouse_x
        elif event.type == "A" and event.value == "PRESS":
            self.additive = not self.additive
        elif event.type == "TAB" and event.value == "PRESS":
            self._shown = not self._shown
        elif event.type not in {"LEFT_CTRL", "RIGHT_CTRL"}:
            return {"RUNNING_MODAL"}
        self.flip = self._flip != event.ctrl
        self._follow(context)
        return {"RUNNING_MODAL"}

    def _follow(self, context: Context) -> None:
        """Show the blended pose, or the pose before the blend if Tab has switched the blend off."""
        rig = face_rig(context)
        sides.restore(rig, self._held)
        if self._shown:
            poses.apply(rig, self._item, self.way(), self._before)
        evaluate.bring_up(context, rig)
        context.workspace.status_text_set(
            say(
                "{label} {share} %    Ctrl: flip, A: additive, Tab: compare with the "
                "face before, Shift: fine steps, click: keep, Esc: cancel",
                label=self._item.expression.label,
                share=round(self.strength * 100),
            )
        )

    def cancel(self, context: Context) -> None:
        rig = face_rig(context)
        sides.restore(rig, self._held)
        evaluate.bring_up(context, rig)
        context.workspace.status_text_set(None)

    def execute(self, context: Context) -> Result:
        if hasattr(self, "_before"):  # execute blends from the pose before the drag
            sides.restore(face_rig(context), self._held)
            del self._before
        return super().execute(context)


# Blender loses a registered class if another registered class derives from it. So the shared code
# of these operators is in the classes Applies and Blends, which are not registered.
class RISORIUS_OT_expression(Applies, Operator):
    """Move the sliders to an expression. Ctrl: swap left and right, Shift: add to the pose"""

    bl_idname = "risorius.expression"
    bl_label = "Expression"


class RISORIUS_OT_blend_expression(Blends, Operator):
    """Blend an expression in by moving the mouse: to the right more, to the left less"""

    bl_idname = "risorius.blend_expression"
    bl_label = "Blend Expression"


class RISORIUS_OT_make_pose_assets(FaceOperator, Operator):
    """Make a pose asset of every expression, for Blender's pose library"""

    bl_idname = "risorius.make_pose_assets"
    bl_label = "Expressions as Pose Assets"

    def execute(self, context: Context) -> Result:
        made, notes = assets.make_assets(face_rig(context))
        for note in notes:
            self.report({"WARNING"}, note)
        self.report({"INFO"}, say("{count} pose assets", count=len(made)))
        if not bpy.app.background:
            cast(Any, bpy.ops).risorius.render_thumbnails("INVOKE_DEFAULT")  # draws their pictures
        return {"FINISHED"}


CLASSES = (RISORIUS_OT_expression, RISORIUS_OT_blend_expression, RISORIUS_OT_make_pose_assets)
