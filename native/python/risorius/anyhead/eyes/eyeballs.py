# SPDX-License-Identifier: MIT
"""Measures the distance of an eye's surface, with cornea, from its centre in any direction.

The target is the head to which expressions are transferred.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..._native import ClosestPoints
from ...author.geometry.skeleton import Doubles, Ints

_OUTSIDE = 3.0  # radii: distance from the centre at which rays towards the eye begin


@dataclass(frozen=True)
class Eyeball:
    """An eyeball and its cornea in the rest pose, in the target's unit.

    Attributes:
        side: "L" or "R".
        middle: float64[3], the centre.
        radius: the radius of the white of the eye.
        points: float64[V, 3], vertices of the ball and of the meshes that turn with it.
        triangles: int64[T, 3], indices into `points`.
    """

    side: str
    middle: Doubles
    radius: float
    points: Doubles
    triangles: Ints
    _surface: list[ClosestPoints] = field(default_factory=list, repr=False, compare=False)
    _known: dict[int, tuple[Doubles, Doubles]] = field(
        default_factory=dict, repr=False, compare=False
    )

    def keep(self, directions: Doubles) -> None:
        """Cache the result of `reach` in the rest pose for directions that are used often.

        Args:
            directions: float64[n, 3] of length 1; `reach` recognizes this array object.
        """
        self._known[id(directions)] = (directions, self.reach(directions))

    def reach(self, directions: Doubles, turn: Doubles | None = None) -> Doubles:
        """float64[n]: distance of the eye's surface from the centre; the radius if a ray misses it.

        Args:
            directions: float64[n, 3] of length 1, from the centre.
            turn: float64[3, 3], the eye's rotation from its rest pose; None: not rotated.
        """
        if not self._surface:
            self._surface.append(
                ClosestPoints(self.points, np.ascontiguousarray(self.triangles, np.int32))
            )
        known = self._known.get(id(directions)) if turn is None else None
        if known is not None and known[0] is directions:
            return known[1]
        rays = directions if turn is None else directions @ turn
        outside = _OUTSIDE * self.radius
        triangle, _, distance = self._surface[0].first_hit(self.middle + outside * rays, -rays)
        missed = (np.asarray(triangle) < 0) | (np.asarray(distance) > outside)
        return np.where(missed, self.radius, outside - np.asarray(distance))
