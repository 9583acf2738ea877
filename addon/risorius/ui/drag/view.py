# SPDX-License-Identifier: GPL-3.0-or-later
"""The 3D view under the cursor, which converts between pixels and places in the world."""

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
    """A region of a 3D view or one of the four regions of a quad view.

    An object is valid only while one operator runs, because Blender may delete the region later.
    """

    area: bpy.types.Area
    region: bpy.types.Region
    data: bpy.types.RegionView3D

    def mouse(self, event: bpy.types.Event) -> Vector:
        """The place of the cursor: pixels from the region's lower left corner."""
        return Vector((event.mouse_x - self.region.x, event.mouse_y - self.region.y))

    def ray(self, at: Vector) -> tuple[Vector, Vector]:
        """Origin and unit direction in world space of the ray from the viewer through a pixel.

        Args:
            at: the pixel, from the region's lower left corner.
        """
        pixel = (at.x, at.y)
        direction = view3d_utils.region_2d_to_vector_3d(self.region, self.data, pixel)
        return view3d_utils.region_2d_to_origin_3d(self.region, self.data, pixel), direction

    def pixel(self, place: Float) -> Vector | None:
        """The pixel at which a place is seen; None if the place is behind the viewer.

        Args:
            place: float64[3] in world space.
        """
        return view3d_utils.location_3d_to_region_2d(self.region, self.data, Vector(place.tolist()))

    def target(self, at: Vector, depth: Float) -> Float:
        """The place in world space under a pixel, float64[3].

        Args:
            at: the pixel, from the region's lower left corner.
            depth: float64[3], a place in world space at the wanted distance from the viewer.
        """
        near = Vector(depth.tolist())
        return np.array(view3d_utils.region_2d_to_location_3d(self.region, self.data, at, near))


def under(context: Context, event: bpy.types.Event) -> View | None:
    """The view under the cursor; None over panels, headers and other editors.

    Args:
        context: context with the screen.
        event: event with the place of the cursor.
    """
    for area in context.screen.areas if context.screen is not None else ():
        if area.type != "VIEW_3D":
            continue
        held = [r for r in area.regions if _is_in(r, event)]
        # Sidebars overlap the view, so a cursor over a sidebar is in two regions.
        if held and all(r.type == "WINDOW" for r in held):
            data = held[0].data
            if isinstance(data, bpy.types.RegionView3D):
                return View(area, held[0], data)
    return None


def _is_in(region: bpy.types.Region, event: bpy.types.Event) -> bool:
    across, up = event.mouse_x - region.x, event.mouse_y - region.y
    return 0 <= across < region.width and 0 <= up < region.height
