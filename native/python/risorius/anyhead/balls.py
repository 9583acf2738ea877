# SPDX-License-Identifier: MIT
"""Finds the eyeballs of a head of unknown direction and unit: spheres that occur in pairs."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ..author.geometry.skeleton import Doubles
from ..author.heads.islands import Ball, ball_of, islands_of
from ..author.heads.parts import HeadPart

_LEAST = 12  # smallest number of vertices of a sphere
_MOST = 400  # meshes with more islands, such as hair, are skipped
# An island is no eye if its longest side is at least this fraction of the longest side of the
# bounding box of all meshes.
_LARGE = 0.3
_ALIKE = 0.1  # largest difference of both radii of a pair, as a fraction of the larger radius
_APART = (2.0, 9.0)  # least and largest distance of the centres of a pair, in larger radii


def paired_balls(parts: Sequence[HeadPart]) -> list[Doubles]:
    """float64[3] each: centres of spheres near which a second sphere of similar radius lies.

    Args:
        parts: meshes of a head, of any unit and direction.
    """
    whole = np.concatenate([part.mesh.positions for part in parts])
    longest = float(np.ptp(whole, axis=0).max())
    balls = [ball for part in parts for ball in _balls(part, longest)]
    out: dict[int, Doubles] = {}
    for (i, one), (k, other) in itertools.combinations(enumerate(balls), 2):
        larger = max(one.radius, other.radius)
        apart = float(np.linalg.norm(one.middle - other.middle)) / larger
        if abs(one.radius - other.radius) < _ALIKE * larger and _APART[0] < apart < _APART[1]:
            out[i], out[k] = one.middle, other.middle
    return list(out.values())


def _balls(part: HeadPart, longest: float) -> list[Ball]:
    points, labels = part.mesh.positions, islands_of(part.mesh)
    sizes = np.bincount(labels)
    if len(sizes) > _MOST:
        return []
    order = np.argsort(labels, kind="stable")
    out = []
    for own in np.split(order, np.cumsum(sizes)[:-1]):
        if len(own) >= _LEAST and np.ptp(points[own], axis=0).max() < _LARGE * longest:
            ball = ball_of(points, own)
            if ball is not None:
                out.append(ball)
    return out
