# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes captured faces to the sliders and the head bone, and restores the earlier values.

Writing makes no keys and no undo steps.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import bpy
from mathutils import Euler, Quaternion

from ..animation import clip_actions, range_properties
from ..base import parts
from ..base.blender_types import ArmatureObject
from ..character import runtime
from .sessions import Session

_HEAD = "head"


def show(session: Session, controls: ArmatureObject) -> bool:
    """Write the newest received face to a character.

    Args:
        session: session of the character.
        controls: its control armature.

    Returns:
        Whether a new face was written.
    """
    _follow_ranges(session, controls)
    frame = session.receiver.latest(session.subject)
    if frame is None or frame.sequence == session.sequence:
        return False
    session.sequence = frame.sequence
    if not session.recent or session.recent[-1] is not frame:
        session.recent.append(frame)
    shaper = session.shaper
    shaper.maximum = parts.maximum_of(controls)
    controlled, values = shaper.apply(frame)
    if controlled != session.names:
        _plan(session, controls, controlled)
    bone, values = controls.pose.bones[parts.FACE], values.tolist()
    for slider, place in session.sliders:
        if slider not in session.before:
            session.before[slider] = bone.get(slider, 0.0)
        bone[slider] = values[place]
    if shaper.head_gain:
        _turn_head(session, controls, dict(zip(controlled, values, strict=True)))
    controls.update_tag()
    return True


def _follow_ranges(session: Session, controls: ArmatureObject) -> None:
    """Use the current capture ranges of the face. If they changed, the face is written again."""
    if session.ranges_seen != range_properties.changes():
        session.ranges_seen = range_properties.changes()
        session.shaper.ranges = range_properties.of(controls)
        session.sequence = 0


def _plan(session: Session, controls: ArmatureObject, controlled: tuple[str, ...]) -> None:
    """Find the slider of this character for each control of the capture.

    Args:
        session: session of the character; its names and sliders are set.
        controls: the control armature.
        controlled: control names of the captured frame.
    """
    rig = parts.rig_of(controls)
    assert rig is not None
    live = runtime.there(rig)
    places = {name: place for place, name in enumerate(controlled)}
    face = controls.pose.bones[parts.FACE]
    found = {}
    for label, name in zip(live.labels, live.dna.raw_control_names, strict=True):
        place = places.pop(name, None)
        if place is not None and label in face:
            found[label] = place
    session.names, session.sliders = controlled, tuple(found.items())


def _turn_head(session: Session, controls: ArmatureObject, values: Mapping[str, float]) -> None:
    bone = controls.pose.bones.get(_HEAD)
    if bone is None or f"{_HEAD}.yaw" not in values:
        return
    if session.turn is None:
        session.turn = _rotation(bone)
    yaw, pitch, roll = (values.get(f"{_HEAD}.{a}", 0.0) for a in ("yaw", "pitch", "roll"))
    # The face looks along -y, its own left is +x. Rotate about the axes of the head: yaw about z,
    # then pitch about the rotated -x, then roll about the rotated y.
    turn = Quaternion((0.0, 0.0, 1.0), yaw) @ Quaternion((1.0, 0.0, 0.0), -pitch)
    turn = turn @ Quaternion((0.0, 1.0, 0.0), roll)
    rest = bone.bone.matrix_local.to_quaternion()
    _rotate(bone, rest.inverted() @ turn @ rest)


def _rotation(bone: bpy.types.PoseBone) -> tuple[str, tuple[float, ...]]:
    """A bone's rotation mode, and the values of its rotation in this mode."""
    return bone.rotation_mode, tuple(getattr(bone, clip_actions.rotation_path(bone)))


def _as_quaternion(mode: str, values: Sequence[float]) -> Quaternion:
    """Convert a rotation to a quaternion.

    Args:
        mode: rotation mode of a bone.
        values: values of the rotation in this mode.
    """
    if mode == "QUATERNION":
        return Quaternion(values).normalized()
    if mode == "AXIS_ANGLE":
        return Quaternion(values[1:], values[0])
    return Euler(values, mode).to_quaternion()


def _rotate(bone: bpy.types.PoseBone, turn: Quaternion) -> None:
    if bone.rotation_mode == "QUATERNION":
        bone.rotation_quaternion = turn
    elif bone.rotation_mode == "AXIS_ANGLE":
        axis, angle = turn.to_axis_angle()
        bone.rotation_axis_angle = (angle, *axis)
    else:
        before = Euler(bone.rotation_euler[:], bone.rotation_mode)
        bone.rotation_euler = turn.to_euler(bone.rotation_mode, before)


def put_back(session: Session, controls: ArmatureObject) -> None:
    """Restore the values that sliders and head bone had before the capture.

    Args:
        session: session of the character.
        controls: its control armature.
    """
    bone = controls.pose.bones[parts.FACE]
    for slider, value in session.before.items():
        if slider in bone:
            bone[slider] = value
    head = controls.pose.bones.get(_HEAD)
    if session.turn is not None and head is not None:
        mode, values = session.turn
        if head.rotation_mode == mode:
            setattr(head, clip_actions.rotation_path(head), values)
        else:
            _rotate(head, _as_quaternion(mode, values))
    session.before.clear()
    session.turn, session.sequence = None, 0
    controls.update_tag()
