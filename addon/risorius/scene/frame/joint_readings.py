# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds joints of neck and head that are rotated by constraints, keys or drivers of their own bone.

The rotations of these joints are read from their evaluated bones. The search runs once per frame
and after edits.
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy

from ..base import compat, console, drivers, last_written, parts
from ..base.blender_types import ArmatureObject
from ..character import runtime
from ..skinning import bone_writer
from . import joint_circles


@dataclass
class Reading:
    """The sources of joint rotations of one face, valid until the file is edited.

    Attributes:
        held: indices of pose bones whose joint rotation is stored in raw controls.
        wiring: constraints, actions and drivers, compared to notice changes.
        keyed: indices of pose bones of neck and head with keys or drivers on the deforming
            armature; the evaluator does not write these bones.
        places: joint index -> index of its pose bone, for rotations that are read from the bone.
        circle: the reason why a joint with constraints is not read, because its rotation depends
            on itself; "" if all are read.
        is_fresh: whether the file was not edited since the Reading was made.
    """

    held: tuple[int, ...]
    wiring: tuple[object, ...]
    keyed: frozenset[int]
    places: dict[int, int]
    circle: str
    is_fresh: bool = True


def of(rig: ArmatureObject, live: runtime.Runtime) -> Reading:
    """The Reading of a face, updated if the file was edited.

    Args:
        rig: deforming armature.
        live: the character's Runtime.
    """
    kept = last_written.readings.get(rig.session_uid)
    if isinstance(kept, Reading) and kept.is_fresh:
        return kept
    return look(rig, live, edited=True)


def look(rig: ArmatureObject, live: runtime.Runtime, edited: bool) -> Reading:
    """Update the Reading of a face; a new circular dependency is printed to the console.

    Args:
        rig: deforming armature.
        live: the character's Runtime.
        edited: True: the file was edited since the last Reading, so search again. False: search
            again only if the wiring changed.
    """
    kept = last_written.readings.get(rig.session_uid)
    before = kept if isinstance(kept, Reading) else None
    if before is None and not live.turning and not drivers.moves(rig):
        return Reading((), (), frozenset(), {}, "")
    if before is not None and not edited and before.wiring == _wiring(rig, before.held):
        before.is_fresh = True
        return before
    writer = bone_writer.writer_of(rig, live)
    keyed, held = _keyed(rig, writer), tuple(writer.driving.values())
    bones, places, circles = rig.pose.bones, dict[int, int](), list[str]()
    for item in live.turning:
        place = writer.driving.get(item.joint)
        if place is None or not (not item.bone or place in keyed or len(bones[place].constraints)):
            continue
        circle = joint_circles.cause(rig, live, item.joint, bones[place])
        if circle:
            circles.append(circle)
        else:
            places[item.joint] = place
    found = Reading(held, _wiring(rig, held), keyed, places, next(iter(circles), ""))
    last_written.readings[rig.session_uid] = found
    if found.circle and (before is None or before.circle != found.circle):
        console.say(f"{rig.name}: {joint_circles.words(found.circle)}")
    return found


def reads(rig: ArmatureObject) -> bool:
    """Whether joint rotations of a face are read from its bones.

    Args:
        rig: deforming armature.
    """
    live = runtime.of(rig) if parts.BAKED not in rig else None
    return live is not None and bool(live.turning and of(rig, live).places)


def note_edit() -> None:
    """Mark all Readings of faces as outdated after an edit."""
    for kept in last_written.readings.values():
        if isinstance(kept, Reading):
            kept.is_fresh = False


def words(rig: ArmatureObject) -> str:
    """The sentence of the panel about joints that depend on themselves; "" if there are none.

    Args:
        rig: deforming armature.
    """
    kept = last_written.readings.get(rig.session_uid)
    if not isinstance(kept, Reading) or not kept.circle:
        return ""
    return joint_circles.words(kept.circle)


def _wiring(rig: ArmatureObject, held: tuple[int, ...]) -> tuple[object, ...]:
    bones = rig.pose.bones
    stacks = [(place, bones[place].constraints) for place in held]
    holds = tuple(
        (place, hold.name, hold.type, hold.mute)
        for place, stack in stacks
        if len(stack)
        for hold in stack
    )
    if not drivers.moves(rig):
        return (holds,)
    actions = tuple(action.session_uid for action in compat.played_actions(rig))
    return holds, actions, len(rig.animation_data.drivers) if rig.animation_data else 0


def _keyed(rig: ArmatureObject, writer: bone_writer.Writer) -> frozenset[int]:
    """Indices of pose bones of neck and head that an action, a strip or a driver rotates."""
    if not drivers.moves(rig):
        return frozenset()
    places = {int(writer.where[row]) for _name, row, _share, _rest in writer.turning}
    bones = rig.pose.bones
    named = {
        f'pose.bones["{bpy.utils.escape_identifier(bones[place].name)}"]': place
        for place in places | set(writer.driving.values())
    }
    curves = [
        curve
        for action in compat.played_actions(rig)
        for curve in compat.curves_for(action, rig)
        if not curve.mute
    ]
    curves += list(rig.animation_data.drivers) if rig.animation_data else []
    split = (curve.data_path.rpartition(".") for curve in curves)
    return frozenset(
        named[bone] for bone, _dot, end in split if bone in named and end.startswith("rotation_")
    )
