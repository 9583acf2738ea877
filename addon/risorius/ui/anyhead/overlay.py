# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws landmarks of the selected head as dots over 3D views, and the names of selected dots."""

from __future__ import annotations

from typing import NamedTuple, cast

import bpy
import numpy as np

from ...scene.anyhead import finding, heads, points
from ...scene.base import parts, session
from .. import words
from ..blender_types import Context
from ..drag.drawing import Mark, draw_points, write

_handles: list[object] = session.keep("landmark_overlay.handles", list, ("unregister",))
_RADIUS, _SELECTED_RADIUS = 3.0, 5.0  # pixels at interface scale 1


class Dot(NamedTuple):
    """A drawn landmark.

    Attributes:
        mark: the landmark's place in world space, its colour, and its radius in pixels.
        label: the landmark's name in the user's language; "" if the landmark is not selected, or
            if Blender draws the name because the object's setting Name is on.
    """

    mark: Mark
    label: str


def start() -> None:
    """Add the draw handler."""
    if not _handles:
        add = bpy.types.SpaceView3D.draw_handler_add
        _handles.append(add(_draw, (), "WINDOW", "POST_PIXEL"))


def stop() -> None:
    """Remove the draw handler."""
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")


def dots(context: Context) -> list[Dot]:
    """The visible landmarks of the selected head.

    Args:
        context: has the selection.
    """
    # Most scenes have no landmarks, and then a redraw should not search the objects.
    if not any(parts.LANDMARKS in group for group in bpy.data.collections):
        return []
    head = heads.head_of(context)
    there = points.of(head).values() if head is not None else ()
    return [_dot(point) for point in there if point.item.visible_get()]


def _dot(point: points.Point) -> Dot:
    selected = point.item.select_get()
    place = np.array(point.item.matrix_world.translation, np.float64)
    radius = _SELECTED_RADIUS if selected else _RADIUS
    named = selected and not point.item.show_name  # Blender draws the name itself
    label = words.say(finding.words().get(point.name, point.name)) if named else ""
    return Dot((place, points.COLORS[point.state], radius), label)


def _draw() -> None:
    context = cast(Context, bpy.context)
    view = cast("bpy.types.SpaceView3D | None", context.space_data)
    if view is None or not view.overlay.show_overlays:
        return
    for mark, label in dots(context):
        at = draw_points(context, [mark])
        if at is not None and label:
            write([label], at, context.preferences.system.ui_scale)
