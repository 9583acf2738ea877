# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the simulations of a scene, unless a face would be evaluated at the wrong frame."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

from ...logic.base.sentences import Sentence, told
from ..base import console, parts
from ..base.blender_types import ArmatureObject, Context
from ..frame import controls_ahead, lateness
from ..skinning import caches
from .bake_face import BakeError


def bake(context: Context, rigs: Sequence[ArmatureObject]) -> Sentence:
    """Bake all simulations of the scene that have a point cache.

    Args:
        context: its scene is played.
        rigs: the faces in the scene.

    Returns:
        A sentence for a report.

    Raises:
        BakeError: the scene has no simulation with a cache, a cache begins below frame 0, or a face
            would be posed only after the simulation of a frame. If a face is late during the bake,
            all bakes are freed.
    """
    found = [cache for _key, cache in caches.of_scene(context.scene)]
    count = len(found)
    if not count:
        raise BakeError(told("There is no simulation with a cache in this scene."))
    begin = min(cache.frame_start for cache in found)
    if begin < 0:
        # Blender reads cache frames as unsigned numbers, so it would show the last cached frame at
        # negative frames.
        raise BakeError(
            told(
                "The cache of a simulation begins at frame {begin}. Blender loses "
                "baked frames below 0: let the cache begin at frame 0 or later.",
                begin=begin,
            )
        )
    for rig in rigs:
        trouble = controls_ahead.examine(context.scene, rig, parts.controls_there(rig))
        if trouble:
            raise BakeError(trouble)
    if caches.are_late(context.scene):
        bpy.ops.ptcache.free_bake_all()
        caches.look()
    before = lateness.total()
    with console.quiet():
        bpy.ops.ptcache.bake_all(bake=True)
    if lateness.total() != before:
        bpy.ops.ptcache.free_bake_all()
        why = next(filter(None, map(lateness.words, rigs)), "")
        raise BakeError(told("Nothing is baked. {why}", why=why))
    return told("Simulations baked: {count}.", count=count)
