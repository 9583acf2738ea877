# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets both eyes look at their target, and moves the lids with the eyes.

Look controls are the raw controls that rotate an eye, such as eyeLookUpL. Their values are found by
evaluating the rig repeatedly, because these controls also move the centres of the eyes and rotate
the eyes slightly sideways. The search always starts at the same values, so that a frame depends
only on its own controls. A few repetitions suffice.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Quaternion, Vector
from numpy.typing import NDArray

from ...logic.base.space import yaw_pitch
from ..base.blender_types import ArmatureObject
from ..character import runtime

Float = NDArray[np.float64]

CONSTRAINT = "Risorius Gaze"  # makes the target follow an object or the world, not the head
STEPS = 4  # most steps of the search; the sample face has less than 0.001 degrees error after 2
_ENOUGH = 2e-5  # radians, about 0.001 degrees: a smaller change ends the search
_AHEAD = np.array([0.0, -1.0, 0.0])
_BLEND = 0.25  # eyes meet on a target that has moved by this fraction of its rest distance
_LIDS = 0.5  # value added to the lid controls at full gaze and amount 1


@dataclass(frozen=True)
class Target:
    """The target of the eyes.

    Positions are in the control armature's space, for a head that is not rotated.

    Attributes:
        rest: rest position of the target, at which the eyes look ahead.
        moved: vector from the rest position to the target.
        meet: convergence, 0 to 1. 0: each eye rotates by the angle by which the direction to the
            target has changed since rest; 1: both eyes look at the target itself.
    """

    rest: Vector
    moved: Vector
    meet: float


def target_of(
    seen: ArmatureObject,
    live: runtime.Runtime,
    turns: Mapping[str, Quaternion],
    local: Vector | None,
) -> Target | None:
    """The Target of a character.

    None if the target bone is missing, or if it follows the head and is at rest.

    Args:
        seen: the evaluated control armature.
        live: the character's Runtime.
        turns: rotations of "neck" and "head" in the armature's axes, including rotations of the
            body.
        local: displacement of the target bone from its rest position, including layers, in the
            axes of the bone; None without a displacement.
    """
    bone = seen.pose.bones.get("eyes")
    if bone is None:
        return None
    rest: Vector = bone.bone.head_local
    hold = bone.constraints.get(CONSTRAINT)
    if hold is not None and not hold.mute:  # the target does not turn with the head
        there = np.array(bone.matrix.translation[:], np.float64)
        if local is not None:  # the displacement that layers add to the constrained place
            more = bone.bone.matrix_local.to_3x3() @ (local - moved(seen, bone))
            there = there + np.array(more[:])
        point = Vector(_unturned(live, there, turns).tolist())
        return Target(rest, point - rest, seen.risorius_converge)
    if local is None:
        return None
    way: Vector = bone.bone.matrix_local.to_3x3() @ local
    if not way.length_squared > 1e-18:
        return None
    far = (rest - _middle(seen)).length
    reach = min(way.length / max(_BLEND * far, 1e-9), 1.0)
    # At rest the eyes look straight ahead. They converge as the target moves away from rest, and
    # fully if it has moved by _BLEND times its rest distance from the eyes.
    meet = seen.risorius_converge * float(np.sin(reach * np.pi / 2.0)) ** 2
    return Target(rest, way, meet)


def moved(seen: ArmatureObject, bone: bpy.types.PoseBone) -> Vector:
    """Displacement of a bone from its rest position, in the bone's axes, with its constraints.

    Args:
        seen: the evaluated armature.
        bone: one of its pose bones.
    """
    return seen.convert_space(
        pose_bone=bone, matrix=bone.matrix, from_space="POSE", to_space="LOCAL"
    ).translation


def _middle(seen: ArmatureObject) -> Vector:
    """The midpoint between the two eye bones at rest, in the armature's space."""
    bones = seen.pose.bones
    heads = [bones[n].bone.head_local for n in ("eye_L", "eye_R") if n in bones]
    return sum(heads, Vector()) / max(len(heads), 1)


