# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills the raw controls of joint rotations before the face is evaluated.

RBF poses of the file read these controls to correct neck and jaw when the head turns. Rotations by
control bones, layers, live capture and a body are known before the frame. If anything else rotates
a joint, such as a constraint on its bone, Blender must evaluate the bone before its rotation can be
read; joint_readings.py finds these joints.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from mathutils import Quaternion, Vector
from numpy.typing import NDArray

from ..base import drivers, parts
from ..base.blender_types import ArmatureObject, Depsgraph
from ..character import runtime
from . import joint_readings

_NOTHING = 1e-7  # components of a quaternion up to this size count as 0


def has_any(rig: ArmatureObject) -> bool:
    """Whether a character has raw controls of joint rotations.

    Args:
        rig: deforming armature.
    """
    live = runtime.of(rig)
    return live is not None and bool(live.turning)


def are_set_by_hand(rig: ArmatureObject, controls: ArmatureObject) -> bool:
    """Whether a slider of a joint rotation has keys, a driver, or a value other than its rest.

    Args:
        rig, controls: deforming and control armature of a character.
    """
    live = runtime.of(rig)
    if live is None or parts.FACE not in controls.pose.bones:
        return False
    values = controls.pose.bones[parts.FACE]
    indices = [index for item in live.turning for index in item.controls]
    labels = [live.labels[index] for index in indices]
    moved = any(values.get(live.labels[i], live.rests[i]) != live.rests[i] for i in indices)
    return moved or bool(labels and drivers.used_controls(controls, labels))


def fill(
    seen: ArmatureObject,
    live: runtime.Runtime,
    depsgraph: Depsgraph,
    raw: NDArray[np.float32],
    turns: Mapping[str, Quaternion],
) -> None:
    """Set the raw controls of joint rotations in place.

    Nothing changes if the property `risorius_neck_poses` of the control armature is off.

    Args:
        seen: the evaluated control armature.
        live: the character's Runtime.
        depsgraph: graph for reading bones of the deforming armature, if needed.
        raw: float32[R], the raw controls.
        turns: "neck" and "head" -> Quaternion in the armature's axes; a missing bone is unrotated.
    """
    if not live.turning or not seen.risorius_neck_poses:
        return
    rig = parts.rig_of(seen.original)
    found = _bones(rig, live, depsgraph) if rig is not None else {}
    for item in live.turning:
        if item.joint in found:
            turn, axes = found[item.joint], item.bone_axes
        else:
            turn, axes = _share(turns.get(item.bone), item.share), item.armature_axes
        x, y, z = axes @ Vector((turn.x, turn.y, turn.z))
        raw[list(item.controls)] = _one_sign((x, y, z, turn.w))


def _share(turn: Quaternion | None, share: float) -> Quaternion:
    if turn is None:
        return Quaternion()
    return Quaternion().slerp(turn, share) if share < 1.0 else turn


def _bones(
    rig: ArmatureObject, live: runtime.Runtime, depsgraph: Depsgraph
) -> dict[int, Quaternion]:
    """Joint index -> rotation of its evaluated bone relative to rest, in the bone's axes."""
    places = joint_readings.of(rig, live).places
    seen = rig.evaluated_get(depsgraph) if places else rig
    if not seen.is_evaluated:
        return {}
    found = {}
    for joint, place in places.items():
        bone = seen.pose.bones[place]
        local = seen.convert_space(
            pose_bone=bone, matrix=bone.matrix, from_space="POSE", to_space="LOCAL"
        )
        found[joint] = local.to_quaternion().normalized()
    return found


def _one_sign(turn: tuple[float, float, float, float]) -> tuple[float, ...]:
    """Return q or -q (x y z w), so that the last component that is not 0 is positive."""
    last = next((part for part in reversed(turn) if abs(part) > _NOTHING), 1.0)
    return tuple(-part for part in turn) if last < 0.0 else turn
