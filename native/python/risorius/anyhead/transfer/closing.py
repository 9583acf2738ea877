# SPDX-License-Identifier: MIT
"""Scales and shifts the motion of lids so that they meet on another head.

The deformation gradient of a lid does not contain the height of the eye opening. If two points of
the template's lids meet in a blink, the same points must meet on the head. So motions near these
points are multiplied by the factor that closes the gap along the motion. A displacement is added to
close the gap that remains.
"""

from __future__ import annotations

import numpy as np

from ...author.geometry.skeleton import Doubles, Ints
from ..surface import Surface
from .template import TemplateFace

BLINKS = ("eyeBlinkL", "eyeBlinkR")
_MOVES = 0.02  # cm: a vertex that a blink moves less does not belong to a lid
_MEETS, _APART = 0.1, 0.35  # cm: largest distance in contact, and least distance in the rest pose
# cm: standard deviation of the Gaussian by which the factor (_AROUND) and the shift (_BESIDE) fade
# out with the distance from contacts of the lids.
_AROUND, _BESIDE = 0.3, 0.15
# Fraction of the largest sum of the contacts' weights at a vertex. At vertices with a smaller sum,
# the factor tends to 1 and the shift to 0.
_REST = 0.02
_SHARES = (0.3, 2.0)  # smallest and largest factor
_ROWS = 256  # number of vertices that are compared at once


def lids_that_meet(surface: Surface, way: Doubles) -> tuple[Ints, Ints]:
    """Pairs of vertices, int64[n] each, that are apart in the rest pose and meet after a motion.

    Args:
        surface: the skin in the rest pose.
        way: float64[V, 3], the motion.
    """
    able = np.flatnonzero(np.linalg.norm(way, axis=1) > _MOVES)
    rest, there = surface.points[able], (surface.points + way)[able]
    first, second = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
    for start in range(0, len(able), _ROWS):
        rows = slice(start, start + _ROWS)
        away = _squares(there[rows], there)
        away[_squares(rest[rows], rest) < _APART**2] = np.inf
        near = away.argmin(axis=1)
        meets = away[np.arange(len(near)), near] < _MEETS**2
        first.append(able[rows][meets])
        second.append(able[near[meets]])
    return np.concatenate(first), np.concatenate(second)


def closing_shares(
    face: TemplateFace, points: Doubles, control: str, carried: Doubles, pairs: tuple[Ints, Ints]
) -> Doubles:
    """float64[V, 1]: factor of a blink's motion at each vertex.

    Args:
        face: the template.
        points: float64[V, 3], positions of its vertices on the other head.
        control: name of the blink's control.
        carried: float64[V, 3], the blink on the other head before this correction.
        pairs: the result of lids_that_meet for this blink of the template, with at least one pair.
    """
    surface, way = face.surface, face.ways[(control,)].astype(np.float64)
    one, other = pairs
    posed = surface.points + way
    left = (posed[one] - posed[other]) - (points[one] - points[other])
    closes = carried[one] - carried[other]
    amount = np.einsum("ni,ni->n", closes, closes)
    wanted = np.einsum("ni,ni->n", closes, left) / np.maximum(amount, 1e-9)
    wanted = np.clip(wanted, *_SHARES) - 1.0
    out = np.ones((len(points), 1))
    moved = np.flatnonzero(way.any(axis=1))
    out[moved] += _around(surface.points, moved, one, wanted[:, None], amount, _AROUND)
    return out


def closing_shift(
    face: TemplateFace, points: Doubles, control: str, carried: Doubles, pairs: tuple[Ints, Ints]
) -> Doubles:
    """float64[V, 3]: displacement to add to a blink, so that lids that meet on the template meet.

    Of two points that meet, the point that moves farther gets the larger part of the displacement.

    Args:
        face: the template.
        points: float64[V, 3], positions of its vertices on the other head.
        control: name of the blink's control.
        carried: float64[V, 3], the blink on the other head before this correction.
        pairs: the result of lids_that_meet for this blink of the template, with at least one pair.
    """
    surface, way = face.surface, face.ways[(control,)].astype(np.float64)
    one, other = pairs
    out = np.zeros_like(points)
    posed, there = surface.points + way, points + carried
    left = (posed[one] - posed[other]) - (there[one] - there[other])
    far = [np.square(carried[pair]).sum(axis=1) for pair in (one, other)]
    share = (far[0] / np.maximum(far[0] + far[1], 1e-9))[:, None]
    at, shift = np.concatenate([one, other]), np.concatenate([share * left, (share - 1) * left])
    moved = np.flatnonzero(way.any(axis=1))
    out[moved] = _around(surface.points, moved, at, shift, np.ones(len(at)), _BESIDE)
    return out


def _around(
    points: Doubles, wanted: Ints, given: Ints, values: Doubles, weights: Doubles, reach: float
) -> Doubles:
    """float64[n, k]: means of the values near `wanted`, which tend to 0 far from all values.

    Args:
        points: float64[V, 3].
        wanted: int64[n], indices of points.
        given: int64[m], indices of the points that have values.
        values: float64[m, k].
        weights: float64[m], weights of the values.
        reach: standard deviation of the fall-off with the distance.
    """
    out, sums = np.zeros((len(wanted), values.shape[1])), np.zeros((len(wanted), 1))
    for start in range(0, len(wanted), _ROWS):
        rows = slice(start, start + _ROWS)
        square = _squares(points[wanted[rows]], points[given])
        near = np.exp(-square / (2 * reach**2)) * weights
        out[rows], sums[rows] = near @ values, near.sum(axis=1, keepdims=True)
    return np.asarray(out / (sums + max(_REST * float(sums.max(initial=0.0)), 1e-12)))


def _squares(one: Doubles, other: Doubles) -> Doubles:
    """float64[n, m]: the squared distance of each of n points `one` from each of m points
    `other`."""
    middle = other.mean(axis=0)  # numbers near 0 lose less precision
    a, b = one - middle, other - middle
    square = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * a @ b.T
    return np.asarray(np.maximum(square, 0.0))
