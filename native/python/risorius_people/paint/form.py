# SPDX-License-Identifier: MIT
"""The form that a divided mesh rounds off: beside a nostril, at a lip's rim, under an eye.

How far a vertex stands out of the mean of its neighbourhood, or lies below it, is form that the
mesh has and shows too softly. The skin's relief has it once more, an unsharp mask of the surface,
and its hollows take colour.
"""

from __future__ import annotations

import numpy as np
from risorius.author.geometry.polygon_mesh import vertex_normals

from ..polygons import Floats, Ints, Polygons, edges_of
from ..wrinkles import blurred
from . import regions
from .images import smooth
from .raster import filled
from .skin import Texels

# Rounds of neighbours over which a mean is taken, and the share of what stands out of it that the
# relief has: what is some three millimetres wide, and some eight.
_SCALES = ((6, 1.4), (30, 0.42))
_MOST = 0.016  # decimetres: more would be the head's own form and not its skin's
_SOFT = 5.0  # texels of HEAD_SIZE over which the mesh's edges are evened out
_HOLLOW = 0.006  # decimetres at which a hollow has all of its colour
_AGES = ((8, 25), (0.5, 1.0))  # years, and how much of it: a child's face is round


def stressed(polygons: Polygons, places: Floats) -> Floats:
    """float64[V]: how far each vertex stands out of those about it; negative: lies below them.

    Args:
        polygons: the mesh.
        places: float64[V, 3] of its vertices, decimetres.

    Returns:
        Decimetres, each scale's share of it, at most _MOST.
    """
    edges = np.array(list(edges_of(polygons.faces)))
    about = np.maximum(np.bincount(edges.ravel(), minlength=len(places)), 1)[:, None]
    normals = vertex_normals(places, polygons.faces)
    out = np.zeros(len(places))
    mean, done = places, 0
    for rounds, share in _SCALES:
        for _ in range(rounds - done):
            mean = (mean + _neighbours(edges, mean) / about) / 2
        done = rounds
        out += share * np.einsum("vi,vi->v", places - mean, normals)
    return np.asarray(_MOST * np.tanh(out / _MOST))


def _neighbours(edges: Ints, values: Floats) -> Floats:
    """float64[V, k]: the sum over each vertex's neighbours."""
    columns = [
        sum(np.bincount(a, column[b], len(column)) for a, b in (edges.T, edges.T[::-1]))
        for column in values.T
    ]
    return np.column_stack(columns)


def form(polygons: Polygons, places: Floats, face: regions.Face, texels: Texels) -> Floats:
    """float32[n]: heights of the face's form at the texels, decimetres.

    Not where lips or lids meet, whose rims are one with the surface behind them, and not on
    ears, scalp and neck.

    Args:
        polygons: of the head.
        places: float64[V, 3] of the person's own vertices, decimetres.
        face: the vertices on the man, by whom places of the face are known.
        texels: of the texture.
    """
    there = smooth(-1.25, -1.05, face.y) * smooth(0.6, 0.3, face.y) * smooth(-0.45, -0.1, face.z)
    there = there * smooth(1.5, 4.0, face.mouth) * smooth(1.5, 4.5, face.eyes)
    raster = texels.raster
    heights = raster.values((stressed(polygons, places) * there)[:, None])[:, 0]
    image = filled(raster.spread(heights), raster.covered)
    return np.asarray(blurred(image, _SOFT * texels.scale).ravel()[raster.where], np.float32)


def share_at(age: int) -> float:
    """How much of a face's form shows at an age in years, up to 1."""
    return float(np.interp(age, *_AGES))


def hollows(form: Floats) -> Floats:
    """float32[n], 0 to 1: how deep in a hollow of the form a texel lies.

    Args:
        form: float32[n], decimetres.
    """
    return np.clip(-form / _HOLLOW, 0, 1)
