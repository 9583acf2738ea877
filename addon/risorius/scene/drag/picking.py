# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the face and the vertex under a ray through the scene.

A point is a vertex of a face: (index of the mesh in the DNA file, index of the vertex). Handles are
points that the user can drag.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import bpy
import numpy as np
from mathutils import Matrix, Vector
from numpy.typing import NDArray

from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..base import parts
from ..base.blender_types import ArmatureObject, Context
from ..character import runtime
from ..frame import inputs
from . import handles
from .head_turns import HeadTurns
from .skin import Point, Skin

_FAR = 0.05  # largest distance of a hit from the nearest vertex / size of the face
NEAR = 0.06  # largest distance of an unoccluded handle from the hit / size of the face
_THROUGH = 16  # largest number of wire or bounds objects that a ray passes


@dataclass
class Hit:
    """The result of a ray.

    Attributes:
        rig: the character.
        point: index of the mesh in the DNA, index of the vertex.
        place: float64[3], position of the vertex in world space.
        is_handle: whether the vertex is a visible handle.
    """

    rig: ArmatureObject
    point: Point
    place: NDArray[np.float64]
    is_handle: bool = False


def under(context: Context, origin: Vector, direction: Vector) -> Hit | None:
    """The vertex of a face that is nearest to the place where a ray meets the face.

    None if the ray meets nothing, or first another object, an instance of a face, a mesh of another
    level of detail, or a place far from all vertices.

    Args:
        context: its evaluated scene is searched.
        origin, direction: of the ray, in world space; the direction has length 1.

    Raises:
        FaceError: the face is linked, or has lost its controls or its DNA.
    """
    met = _first(context, origin, direction)
    if met is None:
        return None
    item, place, index, matrix = met
    rig = parts.rig_of(item) if parts.MESH in item else None
    if rig is None or np.abs(np.array(matrix) - np.array(item.matrix_world)).max() > 1e-4:
        return None  # no face, or an instance of a face
    if rig.library is not None:
        name = rig.name.removesuffix("_rig")
        raise FaceError(told("{name} is linked: make a library override of it first.", name=name))
    live = runtime.of(rig)
    if live is None or parts.controls_of(rig) is None:
        raise FaceError(told("This face has lost its controls or its DNA."))
    return _nearest(context, rig, live, item, np.array(place), index)


def _first(
    context: Context, origin: Vector, direction: Vector
) -> tuple[bpy.types.Object, Vector, int, Matrix] | None:
    """The first object that a ray meets, except objects drawn as wire or bounds.

    Returns:
        (Original object, location of the hit in world space, index of the hit polygon, world matrix
        of the object). None if the ray meets no other object, or if it meets _THROUGH objects that
        are drawn as wire or bounds first.
    """
    depsgraph = context.evaluated_depsgraph_get()
    for _ in range(_THROUGH):
        met, place, _normal, index, item, matrix = context.scene.ray_cast(
            depsgraph, origin, direction
        )
        if not met or item is None:
            return None
        original = cast(bpy.types.Object, item.original)
        if original.display_type not in ("WIRE", "BOUNDS"):
            return original, place, index, matrix
        origin = place + direction * 1e-4
    return None


def _nearest(
    context: Context,
    rig: ArmatureObject,
    live: runtime.Runtime,
    item: bpy.types.Object,
    place: NDArray[np.float64],
    index: int,
) -> Hit | None:
    """The vertex of a face's mesh nearest to the hit of a ray.

    None if the vertex is too far away, or if the mesh belongs to another level of detail.

    Args:
        context: has the visible scene.
        rig, live: the character and its Runtime.
        item: the mesh object.
        place: float64[3], the hit in world space.
        index: index of the polygon that was hit.
    """
    mesh, skin = int(item[parts.MESH]), Skin.of(context, rig, live)
    if mesh not in skin.surface.mesh_indices:
        return None
    corners = skin.corners(mesh, index)
    if corners is not None:
        best = min(corners, key=lambda corner: float(np.linalg.norm(corner[1] - place)))
        return Hit(rig, (mesh, best[0]), best[1])
    places = computed(context, rig, live, skin, mesh)
    far = np.linalg.norm(places - place, axis=1)
    nearest = int(np.argmin(far))
    if far[nearest] > _FAR * skin.size * max(np.abs(np.array(item.matrix_world)[:3, :3]).max(), 0):
        return None
    return Hit(rig, (mesh, nearest), places[nearest])


def computed(
    context: Context, rig: ArmatureObject, live: runtime.Runtime, skin: Skin, mesh: int
) -> NDArray[np.float64]:
    """float64[V, 3]: vertices of a mesh in world space, deformed by the armature but not by the
    other modifiers.

    Args:
        context: has the visible scene.
        rig, live: the character and its Runtime.
        skin: skin of the character.
        mesh: index of the mesh in the DNA file.
    """
    depsgraph, controls = context.evaluated_depsgraph_get(), parts.controls_there(rig)
    seen, maximum = controls.evaluated_get(depsgraph), parts.maximum_of(controls)
    raw, turns = inputs.read_inputs(seen, live, depsgraph, maximum)
    rest = skin.surface.positions(raw, mesh)
    return HeadTurns(rig, live, turns, depsgraph).positions(mesh, rest)


def places(
    context: Context, rig: ArmatureObject, live: runtime.Runtime, points: list[Point]
) -> list[NDArray[np.float64]]:
    """float64[3] for each point: its visible position in world space.

    Args:
        context: has the visible scene.
        rig, live: the character and its Runtime.
        points: (mesh, vertex) pairs; points of another level of detail are left out.
    """
    if not points:
        return []
    skin, found = Skin.of(context, rig, live), []
    for mesh, vertex in points:
        at = skin.seen_at((mesh, vertex))
        if at is None and mesh in skin.surface.mesh_indices:
            at = computed(context, rig, live, skin, mesh)[vertex]
        if at is not None:
            found.append(at)
    return found


def handles_of(
    context: Context, rig: ArmatureObject, live: runtime.Runtime
) -> list[tuple[Point, NDArray[np.float64]]]:
    """(point, position in world space) of each handle of a face that is not hidden.

    Args:
        context: has the visible scene.
        rig, live: the character and its Runtime.
    """
    points = handles.offered(rig, Skin.of(context, rig, live).surface)
    found = places(context, rig, live, points)
    return list(zip(points, found, strict=False))


def size_of(rig: ArmatureObject, live: runtime.Runtime) -> float:
    """The largest extent of the neutral first mesh of the DNA file, in world space.

    Args:
        rig, live: the character and its Runtime.
    """
    first = np.asarray(live.dna.meshes[0].positions) if live.dna.meshes else np.zeros((1, 3))
    across = float(np.ptp(first, axis=0).max()) * live.space.scale
    return across * float(np.abs(np.array(rig.matrix_world)[:3, :3]).max())
