# SPDX-License-Identifier: MIT
"""Scales the motion of lids so that they meet on another head.

The deformation gradient of a lid does not contain the height of the eye opening. If two points of
the template's lids meet in a blink, the same points must meet on the head. So motions near these
points are multiplied by the factor that closes the gap.
"""

from __future__ import annotations

import numpy as np

from ...author.geometry.skeleton import Doubles, Ints
from ..surface import Surface
from .template import TemplateFace

BLINKS = ("eyeBlinkL", "eyeBlinkR")
_MOVES = 0.02  # cm: a vertex that a blink moves less does not belong to a lid
_MEETS, _APART = 0.1, 0.35  # cm: largest distance in contact, and least distance in the rest pose
_AROUND = 0.3  # cm: standard deviation of the fall-off around contacts
_REST = 0.02  # of the largest sum of weights: with a smaller sum the factor tends to 1
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
    face: TemplateFace, points: Doubles, control: str, carried: Doubles
) -> Doubles | None:
    """float64[V, 1]: factor of a blink's motion at each vertex; None if no lids meet.

    Args:
        face: the template.
        points: float64[V, 3], positions of its vertices on the other head.
        control: name of the blink's control.
        carried: float64[V, 3], the blink on the other head before this correction.
    """
    surface, way = face.surface, face.ways[(control,)].astype(np.float64)
    one, other = lids_that_meet(surface, way)
    if not len(one):
        return None
    posed = surface.points + way
    left = (posed[one] - posed[other]) - (points[one] - points[other])
    closes = carried[one] - carried[other]
    amount = np.einsum("ni,ni->n", closes, closes)
    wanted = np.einsum("ni,ni->n", closes, left) / np.maximum(amount, 1e-9)
    wanted = np.clip(wanted, *_SHARES) - 1.0
    moved = np.flatnonzero(way.any(axis=1))
    says, sums = np.zeros(len(moved)), np.zeros(len(moved))
    for start in range(0, len(moved), _ROWS):
        rows = slice(start, start + _ROWS)
        square = _squares(surface.points[moved[rows]], surface.points[one])
        weight = np.exp(-square / (2 * _AROUND**2)) * amount
        says[rows], sums[rows] = weight.sum(axis=1), weight @ wanted
    out = np.ones((len(points), 1))
    out[moved, 0] += sums / (says + max(_REST * float(says.max()), 1e-12))
    return out


def _squares(one: Doubles, other: Doubles) -> Doubles:
    """float64[n, m]: squares of the distances between points."""
    middle = other.mean(axis=0)  # numbers near 0 lose less precision
    a, b = one - middle, other - middle
    square = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * a @ b.T
    return np.asarray(np.maximum(square, 0.0))
