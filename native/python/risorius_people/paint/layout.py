# SPDX-License-Identifier: MIT
"""Lays out the texture of a head so that the face gets most of the texture.

The base mesh's own layout is of a whole body: the head gets a tenth, and its back as many texels as
the face. In this layout the island of the face fills the upper part, upright and enlarged in the
middle. Mouth, eye sockets and neck share a strip below it.
"""

from __future__ import annotations

import numpy as np

from ..polygons import Floats, Ints, Polygons

STRIP = 0.22  # fraction of the texture's height for all islands except the face
_MARGIN = 0.006  # margin around each island, as a fraction of the texture's side
# (middle, reach, density) of the enlarged area in the middle of the face island, across (_ACROSS)
# and down (_DOWN). Middle and reach are fractions of the island's width or height; density is the
# number of texels per length in the middle of this area relative to the island's rim.
_ACROSS = (0.5, 0.19, 2.0)
_DOWN = (0.63, 0.25, 1.45)


def islands(polygons: Polygons) -> Ints:
    """int[T]: number of each texture coordinate's island; island 0 has the most coordinates.

    Args:
        polygons: mesh with texture coordinates.
    """
    owner = list(range(len(polygons.uvs)))

    def root(one: int) -> int:
        while owner[one] != one:
            owner[one] = owner[owner[one]]
            one = owner[one]
        return one

    for face in polygons.uv_faces:
        for other in face[1:]:
            owner[root(other)] = root(face[0])
    roots = np.array([root(one) for one in range(len(owner))])
    _, label, count = np.unique(roots, return_inverse=True, return_counts=True)
    order = np.argsort(-count, kind="stable")
    rank = np.empty(len(order), int)
    rank[order] = np.arange(len(order))
    return np.asarray(rank[label])


def packed(polygons: Polygons) -> Floats:
    """float64[T, 2] in [0, 1]: texture coordinates of a head in this layout.

    Args:
        polygons: head in the base mesh's layout, in which the face is rotated by 90°.
    """
    label = islands(polygons)
    upright = np.column_stack([polygons.uvs[:, 1], -polygons.uvs[:, 0]])
    out = np.zeros_like(upright)
    face = label == 0
    whole = _unit(upright[face])
    place = np.column_stack([_spread(whole[:, 0], *_ACROSS), 1 - _spread(1 - whole[:, 1], *_DOWN)])
    out[face] = _into(place, (0.0, STRIP), (1.0, 1.0))
    rest = [label == k for k in range(1, int(label.max(initial=0)) + 1)]
    widths = [float(np.sqrt(np.prod(np.ptp(upright[one], axis=0)))) for one in rest]
    left = 0.0
    for one, width in zip(rest, widths, strict=True):
        right = left + width / sum(widths)
        out[one] = _fitted(upright[one], (left, 0.0), (right, STRIP))
        left = right
    return out


def _unit(places: Floats) -> Floats:
    """Shifts and scales coordinates so that they fill [0, 1] in both directions."""
    low = places.min(axis=0)
    return np.asarray((places - low) / np.maximum(np.ptp(places, axis=0), 1e-12))


def _spread(at: Floats, middle: float, reach: float, more: float) -> Floats:
    """Maps [0, 1] onto itself; places near `middle` are stretched `more` times as much as the ends.

    `reach` is the distance from `middle` at which the additional stretch has fallen to a third."""
    steps = np.linspace(0, 1, 513)
    density = 1 + (more - 1) * np.exp(-(((steps - middle) / reach) ** 4))
    total = np.concatenate([[0], np.cumsum((density[1:] + density[:-1]) / 2)])
    return np.interp(at, steps, total / total[-1])


def _into(places: Floats, low: tuple[float, float], high: tuple[float, float]) -> Floats:
    """Maps coordinates from [0, 1] to a cell of the texture, except the cell's margin.

    Args:
        places: float64[n, 2] in [0, 1].
        low, high: lower left and upper right corner of the cell.
    """
    a, b = np.array(low) + _MARGIN, np.array(high) - _MARGIN
    return np.asarray(a + places * (b - a))


def _fitted(places: Floats, low: tuple[float, float], high: tuple[float, float]) -> Floats:
    """Scales coordinates until they fill a cell, rotated by 90° if they become larger that way.

    Args:
        places: float64[n, 2], coordinates in any range.
        low, high: lower left and upper right corner of the cell.
    """
    room = np.array(high) - np.array(low) - 2 * _MARGIN

    def scale(size: Floats) -> float:
        return float((room / np.maximum(size, 1e-12)).min())

    size = np.ptp(places, axis=0)
    if scale(size[::-1]) > scale(size):
        places = np.column_stack([places[:, 1], -places[:, 0]])
        size = size[::-1]
    centre = (places.min(axis=0) + places.max(axis=0)) / 2
    return np.asarray((places - centre) * scale(size) + (np.array(low) + np.array(high)) / 2)
