# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Expressions: a grid of pictures of this face."""

from typing import Any, cast

import bpy

from ...scene.base import session
from ...scene.base.blender_types import current_context
from ...scene.character import runtime
from ...scene.expressions import library, thumbnails
from .. import words
from ..blender_types import Context, Panel, UILayout
from ..common import FaceOnlyPanel, face_rig
from . import previews
from .menus import RISORIUS_MT_expressions
from .properties import ALL, STARRED, RISORIUS_PG_expressions, choices, remember_categories

_ICON = 20.0  # pixels of an icon, and of a picture per unit of its size
# Hashes of characters (results of thumbnails.look_of) for which the panel has started to draw
# pictures since Blender was started.
_asked: set[str] = session.keep("expressions.panel.asked", set, ("unregister",))


class RISORIUS_PT_expressions(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_expressions"
    bl_label = "Expressions"
    bl_parent_id = "RISORIUS_PT_animation"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: Context) -> None:
        layout, chosen, rig = self.layout, choices(context), face_rig(context)
        if runtime.of(rig) is None:
            return
        items, troubles = library.all_items(library.folder(context))
        remember_categories(list(dict.fromkeys(i.expression.group for i in items.values())))
        _draw_tools(layout, chosen)
        shown = _chosen(list(items.values()), chosen)
        jobs = previews.jobs_of(rig, shown)
        icons = [previews.icon_of(job.path) for job in jobs]
        _draw_grid(context, layout, chosen, shown, icons)
        if not shown:
            words.write(layout, "No expression matches the search and filters.", "INFO")
        if not all(icons):
            _ask_once(thumbnails.look_of(rig))
        if chosen.active in items:
            _draw_one(layout, items[chosen.active])
        _draw_own(layout, chosen)
        for trouble in troubles[:3]:
            words.write(layout, trouble, "ERROR")


def _draw_tools(layout: UILayout, chosen: RISORIUS_PG_expressions) -> None:
    column = layout.column(align=True)
    row = column.row(align=True)
    words.search(row, chosen, "search")
    row.operator("risorius.render_thumbnails", text="", icon="FILE_REFRESH").again = True
    row.menu(RISORIUS_MT_expressions.bl_idname, text="", icon="DOWNARROW_HLT")
    row = column.row(align=True)
    row.prop(chosen, "category", text="")
    row.prop(chosen, "size")
    row = column.row(align=True)
    row.prop(chosen, "strength", slider=True)
    row.prop(chosen, "flip", text="", icon="MOD_MIRROR")
    row.prop(chosen, "additive", text="", icon="ADD")
    row.prop(chosen, "only", text="", icon="LOOP_BACK")
    header, body = layout.panel("RISORIUS_PT_expression_regions", default_closed=True)
    text = words.say("Regions")
    words.show(header, f"{text}: {len(chosen.regions)}" if chosen.regions else text)
    if body is not None:
        body.column_flow(columns=2, align=True).prop(chosen, "regions")


def _chosen(items: list[library.Item], chosen: RISORIUS_PG_expressions) -> list[library.Item]:
    """The expressions of the chosen category whose name, label or description has all sought words.

    Args:
        items: all expressions.
        chosen: the panel's settings, with the category and the text of the search field.
    """
    sought, group = chosen.search.lower().split(), chosen.category
    starred = library.favourites() if group == STARRED else set()
    found = []
    for item in items:
        expression = item.expression
        # Search the expression's short name too: for example, "PP" finds the label "M B P".
        named = f"{expression.name} {expression.label} {words.say(expression.label)}"
        text = f"{named} {expression.description}".lower()
        fits = group in (ALL, expression.group) or expression.name in starred
        if fits and all(word in text for word in sought):
            found.append(item)
    return found


def _draw_grid(
    context: Context,
    layout: UILayout,
    chosen: RISORIUS_PG_expressions,
    items: list[library.Item],
    icons: list[int],
) -> None:
    """Draw for each expression a picture and buttons that set it or blend it."""
    region, scale = context.region, context.preferences.system.ui_scale or 1.0
    width = region.width / scale if region is not None and region.width > 1 else 280.0
    columns = max(1, int((width - 36.0) / (chosen.size * _ICON + 6.0)))
    grid = layout.grid_flow(
        row_major=True, columns=columns, even_columns=True, even_rows=True, align=False
    )
    for item, icon in zip(items, icons, strict=True):
        cell = grid.column(align=True)
        if icon:
            cell.template_icon(icon_value=icon, scale=chosen.size)
        else:
            row = cell.row()
            row.scale_y = chosen.size
            row.label(text="", icon="USER")
        row = cell.row(align=True)
        name = item.expression.name
        label = words.say(item.expression.label)
        for operator, text in (("risorius.expression", label), ("risorius.blend_expression", "")):
            if text:
                button = row.operator(
                    operator, text=text, depress=name == chosen.active, translate=False
                )
            else:
                button = row.operator(operator, text="", icon="ARROW_LEFTRIGHT")
            button.expression, button.strength = name, chosen.strength
            button.only, button.flip = chosen.only, chosen.flip
            button.additive, button.regions = chosen.additive, chosen.regions


def _draw_one(layout: UILayout, item: library.Item) -> None:
    """Draw the name, description and buttons of the expression that was clicked last."""
    expression, own = item.expression, item.source != library.RISORIUS
    box = layout.box()
    row = box.row(align=True)
    words.show(row, words.say(expression.label), "USER")
    starred = expression.name in library.favourites()
    icon = "SOLO_ON" if starred else "SOLO_OFF"
    row.operator("risorius.star_expression", text="", icon=icon).on = not starred
    if own:
        row.operator("risorius.update_expression", text="", icon="FILE_REFRESH")
        row.operator("risorius.rename_expression", text="", icon="GREASEPENCIL")
        row.operator("risorius.delete_expression", text="", icon="TRASH")
    if expression.description:
        words.write(box, expression.description)


def _draw_own(layout: UILayout, chosen: RISORIUS_PG_expressions) -> None:
    """Draw the row for saving the current pose."""
    column = layout.column(align=True)
    row = column.row(align=True)
    row.prop(chosen, "new_label", text="")
    row.operator("risorius.save_expression", text="Save", icon="ADD")
    row = column.row(align=True)
    row.prop(chosen, "new_group", text="")
    row.prop(chosen, "to_library", text="", icon="ASSET_MANAGER")


def _ask_once(look: str) -> None:
    """Start drawing the pictures of a character after the panel is drawn, once for each character.

    Args:
        look: hash of the character, from thumbnails.look_of.
    """
    if look in _asked or bpy.app.background:
        return
    _asked.add(look)
    bpy.app.timers.register(_begin, first_interval=0.1)


def _begin() -> None:
    """Start the operator that draws pictures.

    A timer calls this, because a panel must not call operators while it is drawn.
    """
    context, operators = current_context(), cast(Any, bpy.ops)
    with context.temp_override(window=context.window_manager.windows[0]):
        if operators.risorius.render_thumbnails.poll():
            operators.risorius.render_thumbnails("INVOKE_DEFAULT")


CLASSES = (RISORIUS_PT_expressions,)
