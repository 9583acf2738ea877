# SPDX-License-Identifier: GPL-3.0-or-later
"""Menus of the panel Layers: sources of a new layer, reactions, and further actions."""

import bpy

from ...scene.animation import layers
from ..blender_types import Context, Icon, Menu
from ..common import face_controls
from ..expressions.menus import GROUPS, expression_menu
from .operators import (
    RISORIUS_OT_fire,
    RISORIUS_OT_layer_add,
    RISORIUS_OT_layer_duplicate,
    RISORIUS_OT_layer_warp,
    RISORIUS_OT_layers_to_nla,
)

ICONS: dict[str, Icon] = {"ACTION": "ACTION", "EXPRESSION": "USER", "IDLE": "HIDE_OFF"}
_ADD = [expression_menu(g, t, RISORIUS_OT_layer_add.bl_idname) for g, t in GROUPS]


class RISORIUS_MT_actions(Menu):
    bl_idname = "RISORIUS_MT_actions"
    bl_label = "Action"

    def draw(self, context: Context) -> None:
        controls = face_controls(context)
        for action in bpy.data.actions:
            if action.asset_data is None and layers.fits(controls, action):
                button = self.layout.operator(
                    RISORIUS_OT_layer_add.bl_idname,
                    text=action.name,
                    icon="ACTION",
                    translate=False,
                )
                button.kind, button.source = "ACTION", action.name


class RISORIUS_MT_layer_add(Menu):
    bl_idname = "RISORIUS_MT_layer_add"
    bl_label = "Add Layer"

    def draw(self, context: Context) -> None:
        layout = self.layout
        add = RISORIUS_OT_layer_add.bl_idname
        layout.operator(add, text="From Active Action", icon="ACTION").kind = "ACTION"
        layout.menu(RISORIUS_MT_actions.bl_idname, icon="ACTION")
        layout.operator(add, text="Idle Life", icon=ICONS["IDLE"]).kind = "IDLE"
        layout.separator()
        for menu in _ADD:
            layout.menu(menu.bl_idname, icon=ICONS["EXPRESSION"])


class RISORIUS_MT_fire(Menu):
    bl_idname = "RISORIUS_MT_fire"
    bl_label = "Fire"

    def draw(self, context: Context) -> None:
        for name, reaction in layers.known_reactions().items():
            button = self.layout.operator(RISORIUS_OT_fire.bl_idname, text=reaction.label)
            button.reaction = name


class RISORIUS_MT_layer_more(Menu):
    bl_idname = "RISORIUS_MT_layer_more"
    bl_label = "Layer Specials"

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.operator(RISORIUS_OT_layer_duplicate.bl_idname, icon="DUPLICATE")
        layout.operator(RISORIUS_OT_layer_warp.bl_idname, icon="MOD_TIME").clear = False
        layout.operator(
            RISORIUS_OT_layer_warp.bl_idname, text="Clear Warp Points", icon="X"
        ).clear = True
        layout.separator()
        layout.operator(RISORIUS_OT_layers_to_nla.bl_idname, icon="NLA")


CLASSES = (
    *_ADD,
    RISORIUS_MT_actions,
    RISORIUS_MT_layer_add,
    RISORIUS_MT_fire,
    RISORIUS_MT_layer_more,
)
