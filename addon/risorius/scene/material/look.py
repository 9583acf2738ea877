# SPDX-License-Identifier: GPL-3.0-or-later
"""Defines Look, the inputs from which one material is built: sizes, areas of skin, textures.

The role of a texture is its purpose in the material, such as "color" or "normal". A wrinkle map is
a texture of wrinkled skin, which an animated map fades in.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np
from numpy.typing import NDArray

from ...logic.material import animated_maps, texture_search
from ..base.blender_types import ArmatureObject
from . import image_loading


@dataclass
class Look:
    """The inputs from which one material is built.

    Attributes:
        kind: kind of the mesh: skin, eyes, teeth, tongue, lashes, hair, wet, gum or cloth.
        base: mesh name without LOD.
        rig: the deforming armature of the character, whose animated maps the material reads.
        extent: float64[3] size of the mesh in Blender units.
        unit: distance between the eyes in Blender units; patterns scale with it.
        vertices: number of vertices of the finest mesh.
        has_uvs: whether the mesh has a UV map.
        simple: True leaves out subsurface scattering, relief and animated maps.
        cornea: whether the face has a mesh of corneas over its eyes.
        uses: effects of the animated maps of the face.
        areas: skin areas of a face, such as the forehead, that this mesh has.
        border: whether the mesh has an open border away from the face, such as at the neck.
        found: textures found for the face.
        images: loader of images.
        atlas: image of square tiles with the wrinkle masks of all regions; None without masks.
        places: region -> column and row of its tile, colour channel, number of tiles in a row.
        offsets: role -> whether that wrinkle map stores differences; filled when needed.
    """

    kind: str
    base: str
    rig: ArmatureObject
    extent: NDArray[np.float64]
    unit: float
    vertices: int
    has_uvs: bool
    simple: bool
    uses: list[animated_maps.MapUse]
    areas: set[str]
    found: texture_search.TexturePlan
    images: image_loading.Images
    cornea: bool = False
    border: bool = False
    atlas: bpy.types.Image | None = None
    places: dict[str, tuple[int, int, int, int]] = field(default_factory=dict)
    offsets: dict[str, bool] = field(default_factory=dict)

    def image(self, role: str, data: bool = False) -> bpy.types.Image | None:
        """The image that the mesh uses for a role, or None.

        Args:
            role: purpose of a texture, such as "color", "cavity" or "normal:2" (the normals of
                wrinkle set 2); texture_search.TexturePlan lists all roles.
            data: whether the pixels are numbers instead of colours.
        """
        return self.images.load(self.found.of(self.base, role), data)

    def small(self, role: str) -> NDArray[np.float32] | None:
        """float32[TILE, TILE, 4]: the pixels of a role's image, scaled, without colour management;
        None if there is no readable image."""
        path = self.found.of(self.base, role)
        return None if path is None else self.images.small(path)

    def is_offset(self, role: str) -> bool:
        """Whether the wrinkle map of this role stores differences around 0.5."""
        if role not in self.offsets:
            self.offsets[role] = image_loading.offsets_in(self.found.of(self.base, role))
        return self.offsets[role]
