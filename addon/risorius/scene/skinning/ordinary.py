# SPDX-License-Identifier: GPL-3.0-or-later
"""Switches faces from Direct mode to the ordinary form, and back.

In the ordinary form the bones are posed and the armature modifiers are enabled. Faces are saved in
this form.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ..base import last_written, parts, session
from ..base.blender_types import ArmatureObject, MeshObject
from ..character import meshes
from . import bone_writer, conditions, direct

# Session uid of a mesh object -> positions in Direct mode, kept while a file is written.
_finished: dict[int, NDArray[np.float32]] = session.table("ordinary.finished", ("undo", "load"))


def take_on(rigs: Iterable[ArmatureObject]) -> None:
    """Give faces the ordinary form before a file is written, without an evaluation.

    The positions in Direct mode are kept, so that `take_off` can restore them.

    Args:
        rigs: deforming armatures.
    """
    _finished.clear()
    for rig in rigs:
        for item in _finished_meshes(rig):
            block = meshes.live_block(item)
            if block is not None:
                _finished[item.session_uid] = meshes.points_of(block)
        leave(rig)


def leave(rig: ArmatureObject) -> None:
    """Give a face the ordinary form in its visible pose; the next evaluation restores Direct mode.

    Args:
        rig: deforming armature.
    """
    frame, found = direct.shown(rig), _finished_meshes(rig)
    if not found:
        return
    if frame is not None and frame.writer.count == len(rig.pose.bones):
        bone_writer.write(rig, frame.live, frame.shape.joints, frame.shape.turns, None)
        rig.update_tag(refresh={"OBJECT"})
    for item in found:
        direct.give_back(item, rig)
        block, rest = meshes.live_block(item), direct.rest_form(item, rig)
        if block is None or rest is None or len(rest) != len(block.points):
            continue
        block.points.foreach_set("co", rest.ravel())
        conditions.note_written(item)
        item.data.update_tag()
    last_written.inputs.pop(rig.session_uid, None)
    direct.unsettle(rig)


def is_unknown(rigs: Iterable[ArmatureObject]) -> bool:
    """Whether the ordinary form of a face is unknown, as between undo and the next update.

    Args:
        rigs: deforming armatures.
    """
    return any(direct.shown(rig) is None and _finished_meshes(rig) for rig in rigs)


def _finished_meshes(rig: ArmatureObject) -> list[MeshObject]:
    return [item for item in parts.meshes_pointing_at(rig) if parts.FINISHED in item]


def take_off(rigs: Iterable[ArmatureObject]) -> None:
    """Switch faces back into Direct mode after `take_on`.

    Args:
        rigs: the deforming armatures that `take_on` got.
    """
    for rig in rigs:
        for item in parts.meshes_of(rig):
            points = _finished.pop(item.session_uid, None)
            block, own = meshes.live_block(item), conditions.armature_of(item, rig)
            if points is None or block is None or own is None:
                continue
            direct.take(item, rig)
            block.points.foreach_set("co", points.ravel())
            conditions.note_written(item)
            item.data.update_tag()
    _finished.clear()
