# SPDX-License-Identifier: GPL-3.0-or-later
"""Faces that are evaluated after their frame, and the reasons: simulations see them one frame late.

The data are kept by session uids and never saved.
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
    """Attributes: cause the reason as text; wiring see _wiring; frames late frames."""

    cause: str
    wiring: tuple[object, ...] = ()
    frames: int = 0


# Deforming armature -> why its controls wait for a face.
_circles: dict[int, _Late] = session.table("lateness.circles", ("undo", "load"))
# Deforming armature -> control whose value changed during the frame.
_others: dict[int, _Late] = session.table("lateness.others", ("undo", "load"))


def is_circle(rig: ArmatureObject, controls: ArmatureObject) -> bool:
    """Whether a face is known to depend on itself or another face; forgotten when its dependencies
    change.

    Args:
        rig, controls: its armatures.
    """
    kept = _circles.get(rig.session_uid)
    if kept is None:
        return False
    if kept.wiring != _wiring(controls):
        del _circles[rig.session_uid]
        return False
    return True


def note_circle(rig: ArmatureObject, controls: ArmatureObject) -> None:
    """Note that the inputs of a face depend on a face. Args: rig, controls its armatures."""
    cause = next(_causes(controls), told("Something that the controls follow"))
    _circles[rig.session_uid] = _Late(cause, _wiring(controls))


def count(rig: ArmatureObject, before: object, after: object, labels: Sequence[str]) -> None:
    """Count a frame after which a face had to be brought up once more.

    Args:
        rig: deforming armature.
        before, after: the states of evaluate.evaluate: bytes of the raw controls, level, ...
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
    """The control with two values; empty if the level of detail differed."""
    if not isinstance(before, tuple) or not isinstance(after, tuple):
        return ""
    states = cast("tuple[object, ...]", before), cast("tuple[object, ...]", after)
    first, then = (np.frombuffer(cast("bytes", state[0]), np.float32) for state in states)
    if len(first) != len(then):
        return ""
    apart = np.flatnonzero(first != then)
    if len(apart):
        return labels[int(apart[0])]
    return told("The turn of the head") if states[0][3:] != states[1][3:] else ""


def circle(rig: ArmatureObject) -> str:
    """The control of a face that depends on a face, as text; empty if none does."""
    kept = _circles.get(rig.session_uid)
    return kept.cause if kept is not None else ""


def words(rig: ArmatureObject) -> str:
    """The sentence of the panel about a late face; empty for others."""
    kept = _circles.get(rig.session_uid)
    if kept is not None:
        return told(
            "{cause} depends on what a face does: it is shown one pass late, and simulations see "
            "it one frame late (frames so far: {count}).",
            cause=kept.cause,
            count=kept.frames,
        )
    kept = _others.get(rig.session_uid)
    if kept is None:
        return ""
    return told(
        "{cause} had another value after the frame than before it: simulations saw it one frame "
        "late (frames so far: {count}).",
        cause=kept.cause,
        count=kept.frames,
    )


def total() -> int:
    """How many frames were late, of all faces."""
    return sum(late.frames for kept in (_circles, _others) for late in kept.values())


def forget(rig: ArmatureObject | None = None) -> None:
    """Forget the data of a face, or of all. Args: rig its deforming armature."""
    for kept in (_circles, _others):
        if rig is None:
            kept.clear()
        else:
            kept.pop(rig.session_uid, None)


def _wiring(controls: ArmatureObject) -> tuple[object, ...]:
    """The direct dependencies of the controls, for comparison only."""
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
    """Names of controls that depend directly on a part of a face."""
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
    """`pose.bones["face"]["jawOpen"]` as `jawOpen`."""
    quoted = path.rpartition('["')[2].removesuffix('"]')
    return bpy.utils.unescape_identifier(quoted) if quoted != path else path
