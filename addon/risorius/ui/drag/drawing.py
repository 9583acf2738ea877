# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws points, pins, moving skin and slider names over the 3D views during a drag.

Blender's draw handlers exist only while an operator uses them; `stop` removes the handlers.
"""

from dataclasses import dataclass, field
from typing import cast

import blf
import bpy
import gpu
import numpy as np
from bpy_extras import view3d_utils
from gpu_extras.batch import batch_for_shader
from mathutils import Vector
from numpy.typing import NDArray

from ...scene.base import session
from ..blender_types import Context

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Colour = tuple[float, float, float, float]
Mark = tuple[Float, Colour, float]  # place in world space, colour, radius in pixels

HELD: Colour = (1.0, 0.55, 0.1, 1.0)  # the dragged point
OFFERED: Colour = (1.0, 1.0, 1.0, 0.9)  # the point that a press would drag
HANDLE: Colour = (1.0, 0.8, 0.3, 0.75)
SELECTED: Colour = (1.0, 0.4, 0.0, 1.0)  # selected handles, in the orange of Blender's selection
PIN: Colour = (0.2, 0.75, 1.0, 1.0)
_HOT = np.array((1.0, 0.45, 0.05))
_SHOWN = 0.04  # share of the largest motion; vertices that move less are not coloured
_MOST = 0.55  # opacity of the vertex that moves farthest
_LIFT = 0.002  # colours are drawn above the skin by this share of the distance to the viewer


@dataclass
class Shown:
    """The marks, text and coloured mesh that are drawn.

    Attributes:
        points: places in world space, each with a colour and a radius in pixels at interface scale
            1.
        lines: lines of text that are drawn beside the first point of `points`.
        places: float64[V, 3], vertices of the coloured mesh in world space; None: no mesh is drawn.
        far: float64[V], distance in world space that the drag moves each vertex.
        triangles: int32[T, 3], triangles of the coloured mesh.
    """

    points: list[Mark] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    places: Float | None = None
    far: Float | None = None
    triangles: NDArray[np.int32] | None = None


_shown = session.value("drawing.shown", Shown(), ("unregister",))
_handles: list[object] = session.keep("drawing.handles", list, ("unregister",))
_users: set[str] = session.keep("drawing.users", set, ("unregister",))


def start(user: str) -> None:
    """Add the draw handlers for an operator, unless another operator has added them.

    Args:
        user: name of the operator; the operator passes the same name to `end`.
    """
    _users.add(user)
    if not _handles:
        view = bpy.types.SpaceView3D
        _handles.append(view.draw_handler_add(_draw_heat, (), "WINDOW", "POST_VIEW"))
        _handles.append(view.draw_handler_add(_draw_marks, (), "WINDOW", "POST_PIXEL"))


def show(context: Context, shown: Shown) -> None:
    """Replace the drawn marks, text and mesh, and redraw all 3D views.

    Args:
        context: context with the window manager.
        shown: the new marks, text and mesh.
    """
    _shown.now = shown
    tag(context)


def tag(context: Context) -> None:
    """Redraw all 3D views of all windows.

    Args:
        context: context with the window manager.
    """
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def end(context: Context, user: str) -> None:
    """Draw nothing more; remove the draw handlers if no other operator uses them.

    Args:
        context: context with the window manager.
        user: name that the operator passed to `start`.
    """
    _users.discard(user)
    if not _users:
        stop()
    show(context, Shown())


def stop() -> None:
    """Remove the draw handlers."""
    _users.clear()
    while _handles:
        bpy.types.SpaceView3D.draw_handler_remove(_handles.pop(), "WINDOW")


def is_drawing() -> bool:
    """Whether draw handlers exist."""
    return bool(_handles)


def colours_of(far: Float) -> Float32:
    """RGBA colours of vertices, float32[V, 4]; the vertex that moves farthest is the most opaque.

    Args:
        far: float64[V], distance that the drag moves each vertex.
    """
    most = float(far.max(initial=0.0))
    share = np.clip(far / most, 0.0, 1.0) if most > 0 else np.zeros(len(far))
    colours = np.empty((len(far), 4), np.float32)
    colours[:, :3] = _HOT
    colours[:, 1] += 0.4 * (1.0 - share)  # yellow for small motion
    colours[:, 3] = _MOST * np.sqrt(share)
    return colours


def _view() -> bpy.types.RegionView3D | None:
    """The 3D view of the region that Blender draws at present; None if it shows no 3D view."""
    return cast("bpy.types.RegionView3D | None", cast(Context, bpy.context).region_data)


def _draw_heat() -> None:
    shown, view = _shown.now, _view()
    if shown.places is None or shown.far is None or shown.triangles is None or view is None:
        return
    most = float(shown.far.max(initial=0.0))
    if most <= 0.0:
        return
    warm = (shown.far > _SHOWN * most)[shown.triangles].any(axis=1)
    eye = np.array(view.view_matrix.inverted().translation)
    lifted = shown.places + _LIFT * (eye - shown.places)
    shader = gpu.shader.from_builtin("SMOOTH_COLOR")
    content = {"pos": lifted.astype(np.float32), "color": colours_of(shown.far)}
    batch = batch_for_shader(shader, "TRIS", content, indices=shown.triangles[warm])  # pyright: ignore  arrays
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_test_set("LESS_EQUAL")
    batch.draw(shader)
    gpu.state.depth_test_set("NONE")
    gpu.state.blend_set("NONE")


def draw_points(context: Context, marks: list[Mark]) -> Vector | None:
    """Draw points over the current region.

    Args:
        context: context of the draw handler.
        marks: the points.

    Returns:
        Pixel of the first visible point, or None.
    """
    region, data = context.region, _view()
    if region is None or data is None:
        return None
    scale, first = context.preferences.system.ui_scale, None
    for place, colour, radius in marks:
        at = view3d_utils.location_3d_to_region_2d(region, data, Vector(place.tolist()))
        if at is None:
            continue
        first = first or at
        _disc(at, radius * scale + 1.5, (0.0, 0.0, 0.0, 0.8))
        _disc(at, radius * scale, colour)
    return first


def _draw_marks() -> None:
    context, shown = cast(Context, bpy.context), _shown.now
    first = draw_points(context, shown.points)
    if first is None:
        return
    if shown.lines:
        write(shown.lines, first, context.preferences.system.ui_scale)


def write(lines: list[str], at: Vector, scale: float) -> None:
    """Draw lines of text beside a place.

    The background is dark, so that outlines of bones do not disturb the text.

    Args:
        lines: one or more lines.
        at: the place, in pixels of the region.
        scale: scale of the interface.
    """
    blf.size(0, round(12 * scale))
    wide = max(blf.dimensions(0, text)[0] for text in lines)
    left, top = at.x + 16 * scale, at.y + 24 * scale
    low, edge = top - (16 * len(lines) + 4) * scale, 6 * scale
    _board((left - edge, low), (left + wide + edge, top))
    for row, text in enumerate(lines):
        blf.color(0, 1.0, 1.0, 1.0, 1.0)
        blf.position(0, left, at.y + (10 - 16 * row) * scale, 0)
        blf.draw(0, text)


def _board(low: tuple[float, float], high: tuple[float, float]) -> None:
    corners = [low, (high[0], low[1]), high, (low[0], high[1])]
    _fill(corners, [(0, 1, 2), (0, 2, 3)], (0.05, 0.05, 0.05, 0.8))


def _disc(at: Vector, radius: float, colour: Colour) -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 21)
    rim = np.stack([at.x + radius * np.cos(angles), at.y + radius * np.sin(angles)], axis=1)
    corners = np.concatenate([[(at.x, at.y)], rim]).astype(np.float32)
    _fill(corners.tolist(), [(0, i, i + 1) for i in range(1, 21)], colour)


def _fill(
    corners: list[tuple[float, float]], triangles: list[tuple[int, int, int]], colour: Colour
) -> None:
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    batch = batch_for_shader(shader, "TRIS", {"pos": corners}, indices=triangles)
    gpu.state.blend_set("ALPHA")
    shader.bind()
    shader.uniform_float("color", colour)
    batch.draw(shader)
    gpu.state.blend_set("NONE")