def asked(
    live: runtime.Runtime,
    raw: NDArray[np.float32],
    target: Target,
    centres: Mapping[str, Vector],
    maximum: float,
) -> dict[str, Float]:
    """Finds the yaw and pitch that the look controls must add so that each eye meets the target.

    Args:
        live: the character's Runtime.
        raw: float32[R], the controls; look controls are set to rest for the search, so that values
            set by the animator are added and not undone.
        target: the Target.
        centres: centre of each eye at rest, by side, in the armature's axes.
        maximum: upper limit of the control values.

    Returns:
        side -> float64[2] yaw and pitch in radians, clipped to the range of the controls unless
            `meet` is 0.
    """
    if not target.meet:
        return {side: _idle_turn(target, centre) for side, centre in centres.items()}
    trial = raw.copy()
    for controls in live.look.values():
        for index, _yaw, _pitch in controls:
            trial[index] = live.rests[index]
    start = trial.copy()
    angles = {side: np.zeros(2) for side in centres}
    for _ in range(STEPS):
        deltas = live.rig.evaluate(trial).joints
        worst = 0.0
        for side, centre in centres.items():
            wrong = _error(live, deltas, side, centre, target)
            if live.anchors.eyes.get(side) is None:
                wrong = wrong - angles[side]  # no eye joint: the error ignores the angles so far
            before = angles[side]
            angles[side] = _within(live, side, before + wrong, maximum)
            worst = max(worst, float(np.abs(angles[side] - before).max()))
        if worst < _ENOUGH:
            break
        np.copyto(trial, start)
        for side, (yaw, pitch) in angles.items():
            add_look(live, trial, side, yaw, pitch, maximum)
    return angles


def _idle_turn(target: Target, centre: Vector) -> Float:
    """float64[2] yaw and pitch in radians of an eye if the eyes do not converge.

    The rotation is the change of the direction to the target since its rest position. Older files
    depend on exactly these values.
    """
    start = target.rest - centre
    before, after = yaw_pitch(start), yaw_pitch(start + target.moved)
    return np.array((after[0] - before[0], after[1] - before[1]))


def _error(
    live: runtime.Runtime, deltas: NDArray[np.float32], side: str, centre: Vector, target: Target
) -> Float:
    """float64[2]: yaw and pitch in radians by which the wanted direction of an eye differs from its
    current direction.

    Args:
        live: the character's Runtime.
        deltas: float32[J, 9] of a Pose.
        side: "L" or "R".
        centre: centre of the eye at rest, in the armature's space.
        target: the Target.
    """
    joint, ahead = live.anchors.eyes.get(side), _AHEAD
    still, rest = np.array(centre[:], np.float64), np.array(target.rest[:], np.float64)
    there = still
    if joint is not None:
        moved, turn = frame_of(live, joint, deltas)
        there = still + target.meet * (moved - still)
        ahead = turn @ live.rest[joint][:3, :3].T @ _AHEAD
    point = rest + np.array(target.moved[:], np.float64)
    wanted = np.array(yaw_pitch(point - there))
    idle = np.array(yaw_pitch(rest - still)) * (1.0 - target.meet)
    return wanted - idle - np.array(yaw_pitch(ahead))


def _within(live: runtime.Runtime, side: str, angles: Float, maximum: float) -> Float:
    """Clip yaw and pitch to the angles that an eye's look controls reach at value `maximum`.

    Args:
        live: the character's Runtime.
        side: "L" or "R", side of the eye.
        angles: float64[2], yaw and pitch in radians.
        maximum: largest value of a look control.
    """
    low, high = np.zeros(2), np.zeros(2)
    for _index, *at_one in live.look[side]:
        low = np.minimum(low, np.array(at_one) * maximum)
        high = np.maximum(high, np.array(at_one) * maximum)
    return np.clip(angles, low, high)


