# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the inputs of a face: sliders, and control bones of head, neck, eyes and gaze target."""

from __future__ import annotations

import bpy
import numpy as np
from mathutils import Matrix, Quaternion, Vector
from numpy.typing import NDArray

from ...logic.base.space import yaw_pitch
from ..animation import layer_mixing, layers
from ..base import parts
from ..base.blender_types import ArmatureObject, Context, Depsgraph
from ..character import board, rig_placement, runtime
from ..gaze import gaze
from . import joint_turns

Turns = dict[str, Quaternion]  # "neck", "head": in the armature's axes

_STRAIGHT = Matrix.Identity(4)  # matrix_basis of a bone at rest
_AHEAD = Vector((0.0, -1.0, 0.0))  # direction in which a face looks


def read_inputs(
    seen: ArmatureObject,
    live: runtime.Runtime,
    depsgraph: Depsgraph,
    maximum: float = 1.0,
) -> tuple[NDArray[np.float32], Turns]:
    """Read the sliders and bones of an evaluated control armature, with its layers applied.

    Args:
        seen: the evaluated control armature object.
        live: the character's Runtime.
        depsgraph: graph with the bones of the body to which the face may be attached.
        maximum: upper limit of sliders that layers change, and of look controls after adding the
            eye bones.

    Returns:
        float32[R] raw controls, and rotations: "neck" and "head" -> Quaternion in the armature's
        axes; unrotated bones are left out.
    """
    raw, own = read_mixed(seen, live, depsgraph, maximum)
    return complete(seen, live, depsgraph, maximum, raw, own)


def read_mixed(
    seen: ArmatureObject,
    live: runtime.Runtime,
    depsgraph: Depsgraph,
    maximum: float = 1.0,
) -> tuple[NDArray[np.float32], layer_mixing.Bones]:
    """Read the sliders and the control bones with the layers applied.

    Args:
        seen: the evaluated control armature object.
        live: the character's Runtime.
        depsgraph: its scene gives the time at which the layers are read.
        maximum: upper limit of sliders that layers change.

    Returns:
        float32[R] raw controls, before the eye bones add to the look controls; and the rotations of
        the control bones, before the rotations of the body are added.
    """
    bones = seen.pose.bones
    raw = read_leading(seen, live)
    turns = {name: _turn(seen, bones.get(name)) for name in layer_mixing.TURNED}
    target = bones.get("eyes")
    own = layer_mixing.Bones(
        {name: turn for name, turn in turns.items() if turn is not None},
        None if target is None or _rests(target) else gaze.moved(seen, target),
    )
    return layer_mixing.mix(seen, live, raw, own, depsgraph, maximum)


def seen_sliders(context: Context, rig: ArmatureObject) -> dict[str, float]:
    """The visible values of a face by slider names, including board and layers.

    Args:
        context: has the evaluated scene.
        rig: the character.
    """
    live, controls = runtime.there(rig), parts.controls_there(rig)
    if not layers.has_any(controls):
        return board.raw_now(rig)
    controls.update_tag()  # a script may have set sliders without notifying Blender
    depsgraph = context.evaluated_depsgraph_get()
    seen = controls.evaluated_get(depsgraph)
    raw, _bones = read_mixed(seen, live, depsgraph, parts.maximum_of(controls))
    face = controls.pose.bones[parts.FACE]
    pairs = zip(live.labels, raw.tolist(), strict=True)
    return {label: value for label, value in pairs if label in face}


