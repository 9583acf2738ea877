# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulations on and around faces, baked by Blender; never with a face of the wrong frame."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import cast

import bpy

from ..base import console, parts
from ..base.blender_types import ArmatureObject, Context
from ..frame import controls_ahead, lateness
from .bake_face import BakeError


def bake(context: Context, rigs: Sequence[ArmatureObject]) -> str:
    """Bake all simulations of the scene that have a point cache.

    Args:
        context: its scene is played.
        rigs: the faces in it.

    Returns:
        A sentence for a report.

    Raises:
        BakeError: there is nothing to bake, or a face cannot be at its place in time; what was
            baked of it is freed.
    """
    caches = list(_caches(context.scene))
    if not caches:
        raise BakeError("There is no simulation with a cache in this scene.")
    for rig in rigs:
        trouble = controls_ahead.examine(context.scene, rig, parts.controls_there(rig))
        if trouble:
            raise BakeError(trouble)
    before = lateness.total()
    with console.quiet():
        bpy.ops.ptcache.bake_all(bake=True)
    if lateness.total() != before:
        bpy.ops.ptcache.free_bake_all()
        late = [words for words in map(lateness.words, rigs) if words]
        raise BakeError(" ".join([*late, "Nothing is baked."]))
    return f"{len(caches)} simulations baked." if len(caches) > 1 else "1 simulation baked."


def _caches(scene: bpy.types.Scene) -> Iterator[bpy.types.PointCache]:
    """The point caches of a scene's cloth, soft bodies, particles, paint and rigid bodies."""
    for item in scene.objects:
        for modifier in item.modifiers:
            if modifier.type in ("CLOTH", "SOFT_BODY"):
                yield cast("bpy.types.ClothModifier", modifier).point_cache
            elif modifier.type == "PARTICLE_SYSTEM":
                yield cast("bpy.types.ParticleSystemModifier", modifier).particle_system.point_cache
            elif modifier.type == "DYNAMIC_PAINT":
                canvas = cast("bpy.types.DynamicPaintModifier", modifier).canvas_settings
                for surface in canvas.canvas_surfaces if canvas else ():
                    yield surface.point_cache
    if scene.rigidbody_world is not None:
        yield scene.rigidbody_world.point_cache
