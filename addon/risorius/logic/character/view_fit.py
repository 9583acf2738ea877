# SPDX-License-Identifier: GPL-3.0-or-later
"""The place of a 3D view that shows something whole."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Box = tuple[float, float, float, float]  # left, bottom, right, top

_HALF = 36.0  # mm, half of what the viewport's camera sees: twice that of a render's camera
_MARGIN = 1.25
_FILLED = 0.98  # of the free part of a region
_HALVINGS, _SHIFTS = 30, 3
_NEAR_ENOUGH = 1.8  # a view that is so many times nearer or farther than wanted is left alone


def distance(radius: float, lens: float, size: Sequence[float], perspective: bool) -> float:
    """The distance of a view from the centre of a ball that shows it whole.

    Args:
        radius: of the ball, in Blender units.
        lens: of the view, in mm.
        size: width and height of its region, in pixels.
        perspective: whether it is a perspective view.
    """
    longer, shorter = max(*size, 1.0), max(min(size), 1.0)
    slope = _HALF / lens * shorter / longer  # half of what the shorter side shows
    share = math.sin(math.atan(slope)) if perspective else slope
    return _MARGIN * radius / max(share, 1e-6)


def on_screen(
    points: ArrayLike, far: float, lens: float, size: Sequence[float], perspective: bool
) -> NDArray[np.float64]:
    """Places of points in pixels from the centre of a view.

    Args:
        points: float[N, 3] relative to the view's pivot: right, up, towards the view.
        far: the view's distance from that point.
        lens: of the view, in mm.
        size: width and height of its region, in pixels.
        perspective: whether it is a perspective view.

    Returns:
        float64[N, 2]; NaN for points behind the view.
    """
    places = np.asarray(points, np.float64)
    away = far - places[:, 2] if perspective else np.full(len(places), far)
    away = np.where(away > 0.0, away, np.nan)
    return places[:, :2] / away[:, None] * (lens / _HALF * max(*size, 1.0) / 2)


def fit(
    points: ArrayLike, lens: float, size: Sequence[float], free: Box, perspective: bool
) -> tuple[float, float, float]:
    """The place of a view that shows points as large as possible in the free part of its region.

    Args:
        points: float[N, 3] in the view's axes: to its right, up, towards it.
        lens: of the view, in mm.
        size: width and height of its region, in pixels.
        free: the uncovered part of the region, in pixels from its lower left corner.
        perspective: whether it is a perspective view.

    Returns:
        Pivot to the right and up, and the distance from it.
    """
    places = np.asarray(points, np.float64)
    room = np.array([free[2] - free[0], free[3] - free[1]]) * _FILLED
    aside = np.array([free[0] + free[2] - size[0], free[1] + free[3] - size[1]]) / 2
    middle = (places.min(axis=0) + places.max(axis=0))[:2] / 2
    span = max(float(np.ptp(places, axis=0).max()), 1e-9)
    near, far = 0.0, distance(span, lens, size, perspective) * max(size) / max(room.min(), 1.0)
    for _halving in range(_HALVINGS):
        tried = (near + far) / 2
        for _time in range(_SHIFTS):  # what is nearer goes further: not exact at once
            off = _middle(places - (*middle, 0.0), tried, lens, size, perspective) - aside
            middle = middle + np.nan_to_num(off) * tried / (lens / _HALF * max(size) / 2)
        seen = on_screen(places - (*middle, 0.0), tried, lens, size, perspective)
        fits = bool((np.ptp(seen, axis=0) <= room).all())  # not where some lie behind the view
        near, far = (near, tried) if fits else (tried, far)
    return float(middle[0]), float(middle[1]), far


def _middle(
    points: NDArray[np.float64], far: float, lens: float, size: Sequence[float], perspective: bool
) -> NDArray[np.float64]:
    """float64[2]: the centre of the result of on_screen."""
    seen = on_screen(points, far, lens, size, perspective)
    return (seen.min(axis=0) + seen.max(axis=0)) / 2


def is_well_in_view(
    middle: Sequence[float], radius: float, wanted: float, held: Sequence[float], far: float
) -> bool:
    """Whether a view already shows a ball well.

    Args:
        middle, radius: of the ball.
        wanted: distance that shows it whole.
        held: pivot of the view.
        far: its distance from that point.
    """
    near = wanted / _NEAR_ENOUGH < far < wanted * _NEAR_ENOUGH
    return near and math.dist(middle, held) < radius / 2.0