def complete(
    seen: ArmatureObject,
    live: runtime.Runtime,
    depsgraph: Depsgraph,
    maximum: float,
    raw: NDArray[np.float32],
    own: layer_mixing.Bones,
) -> tuple[NDArray[np.float32], Turns]:
    """Add the rotations of the body and the effect of the eye bones.

    Args:
        seen: the evaluated control armature.
        live: the character's Runtime.
        depsgraph: an evaluated graph with the controls and the body.
        maximum: largest value of the sliders.
        raw: float32[R], the sliders with their layers; the look controls and the controls of joint
            rotations are changed in place.
        own: rotations of the character's own control bones, with layers.

    Returns:
        raw; and the rotations of neck and head including the body: "neck" and "head" -> Quaternion
        in the armature's axes, without entries for unrotated bones.
    """
    turns = rig_placement.body_turns(seen.original, depsgraph)
    share = seen.risorius_body_turn
    if share < 1.0:  # at 1 the rotation keeps its exact bits
        turns = {name: Quaternion().slerp(turn, share) for name, turn in turns.items()}
    for name in ("neck", "head"):
        turn = own.turns.get(name)
        if turn is not None:
            turns[name] = turns[name] @ turn if name in turns else turn
    _add_look(seen, live, raw, maximum, turns, own)
    joint_turns.fill(seen, live, depsgraph, raw, turns)
    return raw, turns


def read_leading(seen: ArmatureObject, live: runtime.Runtime) -> NDArray[np.float32]:
    """Read the raw controls from the sliders, or from the face board if the board moves the face.

    Args:
        seen: the evaluated control armature.
        live: the character's Runtime.

    Returns:
        float32[R], raw controls before layers.
    """
    if not board.leads(seen.original, live):
        return read_sliders(seen, live)
    others = None if live.table.reached.all() else read_sliders(seen, live)
    return board.raw_of(board.read(seen, live), live, others)


def read_sliders(seen: ArmatureObject, live: runtime.Runtime) -> NDArray[np.float32]:
    """Read the sliders alone. A value that is not finite counts as 0, a missing slider as its rest
    value.

    Args:
        seen: the evaluated control armature.
        live: the character's Runtime, for the names and order of sliders.

    Returns:
        float32[R], slider values.
    """
    values = dict(seen.pose.bones[parts.FACE].items())
    rests = live.rests
    found = [values.get(label, rests[i]) for i, label in enumerate(live.labels)]
    try:
        raw = np.array(found, np.float32)
    except (TypeError, ValueError):  # a damaged slider with text or a list counts as 0
        raw = np.array([v if isinstance(v, int | float) else 0.0 for v in found], np.float32)
    if not np.isfinite(raw).all():
        np.nan_to_num(raw, copy=False, nan=0.0, posinf=0.0, neginf=0.0)
    return raw


def _rests(bone: bpy.types.PoseBone) -> bool:
    return not bone.constraints and bone.matrix_basis == _STRAIGHT


def _turn(seen: ArmatureObject, bone: bpy.types.PoseBone | None) -> Quaternion | None:
    """A bone's rotation relative to rest and parent, in the armature's axes.

    None if the bone is missing or not rotated.
    """
    if bone is None or _rests(bone):
        return None
    turn = rig_placement.own_turn(seen, bone)
    return turn if turn.angle else None


def _add_look(
    seen: ArmatureObject,
    live: runtime.Runtime,
    raw: NDArray[np.float32],
    maximum: float,
    turns: Turns,
    own: layer_mixing.Bones,
) -> None:
    """Add the rotations of eye bones and gaze target to the look controls, and move the lids.

    Args:
        seen: the evaluated control armature.
        live: the character's Runtime.
        raw: float32[R], the sliders with their layers; changed in place.
        maximum: upper limit of the look controls.
        turns: rotations of neck and head including the body.
        own: rotations of the character's own control bones, with layers.
    """
    bones = seen.pose.bones
    eyes = {side: bones[f"eye_{side}"] for side in live.look if f"eye_{side}" in bones}
    target = gaze.target_of(seen, live, turns, own.target)
    asked = {}
    if target is not None:
        centres = {side: bone.bone.head_local for side, bone in eyes.items()}
        asked = gaze.asked(live, raw, target, centres, maximum)
    for side in eyes:
        turn = own.turns.get(f"eye_{side}")
        if turn is None and side not in asked:
            continue
        yaw, pitch = yaw_pitch((turn or Quaternion()) @ _AHEAD)
        more = asked.get(side, (0.0, 0.0))
        gaze.add_look(live, raw, side, yaw + more[0], pitch + more[1], maximum)
    gaze.follow_lids(live, raw, seen.risorius_lids, maximum)
