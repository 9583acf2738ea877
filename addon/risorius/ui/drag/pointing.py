# SPDX-License-Identifier: GPL-3.0-or-later
"""The point that a press at the cursor takes, and the drawn handles and pins."""

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

_NEAR = 9  # pixels, at an interface of 1, within which a press takes a handle


def counts_of(live: runtime.Runtime) -> list[int]:
    """The vertices of each mesh of a face's DNA. Args: live  its Runtime."""
    return [len(mesh.positions) for mesh in live.dna.meshes]


def pick(context: Context, where: view.View, event: bpy.types.Event) -> picking.Hit | None:
    """The point that a press takes: the nearest handle, or the skin under the cursor.

    Args:
        context: has the visible scene.
        where: the view under the cursor.
        event: has the cursor.

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
    """The pins of a face as they are drawn. Args: context, rig, live  the face that is seen."""
    if parts.controls_of(rig) is None:
        return []
    points = kept_points.of(rig, kept_points.PINS, counts_of(live))
    found = picking.places(context, rig, live, points)
    return [(place, drawing.PIN, 4.0) for place in found]


def marks_of(context: Context, rig: ArmatureObject) -> list[drawing.Mark]:
    """Handles and pins of a face as they are drawn. Args: context, rig  the face that is seen."""
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
    """The skin of a face at the level that is seen. Args: context, rig  of the face."""
    return Skin.of(context, rig, runtime.there(rig))


def activate(context: Context, rig: ArmatureObject) -> None:
    """Make a face the active one, so that panels, pins and repeats mean it.

    Args:
        context: has the view layer.
        rig: the character.
    """
    if parts.active_rig(context) != rig:
        context.view_layer.objects.active = parts.controls_there(rig)
