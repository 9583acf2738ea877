# SPDX-License-Identifier: GPL-3.0-or-later
"""The menu Face of the 3D view's header, which lets Blender's search find every command."""

import bpy

from ... import native
from ...scene.animation import tweaks
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import outlines
from .. import words
from ..blender_types import Context, Icon, Menu, UILayout
from ..common import active_controls
from . import entries

_MODES = {"OBJECT", "POSE"}  # in edit mode Blender has its own menu Face
_PARTS: tuple[tuple[type[Menu], Icon], ...] = (
    (entries.RISORIUS_MT_face_keys, "KEYINGSET"),
    (entries.RISORIUS_MT_face_sides, "MOD_MIRROR"),
    (entries.RISORIUS_MT_face_eyes, "HIDE_OFF"),
    (entries.RISORIUS_MT_face_drag, "VIEW_PAN"),
    (entries.RISORIUS_MT_face_board, "MESH_GRID"),
    (entries.RISORIUS_MT_face_layers, "RENDERLAYERS"),
    (entries.RISORIUS_MT_face_why, "QUESTION"),
)


class RISORIUS_MT_face(Menu):
    bl_idname = "RISORIUS_MT_face"
    bl_label = "Face"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.operator_context = "INVOKE_REGION_WIN"
        if native.problem():  # only the submenu About can help
            layout.menu(entries.RISORIUS_MT_face_about.bl_idname)
            return
        layout.operator("risorius.frame_face", icon="ZOOM_SELECTED").instead = False
        controls = active_controls(context)
        hidden = controls is not None and outlines.are_hidden(controls)
        text = "Show Outlines" if hidden else "Hide Outlines"
        layout.operator("risorius.hide_outlines", text=text).hide = not hidden
        layout.separator()
        _draw_pose(layout, controls)
        layout.separator()
        for menu, icon in _PARTS:
            layout.menu(menu.bl_idname, icon=icon)
        layout.separator()
        layout.menu(entries.RISORIUS_MT_face_import.bl_idname, icon="IMPORT")
        layout.menu(entries.RISORIUS_MT_face_out.bl_idname, icon="EXPORT")
        layout.separator()
        layout.menu(entries.RISORIUS_MT_face_character.bl_idname, icon="USER")
        layout.operator("risorius.add_studio", icon="LIGHT_AREA")
        layout.menu(entries.RISORIUS_MT_face_about.bl_idname, icon="BLANK1")


def _draw_pose(layout: UILayout, controls: ArmatureObject | None) -> None:
    """Draw entries for frequent actions: rest, keys, expressions, tweaks, copied poses."""
    layout.operator("risorius.reset", icon="LOOP_BACK").region = ""
    layout.operator("risorius.rest_others")
    layout.operator("risorius.key", text="Key All", icon="KEYFRAME_HLT").region = ""
    layout.menu("RISORIUS_MT_expressions", icon="MONKEY")
    tweaked = controls is not None and tweaks.of(controls) is not None
    text = "End Tweak" if tweaked else "Tweak over a Range"
    layout.operator("risorius.tweak", text=text, icon="MOD_TIME").enable = not tweaked
    layout.separator()
    layout.operator("risorius.copy_pose", icon="COPYDOWN").region = ""
    layout.operator("risorius.paste_pose", icon="PASTEDOWN").flipped = False
    layout.operator(
        "risorius.paste_pose", text="Paste Face Flipped", icon="PASTEFLIPDOWN"
    ).flipped = True


def draw_header(self: Menu, context: Context) -> None:
    """Draw the menu Face in the header, in object mode and pose mode.

    Blender's search matches the names of the menus that contain an entry, too. The menu's label
    contains "Risorius", so a search for this word finds every entry.

    Args:
        self: the menu with the header's menus.
        context: context with the mode.
    """
    if context.mode in _MODES:
        text = words.say("Face (Risorius)")
        self.layout.menu(RISORIUS_MT_face.bl_idname, text=text, translate=False)


def register() -> None:
    """Add the menu after Blender's own menus."""
    bpy.types.VIEW3D_MT_editor_menus.append(draw_header)


def unregister() -> None:
    """Remove the menu."""
    bpy.types.VIEW3D_MT_editor_menus.remove(draw_header)


CLASSES = (RISORIUS_MT_face,)
