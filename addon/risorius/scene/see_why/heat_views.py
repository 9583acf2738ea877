# SPDX-License-Identifier: GPL-3.0-or-later
"""Switches 3D views to vertex colours during a heat map, and restores their settings."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import bpy

from ..base import session

_SETTINGS = ("type", "color_type", "light")
# Pointer of a view -> its settings before the heat map. Views have no names and outlive undo.
_before: dict[int, dict[str, str]] = session.table("heat_views.before", ("unregister",))


def _views() -> Iterator[bpy.types.SpaceView3D]:
    for screen in bpy.data.screens:
        for area in screen.areas:
            for space in area.spaces:
                if space.type == "VIEW_3D":
                    yield cast("bpy.types.SpaceView3D", space)


def show() -> None:
    """Let all 3D views show the active colours of meshes."""
    for view in _views():
        if view.as_pointer() not in _before:
            shading = view.shading
            _before[view.as_pointer()] = {n: getattr(shading, n) for n in _SETTINGS}
            shading.type = "SOLID"
            shading.color_type = "VERTEX"
            shading.light = "STUDIO"
            for area in view.id_data.areas if isinstance(view.id_data, bpy.types.Screen) else ():
                area.tag_redraw()


def give_back() -> None:
    """Restore the settings of all 3D views, except views that the user has changed since."""
    for view in _views():
        before = _before.pop(view.as_pointer(), None)
        shading: Any = view.shading
        if before is None or (shading.type, shading.color_type) != ("SOLID", "VERTEX"):
            continue
        # Light and colour type belong to the solid view, so they are set before the view type.
        shading.light, shading.color_type = before["light"], before["color_type"]
        shading.type = before["type"]
    _before.clear()


def are_shown() -> bool:
    """Whether 3D views are switched to the colours of a heat map."""
    return bool(_before)
