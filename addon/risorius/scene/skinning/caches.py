# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds caches of simulations, and caches that were baked when faces were one frame late.

A cache does not store which version baked it, so the version number of the characters in its scene
decides (base/form.py): before version 2 every simulation saw the face of the previous frame. A
character of an older file keeps its version number while such a cache exists, and is checked again
when the file is opened.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

import bpy

from ...logic.base.sentences import told
from ..base import parts, session
from ..base.blender_types import ArmatureObject

SIMULATED = frozenset(
    ("CLOTH", "COLLISION", "SOFT_BODY", "PARTICLE_SYSTEM", "DYNAMIC_PAINT", "FLUID")
)
Key = tuple[int, str]  # session uid of an object or scene, and the name of its modifier or part

# Session uid of a deforming armature -> caches that were already baked when the file was opened and
# have not been freed since.
_late: dict[int, set[Key]] = session.table("caches.late", ("load",))


def of_scene(scene: bpy.types.Scene) -> Iterator[tuple[Key, bpy.types.PointCache]]:
    """(Key, cache) of a scene's cloth, soft bodies, particles, paint and rigid bodies."""
    for item in scene.objects:
        for modifier in item.modifiers:
            for number, cache in enumerate(_of_modifier(modifier)):
                yield (item.session_uid, f"{modifier.name} {number}"), cache
    if scene.rigidbody_world is not None:
        yield (scene.session_uid, "rigid bodies"), scene.rigidbody_world.point_cache


def _of_modifier(modifier: bpy.types.Modifier) -> Iterator[bpy.types.PointCache]:
    if modifier.type in ("CLOTH", "SOFT_BODY"):
        yield cast("bpy.types.ClothModifier", modifier).point_cache
    elif modifier.type == "PARTICLE_SYSTEM":
        yield cast("bpy.types.ParticleSystemModifier", modifier).particle_system.point_cache
    elif modifier.type == "DYNAMIC_PAINT":
        canvas = cast("bpy.types.DynamicPaintModifier", modifier).canvas_settings
        for surface in canvas.canvas_surfaces if canvas else ():
            yield surface.point_cache


def _baked(scene: bpy.types.Scene) -> set[Key]:
    """The baked caches and fluids of a scene."""
    found = {key for key, cache in of_scene(scene) if cache.is_baked}
    for item in scene.objects:
        for modifier in item.modifiers:
            domain = getattr(modifier, "domain_settings", None)
            if domain is not None and domain.has_cache_baked_data:
                found.add((item.session_uid, modifier.name))
    return found


def any_simulates() -> bool:
    """Whether this file has rigid bodies, a modifier of SIMULATED, or geometry nodes to bake."""
    if any(scene.rigidbody_world is not None for scene in bpy.data.scenes):
        return True
    for item in bpy.data.objects:
        for modifier in item.modifiers:
            kind = modifier.type
            if kind in SIMULATED or (kind == "NODES" and _bakes(modifier)):
                return True
    return False


def _bakes(modifier: bpy.types.Modifier) -> bool:
    """Whether geometry nodes have a zone or a node that can be baked, in groups too."""
    return len(getattr(modifier, "bakes", ())) > 0


def have_nodes(rig: ArmatureObject) -> bool:
    """Whether scenes of a face have geometry nodes that can be baked. Blender does not tell whether
    they are baked."""
    items = (item for scene in rig.users_scene for item in scene.objects)
    return any(_bakes(m) for item in items for m in item.modifiers)


def note_old(rig: ArmatureObject) -> bool:
    """Record the baked caches in the scenes of a character of an older file.

    Args:
        rig: its deforming armature.

    Returns:
        Whether any of these caches still exists.
    """
    if rig.session_uid not in _late:
        _late[rig.session_uid] = {key for scene in rig.users_scene for key in _baked(scene)}
    look()
    return bool(_late[rig.session_uid])


def look() -> None:
    """Remove freed caches from the record of late caches; quick if no cache is recorded."""
    if any(_late.values()):
        there = {key for scene in bpy.data.scenes for key in _baked(scene)}
        for keys in _late.values():
            keys.intersection_update(there)


def words(rig: ArmatureObject) -> str:
    """The panel's sentence about late caches in the scenes of a face; empty if there are none."""
    count = len(_late.get(rig.session_uid, ()))
    if not count:
        return ""
    return told(
        "Simulations in the scenes of this face were baked by an older Risorius, which used the "
        "face of the previous frame: bake them again (caches: {count}).",
        count=count,
    )


def are_late(scene: bpy.types.Scene) -> bool:
    """Whether a scene has a character with late caches."""
    return any(_late.get(rig.session_uid) for rig in parts.rigs() if scene in rig.users_scene)
