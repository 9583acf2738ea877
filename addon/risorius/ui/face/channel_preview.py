# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Tests one blend shape by hand: a search, a weight and a button that ends the test."""

from typing import cast

import bpy

from ...scene.base import parts, session
from ...scene.base.blender_types import ArmatureObject, current_context
from ...scene.character import build, runtime
from ...scene.frame import channel_preview, evaluate
from ..blender_types import Context, Item, Operator, Panel, Result
from ..common import FaceOnlyPanel, FaceOperator, face_rig
from ..words import CONTEXT, NAMES, say

# Items of the enum `channel`. Blender reads their strings after `_channels` has returned, so the
# items are kept here.
_items: list[Item] = session.keep("channel_preview.items", list, ("unregister",))


def _test(context: Context, rig: ArmatureObject, channel: int, value: float | None) -> None:
    """Show a blend shape channel of a face with a test weight, or end the test.

    Args:
        context: context of Blender.
        rig: deforming armature of the face.
        channel: index of the channel in the DNA file.
        value: weight of the channel; None: end the test.
    """
    if value is None:
        channel_preview.clear(rig)
    else:
        channel_preview.set_override(rig, channel, value)
    evaluate.bring_up(context, rig)


def _channels(_operator: object, context: bpy.types.Context | None) -> list[Item]:
    """Enum items for the blend shape channels that move at least one mesh of the active face."""
    rig = parts.active_rig(cast(Context, context)) if context is not None else None
    live = runtime.of(rig) if rig is not None else None
    _items.clear()
    if rig is None or live is None:
        return _items
    moved = set()
    for item in parts.meshes_of(rig):
        dna_mesh = runtime.dna_mesh(live, item)
        targets = dna_mesh.blend_shape_targets if dna_mesh is not None else ()
        moved.update(int(t.blend_shape_channel_index) for t in targets)
    labels = build.channel_labels(live.dna)
    _items.extend((str(c), labels[c], live.dna.blend_shape_channel_names[c]) for c in sorted(moved))
    return _items


class RISORIUS_OT_test_channel(FaceOperator, Operator):
    """Show one blend shape with a weight of your choice until the next frame, edit or save"""

    bl_idname = "risorius.test_channel"
    bl_label = "Test a Shape"
    bl_property = "channel"
    baked_too = True

    channel: bpy.props.EnumProperty(
        name="Shape",
        description="Blend shape to test",
        items=_channels,
        translation_context=NAMES,
    )
    value: bpy.props.FloatProperty(
        name="Weight",
        description="Weight of the tested shape",
        default=1.0,
        min=-10.0,
        max=10.0,
        soft_min=0.0,
        soft_max=1.0,
    )
    end: bpy.props.BoolProperty(
        name="End",
        description="End the running test instead of beginning a test",
        options={"SKIP_SAVE", "HIDDEN"},
    )

    def execute(self, context: Context) -> Result:
        rig = face_rig(context)
        if self.end:
            _test(context, rig, 0, None)
            return {"FINISHED"}
        if not self.channel:
            self.report({"ERROR"}, say("{name} has no blend shapes.", name=rig.name))
            return {"CANCELLED"}
        _test(context, rig, int(self.channel), self.value)
        return {"FINISHED"}

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if self.end:
            return self.execute(context)
        context.window_manager.invoke_search_popup(self)
        return {"RUNNING_MODAL"}


def _get_weight(_manager: bpy.types.WindowManager) -> float:
    rig = parts.active_rig(current_context())
    now = channel_preview.current(rig) if rig is not None else None
    return now[1] if now else 0.0


def _set_weight(_manager: bpy.types.WindowManager, value: float) -> None:
    rig = parts.active_rig(current_context())
    now = channel_preview.current(rig) if rig is not None else None
    if rig is not None and now is not None:
        _test(current_context(), rig, now[0], value)


def weight_property() -> object:
    """Define the slider that shows and sets the test weight of the active face.

    The property itself stores no value.
    """
    return bpy.props.FloatProperty(
        name="Weight",
        translation_context=CONTEXT,
        description="Weight of the tested shape",
        soft_min=0.0,
        soft_max=1.0,
        get=_get_weight,
        set=_set_weight,
        options={"SKIP_SAVE"},
    )


class RISORIUS_PT_shape_test(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_shape_test"
    bl_label = "Test a Shape"
    bl_parent_id = "RISORIUS_PT_options"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        layout = self.layout
        rig = face_rig(context)
        live, now = runtime.of(rig), channel_preview.current(rig)
        if live is None:
            return
        name = build.channel_labels(live.dna)[now[0]] if now else say("Choose a Shape")
        layout.operator("risorius.test_channel", text=name, icon="VIEWZOOM", translate=False)
        if now:
            row = layout.row(align=True)
            row.prop(context.window_manager, "risorius_test", slider=True)
            row.operator("risorius.test_channel", text="", icon="X").end = True


CLASSES = (RISORIUS_OT_test_channel, RISORIUS_PT_shape_test)
