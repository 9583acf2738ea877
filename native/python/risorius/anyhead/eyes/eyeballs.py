# SPDX-License-Identifier: MIT
"""An eye as lids meet it: its middle, and how far its surface is from there."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..._native import ClosestPoints
from ...author.geometry.skeleton import Doubles, Ints

_OUTSIDE = 3.0  # of the radius: where a ray begins that ends at the eye's surface


@dataclass(frozen=True)
class Eyeball:
    """A ball and its cornea at rest, in the target's unit.

    Attributes:
        side: "L" or "R".
        middle: float64[3].
        radius: of the white.
        points: float64[V, 3], of the ball and of what turns with it.
        triangles: int64[T, 3].
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
        """Remember how far the resting surface is in directions that are asked for often.

        Args:
            directions: float64[n, 3] of length 1; the same array is asked for later.
        """
        self._known[id(directions)] = (directions, self.reach(directions))

    def reach(self, directions: Doubles, turn: Doubles | None = None) -> Doubles:
        """float64[n], how far the surface is from the middle; the radius where there is none.

        Args:
            directions: float64[n, 3] of length 1, from the middle.
            turn: float64[3, 3], what the eye is turned by; None: it rests.
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
