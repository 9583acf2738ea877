# SPDX-License-Identifier: GPL-3.0-or-later
"""3D views show the face: after an import, where it would be a speck, and when one asks for it."""

from collections.abc import Sequence
from typing import cast

import bpy
import numpy as np
from mathutils import Quaternion, Vector

from ...logic.character import view_fit
from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import lods
from ..blender_types import Context

_FRONT = Vector((0.0, -1.0, 0.0))  # where an imported face looks
_THREE_QUARTER = Vector((0.36, -0.92, 0.16))  # whence a face is seen best
_SIDE = 0.77  # cosine of 40 degrees: whoever looks from farther aside sees a profile


def frame(context: Context, rig: ArmatureObject) -> None:
    """Let the 3D views of the user's window show a face; one in profile is shown from the front.

    A view through a camera is left alone, and one that shows the face well already. A solid view in
    Blender's default colours, one a material, shows the textures' from now on: iris, lips and brows
    are in them. Views are no part of undo: it takes the face away and leaves the view.

    Args:
        context: a Blender context; without a window nothing happens.
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
    """Let the 3D view of the context, else all of the window, show a face.

    Each keeps its direction; outlines of bones and the face board do not count. A view through
    a camera leaves the camera, as with Blender's Frame Selected.

    Args:
        context: a Blender context.
        rig: deforming armature of the face.

    Returns:
        How many views show it. One that is locked to an object or the 3D cursor does not.
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
        # Straight views (front, side, top) are chosen with a key and keep their direction.
        seen_from = view.view_rotation @ Vector((0.0, 0.0, 1.0))
        if perspective and seen_from.dot(turn @ _FRONT) < _SIDE:
            view.view_rotation = (turn @ _THREE_QUARTER).to_track_quat("Z", "Y")


def _ball(rig: ArmatureObject) -> tuple[list[float], float]:
    """Middle and radius of the head, else of all meshes of the finest level that is built."""
    items = parts.meshes_of(rig)
    first = min((min(lods.levels_of(item), default=0) for item in items), default=0)
    shown = [item for item in items if lods.shows(item, first)]
    heads = [item for item in shown if "head" in item.data.name.rpartition("_lod")[0].lower()]
    corners = np.array(
        [item.matrix_world @ Vector(c) for item in heads or shown for c in item.bound_box]
    )
    low, high = corners.min(axis=0), corners.max(axis=0)
    return ((low + high) / 2).tolist(), float(np.linalg.norm(high - low)) / 2
