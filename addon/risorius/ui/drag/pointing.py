# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the point that a press at the cursor drags, and the handles and pins to draw."""

from __future__ import annotations

import bpy
import numpy as np

from ...scene.base import parts
from ...scene.base.blender_types import ArmatureObject
from ...scene.character import runtime
from ...scene.drag import handles, kept_points, picking
from ...scene.drag.skin import Skin
from ..blender_types import Context
from . import drawing, properties, view

_NEAR = 9  # distance from a handle in pixels, at interface scale 1, within which a press drags it


def counts_of(live: runtime.Runtime) -> list[int]:
    """The number of vertices of each mesh in a face's DNA.

    Args:
        live: Runtime of the face.
    """
    return [len(mesh.positions) for mesh in live.dna.meshes]


def pick(context: Context, where: view.View, event: bpy.types.Event) -> picking.Hit | None:
    """Find the point that a press would drag: a handle near the cursor, or the skin under it.

    Args:
        context: context with the visible scene.
        where: the view under the cursor.
        event: event with the place of the cursor.

    Returns:
        None if no face is under the cursor.

    Raises:
        FaceError: the face is linked, or has lost its DNA.
    """
    mouse = where.mouse(event)
    hit = picking.under(context, *where.ray(mouse))
    live = runtime.of(hit.rig) if hit is not None else None
    if hit is None or live is None or not properties.choices_of(context).handles:
        return hit
    best, near = hit, _NEAR * context.preferences.system.ui_scale
    reach = picking.NEAR * picking.size_of(hit.rig, live)
    for point, place in picking.handles_of(context, hit.rig, live):
        pixel = where.pixel(place)
        far = (pixel - mouse).length if pixel is not None else near
        if far < near and np.linalg.norm(place - hit.place) < reach:
            best, near = picking.Hit(hit.rig, point, place, is_handle=True), far
    return best


def pins_of(context: Context, rig: ArmatureObject, live: runtime.Runtime) -> list[drawing.Mark]:
    """The pins of a face as marks; none if the face has lost its control armature.

    Args:
        context: context with the visible scene.
        rig: deforming armature of the face.
        live: Runtime of the face.
    """
    if parts.controls_of(rig) is None:
        return []
    points = kept_points.of(rig, kept_points.PINS, counts_of(live))
    found = picking.places(context, rig, live, points)
    return [(place, drawing.PIN, 4.0) for place in found]


def marks_of(context: Context, rig: ArmatureObject) -> list[drawing.Mark]:
    """The handles and pins of a face as marks.

    A face that is baked, or has lost its control armature or its DNA, has none. Handles are left
    out if the setting Show Handles is off.

    Args:
        context: context with the visible scene.
        rig: deforming armature of the face.
    """
    live = runtime.of(rig)
    if live is None or parts.controls_of(rig) is None or parts.BAKED in rig:
        return []
    marks = pins_of(context, rig, live)
    if properties.choices_of(context).handles:
        chosen = handles.selected(rig, Skin.of(context, rig, live).surface)
        for point, place in picking.handles_of(context, rig, live):
            on = point in chosen
            marks.append((place, drawing.SELECTED if on else drawing.HANDLE, 4.0 if on else 3.0))
    return marks


def skin_of(context: Context, rig: ArmatureObject) -> Skin:
    """The skin of a face at the visible level of detail.

    Args:
        context: context with the visible scene.
        rig: deforming armature of the face.
    """
    return Skin.of(context, rig, runtime.there(rig))


def activate(context: Context, rig: ArmatureObject) -> None:
    """Make a face the active one, so that panels and repeated operators act on it.

    Args:
        context: context with the view layer.
        rig: deforming armature of the face.
    """
    if parts.active_rig(context) != rig:
        context.view_layer.objects.active = parts.controls_there(rig)
