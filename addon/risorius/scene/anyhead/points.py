# SPDX-License-Identifier: GPL-3.0-or-later
"""Landmarks of a head as empties on it: found, moved by hand, placed by hand."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple, cast

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from ..base import parts, saved
from ..base.blender_types import Context, MeshObject

Doubles = NDArray[np.float64]
Place = Vector | Doubles

FOUND, MOVED, PLACED = "FOUND", "MOVED", "PLACED"
# Colours of the empties, which views show whose wires have the colours of objects.
_COLORS = {
    FOUND: (0.15, 0.75, 0.3, 1.0),
    MOVED: (1.0, 0.55, 0.05, 1.0),
    PLACED: (0.2, 0.5, 1.0, 1.0),
}
_SIZE = 0.012  # of an empty, in the largest side of the box around all landmarks
_STAYED = (
    1e-4  # of the same: one that is nearer to the place where it was found counts as not moved
)


class Point(NamedTuple):
    """A landmark that is shown.

    Attributes:
        name: as the package has it.
        place: float64[3] in the head's own coordinates.
        state: FOUND, MOVED, or PLACED where it was not found.
        item: the empty.
    """

    name: str
    place: Doubles
    state: str
    item: bpy.types.Object


def is_point(item: bpy.types.Object | None) -> bool:
    """Whether an object is a landmark of a head."""
    return item is not None and item.type == "EMPTY" and bool(saved.text(item, parts.LANDMARK))


def of(head: bpy.types.Object) -> dict[str, Point]:
    """The landmarks of a head, by their names. Args: head  the mesh object."""
    items = [item for item in head.children if is_point(item)]
    into = head.matrix_world.inverted_safe()
    places = {
        item.name: np.array(into @ item.matrix_world.translation, np.float64) for item in items
    }
    size = _size(list(places.values()))
    out: dict[str, Point] = {}
    for item in sorted(items, key=lambda one: one.name):
        place = places[item.name]
        found = saved.numbers(item, parts.LANDMARK_FOUND)
        state = PLACED
        if len(found) == 3:
            stayed = np.linalg.norm(place - found) <= _STAYED * size
            state = FOUND if stayed else MOVED
        name = saved.text(item, parts.LANDMARK)
        # A copy of the empty beside it does not count.
        out.setdefault(name, Point(name, place, state, item))
    return out


def by_hand(points: Mapping[str, Point]) -> dict[str, Doubles]:
    """Where a person wants landmarks: those that were moved or placed. Args: points  of `of`."""
    return {name: point.place for name, point in points.items() if point.state != FOUND}


def show(
    context: Context,
    head: MeshObject,
    found: Mapping[str, Place],
) -> None:
    """Show landmarks that were found; one that a person moved or placed stays where it is.

    Args:
        context: has the scene.
        head: the mesh object.
        found: name -> [3] in the head's own coordinates.
    """
    there = of(head)
    size = _size([*(np.asarray(p) for p in found.values()), *(p.place for p in there.values())])
    for name, place in found.items():
        point = there.get(name)
        if point is not None and point.state != FOUND:
            continue
        item = point.item if point is not None else _make(context, head, name, size)
        _put(head, item, place)
        item[parts.LANDMARK_FOUND] = [float(value) for value in place]
        item.color = _COLORS[FOUND]
    for name, point in there.items():
        if name not in found and point.state == FOUND:
            bpy.data.objects.remove(point.item)
    context.view_layer.update()


def place(context: Context, head: MeshObject, name: str, where: Place) -> bpy.types.Object:
    """Put a landmark where a person wants it.

    Args:
        context: has the scene.
        head: the mesh object.
        name: of the landmark.
        where: [3] in the head's own coordinates.

    Returns:
        The empty.
    """
    there = of(head)
    point = there.get(name)
    size = _size([*(p.place for p in there.values())]) or head.dimensions.length / 2
    item = point.item if point is not None else _make(context, head, name, size)
    _put(head, item, where)
    state = MOVED if len(saved.numbers(item, parts.LANDMARK_FOUND)) == 3 else PLACED
    item.color = _COLORS[state]
    context.view_layer.update()
    return item


def remove(head: bpy.types.Object) -> int:
    """Take the landmarks of a head away, with their collection.

    Args:
        head: the mesh object.

    Returns:
        How many there were.
    """
    items = [item for item in head.children if is_point(item)]
    _delete(items)
    return len(items)


def names_are_shown(points: Iterable[Point]) -> bool:
    """Whether the views write the names of landmarks beside them. Args: points  of a head."""
    return any(point.item.show_name for point in points)


def _delete(items: Iterable[bpy.types.Object]) -> None:
    items = list(items)
    held = {group for item in items for group in item.users_collection}
    for item in items:
        bpy.data.objects.remove(item)
    for group in held:
        if parts.LANDMARKS in group and not group.objects and not group.children:
            bpy.data.collections.remove(group)


def _make(context: Context, head: MeshObject, name: str, size: float) -> bpy.types.Object:
    item = bpy.data.objects.new(name, None)
    item[parts.LANDMARK] = name
    item.empty_display_type = "SPHERE"
    item.empty_display_size = _SIZE * size
    item.show_name = item.show_in_front = True
    item.parent = head
    item.matrix_parent_inverse = Matrix()
    _collection(context, head).objects.link(item)
    return item


def _put(head: bpy.types.Object, item: bpy.types.Object, where: Place) -> None:
    point = Vector(tuple(float(value) for value in where))
    if item.parent == head and item.matrix_parent_inverse == Matrix() and not item.constraints:
        item.location = point
    else:
        item.matrix_world.translation = head.matrix_world @ point


def _collection(context: Context, head: bpy.types.Object) -> bpy.types.Collection:
    """Where the landmarks of a head are: with those that are there, else a new collection."""
    for item in head.children:
        if is_point(item):
            for group in item.users_collection:
                if parts.LANDMARKS in group:
                    return group
    group = bpy.data.collections.new(f"{head.name} Landmarks")
    group[parts.LANDMARKS] = True
    context.scene.collection.children.link(group)
    return group


def _size(places: Iterable[Doubles]) -> float:
    """The largest side of the box around points; 0 of none."""
    rows = [np.asarray(place, np.float64) for place in places]
    return float(np.ptp(np.stack(rows), axis=0).max()) if rows else 0.0


def head_of(item: bpy.types.Object | None) -> MeshObject | None:
    """The head that a landmark is on, or None. Args: item  any object."""
    above = item.parent if item is not None and is_point(item) else None
    return cast(MeshObject, above) if above is not None and above.type == "MESH" else None
