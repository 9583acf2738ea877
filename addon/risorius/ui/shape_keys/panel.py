# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""The panel Names of Shape Keys: each key of a head with its picture and assignment."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import bpy

from ... import native
from ...scene.base import parts, session
from ...scene.base.blender_types import MeshObject, current_context
from ...scene.file import shape_key_head
from ...scene.shape_keys import assigned, pictures
from .. import words
from ..blender_types import Context, Icon, Panel, UILayout, UIList
from ..common import FacePanel
from ..expressions import previews
from . import shown

_ROWS = 5
_PICTURE = 6.0  # height of the large picture, in lines
_LITTLE = 2.0  # height of a picture in the list, in lines
# Pairs for which the panel has already started to draw missing pictures: session uid of a head's
# mesh, and value of the assigned.Choice whose picture of the sample man is shown.
_asked: set[tuple[int, str]] = session.keep("shape_keys.asked", set, ("undo", "load"))


class RISORIUS_UL_shape_key_names(UIList):
    """One line for each shape key: picture, name, assignment; unknown ones first."""

    only_unknown: bpy.props.BoolProperty(
        name="Only Unknown Names", description="Show only shape keys with unknown names"
    )

    def draw_item(
        self,
        context: Context,
        layout: UILayout,
        data: bpy.types.Key,
        item: bpy.types.ShapeKey,
        icon: int,
        active_data: MeshObject,
        active_property: str,
    ) -> None:
        row = assigned.of(active_data).rows.get(item.name)
        if row is None:
            words.show(layout, item.name)
            return
        line = layout.row(align=True)
        picture = _icon(pictures.paths_of(active_data), item.name)
        if picture:
            line.template_icon(icon_value=picture, scale=_LITTLE)
        else:
            line.label(text="", icon="SHAPEKEY_DATA")
        both = line.column(align=True)
        words.show(both, item.name)
        below = both.row(align=True)
        # Blender's list selects an item only by a click on its first line. So the second line is a
        # button that selects the shape key.
        below.alignment = "LEFT"
        is_open = not row.is_known and not row.is_said
        below.active = is_open or row.is_said
        text = words.say("Unknown") if is_open else shown.becomes(row)
        mark: Icon = "QUESTION" if is_open else "ERROR" if row.holder else "NONE"
        button = below.operator(
            "risorius.select_shape_key", text=text, icon=mark, emboss=False, translate=False
        )
        button.key = item.name

    def draw_filter(self, context: Context, layout: UILayout) -> None:
        """Draw the search field and the filter of unknown names below the list.

        Args:
            context: context of the panel.
            layout: layout of the filter.
        """
        row = layout.row(align=True)
        row.prop(self, "filter_name", text="", icon="VIEWZOOM")
        row.prop(self, "only_unknown", text="", icon="QUESTION")

    def filter_items(
        self, context: Context, data: bpy.types.Key, property: str
    ) -> tuple[list[int], list[int]]:
        names = [key.name for key in data.key_blocks]
        rows = assigned.of(cast(MeshObject, context.active_object)).rows
        sought = self.filter_name.casefold().split()

        def is_shown(name: str) -> bool:
            row = rows.get(name)
            if row is None or (self.only_unknown and row.is_known):
                return False
            text = f"{name} {shown.becomes(row)}".casefold()
            return all(word in text for word in sought)

        flags = [self.bitflag_filter_item if is_shown(name) else 0 for name in names]
        known = [name in rows and rows[name].is_known for name in names]
        # Shape keys with unknown names come first, whether the user has assigned them or not. So no
        # row moves when the user makes an assignment.
        ranked = sorted(range(len(names)), key=known.__getitem__)
        order = [0] * len(names)
        for place, index in enumerate(ranked):
            order[index] = place
        return flags, order


