# SPDX-License-Identifier: GPL-3.0-or-later
"""Words and buttons of the panel Face for what keeps a face from moving."""

import textwrap

from ...scene.base import parts
from ...scene.life import library_overrides, migrations, repair
from .operators import RISORIUS_OT_bring_back, RISORIUS_OT_make_override, broken_override


def draw_trouble(layout, context):
    """Words and buttons for what keeps the active face from moving.

    Returns:
        Whether the panel need not say anything more.
    """
    shown = library_overrides.linked_rig(context) or parts.active_rig(context)
    if shown is not None and migrations.newer(shown):
        _say(layout, migrations.newer(shown), "INFO")
    if library_overrides.linked_rig(context) is not None:
        _say(layout, "Linked: make an override to animate.", "LINKED")
        layout.operator_menu_enum(RISORIUS_OT_make_override.bl_idname, "shapes")
        return True
    rig = broken_override(context)
    if rig is not None:
        _say(layout, library_overrides.trouble(rig), "ERROR")
        layout.operator(RISORIUS_OT_make_override.bl_idname, text="Repair Override")
    lost = repair.missing(context.object or parts.active_rig(context))
    for sentence in lost:
        _say(layout, sentence, "ERROR")
    if any("still in the file" in sentence for sentence in lost):
        layout.operator(RISORIUS_OT_bring_back.bl_idname)
    return bool(lost) and parts.active_rig(context) is None


def _say(layout, text, icon):
    column = layout.column(align=True)
    column.scale_y = 0.8
    for number, line in enumerate(textwrap.wrap(text, 38)):
        column.label(text=line, icon=icon if number == 0 else "BLANK1")
