# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that pin points of the skin, and that select, hide and key handles on it."""

import bpy

from ...logic.base.errors import FaceError
from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import runtime
from ...scene.drag import handles, kept_points, picking
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_rig
from ..words import of_error, say
from . import pointing, view


class _PointOperator(FaceOperator):
    """Base of operators on one point of a face.

    A click uses the point under the cursor; scripts set the properties `mesh` and `vertex`.
    """

    mesh: bpy.props.IntProperty(
        name="Mesh",
        description="Number of the mesh in the DNA file, from 0",
        min=0,
        options={"SKIP_SAVE"},
    )
    vertex: bpy.props.IntProperty(
        name="Vertex",
        description="Number of the vertex in the mesh, from 0",
        min=-1,
        options={"SKIP_SAVE"},
    )

    def fits(self, hit: picking.Hit) -> bool:
        """Whether the operator accepts the point under the cursor."""
        raise NotImplementedError

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        where = view.under(context, event)
        try:
            hit = pointing.pick(context, where, event) if where else None
        except FaceError as error:
            self.report({"WARNING"}, of_error(error))
            return {"CANCELLED"}
        if hit is None or not self.fits(hit):
            return {"PASS_THROUGH"}
        pointing.activate(context, hit.rig)
        self.mesh, self.vertex = hit.point
        return self.execute(context)


class RISORIUS_OT_pin(_PointOperator, Operator):
    """Pin a point of the skin while you drag others, or remove its pin"""

    bl_idname = "risorius.pin"
    bl_label = "Pin"

    def fits(self, hit: picking.Hit) -> bool:
        # Shift-click on the skin pins a point, and Shift-click on a handle selects the handle. If
        # Blender tries this operator first, it refuses a handle, so that the operator that
        # selects handles gets the click.
        return not hit.is_handle

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        counts = pointing.counts_of(runtime.there(rig))
        if self.mesh >= len(counts) or not 0 <= self.vertex < counts[self.mesh]:
            self.report({"ERROR"}, say("This face has no vertex with this number."))
            return {"CANCELLED"}
        kept_points.toggle(rig, kept_points.PINS, (self.mesh, self.vertex), counts)
        return {"FINISHED"}


class RISORIUS_OT_clear_pins(FaceOperator, Operator):
    """Remove all pins of this face"""

    bl_idname = "risorius.clear_pins"
    bl_label = "Remove All Pins"

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        rig = face_rig(context)
        counts = pointing.counts_of(runtime.there(rig))
        if not kept_points.of(rig, kept_points.PINS, counts):
            cls.poll_message_set(say("This face has no pins."))
            return False
        return True

    def execute(self, context: Context) -> Result:
        kept_points.put(face_rig(context), kept_points.PINS, [])
        return {"FINISHED"}


class RISORIUS_OT_select_handle(_PointOperator, Operator):
    """Select this handle. Selected handles are dragged, keyed and hidden together"""

    bl_idname = "risorius.select_handle"
    bl_label = "Select Handle"

    extend: bpy.props.BoolProperty(
        name="Extend",
        description="Add to the selection; a selected handle is deselected",
        options={"SKIP_SAVE"},
    )

    def fits(self, hit: picking.Hit) -> bool:
        return hit.is_handle

    def execute(self, context: Context) -> Result:
        rig, point = face_rig(context), (self.mesh, self.vertex)
        surface = pointing.skin_of(context, rig).surface
        if self.vertex >= 0 and point not in handles.offered(rig, surface):
            self.report({"ERROR"}, say("This face has no such handle."))
            return {"CANCELLED"}
        if self.extend and self.vertex >= 0:
            kept_points.toggle(rig, kept_points.SELECTED, point, surface.vertex_counts)
        else:
            kept_points.put(rig, kept_points.SELECTED, [point] if self.vertex >= 0 else [])
        return {"FINISHED"}


class _SelectedOperator(FaceOperator):
    """Base of operators on the selected handles."""

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        rig = face_rig(context)
        if not handles.selected(rig, pointing.skin_of(context, rig).surface):
            cls.poll_message_set(say("Select a handle first."))  # type: ignore[attr-defined]
            return False
        return True


class RISORIUS_OT_hide_handles(_SelectedOperator, Operator):
    """Hide the selected handles; their points can be dragged like any other point"""

    bl_idname = "risorius.hide_handles"
    bl_label = "Hide Handles"

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        surface = pointing.skin_of(context, rig).surface
        hidden = kept_points.of(rig, kept_points.HIDDEN, surface.vertex_counts)
        gone = handles.selected(rig, surface)
        kept_points.put(rig, kept_points.HIDDEN, [*hidden, *gone])
        kept_points.put(rig, kept_points.SELECTED, [])
        return {"FINISHED"}


class RISORIUS_OT_show_handles(FaceOperator, Operator):
    """Show the hidden handles again, and select them"""

    bl_idname = "risorius.show_handles"
    bl_label = "Show Hidden Handles"

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        if not _hidden(face_rig(context)):
            cls.poll_message_set(say("No handle is hidden."))
            return False
        return True

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        kept_points.put(rig, kept_points.SELECTED, _hidden(rig))
        kept_points.put(rig, kept_points.HIDDEN, [])
        return {"FINISHED"}


class RISORIUS_OT_key_handles(_SelectedOperator, Operator):
    """Insert keyframes on the sliders that move the selected handles"""

    bl_idname = "risorius.key_handles"
    bl_label = "Key Handles"

    def execute(self, context: Context) -> Result:
        try:
            count = handles.key(context, face_rig(context))
        except FaceError as error:
            self.report({"ERROR"}, of_error(error))
            return {"CANCELLED"}
        frame = context.scene.frame_current
        self.report(
            {"INFO"}, say("{count} controls keyed at frame {frame}", count=count, frame=frame)
        )
        return {"FINISHED"}


def _hidden(rig: ArmatureObject) -> list[kept_points.Point]:
    live = runtime.of(rig)
    if live is None or parts.controls_of(rig) is None:
        return []
    return kept_points.of(rig, kept_points.HIDDEN, pointing.counts_of(live))


CLASSES = (
    RISORIUS_OT_pin,
    RISORIUS_OT_clear_pins,
    RISORIUS_OT_select_handle,
    RISORIUS_OT_hide_handles,
    RISORIUS_OT_show_handles,
    RISORIUS_OT_key_handles,
)
