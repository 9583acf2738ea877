# SPDX-License-Identifier: GPL-3.0-or-later
"""UV layouts for baking a mesh: its UV map stretched over the unit square, or a cell per face."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Totals = NDArray[np.int32] | NDArray[np.int64]

_FULL = 0.5  # a layout whose bounds cover at least this share of the square stays unchanged
_RIM = 0.08  # share of a cell's size, empty on each side, so that no neighbour's colour shows


def spread(points: Float32) -> Float32 | None:
    """Stretch a UV layout over the unit square, unless it already fits.

    A layout fits if it is inside the square and its bounding rectangle covers at least half of the
    square.

    Args:
        points: float[N, 2], UV coordinates of all face corners of one texture.

    Returns:
        float32[N, 2], or None if the layout already fits the square.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    size = np.maximum(high - low, 1e-9)
    inside = bool((low >= -1e-4).all() and (high <= 1 + 1e-4).all())
    if inside and size.prod() >= _FULL:
        return None
    return ((points - low) / size).astype(np.float32)


def overlaps(points: Float32, totals: Totals) -> bool:
    """Whether faces must overlap in UV space.

    They must if the sum of the faces' areas is more than 1.02 times the area of the rectangle
    around all of them.

    Args:
        points: float[N, 2], UV coordinates of the corners, face by face.
        totals: int[F], number of corners of each face.
    """
    if not len(points):
        return False
    totals = np.asarray(totals, np.int64)
    first = np.cumsum(totals) - totals
    following = np.arange(len(points)) + 1
    following[first + totals - 1] = first
    x, y = np.asarray(points, np.float64).T
    twice = np.add.reduceat(x * y[following] - x[following] * y, first)
    area = float(np.abs(twice).sum()) / 2
    return area > 1.02 * float(np.ptp(points, axis=0).astype(np.float64).prod())


def cells(totals: Totals) -> Float32:
    """Make a UV layout for a mesh without one: every face as a regular polygon in its own cell.

    Args:
        totals: int[F], number of corners of each face.

    Returns:
        float32[sum of totals, 2], UV coordinates of all corners, face by face.
    """
    totals = np.asarray(totals, np.int64)
    side = int(np.ceil(np.sqrt(max(len(totals), 1))))
    face = np.repeat(np.arange(len(totals)), totals)
    first = np.repeat(np.cumsum(totals) - totals, totals)
    corner = np.arange(len(face)) - first
    angle = 2 * np.pi * (corner + 0.5) / totals[face]
    # A unit square's corners are sqrt(1/2) from its centre. Other polygons fit into a circle of
    # radius 1/2.
    reach = np.where(totals[face] == 4, np.sqrt(0.5), 0.5) * (1 - 2 * _RIM)
    place = np.stack([face % side, face // side], axis=1) + 0.5
    ray = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return ((place + ray * reach[:, None]) / side).astype(np.float32)
