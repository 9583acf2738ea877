# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the pivot and distance from which a 3D view shows all given points."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

Box = tuple[float, float, float, float]  # left, bottom, right, top

_HALF = 36.0  # mm, half the sensor width (72 mm) of the viewport; a render camera has 36 mm
_MARGIN = 1.25
_FILLED = 0.98  # share of the free part of a region that the points fill
_HALVINGS, _SHIFTS = 30, 3
_NEAR_ENOUGH = 1.8  # a view whose distance is wrong by a smaller factor does not move


def distance(radius: float, lens: float, size: Sequence[float], perspective: bool) -> float:
    """The distance from the centre of a ball at which a view shows the ball with a margin of 25 %.

    Args:
        radius: radius of the ball, in Blender units.
        lens: focal length of the view, in mm.
        size: width and height of the view's region, in pixels.
        perspective: True: perspective view; False: orthographic view.
    """
    longer, shorter = max(*size, 1.0), max(min(size), 1.0)
    # Half of the extent that is visible along the region's shorter side, per unit of distance.
    slope = _HALF / lens * shorter / longer
    share = math.sin(math.atan(slope)) if perspective else slope
    return _MARGIN * radius / max(share, 1e-6)


def on_screen(
    points: ArrayLike, far: float, lens: float, size: Sequence[float], perspective: bool
) -> NDArray[np.float64]:
    """Project points to a view's region.

    Args:
        points: float[N, 3] relative to the view's pivot: right, up, towards the viewer.
        far: distance of the viewer from the pivot, in Blender units.
        lens: focal length of the view, in mm.
        size: width and height of the view's region, in pixels.
        perspective: True: perspective view; False: orthographic view.

    Returns:
        float64[N, 2], pixels right of and above the region's centre; NaN for points behind the
        viewer.
    """
    places = np.asarray(points, np.float64)
    away = far - places[:, 2] if perspective else np.full(len(places), far)
    away = np.where(away > 0.0, away, np.nan)
    return places[:, :2] / away[:, None] * (lens / _HALF * max(*size, 1.0) / 2)


def fit(
    points: ArrayLike, lens: float, size: Sequence[float], free: Box, perspective: bool
) -> tuple[float, float, float]:
    """Fit a view so that points appear as large as possible in the free part of its region.

    Args:
        points: float[N, 3] in the view's axes: right, up, towards the viewer.
        lens: focal length of the view, in mm.
        size: width and height of the view's region, in pixels.
        free: the uncovered part of the region, in pixels from its lower left corner.
        perspective: True: perspective view; False: orthographic view.

    Returns:
        Coordinates of the pivot along the view's right and up axes, and the viewer's distance from
        the pivot, in the unit of `points`.
    """
    places = np.asarray(points, np.float64)
    room = np.array([free[2] - free[0], free[3] - free[1]]) * _FILLED
    aside = np.array([free[0] + free[2] - size[0], free[1] + free[3] - size[1]]) / 2
    middle = (places.min(axis=0) + places.max(axis=0))[:2] / 2
    span = max(float(np.ptp(places, axis=0).max()), 1e-9)
    near, far = 0.0, distance(span, lens, size, perspective) * max(size) / max(room.min(), 1.0)
    for _halving in range(_HALVINGS):
        tried = (near + far) / 2
        for _time in range(_SHIFTS):  # near points shift more, so one step is not exact
            off = _middle(places - (*middle, 0.0), tried, lens, size, perspective) - aside
            middle = middle + np.nan_to_num(off) * tried / (lens / _HALF * max(size) / 2)
        seen = on_screen(places - (*middle, 0.0), tried, lens, size, perspective)
        fits = bool((np.ptp(seen, axis=0) <= room).all())  # False if a point is behind the viewer
        near, far = (near, tried) if fits else (tried, far)
    return float(middle[0]), float(middle[1]), far


def _middle(
    points: NDArray[np.float64], far: float, lens: float, size: Sequence[float], perspective: bool
) -> NDArray[np.float64]:
    """float64[2]: the centre of the points' bounding rectangle in the region, in pixels."""
    seen = on_screen(points, far, lens, size, perspective)
    return (seen.min(axis=0) + seen.max(axis=0)) / 2


def is_well_in_view(
    middle: Sequence[float], radius: float, wanted: float, held: Sequence[float], far: float
) -> bool:
    """Whether a view already shows a ball well, so that it need not move.

    The distance may differ from `wanted` by at most a factor of 1.8, and the pivot may be at most
    half a radius from the ball's centre.

    Args:
        middle, radius: centre and radius of the ball, in Blender units.
        wanted: distance at which the view shows the whole ball, from `distance`.
        held: current pivot of the view.
        far: current distance of the viewer from the pivot.
    """
    near = wanted / _NEAR_ENOUGH < far < wanted * _NEAR_ENOUGH
    return near and math.dist(middle, held) < radius / 2.0
