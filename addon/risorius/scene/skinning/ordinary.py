# SPDX-License-Identifier: GPL-3.0-or-later
"""A face in the form that files have, while it is in Direct mode: bones posed, modifiers enabled."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ..base import last_written, parts, session
from ..base.blender_types import ArmatureObject, MeshObject
from ..character import meshes
from . import bone_writer, conditions, direct

# Mesh object -> the finished positions that it had before the file was written.
_finished: dict[int, NDArray[np.float32]] = session.table("ordinary.finished", ("undo", "load"))


def take_on(rigs: Iterable[ArmatureObject]) -> None:
    """Give faces the form of files, for a file that is written now. Nothing is evaluated.

    Args:
        rigs: deforming armatures.
    """
    _finished.clear()
    for rig in rigs:
        frame = direct.shown(rig)
        found = [item for item in parts.meshes_of(rig) if parts.FINISHED in item]
        if frame is None or not found:
            continue
        bone_writer.write(rig, frame.live, frame.shape.joints, frame.shape.turns, None)
        for item in found:
            _ordinary(item, rig, frame)


def _ordinary(item: MeshObject, rig: ArmatureObject, frame: direct.Frame) -> None:
    block, own = meshes.live_block(item), conditions.armature_of(item, rig)
    if block is None or own is None:
        return
    _finished[item.session_uid] = meshes.points_of(block)
    morph = frame.live.morph(item[parts.MESH])
    rest = morph.evaluate(frame.shape.weights, base=meshes.points_of(parts.keys_there(item).reference_key))
    block.points.foreach_set("co", rest.ravel())
    own.show_viewport = own.show_render = True
    del item[parts.FINISHED]


def take_off(rigs: Iterable[ArmatureObject]) -> None:
    """After `take_on`: bring the faces back into Direct mode. Args: rigs  the same."""
    for rig in rigs:
        for item in parts.meshes_of(rig):
            points = _finished.pop(item.session_uid, None)
            block, own = meshes.live_block(item), conditions.armature_of(item, rig)
            if points is None or block is None or own is None:
                continue
            block.points.foreach_set("co", points.ravel())
            own.show_viewport = own.show_render = False
            item[parts.FINISHED] = True
            conditions.note_written(item)
    _finished.clear()
