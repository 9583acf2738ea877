# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""A pie menu of frequent tools. It has no key until the user assigns one."""

import bpy

from ...scene.animation import tweaks
from ..blender_types import Context, Menu, Operator, Result, UILayout
from ..common import active_controls

_PIE = "RISORIUS_MT_pie"
_KEYMAP = ("3D View", "VIEW_3D")


class RISORIUS_MT_pie(Menu):
    bl_idname = _PIE
    bl_label = "Face"

    def draw(self, context: Context) -> None:
        pie = self.layout.menu_pie()
        controls = active_controls(context)
        if controls is None:
            pie.operator("risorius.add_character", icon="USER")
            return
        pie.menu("RISORIUS_MT_expressions", icon="MONKEY")  # left
        pie.operator("risorius.key", icon="KEYFRAME_HLT").region = ""  # right
        pie.operator("risorius.breakdown", icon="ARROW_LEFTRIGHT").kind = "BREAKDOWN"  # below
        pie.operator("risorius.drag_tool", icon="VIEW_PAN")  # above
        pie.operator("risorius.mirror", icon="MOD_MIRROR").region = ""
        pie.operator("risorius.reset", icon="LOOP_BACK").region = ""
        pie.operator("risorius.tweak", icon="MOD_TIME").enable = not tweaks.of(controls)
        pie.operator(
            "wm.call_panel", text="Favourites", icon="SOLO_ON"
        ).name = "RISORIUS_PT_favourites"


def shortcut(context: Context) -> bpy.types.KeyMapItem | None:
    """The key map item that opens the pie menu, or None."""
    config = context.window_manager.keyconfigs.user
    keymap = config.keymaps.get(_KEYMAP[0]) if config is not None else None
    items = keymap.keymap_items if keymap is not None else ()
    return next((i for i in items if i.idname == "wm.call_menu_pie" and _is_ours(i)), None)


def _is_ours(item: bpy.types.KeyMapItem) -> bool:
    return getattr(item.properties, "name", "") == _PIE


class RISORIUS_OT_shortcut(Operator):
    """Add a keyboard shortcut for the pie menu of the face, or remove the shortcut"""

    bl_idname = "risorius.shortcut"
    bl_label = "Key for the Pie Menu"

    def execute(self, context: Context) -> Result:
        config = context.window_manager.keyconfigs.user
        if config is None:
            return {"CANCELLED"}  # there is no key configuration without a window
        keymap = config.keymaps.get(_KEYMAP[0])
        if keymap is None:
            keymap = config.keymaps.new(_KEYMAP[0], space_type=_KEYMAP[1])
        there = shortcut(context)
        if there is not None:
            keymap.keymap_items.remove(there)
        else:
            item = keymap.keymap_items.new("wm.call_menu_pie", "F", "PRESS", shift=True, alt=True)
            item.properties.name = _PIE  # pyright: ignore  each operator has its own
        context.preferences.is_dirty = True
        return {"FINISHED"}


def draw_preferences(layout: UILayout, context: Context) -> None:
    """Draw the button that adds or removes the shortcut of the pie menu, and the shortcut.

    Args:
        layout: layout of the preferences.
        context: context of the preferences.
    """
    row, item = layout.row(), shortcut(context)
    row.operator("risorius.shortcut", icon="EVENT_F", depress=item is not None)
    if item is not None:
        row.prop(item, "type", text="", full_event=True)


CLASSES = (RISORIUS_MT_pie, RISORIUS_OT_shortcut)
