# SPDX-License-Identifier: GPL-3.0-or-later
"""The 3D view under the cursor: rays through it, targets on the screen; every kind of view."""

from dataclasses import dataclass

import bpy
import numpy as np
from bpy_extras import view3d_utils
from mathutils import Vector
from numpy.typing import NDArray

from ..blender_types import Context

Float = NDArray[np.float64]


@dataclass
class View:
    """A region of a 3D view; of a quad view one of four. Lives within one operator."""

    area: bpy.types.Area
    region: bpy.types.Region
    data: bpy.types.RegionView3D

    def mouse(self, event: bpy.types.Event) -> Vector:
        """Where the cursor is: pixels from the region's lower left corner."""
        return Vector((event.mouse_x - self.region.x, event.mouse_y - self.region.y))

    def ray(self, at: Vector) -> tuple[Vector, Vector]:
        """Origin and direction, of length 1, of the ray through a pixel. Args: at  the pixel."""
        pixel = (at.x, at.y)
        direction = view3d_utils.region_2d_to_vector_3d(self.region, self.data, pixel)
        return view3d_utils.region_2d_to_origin_3d(self.region, self.data, pixel), direction

    def pixel(self, place: Float) -> Vector | None:
        """The pixel of a place in the world, or None behind the viewer. Args: place float64[3]"""
        return view3d_utils.location_3d_to_region_2d(self.region, self.data, Vector(place.tolist()))

    def target(self, at: Vector, depth: Float) -> Float:
        """The place of the world under a pixel: float64[3].

        Args:
            at: the pixel.
            depth: float64[3] a place that is as far away.
        """
        near = Vector(depth.tolist())
        return np.array(view3d_utils.region_2d_to_location_3d(self.region, self.data, at, near))


def under(context: Context, event: bpy.types.Event) -> View | None:
    """The view that the cursor is in; None over panels, headers, other editors.

    Args:
        context: has the screen.
        event: has the cursor.
    """
    for area in context.screen.areas if context.screen is not None else ():
        if area.type != "VIEW_3D":
            continue
        held = [r for r in area.regions if _is_in(r, event)]
        # Sidebars lie over the view.
        if held and all(r.type == "WINDOW" for r in held):
            data = held[0].data
            if isinstance(data, bpy.types.RegionView3D):
                return View(area, held[0], data)
    return None


def _is_in(region: bpy.types.Region, event: bpy.types.Event) -> bool:
    across, up = event.mouse_x - region.x, event.mouse_y - region.y
    return 0 <= across < region.width and 0 <= up < region.height
