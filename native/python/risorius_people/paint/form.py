# SPDX-License-Identifier: MIT
"""Computes the fine form of a face for the skin's relief: beside nostrils, at lips, under eyes.

Form is the height of a vertex above or below the mean of its neighbourhood. The mesh shows it too
softly, so the skin's relief adds it once more, like an unsharp mask. Hollows of the form also get
colour.
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

# (smoothing rounds of the mean, fraction of the form that the relief adds): for forms about 3 mm
# and about 8 mm wide.
_SCALES = ((6, 1.4), (30, 0.42))
_MOST = 0.016  # decimetres: larger form is of the head and not of its skin
_SOFT = 5.0  # texels at HEAD_SIZE over which the edges of the mesh are blurred
_HOLLOW = 0.006  # decimetres: depth at which a hollow has its full colour
# (ages in years), (factor on the form at these ages). The factor is smaller for children, because
# their faces are round.
_AGES = ((8, 25), (0.5, 1.0))


def stressed(polygons: Polygons, places: Floats) -> Floats:
    """float64[V]: height of each vertex above its neighbourhood in decimetres; negative below.

    Args:
        polygons: polygons of the head.
        places: float64[V, 3], positions of its vertices in decimetres.

    Returns:
        The sum of the heights at each of _SCALES, weighted by its fraction, limited to _MOST.
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
    """float64[V, k]: for each vertex, the sum of `values` over its neighbours."""
    columns = [
        sum(np.bincount(a, column[b], len(column)) for a, b in (edges.T, edges.T[::-1]))
        for column in values.T
    ]
    return np.column_stack(columns)


def form(polygons: Polygons, places: Floats, face: regions.Face, texels: Texels) -> Floats:
    """float32[n]: heights of the face's form at the texels, in decimetres.

    The heights are 0 where lips or lids meet, because there the neighbourhood includes the surface
    behind the rim, and on ears, scalp and neck.

    Args:
        polygons: polygons of the head.
        places: float64[V, 3], positions of the person's vertices in decimetres.
        face: vertices on the man's head, which locate the parts of the face.
        texels: texels of the texture.
    """
    there = smooth(-1.25, -1.05, face.y) * smooth(0.6, 0.3, face.y) * smooth(-0.45, -0.1, face.z)
    there = there * smooth(1.5, 4.0, face.mouth) * smooth(1.5, 4.5, face.eyes)
    raster = texels.raster
    heights = raster.values((stressed(polygons, places) * there)[:, None])[:, 0]
    image = filled(raster.spread(heights), raster.covered)
    return np.asarray(blurred(image, _SOFT * texels.scale).ravel()[raster.where], np.float32)


def share_at(age: int) -> float:
    """Factor on a face's form at an age in years, at most 1."""
    return float(np.interp(age, *_AGES))


def hollows(form: Floats) -> Floats:
    """float32[n], 0 to 1: depth of each texel in a hollow of the form.

    Args:
        form: float32[n], heights from `form` in decimetres.
    """
    return np.clip(-form / _HOLLOW, 0, 1)
