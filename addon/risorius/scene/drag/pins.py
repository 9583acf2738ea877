# SPDX-License-Identifier: GPL-3.0-or-later
"""Points of a face that hold still while others are dragged; kept on its control armature."""

from __future__ import annotations

from ..base import parts
from ..base.blender_types import ArmatureObject

Point = tuple[int, int]  # a mesh of the DNA, one of its vertices


def of(rig: ArmatureObject, counts: list[int]) -> list[Point]:
    """The pins of a face.

    Args:
        rig: the character.
        counts: of the vertices of each mesh of its DNA; a pin beyond them is another file's.
    """
    controls = parts.controls_of(rig)
    flat = controls.get(parts.PINS, ()) if controls is not None else ()
    if isinstance(flat, str | int | float):
        return []
    numbers = [int(n) for n in flat]
    pairs = zip(numbers[::2], numbers[1::2], strict=False)
    return [(m, v) for m, v in pairs if 0 <= m < len(counts) and 0 <= v < counts[m]]


def put(rig: ArmatureObject, pins: list[Point]) -> None:
    """Give a face these pins and no others.

    Args:
        rig: the character.
        pins: its pins from now on.
    """
    controls = parts.controls_there(rig)
    if pins:
        controls[parts.PINS] = [number for pin in pins for number in pin]
        controls.property_overridable_library_set(f'["{parts.PINS}"]', True)
    elif parts.PINS in controls:
        del controls[parts.PINS]


def toggle(rig: ArmatureObject, point: Point, counts: list[int]) -> bool:
    """Set a pin, or take it out where there is one.

    Args:
        rig: the character.
        point: of it.
        counts: as for `of`.

    Returns:
        Whether it is pinned now.
    """
    pins = of(rig, counts)
    if point in pins:
        pins.remove(point)
    else:
        pins.append(point)
    put(rig, pins)
    return point in pins
