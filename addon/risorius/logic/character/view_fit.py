# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a 3D view has to be to show something whole."""

from __future__ import annotations

import math
from collections.abc import Sequence

_HALF = 36.0  # mm, half of what the viewport's camera sees: twice that of a render's camera
_MARGIN = 1.25
_NEAR_ENOUGH = 1.8  # a view that is so many times nearer or farther than wanted is left alone


def distance(radius: float, lens: float, size: Sequence[float], perspective: bool) -> float:
    """How far a view has to be from the middle of a ball to show it whole.

    Args:
        radius: of the ball, in Blender units.
        lens: of the view, in mm.
        size: width and height of its region, in pixels.
        perspective: whether it is one.
    """
    longer, shorter = max(*size, 1.0), max(min(size), 1.0)
    slope = _HALF / lens * shorter / longer  # half of what the shorter side shows
    share = math.sin(math.atan(slope)) if perspective else slope
    return _MARGIN * radius / max(share, 1e-6)


def is_well_in_view(
    middle: Sequence[float], radius: float, wanted: float, held: Sequence[float], far: float
) -> bool:
    """Whether a view shows a ball well enough to be left as it is.

    Args:
        middle, radius: of the ball.
        wanted: distance that shows it whole.
        held: the point that the view turns about.
        far: its distance from that point.
    """
    near = wanted / _NEAR_ENOUGH < far < wanted * _NEAR_ENOUGH
    return near and math.dist(middle, held) < radius / 2.0
