# SPDX-License-Identifier: GPL-3.0-or-later
"""The optional overlay of the 3D view: milliseconds per stage of a frame."""

from typing import cast

import blf
import bpy

from ...scene.base import session
from ...scene.base.blender_types import WindowManager
from ...scene.frame import timing
from .. import words
from ..blender_types import Context

_handles: list[object] = session.keep("timing_overlay.handles", list, ("unregister",))


def show_property() -> object:
    """The property that switches the overlay; it belongs to the window manager and is not saved."""
    return bpy.props.BoolProperty(
        name="Show Timing",
        translation_context=words.CONTEXT,
        description=(
            "Show the time of each stage of a frame in milliseconds, in the corner of the 3D view"
        ),
        options={"SKIP_SAVE"},
        update=_switched,
    )


def _switched(manager: bpy.types.WindowManager, context: bpy.types.Context) -> None:
    stop()
    if cast(WindowManager, manager).risorius_show_timing:
        view = bpy.types.SpaceView3D
        _handles.append(view.draw_handler_add(timing.drawing_begins, (), "WINDOW", "PRE_VIEW"))
        _handles.append(view.draw_handler_add(_draw, (), "WINDOW", "POST_PIXEL"))
    screen = cast(Context, context).screen
    for area in screen.areas if screen else ():
        if area.type == "VIEW_3D":
            area.tag_redraw()


def stop() -> None:
    """Remove the overlay."""
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")


def _draw() -> None:
    timing.drawing_ends()
    context = cast(Context, bpy.context)
    size = round(12 * context.preferences.system.ui_scale)
    x = 20 + _width(context.area, "TOOLS")
    y = 20
    for text in reversed(timing.lines()):
        blf.size(0, size)
        blf.enable(0, blf.SHADOW)
        blf.shadow(0, 3, 0.0, 0.0, 0.0, 0.9)
        blf.color(0, 1.0, 1.0, 1.0, 1.0)
        blf.position(0, x, y, 0)
        blf.draw(0, words.local(text))
        blf.disable(0, blf.SHADOW)
        y += round(size * 1.5)


def _width(area: bpy.types.Area | None, kind: str) -> int:
    return next((r.width for r in area.regions if r.type == kind), 0) if area else 0
