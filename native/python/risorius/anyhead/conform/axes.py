# SPDX-License-Identifier: MIT
"""Converts a face from the axes and unit of its file to the space x left, y up, z front, in cm."""

from __future__ import annotations

import numpy as np

from ... import Dna
from ...author.geometry.skeleton import Doubles
from ...author.heads.sizes import UNITS
from ..surface import Surface
from .change import surface_of

_DIRECTIONS = {
    "right": (1, 0, 0),
    "left": (-1, 0, 0),
    "up": (0, 1, 0),
    "down": (0, -1, 0),
    "front": (0, 0, 1),
    "back": (0, 0, -1),
}


def standing_axes(dna: Dna) -> Doubles:
    """float64[3, 3]: the axes of a file in the standing space (x left, y up, z front), as rows.

    Standing positions are `points @ standing_axes(dna)`.

    Args:
        dna: the face.
    """
    return np.array([_DIRECTIONS[name] for name in dna.coordinate_system], np.float64)


def mm_of(dna: Dna) -> float:
    """Millimetres per unit of a file.

    Args:
        dna: the file.
    """
    return UNITS.get(dna.translation_unit, UNITS["cm"])


def standing_skin(dna: Dna, skin: int) -> Surface:
    """The skin of a face in the standing space, in cm, with triangles that face outward.

    Triangles that face inward, as in left-handed files, are reversed.

    Args:
        dna: the face.
        skin: the index of the skin mesh.
    """
    size = mm_of(dna) / UNITS["cm"]
    points = np.asarray(dna.meshes[skin].positions, np.float64)
    surface = surface_of(dna.meshes[skin], size * points @ standing_axes(dna))
    middle = surface.points.mean(axis=0)
    corners = surface.points[surface.triangles[:, 0]] - middle
    if float((corners * surface.face_normals()).sum()) >= 0:
        return surface
    return Surface(surface.points, surface.triangles[:, ::-1])
