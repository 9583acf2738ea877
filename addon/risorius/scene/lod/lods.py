# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the LOD of a character in the viewport and in renders, by hand or by camera distance."""

from __future__ import annotations

import bpy

from ...logic.character import lod_distance as rules
from ..base import parts, saved
from ..base.blender_types import ArmatureObject, Depsgraph, MeshObject

_COARSEST = 255  # largest level that is accepted; files have fewer
SAME = -1  # stored as the level of renders: use the viewport's level


def built(rig: ArmatureObject) -> list[int]:
    """The levels for which a character has meshes, sorted."""
    return sorted({level for item in parts.meshes_of(rig) for level in levels_of(item)})


def levels_of(item: MeshObject) -> list[int]:
    """The levels that show a mesh.

    Args:
        item: the mesh object.
    """
    return saved.wholes(item, parts.LODS, 0, _COARSEST)


def shows(item: MeshObject, level: int) -> bool:
    """Whether a level shows a mesh; a mesh without levels is always shown.

    Args:
        item: the mesh object.
        level: number of the level.
    """
    return parts.LODS not in item or level in levels_of(item)


def heads(rig: ArmatureObject) -> list[MeshObject]:
    """The head meshes of the finest existing level; all meshes of this level if none is a head.

    Args:
        rig: the deforming armature.
    """
    items = parts.meshes_of(rig)
    first = min((min(levels_of(item), default=0) for item in items), default=0)
    shown = [item for item in items if shows(item, first)]
    found = [item for item in shown if "head" in item.data.name.rpartition("_lod")[0].lower()]
    return found or shown


def viewport_level(rig: ArmatureObject) -> int:
    """The level that the viewport shows."""
    return saved.whole(rig, parts.LOD, 0, 0, _COARSEST)


def render_level(rig: ArmatureObject) -> int:
    """The level that renders show unless the camera distance chooses it."""
    level = saved.whole(rig, parts.LOD_RENDER, SAME, SAME, _COARSEST)
    return viewport_level(rig) if level == SAME else level


def by_distance(rig: ArmatureObject) -> bool:
    """Whether the distance to the camera chooses the level."""
    return bool(rig.get(parts.LOD_BY_DISTANCE))


def show(rig: ArmatureObject, viewport: int | None = None, render: int | None = None) -> None:
    """Choose levels by hand.

    Args:
        rig: the deforming armature.
        viewport: level of the viewport; None: unchanged.
        render: level of renders; SAME: the level of the viewport; None: unchanged.
    """
    if viewport is not None:
        rig[parts.LOD] = int(viewport)
    if render is not None:
        rig[parts.LOD_RENDER] = int(render)
    _hide(rig, viewport_level(rig), "hide_viewport")
    _hide(rig, render_level(rig), "hide_render")
    rig.update_tag()


def distances(rig: ArmatureObject) -> list[float]:
    """The distances from the camera, in Blender units, at which the next coarser level is shown.

    Args:
        rig: the deforming armature.
    """
    return saved.numbers(rig, parts.LOD_DISTANCES, 0.0)


def follow_camera(rig: ArmatureObject, enable: bool, size: float | None = None) -> None:
    """Turn the choice of the level by camera distance on or off.

    Args:
        rig: the deforming armature.
        enable: True: on; False: off.
        size: size of the face in Blender units, from which the distances are computed if the
            face has none; None: 0.25.
    """
    levels = built(rig)
    if enable and levels and not distances(rig):
        rig[parts.LOD_DISTANCES] = rules.default_distances(levels[-1] + 1, size or 0.25)
        rig.property_overridable_library_set(f'["{parts.LOD_DISTANCES}"]', True)
    rig[parts.LOD_BY_DISTANCE] = bool(enable)
    show(rig)


def expected(rig: ArmatureObject, rendering: bool, last: int | None) -> int:
    """The probable level of a frame whose camera distance is unknown because the frame is not
    evaluated yet.

    Args:
        rig: the deforming armature.
        rendering: whether the frame is rendered.
        last: the level of the last evaluation; None if there was none.
    """
    if by_distance(rig) and last is not None:
        return last
    return render_level(rig) if rendering else viewport_level(rig)


def choose(rig: ArmatureObject, seen: ArmatureObject, depsgraph: Depsgraph) -> int:
    """The level to evaluate for a dependency graph; a level chosen by distance is also shown.

    In renders the level depends on the frame alone; only the viewport has hysteresis.

    Args:
        rig: the deforming armature, the original.
        seen: the evaluated control armature.
        depsgraph: the evaluated dependency graph.
    """
    rendering = depsgraph.mode == "RENDER"
    kept = render_level(rig) if rendering else viewport_level(rig)
    camera = depsgraph.scene.camera if by_distance(rig) else None
    levels = built(rig) if camera is not None else ()
    if camera is None or not levels:
        return kept
    level = rules.level_at(
        _distance(seen, camera.evaluated_get(depsgraph)),
        distances(rig),
        levels,
        None if rendering else kept,
    )
    if not rendering and level != kept:
        rig[parts.LOD] = level
    _hide(rig, level, "hide_render" if rendering else "hide_viewport")
    return level


def _distance(seen: ArmatureObject, camera: bpy.types.Object) -> float:
    bone = seen.pose.bones.get("head")
    place = seen.matrix_world @ (bone.head if bone else seen.matrix_world.translation * 0)
    return (place - camera.matrix_world.translation).length


def _hide(rig: ArmatureObject, level: int, flag: str) -> None:
    """Hide the meshes of other levels; meshes that the user hid stay hidden.

    If the value of the flag on a mesh differs from the value that the add-on wrote last, the user
    has set it.

    Args:
        rig: the deforming armature.
        level: the level of detail to show.
        flag: property that hides a mesh: "hide_viewport" or "hide_render".
    """
    for item in parts.meshes_of(rig):
        written, users = f"{parts.HIDDEN_PREFIX}{flag}", f"{parts.HIDDEN_PREFIX}user_{flag}"
        now = getattr(item, flag)
        if bool(item.get(written, now)) != now:
            item[users] = now
        hidden = not shows(item, level) or bool(item.get(users))
        if now != hidden:
            setattr(item, flag, hidden)
        if item.get(written) != hidden:
            item[written] = hidden
            # Mark the value as overridable. Otherwise a library override loses the value when the
            # file is opened, and the flag would count as a choice of the user.
            item.property_overridable_library_set(f'["{written}"]', True)
