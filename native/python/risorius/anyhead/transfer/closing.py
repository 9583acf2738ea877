# SPDX-License-Identifier: MIT
"""How far lids go until they meet on another head.

The form of a lid does not contain the height of the opening. Where two places of the template's
lids meet in a blink, the same places of the head shall meet, so motions near them are multiplied
with the share that this takes.
"""

from __future__ import annotations

import numpy as np

from ...author.geometry.skeleton import Doubles, Ints
from ..surface import Surface
from .template import TemplateFace

BLINKS = ("eyeBlinkL", "eyeBlinkR")
_MOVES = 0.02  # cm: a vertex that a blink moves less does not belong to a lid
_MEETS, _APART = 0.1, 0.35  # cm: farthest places that meet, and nearest that are two lids at rest
_AROUND = 0.3  # cm around places that meet, in which motions are multiplied
_REST = 0.02  # of the most that places say together: from there motions stay as they are
_SHARES = (0.3, 2.0)  # least and largest share
_ROWS = 256  # vertices that are looked at together


def lids_that_meet(surface: Surface, way: Doubles) -> tuple[Ints, Ints]:
    """Vertices int64[n] that meet others, int64[n], when a motion is done.

    Args:
        surface: at rest.
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
    """float64[V, 1]: what the motions of a blink are multiplied with; None where no lids meet.

    Args:
        face: the template.
        points: float64[V, 3], its vertices on the other head.
        control: of the blink.
        carried: float64[V, 3], its motion on the other head so far.
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
    middle = other.mean(axis=0)  # of numbers near 0 less is lost
    a, b = one - middle, other - middle
    square = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * a @ b.T
    return np.asarray(np.maximum(square, 0.0))
