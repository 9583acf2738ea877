# SPDX-License-Identifier: GPL-3.0-or-later
"""Stored points of a face on its control armature: pins, and selected and hidden handles.

Pins stay while other points are dragged. Handles can be selected together or hidden.
"""

from __future__ import annotations

from collections.abc import Iterable

from ..base import parts, saved
from ..base.blender_types import ArmatureObject

Point = tuple[int, int]  # a mesh of the DNA, one of its vertices

PINS, SELECTED, HIDDEN = parts.PINS, parts.HANDLES_SELECTED, parts.HANDLES_HIDDEN


def of(rig: ArmatureObject, kind: str, counts: list[int]) -> list[Point]:
    """The stored points of one kind.

    Args:
        rig: the character.
        kind: PINS, SELECTED or HIDDEN.
        counts: number of vertices of each mesh of its DNA; points beyond belong to another file.
    """
    controls = parts.controls_of(rig)
    numbers = saved.wholes(controls, kind) if controls is not None else []
    pairs = zip(numbers[::2], numbers[1::2], strict=False)
    return [(m, v) for m, v in pairs if 0 <= m < len(counts) and 0 <= v < counts[m]]


def put(rig: ArmatureObject, kind: str, points: Iterable[Point]) -> None:
    """Give a face these points of a kind and no others.

    Args:
        rig: the character.
        kind: PINS, SELECTED or HIDDEN.
        points: from now on.
    """
    controls, flat = parts.controls_there(rig), [number for point in points for number in point]
    if kind in controls:
        del controls[kind]  # Blender keeps the length of an array that is there
    if flat:
        controls[kind] = flat
        controls.property_overridable_library_set(f'["{kind}"]', True)


def toggle(rig: ArmatureObject, kind: str, point: Point, counts: list[int]) -> bool:
    """Add a point, or remove it if it is stored.

    Args:
        rig: the character.
        kind: PINS, SELECTED or HIDDEN.
        point: point of the character.
        counts: see `of`.

    Returns:
        Whether it is stored now.
    """
    points = of(rig, kind, counts)
    if point in points:
        points.remove(point)
    else:
        points.append(point)
    put(rig, kind, points)
    return point in points
