# SPDX-License-Identifier: GPL-3.0-or-later
"""Which level of detail a distance asks for."""

from __future__ import annotations

from collections.abc import Sequence

SLACK = 0.1  # of a distance: how far beyond it the viewport waits before it switches


def default_distances(count: int, size: float) -> list[float]:
    """Distances at which each level changes to the next: doubling from six times the size of the
    face.

    Args:
        count: of levels.
        size: of the face, in Blender units.

    Returns:
        count - 1 distances, at least one.
    """
    return [size * 6.0 * 2.0**level for level in range(max(1, count - 1))]


def level_at(
    distance: float,
    distances: Sequence[float],
    built: Sequence[int],
    current: int | None = None,
) -> int:
    """The level to show.

    Args:
        distance: from the camera.
        distances: distances at which level n changes to level n + 1, ascending.
        built: existing levels, ascending, at least one.
        current: the level shown now, for hysteresis; None for a plain function of the distance.

    Returns:
        One of `built`: the wanted level, or the next coarser one, or the coarsest.
    """
    rising = sorted(distances)
    wanted = sum(distance >= d for d in rising)
    if current is not None and wanted != current:
        # Towards finer levels it must come clearly nearer, towards coarser ones clearly farther.
        factor = 1.0 + SLACK if wanted > current else 1.0 - SLACK
        eased = sum(distance >= d * factor for d in rising)
        wanted = max(current, eased) if wanted > current else min(current, eased)
    return next((level for level in built if level >= wanted), built[-1])
