# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the level of detail for a distance from the camera."""

from __future__ import annotations

from collections.abc import Sequence

SLACK = 0.1  # the viewport changes the level 10 % beyond a threshold distance


def default_distances(count: int, size: float) -> list[float]:
    """The distances from the camera at which a level of detail (LOD) changes to the next coarser.

    The first distance is six times the size of the face; each later one is twice the one before.

    Args:
        count: number of LODs.
        size: largest extent of the face, in Blender units.

    Returns:
        count - 1 distances in Blender units, at least one.
    """
    return [size * 6.0 * 2.0**level for level in range(max(1, count - 1))]


def level_at(
    distance: float,
    distances: Sequence[float],
    built: Sequence[int],
    current: int | None = None,
) -> int:
    """The level of detail to show.

    Args:
        distance: distance of the face from the camera, in Blender units.
        distances: distances at which level n changes to level n + 1, ascending.
        built: existing levels, ascending, at least one.
        current: the level that is shown, for hysteresis; None for no hysteresis.

    Returns:
        The level for this distance if it is in `built`. Otherwise the next coarser level in
        `built`, or the coarsest one if none is coarser.
    """
    rising = sorted(distances)
    wanted = sum(distance >= d for d in rising)
    if current is not None and wanted != current:
        # The level changes only if the distance is beyond its threshold by the fraction SLACK.
        factor = 1.0 + SLACK if wanted > current else 1.0 - SLACK
        eased = sum(distance >= d * factor for d in rising)
        wanted = max(current, eased) if wanted > current else min(current, eased)
    return next((level for level in built if level >= wanted), built[-1])
