# SPDX-License-Identifier: GPL-3.0-or-later
"""The button that activates the drag tool, and its options."""

from ...scene.base import parts
from ...scene.character import runtime
from ...scene.drag import kept_points
from .. import words
from ..blender_types import Context, Panel, UILayout
from ..common import FaceOnlyPanel, face_rig
from . import pointing, properties, tool


def draw_button(layout: UILayout, context: Context) -> None:
    """Draw the button of the drag tool, and a button that opens its options.

    Args:
        layout: layout of the panel.
        context: context of the panel.
    """
    row = layout.row(align=True)
    row.operator("risorius.drag_tool", icon="VIEW_PAN", depress=tool.is_active(context))
    row.popover(panel="RISORIUS_PT_drag", text="", icon="DOWNARROW_HLT")


class RISORIUS_PT_drag(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_drag"
    bl_label = "Drag the Face"
    bl_options = {"INSTANCED"}

    def draw(self, context: Context) -> None:
        layout, choices = self.layout, properties.choices_of(context)
        layout.prop(choices, "symmetric")
        layout.prop(choices, "region")
        layout.prop(choices, "handles")
        layout.prop(choices, "heat")
        layout.row().prop(choices, "method", expand=True)
        rig = face_rig(context)
        live = runtime.of(rig)
        if live is None or parts.controls_of(rig) is None:
            return
        count = len(kept_points.of(rig, kept_points.PINS, pointing.counts_of(live)))
        row = layout.row()
        words.show(row, words.say("{count} pins", count=count), "PINNED")
        row.operator("risorius.clear_pins", text="Remove All", icon="X")
        column = layout.column(align=True)
        column.operator("risorius.key_handles", icon="KEYFRAME_HLT")
        column.operator("risorius.hide_handles", icon="HIDE_ON")
        column.operator("risorius.show_handles", icon="HIDE_OFF")


CLASSES = (RISORIUS_PT_drag,)
