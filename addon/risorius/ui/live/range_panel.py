# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Capture Range: the extreme values of each control that a person reaches in captures."""

from ...logic.base import names
from ...scene.animation import range_properties
from ...scene.base.blender_types import ArmatureObject
from ...scene.live import sessions
from .. import words
from ..blender_types import Context, Panel, UILayout, UIList
from ..common import FaceOnlyPanel, face_controls

_PREFIX = "CTRL_expressions."
# Reasons of risorius.ranges.learn for not stretching a control, marked for the translation.
_REASONS = (
    words.mark("gaze is an angle"),
    words.mark("hardly moves"),
    words.mark("moves no more than its noise"),
    words.mark("is never at rest"),
    words.mark("its peaks differ, so none is an extreme"),
    words.mark("does not come near its extreme"),
    words.mark("off"),
)


class RISORIUS_UL_ranges(UIList):
    """One line per control, with its neutral and its extreme value in the captures of a person."""

    def draw_item(
        self,
        context: Context,
        layout: UILayout,
        data: ArmatureObject,
        item: range_properties.RISORIUS_PG_range,
        icon: int,
        active_data: ArmatureObject,
        active_property: str,
    ) -> None:
        split = layout.split(factor=0.5, align=True)
        row = split.row(align=True)
        row.prop(item, "used", text="")
        words.show(row, item.name.removeprefix(_PREFIX))
        row = split.row(align=True)
        row.active = item.used
        row.prop(item, "neutral", text="", emboss=False)
        row.prop(item, "extreme", text="", emboss=False)


class RISORIUS_PT_ranges(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_ranges"
    bl_label = "Capture Range"
    bl_parent_id = "RISORIUS_PT_live"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        layout, controls = self.layout, face_controls(context)
        column = layout.column(align=True)
        column.operator_context = "INVOKE_DEFAULT"
        column.operator("risorius.learn_range", icon="IMPORT")
        if sessions.of(controls) is not None:
            column.operator("risorius.learn_range_live", icon="REC")
        row = column.row(align=True)
        row.operator("risorius.load_range", text="Load")
        rows = range_properties.rows_of(controls)
        if not rows:
            words.write(layout, "Captures of this face are not stretched: no range was learned.")
            return
        row.operator("risorius.save_range", text="Save")
        row.operator("risorius.forget_range", text="Forget")
        layout.prop(controls, range_properties.SWITCH)
        layout.template_list(
            "RISORIUS_UL_ranges",
            "",
            controls,
            range_properties.ROWS,
            controls,
            range_properties.INDEX,
            rows=6,
        )
        index = getattr(controls, range_properties.INDEX)
        if 0 <= index < len(rows):
            _draw_chosen(layout, rows[index])


def _draw_chosen(layout: UILayout, row: range_properties.RISORIUS_PG_range) -> None:
    """Draw the gain of the selected control, or the reason why the control is not stretched.

    The gain is the factor by which captured values are stretched.
    """
    if row.used:
        gain = f"{1.0 / max(row.extreme - row.neutral, 0.01):.2f}"
        words.show(layout, words.say("Gain {gain}", gain=gain))
    elif row.reason:
        reason = (
            words.say(row.reason) if row.reason in _REASONS else names.printable(row.reason, 80)
        )
        words.write(layout, words.say("As captured: {reason}.", reason=reason))


CLASSES = (RISORIUS_UL_ranges, RISORIUS_PT_ranges)