class RISORIUS_PT_shape_key_names(FacePanel, Panel):
    bl_idname = "RISORIUS_PT_shape_key_names"
    bl_label = "Names of Shape Keys"
    bl_order = 1

    @classmethod
    def poll(cls, context: Context) -> bool:
        return not native.problem() and shape_key_head.usable_head(context.active_object)

    def draw(self, context: Context) -> None:
        layout, item = self.layout, cast(MeshObject, context.active_object)
        names, paths = assigned.of(item), pictures.paths_of(item)
        row = layout.row(align=True)
        _draw_count(row, names)
        row.operator("risorius.load_shape_key_names", text="", icon="IMPORT")
        row.operator("risorius.save_shape_key_names", text="", icon="EXPORT")
        row.separator()
        row.prop(item, "show_only_shape_key", text="", icon_only=True)
        row.operator("risorius.shape_key_pictures", text="", icon="FILE_REFRESH").again = True
        layout.template_list(
            "RISORIUS_UL_shape_key_names",
            "",
            parts.keys_there(item),
            "key_blocks",
            item,
            "active_shape_key_index",
            rows=_ROWS,
        )
        active = names.rows.get(shown.active_key(item))
        sample = shown.sample_of(active) if active is not None else ""
        if paths is None or (sample and not pictures.sample_path(sample).is_file()):
            _ask_once(item.data.session_uid, sample)
        if active is not None:
            _draw_one(layout, active, _icon(paths, active.key), sample)


def _draw_count(layout: UILayout, names: assigned.Names) -> None:
    count, unknown = len(names.rows), names.unknown
    if unknown:
        text = words.say(
            "Shape-key names: {unknown} of {count} unknown", unknown=unknown, count=count
        )
        words.show(layout, text, "QUESTION")
    else:
        words.show(
            layout, words.say("Shape-key names: all {count} known", count=count), "CHECKMARK"
        )


def _draw_one(layout: UILayout, row: assigned.Row, picture: int, sample: str) -> None:
    """Draw pictures of the active shape key and of its control on the sample man, and buttons."""
    box = layout.box()
    pair = box.split(factor=0.5)
    _draw_picture(pair.column(align=True), picture, row.key)
    shown_sample = previews.icon_of(pictures.sample_path(sample)) if sample else 0
    _draw_picture(pair.column(align=True), shown_sample, shown.becomes(row))
    column = box.column(align=True)
    column.operator("risorius.choose_shape_key", text="Choose...", icon="VIEWZOOM")
    line = column.row(align=True)
    for way, text in (("OWN", "Own Control"), ("NOTHING", "Leave Out"), ("NAME", "By Name")):
        button = line.operator("risorius.assign_shape_key", text=text)
        button.way = way
    words.write(box, shown.who_knows(row), "ERROR" if row.holder else "NONE")


def _draw_picture(column: UILayout, icon: int, caption: str) -> None:
    if icon:
        column.template_icon(icon_value=icon, scale=_PICTURE)
    else:
        empty = column.row()
        empty.alignment, empty.scale_y, empty.active = "CENTER", _PICTURE, False
        empty.label(text="", icon="QUESTION")
    below = column.row()
    below.alignment = "CENTER"
    words.show(below, caption)


def _icon(paths: Mapping[str, Path] | None, key: str) -> int:
    path = paths.get(key) if paths is not None else None
    return previews.icon_of(path) if path is not None else 0


def _ask_once(mesh: int, sample: str) -> None:
    """Start drawing missing pictures after the panel is drawn, once for each pair.

    Args:
        mesh: session uid of the head's mesh.
        sample: value of the assigned.Choice whose picture of the sample man is shown.
    """
    if (mesh, sample) in _asked or bpy.app.background:
        return
    _asked.add((mesh, sample))
    bpy.app.timers.register(_begin, first_interval=0.1)


def _begin() -> None:
    """Start the operator that draws pictures.

    A timer calls this, because a panel must not call operators while it is drawn.
    """
    context, operators = current_context(), cast(Any, bpy.ops)
    with context.temp_override(window=context.window_manager.windows[0]):
        if operators.risorius.shape_key_pictures.poll():
            operators.risorius.shape_key_pictures("INVOKE_DEFAULT")


CLASSES = (RISORIUS_UL_shape_key_names, RISORIUS_PT_shape_key_names)
