# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows the landmarks of a head as empties, and reads them back after the user moved them."""

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
# Colours of the dots on the landmarks, and of the empties in viewports with wire colour "Object".
COLORS: dict[str, tuple[float, float, float, float]] = {
    FOUND: (0.15, 0.75, 0.3, 1.0),
    MOVED: (1.0, 0.55, 0.05, 1.0),
    PLACED: (0.2, 0.5, 1.0, 1.0),
}
_SIZE = 0.012  # size of an empty / largest side of the box around all landmarks
_STAYED = 1e-4  # a landmark counts as moved from this distance to its found place / that side


class Point(NamedTuple):
    """A landmark that is shown as an empty.

    Attributes:
        name: the name of the landmark in the package risorius.
        place: float64[3], in the coordinates of the head's object.
        state: FOUND, MOVED (found, then moved), or PLACED (not found, placed by the user).
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
    """The landmarks of a head, a mesh object, by name."""
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
        # Copies of an empty sort after the original by name, and setdefault ignores them.
        out.setdefault(name, Point(name, place, state, item))
    return out


def by_hand(points: Mapping[str, Point]) -> dict[str, Doubles]:
    """Name -> position of the landmarks that the user moved or placed, in the head's object space.

    Args:
        points: all landmarks of the head by name.
    """
    return {name: point.place for name, point in points.items() if point.state != FOUND}


def show(
    context: Context,
    head: MeshObject,
    found: Mapping[str, Place],
) -> None:
    """Show landmarks that were found. Landmarks that the user moved or placed stay unchanged.

    Other empties of landmarks that `found` does not contain are deleted.

    Args:
        context: has the scene.
        head: the mesh object.
        found: name -> float[3], positions in the coordinates of the head's object.
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
        item.color = COLORS[FOUND]
    for name, point in there.items():
        if name not in found and point.state == FOUND:
            bpy.data.objects.remove(point.item)
    context.view_layer.update()


def place(context: Context, head: MeshObject, name: str, where: Place) -> bpy.types.Object:
    """Place a landmark at a position that the user chose.

    Args:
        context: has the scene.
        head: the mesh object.
        name: name of the landmark.
        where: float[3], the position in the coordinates of the head's object.

    Returns:
        The empty of the landmark.
    """
    there = of(head)
    point = there.get(name)
    size = _size([*(p.place for p in there.values())]) or head.dimensions.length / 2
    item = point.item if point is not None else _make(context, head, name, size)
    _put(head, item, where)
    state = MOVED if len(saved.numbers(item, parts.LANDMARK_FOUND)) == 3 else PLACED
    item.color = COLORS[state]
    context.view_layer.update()
    return item


def remove(head: bpy.types.Object) -> int:
    """Delete the landmarks of a head, and their collection if it is then empty.

    Args:
        head: the mesh object.

    Returns:
        The number of deleted landmarks.
    """
    items = [item for item in head.children if is_point(item)]
    _delete(items)
    return len(items)


def names_are_shown(points: Iterable[Point]) -> bool:
    """Whether the viewports show the name of at least one of the landmarks."""
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
    item.show_in_front = True
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
    """The collection of a head's landmarks; created if it has none."""
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
    """The largest side of the bounding box of points; 0 without points."""
    rows = [np.asarray(place, np.float64) for place in places]
    return float(np.ptp(np.stack(rows), axis=0).max()) if rows else 0.0


def head_of(item: bpy.types.Object | None) -> MeshObject | None:
    """The head of a landmark; None if the object is no landmark or its parent is no mesh."""
    above = item.parent if item is not None and is_point(item) else None
    return cast(MeshObject, above) if above is not None and above.type == "MESH" else None
