# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames a face in 3D views, after an import and on request."""

from collections.abc import Sequence
from typing import cast

import bpy
import numpy as np
from mathutils import Quaternion, Vector
from numpy.typing import NDArray

from ...logic.character import view_fit
from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import board_bones
from ...scene.lod import lods
from ..blender_types import Context

_FRONT = Vector((0.0, -1.0, 0.0))  # direction in which an imported face looks
_THREE_QUARTER = Vector((0.36, -0.92, 0.16))  # from the face to the viewer: 21 degrees aside
_ROWS, _COLUMNS = ("HEADER", "TOOL_HEADER"), ("TOOLS", "UI")  # types of regions that overlap a view
_SIDE = 0.77  # cosine of 40 degrees: views farther off the front are rotated


def frame(context: Context, rig: ArmatureObject) -> None:
    """Frame a face in the 3D views of the user's window.

    A perspective view that is more than 40 degrees off the front rotates to a three-quarter view.
    Views through a camera do not change, nor views locked to an object or the 3D cursor, nor views
    that already show the face well. A solid view with Blender's default material colours switches
    to texture colours, which show iris, lips and brows. Undo does not restore views.

    Args:
        context: context of Blender; without a window nothing happens.
        rig: deforming armature of the face.
    """
    screen = context.window.screen if context.window is not None else None
    areas = [a for a in screen.areas if a.type == "VIEW_3D"] if screen is not None else []
    if not areas:
        return
    middle, radius = _ball(rig)
    turn = (parts.controls_of(rig) or rig).matrix_world.to_quaternion()
    for area in areas:
        _show_textures(_view(area).shading)
        _frame(area, middle, radius, turn)


def show_whole(context: Context, rig: ArmatureObject) -> int:
    """Frame the head in the 3D view of the context, or in all views of the window.

    Each view keeps its direction. Control bones and the face board are ignored. A view through a
    camera leaves the camera, as with Blender's Frame Selected.

    Args:
        context: context of Blender.
        rig: deforming armature of the face.

    Returns:
        The number of framed views; views locked to an object or the 3D cursor are skipped.
    """
    screen = context.window.screen if context.window is not None else None
    areas = [a for a in screen.areas if a.type == "VIEW_3D"] if screen is not None else []
    if context.area in areas:
        areas = [context.area]
    middle, radius = _ball(rig)
    shown = 0
    for area in areas:
        space, region = _view(area), _window_of(area)
        if region is None or _is_locked(space):
            continue
        for view in (space.region_3d, *space.region_quadviews):
            if view is None:
                continue
            if view.view_perspective == "CAMERA":
                view.view_perspective = "PERSP"
            perspective = view.view_perspective == "PERSP"
            size = (region.width, region.height)
            view.view_location = middle
            view.view_distance = view_fit.distance(radius, space.lens, size, perspective)
        shown += 1
    return shown


def show_with_board(context: Context, rig: ArmatureObject) -> None:
    """Frame the head and its face board side by side in a 3D view, from the front.

    If the context has a 3D view, this view is framed, and a camera view becomes a free view.
    Otherwise the window's largest view that shows no camera is framed. Sidebar, toolbar and headers
    do not cover head and board. A view locked to an object or the 3D cursor does not change.

    Args:
        context: context of Blender; without a window nothing happens.
        rig: deforming armature of the face, with a board.
    """
    area = _largest_or_own(context)
    region = _window_of(area) if area is not None else None
    space = _view(area) if area is not None else None
    view = space.region_3d if space is not None else None
    if area is None or region is None or space is None or view is None or _is_locked(space):
        return
    if view.view_perspective == "CAMERA":
        view.view_perspective = "PERSP"
    controls = parts.controls_there(rig)
    turn = (controls.matrix_world.to_quaternion() @ _FRONT).to_track_quat("Z", "Y")
    corners = np.concatenate([_corners(rig), board_bones.corners(controls)])
    points = corners @ np.array(turn.to_matrix(), np.float64)
    depth = float(points[-1, 2])  # depth of the board, which is the view's pivot
    size, perspective = (region.width, region.height), view.view_perspective == "PERSP"
    free = _free_part(area, region)
    right, up, far = view_fit.fit(points - (0.0, 0.0, depth), space.lens, size, free, perspective)
    view.view_rotation = turn
    view.view_location = turn @ Vector((right, up, depth))
    view.view_distance = far


