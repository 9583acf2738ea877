# SPDX-License-Identifier: GPL-3.0-or-later
"""Records faces that are evaluated only after their frame, so that simulations see them late.

The tables have session uids of deforming armatures as keys and are never saved.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import cast

import bpy
import numpy as np

from ...logic.base.sentences import told
from ..base import compat, parts, session
from ..base.blender_types import ArmatureObject


@dataclass
class _Late:
    """Record of a late face.

    Attributes:
        cause: name of the control or constraint that makes the face late.
        wiring: parent, drivers and constraints of the controls when the record was made; empty for
            a face whose controls depend on no face.
        frames: number of late frames.
    """

    cause: str
    wiring: tuple[object, ...] = ()
    frames: int = 0


# Session uid of a deforming armature -> record of a face whose controls depend on a face.
_circles: dict[int, _Late] = session.table("lateness.circles", ("undo", "load"))
# Session uid of a deforming armature -> record of a face with a control whose value changed during
# the frame.
_others: dict[int, _Late] = session.table("lateness.others", ("undo", "load"))


def is_circle(rig: ArmatureObject, controls: ArmatureObject) -> bool:
    """Whether `note_circle` has recorded that the inputs of a face depend on this or another face.

    A dependence on another face counts even if that face does not depend on this one. If the
    parent, drivers or constraints of the control armature have changed since the record was made,
    this call drops the record, and the result is False.

    Args:
        rig, controls: deforming and control armature of the face.
    """
    kept = _circles.get(rig.session_uid)
    if kept is None:
        return False
    if kept.wiring != _wiring(controls):
        del _circles[rig.session_uid]
        return False
    return True


def note_circle(rig: ArmatureObject, controls: ArmatureObject) -> None:
    """Record that the inputs of a face depend on this or another face, and the cause.

    Args:
        rig, controls: deforming and control armature of the face.
    """
    cause = next(_causes(controls), told("An unknown input of the controls"))
    _circles[rig.session_uid] = _Late(cause, _wiring(controls))


def count(rig: ArmatureObject, before: object, after: object, labels: Sequence[str]) -> None:
    """Count a frame after which a face had to be evaluated again.

    Without a known dependency on a face, the frame counts only if a raw control or the rotation of
    the head differs.

    Args:
        rig: deforming armature.
        before, after: states from last_written.inputs before and after this evaluation: a tuple
            that begins with the bytes of the raw controls.
        labels: names of the raw controls.
    """
    kept = _circles.get(rig.session_uid)
    if kept is None:
        cause = _difference(before, after, labels)
        if not cause:
            return
        kept = _others.setdefault(rig.session_uid, _Late(cause))
        kept.cause = cause
    kept.frames += 1


def _difference(before: object, after: object, labels: Sequence[str]) -> str:
    """The first control with different values in two states, or a text about the head's rotation.

    "" if only other inputs differ, such as the level of detail.

    Args:
        before, after: tuples that begin with the bytes of the raw controls; other types give "".
        labels: names of the raw controls.
    """
    if not isinstance(before, tuple) or not isinstance(after, tuple):
        return ""
    states = cast("tuple[object, ...]", before), cast("tuple[object, ...]", after)
    first, then = (np.frombuffer(cast("bytes", state[0]), np.float32) for state in states)
    if len(first) != len(then):
        return ""
    apart = np.flatnonzero(first != then)
    if len(apart):
        return labels[int(apart[0])]
    return told("The rotation of the head") if states[0][3:] != states[1][3:] else ""


def circle(rig: ArmatureObject) -> str:
    """The control or constraint of a face that depends on a face, as text; "" if none does."""
    kept = _circles.get(rig.session_uid)
    return kept.cause if kept is not None else ""


def words(rig: ArmatureObject) -> str:
    """The sentence of the panel about a late face; "" if it is not late."""
    kept = _circles.get(rig.session_uid)
    if kept is not None:
        return told(
            "{cause} depends on the motion of a face: the effect is shown one "
            "evaluation late, and simulations see the effect one frame late (frames "
            "so far: {count}).",
            cause=kept.cause,
            count=kept.frames,
        )
    kept = _others.get(rig.session_uid)
    if kept is None:
        return ""
    return told(
        "{cause} changed its value during the evaluation of the frame: simulations "
        "saw the new value one frame late (frames so far: {count}).",
        cause=kept.cause,
        count=kept.frames,
    )


def total() -> int:
    """The number of late frames of all faces."""
    return sum(late.frames for kept in (_circles, _others) for late in kept.values())


def forget(rig: ArmatureObject | None = None) -> None:
    """Forget the records of a face.

    Args:
        rig: the character's deforming armature; None: all faces.
    """
    for kept in (_circles, _others):
        if rig is None:
            kept.clear()
        else:
            kept.pop(rig.session_uid, None)


def _wiring(controls: ArmatureObject) -> tuple[object, ...]:
    """Parent, drivers and constraints of the controls, for comparison."""
    data = controls.animation_data
    return (
        controls.parent.session_uid if controls.parent is not None else 0,
        tuple((c.data_path, c.array_index, c.mute) for c in (data.drivers if data else ())),
        tuple((owner, c.name, c.mute) for owner, c in _constraints(controls)),
    )


def _constraints(controls: ArmatureObject) -> Iterator[tuple[str, bpy.types.Constraint]]:
    for constraint in controls.constraints:
        yield controls.name, constraint
    for bone in controls.pose.bones:
        for constraint in bone.constraints:
            yield bone.name, constraint


def _causes(controls: ArmatureObject) -> Iterator[str]:
    """Yields names of driven controls and constraints that read a part of a face directly."""
    members = set()
    for rig in parts.rigs():
        items = parts.meshes_of(rig)
        keys = [item.data.shape_keys for item in items]
        owners = (rig, *items, *(item.data for item in items), *(key for key in keys if key))
        members |= {owner.session_uid for owner in owners}
    data = controls.animation_data
    for curve in data.drivers if data else ():
        targets = (t.id for v in compat.driver_of(curve).variables for t in v.targets)
        if any(item is not None and item.session_uid in members for item in targets):
            yield _label(curve.data_path)
    for owner, constraint in _constraints(controls):
        target = getattr(constraint, "target", None)
        if target is not None and target.session_uid in members:
            yield told("The constraint {name} of {owner}", name=constraint.name, owner=owner)


def _label(path: str) -> str:
    """The property name in a data path: `pose.bones["face"]["jawOpen"]` gives `jawOpen`."""
    quoted = path.rpartition('["')[2].removesuffix('"]')
    return bpy.utils.unescape_identifier(quoted) if quoted != path else path
