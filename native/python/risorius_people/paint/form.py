# SPDX-License-Identifier: MIT
"""Fine form of the face that the mesh shows too softly: beside a nostril, at a lip's rim, under an
eye.

A vertex that stands out of the mean of its neighbourhood, or lies below it, is form. The mesh shows
it too softly, so the skin's relief adds it once more: an unsharp mask of the surface. Hollows of
the form also get colour.
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

# Smoothing rounds of each mean, and the share of the form that the relief adds: forms about 3 mm
# wide, and about 8 mm wide.
_SCALES = ((6, 1.4), (30, 0.42))
_MOST = 0.016  # decimetres: larger form belongs to the head, not to its skin
_SOFT = 5.0  # texels of HEAD_SIZE over which the mesh's edges are blurred
_HOLLOW = 0.006  # decimetres: depth of a hollow with full colour
# Years, and the share of the form at that age: a child's face is round.
_AGES = ((8, 25), (0.5, 1.0))


def stressed(polygons: Polygons, places: Floats) -> Floats:
    """Height of each vertex above its neighbourhood, float64[V]; negative: below it.

    Args:
        polygons: the mesh.
        places: float64[V, 3] of its vertices, decimetres.

    Returns:
        Decimetres: the weighted sum over the scales, at most _MOST.
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
    """The sum over the neighbours of each vertex, float64[V, k]."""
    columns = [
        sum(np.bincount(a, column[b], len(column)) for a, b in (edges.T, edges.T[::-1]))
        for column in values.T
    ]
    return np.column_stack(columns)


def form(polygons: Polygons, places: Floats, face: regions.Face, texels: Texels) -> Floats:
    """Heights of the face's form at the texels, float32[n], decimetres.

    Zero where lips or lids meet, because their rims are one with the surface behind them, and on
    ears, scalp and neck.

    Args:
        polygons: polygons of the head.
        places: float64[V, 3] of the person's own vertices, decimetres.
        face: the vertices on the man, which give the places of the face.
        texels: texels of the texture.
    """
    there = smooth(-1.25, -1.05, face.y) * smooth(0.6, 0.3, face.y) * smooth(-0.45, -0.1, face.z)
    there = there * smooth(1.5, 4.0, face.mouth) * smooth(1.5, 4.5, face.eyes)
    raster = texels.raster
    heights = raster.values((stressed(polygons, places) * there)[:, None])[:, 0]
    image = filled(raster.spread(heights), raster.covered)
    return np.asarray(blurred(image, _SOFT * texels.scale).ravel()[raster.where], np.float32)


def share_at(age: int) -> float:
    """The share of a face's form at an age in years, up to 1."""
    return float(np.interp(age, *_AGES))


def hollows(form: Floats) -> Floats:
    """Depth of each texel in a hollow of the form, float32[n], 0 to 1.

    Args:
        form: float32[n], decimetres.
    """
    return np.clip(-form / _HOLLOW, 0, 1)
