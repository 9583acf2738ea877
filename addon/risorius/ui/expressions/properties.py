# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Settings of the grid of expressions and of clicks on it; they belong to the window manager."""

from typing import cast

import bpy

from ... import native
from ...scene.base import session
from ..blender_types import Context, Item
from ..words import say

ALL, STARRED = "ALL", "STARRED"
# "regions" or "categories" -> items of the enum property that Blender asks for. The items are kept
# here, because Blender keeps no references to the strings of the items.
_known: dict[str, list[Item]] = session.table("expressions.properties.known", ("unregister",))


def region_items(_self: object, _context: object) -> list[tuple[str, str, str, int]]:
    """The regions of a face as items of an enum property from which the user may choose several.

    Args:
        _self, _context: passed by Blender, not used.
    """
    titles = native.regions().titles.items()
    items = [(name, say(title), "", 1 << place) for place, (name, title) in enumerate(titles)]
    return cast("list[tuple[str, str, str, int]]", _known.setdefault("regions", items))  # type: ignore[arg-type]


def remember_categories(groups: list[str]) -> None:
    """Set the categories that the panel offers.

    Args:
        groups: names of the groups of all existing expressions, in the order of the menu; each
            group becomes a category.
    """
    named = {"emotion": say("Emotions"), "face": say("Faces"), "viseme": say("Visemes")}
    items = [(ALL, say("All"), say("All expressions"))]
    items.append((STARRED, say("Favourites"), say("Expressions with a star")))
    items += [(group, named.get(group, group), "") for group in groups if group]
    if items != _known.get("categories"):
        _known["categories"] = items


def _categories(_self: object, _context: object) -> list[Item]:
    if "categories" not in _known:
        remember_categories([])
    return _known["categories"]


class RISORIUS_PG_expressions(bpy.types.PropertyGroup):
    """The settings of the grid of expressions."""

    search: bpy.props.StringProperty(
        name="Search",
        description="Show only the expressions with these words",
        options={"TEXTEDIT_UPDATE", "SKIP_SAVE"},
    )
    category: bpy.props.EnumProperty(
        name="Category", description="Expressions to show", items=_categories
    )
    size: bpy.props.FloatProperty(
        name="Size", description="Size of the pictures", default=5.0, min=2.0, max=12.0
    )
    strength: bpy.props.FloatProperty(
        name="Strength",
        description="Strength of the expression that a click sets",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
    )
    flip: bpy.props.BoolProperty(
        name="Flip", description="Swap left and right; a Ctrl-click does the same"
    )
    additive: bpy.props.BoolProperty(
        name="Additive",
        description="Add the expression to the current pose; a Shift-click does the same",
    )
    only: bpy.props.BoolProperty(
        name="Rest of the Face at Rest",
        description="Set sliders to 0 that the expression does not move",
        default=True,
    )
    regions: bpy.props.EnumProperty(
        name="Regions",
        description="Move only these regions; no region: all regions",
        items=region_items,
        options={"ENUM_FLAG"},
    )
    active: bpy.props.StringProperty(name="Expression")
    new_label: bpy.props.StringProperty(
        name="Name",
        description=(
            "Name of the new expression; empty: the word Expression, with a number if needed"
        ),
    )
    new_group: bpy.props.StringProperty(
        name="Category", description="Category of the new expression", default="own"
    )
    to_library: bpy.props.BoolProperty(
        name="Shared Library",
        description="Also save the expression for all files, in the folder set in the preferences",
        default=True,
    )


def choices(context: Context) -> RISORIUS_PG_expressions:
    """The settings of the grid of expressions.

    Args:
        context: context of Blender.
    """
    return cast(RISORIUS_PG_expressions, context.window_manager.risorius_expressions)  # type: ignore[attr-defined]


CLASSES = (RISORIUS_PG_expressions,)
