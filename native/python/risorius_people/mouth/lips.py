# SPDX-License-Identifier: MIT
"""Closes the lips: the data's lips are a millimetre apart, which would look like a black line.

Lengths are in decimetres.
"""

from __future__ import annotations

import itertools

import numpy as np

from ..polygons import Floats, Ints, Polygons, subdivide
from ..source import BaseMesh

PRESSED = 0.0015  # overlap of the lips, because skin in contact is pressed flat
_REACH = 0.035  # distance from the line of the lips over which their displacement fades out
_NEAR = 0.06  # a vertex nearer than this to the other lip belongs to the rim of its lip
_BINS = 24  # number of bins across the mouth


class Mouth:
    """The faces of the mouth, subdivided as in LOD 0, and the vertices of both lips.

    Attributes:
        operator: converts values of the base mesh's vertices to the subdivided faces' vertices.
        upper, lower: int[n], indices of the subdivided vertices of each lip.
    """

    def __init__(self, base: BaseMesh, pucker: Floats, jaw_open: Floats) -> None:
        """Finds the lips by their motion, because their positions are too near to each other.

        Args:
            base: the base mesh.
            pucker: float64[V, 3], displacement of a unit that moves both lips and hardly anything
                else.
            jaw_open: float64[V, 3], displacement of a unit that moves the lower lip.
        """
        strength = np.linalg.norm(pucker, axis=1)
        inside = strength > 0.08 * strength.max()
        faces = [[c[0] for c in face] for face in base.faces["body"]]
        faces = [face for face in faces if inside[face].all()]
        polygons = Polygons(faces, faces, np.zeros((len(base.positions), 2)), len(base.positions))
        _, self.operator = subdivide(polygons)
        used = np.unique(self.operator.rows[self.operator.rows >= len(base.positions)])
        used = np.concatenate([np.unique(np.concatenate(faces)), used])
        strength = self.operator.apply(strength[:, None])[used, 0]
        lips = used[strength > 0.25 * strength.max()]
        travel = np.linalg.norm(self.operator.apply(jaw_open), axis=1)[lips]
        whole = np.quantile(travel, 0.9)
        self.upper, self.lower = lips[travel < 0.35 * whole], lips[travel > 0.6 * whole]


def rims(mouth: Mouth, points: Floats) -> tuple[Ints, Ints]:
    """Vertices of the upper and of the lower lip that are near the other lip.

    Args:
        mouth: the mouth.
        points: float64[v, 3], positions of the mouth's subdivided vertices.
    """
    apart = np.linalg.norm(points[mouth.upper][:, None] - points[mouth.lower][None], axis=2)
    return mouth.upper[apart.min(axis=1) < _NEAR], mouth.lower[apart.min(axis=0) < _NEAR]


def gap_across(mouth: Mouth, points: Floats) -> tuple[Floats, Floats]:
    """Height of the gap between the lips, from one corner of the mouth to the other.

    Args:
        mouth: the mouth.
        points: float64[v, 3], positions of the mouth's subdivided vertices.

    Returns:
        x of places across the mouth, float64[n], and heights of the gap there, float64[n], negative
        if the lips overlap.
    """
    upper, lower = (points[rim] for rim in rims(mouth, points))
    edges = np.linspace(
        max(upper[:, 0].min(), lower[:, 0].min()), min(upper[:, 0].max(), lower[:, 0].max()), _BINS
    )
    places, gaps = [], []
    for low, high in itertools.pairwise(edges):
        above = upper[(upper[:, 0] >= low) & (upper[:, 0] <= high), 1]
        below = lower[(lower[:, 0] >= low) & (lower[:, 0] <= high), 1]
        if len(above) and len(below):
            places.append((low + high) / 2)
            gaps.append(above.min() - below.max())
    return np.array(places), np.array(gaps)


def sealed(mouth: Mouth, positions: Floats) -> Floats:
    """float64[V, 3]: positions with closed lips; each lip moves by half of the gap.

    Args:
        mouth: the mouth of the base mesh.
        positions: float64[V, 3] of a person; not changed.
    """
    out = positions.copy()
    for _ in range(3):
        points = mouth.operator.apply(out)
        places, gaps = gap_across(mouth, points)
        if not len(places):
            return out
        for lip, rim, way in zip(
            (mouth.upper, mouth.lower), rims(mouth, points), (-1, 1), strict=True
        ):
            own = lip[lip < len(positions)]  # the first vertices are vertices of the base mesh
            away = np.linalg.norm(points[own][:, None] - points[rim][None], axis=2).min(axis=1)
            half = np.interp(out[own, 0], places, (gaps + PRESSED) / 2)
            out[own, 1] += way * half * np.exp(-((away / _REACH) ** 2))
    return out
