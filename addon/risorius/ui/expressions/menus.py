# SPDX-License-Identifier: GPL-3.0-or-later
"""Menus with one entry per expression."""

from ...scene.expressions import assets
from ..blender_types import Context, Menu
from ..words import mark
from .operators import RISORIUS_OT_expression, RISORIUS_OT_make_pose_assets


def _expressions_of(group: str) -> list[tuple[str, str]]:
    return [(e.name, e.label) for e in assets.groups().get(group, ())]


def expression_menu(group: str, title: str, operator: str) -> type[Menu]:
    """Make a menu class with one entry per expression of a group.

    Args:
        group: group of the listed expressions, such as "emotion" or "viseme".
        title: title of the menu.
        operator: bl_idname of the entries' operator, which sets the expression or adds it as a
            layer.

    Returns:
        The menu class, to be registered.
    """

    def draw(self: Menu, _context: Context) -> None:
        for name, label in _expressions_of(group):
            button = self.layout.operator(operator, text=label)
            if operator == RISORIUS_OT_expression.bl_idname:
                button.expression = name
            else:
                button.kind, button.source = "EXPRESSION", name

    name = f"RISORIUS_MT_{'set' if operator == RISORIUS_OT_expression.bl_idname else 'add'}_{group}"
    return type(name, (Menu,), {"bl_idname": name, "bl_label": title, "draw": draw})


GROUPS = (("emotion", mark("Emotions")), ("face", mark("Faces")), ("viseme", mark("Visemes")))
_SET = [expression_menu(g, t, RISORIUS_OT_expression.bl_idname) for g, t in GROUPS]


class RISORIUS_MT_expressions(Menu):
    bl_idname = "RISORIUS_MT_expressions"
    bl_label = "Expressions"

    def draw(self, context: Context) -> None:
        for menu in _SET:
            self.layout.menu(menu.bl_idname)
        self.layout.separator()
        self.layout.operator(RISORIUS_OT_make_pose_assets.bl_idname, icon="ASSET_MANAGER")
        self.layout.operator_context = "INVOKE_DEFAULT"
        self.layout.operator("risorius.import_expressions", icon="IMPORT")
        self.layout.operator("risorius.export_expressions", icon="EXPORT")


CLASSES = (*_SET, RISORIUS_MT_expressions)
