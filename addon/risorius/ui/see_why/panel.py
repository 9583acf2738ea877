# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel See Why: solo and mute, causes of a vertex's motion, heat maps, correctives."""

import bpy

from ...scene.animation import layers
from ...scene.base import parts, session
from ...scene.base.blender_types import ArmatureObject, current_context
from ...scene.frame import joint_readings, look_masks
from ...scene.see_why import causes, heat, present
from .. import words
from ..blender_types import Context, Panel, UILayout
from ..common import FaceOnlyPanel, face_controls, face_rig
from .properties import choices
from .spoken import spoken, title

_ROWS = 10  # most rows of a list
# True: a timer is registered that will compute the strongest correctives of all faces.
_soon = session.value("see_why.panel.soon", False, ("load",))


class RISORIUS_PT_why(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_why"
    bl_label = "See Why"
    bl_order = 1
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        layout, rig = self.layout, face_rig(context)
        if present.of(rig) is None:
            words.write(layout, "This face shows no controls now.", "INFO")
            return
        look = look_masks.of(rig)
        _draw_mutes(layout, look)
        _draw_heat(layout, rig, context)
        _draw_vertex(layout, context, rig)
        header, body = layout.panel("RISORIUS_PT_why_control", default_closed=True)
        header.label(text="A Control and Its Correctives", text_ctxt=words.CONTEXT)
        if body is not None:
            _draw_control(body, rig, context, look)
        header, body = layout.panel("RISORIUS_PT_why_strongest", default_closed=True)
        header.label(text="Strongest Correctives", text_ctxt=words.CONTEXT)
        if body is not None:
            _draw_strongest(body, context, rig)


def _draw_mutes(layout: UILayout, look: look_masks.Look) -> None:
    row = layout.row(align=True)
    row.label(text="Mute", text_ctxt=words.CONTEXT)
    for kind, text in (("JOINTS", "Joints"), ("SHAPES", "Shapes"), ("MAPS", "Maps")):
        button = row.operator("risorius.mute", text=text, depress=kind in look.muted)
        button.kind, button.enable = kind, kind not in look.muted
    row = layout.row()
    row.enabled = not look.is_whole  # always drawn, so that buttons do not move when solo starts
    row.operator("risorius.mask_renders", depress=look.in_renders).enable = not look.in_renders


def _draw_heat(layout: UILayout, rig: ArmatureObject, context: Context) -> None:
    shown = heat.of(rig)
    column = layout.column(align=True)
    row = column.row(align=True)
    on = shown is not None and shown.kind == "POSE"
    row.operator(
        "risorius.heat", text="Heat Map from Neutral", icon="SHADING_RENDERED", depress=on
    ).kind = "POSE"
    if shown is not None:
        row.operator("risorius.heat", text="", icon="X").kind = "OFF"
    scale = "0 (violet) to {most:.2f} mm (yellow)"
    words.show(column, words.say(title(context, rig, shown)) if shown is not None else "")
    words.show(column, words.say(scale, most=shown.most) if shown is not None else "")
    controls = face_controls(context)
    for place, layer in layers.ordered(controls):
        depress = shown is not None and (shown.kind, shown.what) == ("LAYER", str(place))
        text = words.say("Heat Map of {name}", name=layer.name)
        button = column.operator("risorius.heat", text=text, depress=depress, translate=False)
        button.kind, button.what = "LAYER", str(place)


def _draw_vertex(layout: UILayout, context: Context, rig: ArmatureObject) -> None:
    layout.operator("risorius.why_vertex", icon="EYEDROPPER")
    found = causes.last(rig)
    if found is None:
        return
    column = layout.column(align=True)
    head = words.say(
        "Vertex {vertex}: {moved:.2f} mm from neutral", vertex=found.vertex, moved=found.moved
    )
    words.show(column, head)
    for cause in found.causes[:_ROWS]:
        _draw_cause(column, context, cause, max(found.moved, found.causes[0].now))
    _draw_more(column, len(found.causes) - _ROWS)


def _draw_more(layout: UILayout, count: int) -> None:
    if count > 0:
        words.show(layout, words.say("and {count} more", count=count))


def _draw_cause(layout: UILayout, context: Context, cause: causes.Cause, most: float) -> None:
    """Draw a control or corrective that moves a vertex: name, motion in mm, heat map and solo.

    Args:
        layout: layout of the panel.
        context: context of the panel.
        cause: the control or corrective.
        most: motion in mm at which the bar is full.
    """
    row, name = layout.row(align=True), spoken(context, cause.name)
    if cause.now:
        text = words.say("{name}  {now:.2f} mm", name=name, now=cause.now)
    else:
        text = words.say("{name}  max. {full:.2f} mm", name=name, full=cause.full)
    row.progress(text=text, factor=min(cause.now / most, 1.0) if most else 0.0, translate=False)
    button = row.operator("risorius.heat", text="", icon="SHADING_RENDERED")
    solo = row.operator("risorius.solo", text="", icon="RADIOBUT_ON")
    if cause.is_raw:
        button.kind, button.what = "CONTROL", cause.label
        solo.control = cause.label
    else:
        button.kind, button.what = "CORRECTIVE", str(cause.control)
        solo.corrective = cause.control


def _draw_control(
    layout: UILayout, rig: ArmatureObject, context: Context, look: look_masks.Look
) -> None:
    chosen = choices(context)
    layout.prop(chosen, "control", text="", icon="VIEWZOOM")
    control = causes.control_of(rig, chosen.control)
    if control < 0:
        return
    row = layout.row(align=True)
    alone = look.solo == {chosen.control}
    row.operator("risorius.solo", icon="RADIOBUT_ON", depress=alone).control = chosen.control
    button = row.operator("risorius.heat", text="Reach", icon="SHADING_RENDERED")
    button.kind, button.what = "CONTROL", chosen.control
    layout.prop(chosen, "show_graph")
    column = layout.column(align=True)
    found = causes.parts_of(rig, control)
    if not found:
        words.show(column, words.say("No correctives."))
    for part in found[:_ROWS]:
        others = ", ".join(f"{spoken(context, name)} {value:.2f}" for name, value in part.others)
        row = column.row(align=True)
        text = f"{spoken(context, part.name)}  {part.value:.2f}"
        row.progress(text=text, factor=min(max(part.value, 0.0), 1.0), translate=False)
        words.show(column, f"   x {others}")
    _draw_more(column, len(found) - _ROWS)


def _draw_strongest(layout: UILayout, context: Context, rig: ArmatureObject) -> None:
    if not causes.is_known(rig):
        _ask_soon()
    fired = causes.known(rig)
    column = layout.column(align=True)
    circle = joint_readings.words(rig)
    if circle:
        words.write(column, circle, "ERROR")
    if not fired:
        words.show(column, words.say("No corrective is active."))
    for cause in fired[:_ROWS]:
        _draw_cause(column, context, cause, fired[0].now)


def _ask_soon() -> None:
    """Let a timer compute the strongest correctives of all faces in 0.2 s.

    Without the delay, each drawing of the panel while a slider is dragged would wait for them.
    """
    if not _soon.now:
        _soon.now = True
        bpy.app.timers.register(_ask, first_interval=0.2)


def _ask() -> None:
    _soon.now = False
    for rig in parts.rigs():
        causes.strongest(rig)
    for window in current_context().window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def stop() -> None:
    """Stop the timer."""
    if bpy.app.timers.is_registered(_ask):
        bpy.app.timers.unregister(_ask)
    _soon.now = False


CLASSES = (RISORIUS_PT_why,)