def add_look(
    live: runtime.Runtime,
    raw: NDArray[np.float32],
    side: str,
    yaw: float,
    pitch: float,
    maximum: float,
) -> None:
    """Increase the look controls of one eye, so that the eye rotates further by two angles.

    Args:
        live: the character's Runtime.
        raw: float32[R], changed in place.
        side: L or R.
        yaw, pitch: the two angles in radians.
        maximum: upper limit of the control values.
    """
    for index, yaw_at_one, pitch_at_one in live.look[side]:
        share = yaw / yaw_at_one if yaw_at_one else pitch / pitch_at_one
        if share > 1e-6:
            raw[index] = min(raw[index] + share, max(maximum, raw[index]))


def frame_of(
    live: runtime.Runtime,
    joint: int,
    deltas: NDArray[np.float32],
    turns: Mapping[str, Quaternion] | None = None,
) -> tuple[Float, Float]:
    """Position and rotation of a posed joint, in the armature's space.

    Args:
        live: the character's Runtime.
        joint: its index in the DNA file.
        deltas: float32[J, 9] of a Pose.
        turns: rotations of "neck" and "head", applied as on the bones of the rig.

    Returns:
        float64[3] position in Blender units, and float64[3, 3] rotation matrix whose columns are
        the joint's axes; joint scales are ignored.
    """
    chain = live.chain(joint)
    moved = np.asarray(deltas[chain.joints], np.float64)
    rotations = live.space.rotations(chain.angles + moved[:, 3:6])
    offsets = chain.offsets + live.space.points(moved[:, :3])
    place, turn = np.zeros(3), np.eye(3)
    for link, number in enumerate(chain.joints.tolist()):
        place = place + turn @ offsets[link]
        extra = _turn_of(live, number, turns) if turns else None
        if extra is not None:
            before = live.rest[chain.joints[link - 1]][:3, :3] if link else np.eye(3)
            turn = turn @ before.T @ extra @ before
        turn = turn @ rotations[link]
    return place, turn


def _turn_of(live: runtime.Runtime, joint: int, turns: Mapping[str, Quaternion]) -> Float | None:
    """float64[3, 3]: rotation in the armature's axes that a joint gets from the neck or head bone.

    None if neither bone rotates the joint. The neck joints share the rotation of the neck bone
    equally.
    """
    if joint == live.anchors.head and "head" in turns:
        return np.array(turns["head"].to_matrix())
    if joint in live.anchors.neck and "neck" in turns:
        share = 1.0 / len(live.anchors.neck)
        return np.array(Quaternion().slerp(turns["neck"], share).to_matrix())
    return None


def _unturned(live: runtime.Runtime, point: Float, turns: Mapping[str, Quaternion]) -> Float:
    """The position of a point that moves with the head, for a head that is not rotated.

    Both positions, `point` and the result, are in the armature's space.
    """
    head = live.anchors.head
    if head is None or not turns:
        return point
    still = np.zeros((len(live.rest), 9), np.float32)
    place, turn = frame_of(live, head, still, turns)
    rest = live.rest[head]
    return rest[:3, 3] + rest[:3, :3] @ turn.T @ (point - place)


def follow_lids(
    live: runtime.Runtime, raw: NDArray[np.float32], amount: float, maximum: float
) -> None:
    """Move the lids with a gaze up or down.

    Args:
        live: the character's Runtime.
        raw: float32[R] with the look controls; the lids' controls are raised in place.
        amount: 0 to 1; at 0 only the rig moves the lids.
        maximum: upper limit of the control values.
    """
    if amount <= 0.0:
        return
    for side, controls in live.look.items():
        for index, _yaw, pitch in controls:
            lid = live.lids.get(f"{'eyeWiden' if pitch > 0 else 'eyeBlink'}{side}")
            if lid is None or not pitch:
                continue
            share = _LIDS * amount * min(max(float(raw[index]), 0.0), maximum)
            raw[lid] += share * max(1.0 - float(raw[lid]), 0.0)  # a closed eye stays closed
