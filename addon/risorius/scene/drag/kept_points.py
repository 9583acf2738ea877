# SPDX-License-Identifier: GPL-3.0-or-later
"""Stores points of a face on its control armature: pins, and selected and hidden handles.

A point is a vertex of a face: (index of the mesh in the DNA file, index of the vertex). A pinned
point keeps its position while other points are dragged.
"""

from __future__ import annotations

from collections.abc import Iterable

from ..base import parts, saved
from ..base.blender_types import ArmatureObject

Point = tuple[int, int]  # index of a mesh in the DNA file, index of its vertex

PINS, SELECTED, HIDDEN = parts.PINS, parts.HANDLES_SELECTED, parts.HANDLES_HIDDEN


def of(rig: ArmatureObject, kind: str, counts: list[int]) -> list[Point]:
    """The stored points of one kind.

    Args:
        rig: the character.
        kind: PINS, SELECTED or HIDDEN.
        counts: number of vertices of each DNA mesh; points with a larger index are left out.
    """
    controls = parts.controls_of(rig)
    numbers = saved.wholes(controls, kind) if controls is not None else []
    pairs = zip(numbers[::2], numbers[1::2], strict=False)
    return [(m, v) for m, v in pairs if 0 <= m < len(counts) and 0 <= v < counts[m]]


def put(rig: ArmatureObject, kind: str, points: Iterable[Point]) -> None:
    """Replace the stored points of a kind.

    Args:
        rig: the character.
        kind: PINS, SELECTED or HIDDEN.
        points: the new points.
    """
    controls, flat = parts.controls_there(rig), [number for point in points for number in point]
    if kind in controls:
        del controls[kind]  # the length of an existing array cannot change
    if flat:
        controls[kind] = flat
        controls.property_overridable_library_set(f'["{kind}"]', True)


def toggle(rig: ArmatureObject, kind: str, point: Point, counts: list[int]) -> bool:
    """Add a point, or remove it if it is stored.

    Args:
        rig: the character.
        kind: PINS, SELECTED or HIDDEN.
        point: the point to add or remove.
        counts: number of vertices of each DNA mesh.

    Returns:
        True if the point was added, False if it was removed.
    """
    points = of(rig, kind, counts)
    if point in points:
        points.remove(point)
    else:
        points.append(point)
    put(rig, kind, points)
    return point in points