def _largest_or_own(context: Context) -> bpy.types.Area | None:
    """The 3D view of the context, or else the window's largest 3D view without a camera view.

    Returns None if the window has no such view.
    """
    screen = context.window.screen if context.window is not None else None
    areas = [a for a in screen.areas if a.type == "VIEW_3D"] if screen is not None else []
    if context.area in areas:
        return context.area
    views = [(a, _view(a).region_3d) for a in areas]
    free = [a for a, view in views if view is not None and view.view_perspective != "CAMERA"]
    return max(free, key=lambda area: area.width * area.height, default=None)


def _free_part(area: bpy.types.Area, region: bpy.types.Region) -> view_fit.Box:
    """The rectangle of `region` that no other region of its area covers.

    Sidebar, toolbar and headers cover a part of `region` if the preferences let regions overlap. If
    they cover `region` completely, the result is the whole region. The rectangle is (left, bottom,
    right, top) in pixels from the lower left corner of `region`.
    """
    left, bottom, right, top = 0, 0, region.width, region.height
    for other in area.regions:
        if min(other.width, other.height) <= 1 or other.type not in (*_ROWS, *_COLUMNS):
            continue
        x, y = other.x - region.x, other.y - region.y
        at_start = x < region.width / 2 if other.type in _COLUMNS else y < region.height / 2
        if other.type in _COLUMNS and at_start:
            left = max(left, x + other.width)
        elif other.type in _COLUMNS:
            right = min(right, x)
        elif at_start:
            bottom = max(bottom, y + other.height)
        else:
            top = min(top, y)
    whole = (0, 0, region.width, region.height)
    return (left, bottom, right, top) if left < right and bottom < top else whole


def _window_of(area: bpy.types.Area) -> bpy.types.Region | None:
    return next((r for r in area.regions if r.type == "WINDOW"), None)


def _is_locked(space: bpy.types.SpaceView3D) -> bool:
    return space.lock_object is not None or space.lock_cursor


def _view(area: bpy.types.Area) -> bpy.types.SpaceView3D:
    return cast(bpy.types.SpaceView3D, area.spaces.active)


def _show_textures(shading: bpy.types.View3DShading) -> None:
    if shading.type == "SOLID" and shading.color_type == "MATERIAL":
        shading.color_type = "TEXTURE"


def _frame(area: bpy.types.Area, middle: Sequence[float], radius: float, turn: Quaternion) -> None:
    space = _view(area)
    region = _window_of(area)
    if region is None or _is_locked(space):
        return
    for view in (space.region_3d, *space.region_quadviews):
        if view is None or view.view_perspective == "CAMERA":
            continue
        perspective = view.view_perspective == "PERSP"
        far = view_fit.distance(radius, space.lens, (region.width, region.height), perspective)
        held = view.view_location[:]
        if view_fit.is_well_in_view(middle, radius, far, held, view.view_distance):
            continue
        view.view_location, view.view_distance = middle, far
        # An orthographic view, such as Front or Right, keeps the direction that the user chose.
        seen_from = view.view_rotation @ Vector((0.0, 0.0, 1.0))
        if perspective and seen_from.dot(turn @ _FRONT) < _SIDE:
            view.view_rotation = (turn @ _THREE_QUARTER).to_track_quat("Z", "Y")


def _corners(rig: ArmatureObject) -> NDArray[np.float64]:
    """Corners of the bounding boxes of the head's meshes in world space, float64[N, 3]."""
    boxes = [(item.matrix_world, item.bound_box) for item in lods.heads(rig)]
    return np.array([matrix @ Vector(c) for matrix, box in boxes for c in box], np.float64)


def _ball(rig: ArmatureObject) -> tuple[list[float], float]:
    """Centre and radius of a ball around bounding boxes of the head's meshes, in world space."""
    corners = _corners(rig)
    low, high = corners.min(axis=0), corners.max(axis=0)
    return ((low + high) / 2).tolist(), float(np.linalg.norm(high - low)) / 2
