# SPDX-License-Identifier: GPL-3.0-or-later
"""Detects joints whose rotation depends on itself through the neck poses of the face.

The rotations of these joints drive neck poses (RBF correctives of the file). A constraint on the
bone of such a joint may depend, through any number of objects, on a bone or mesh that moves with
these poses. Such a face has no consistent pose.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import cast

import bpy
import numpy as np

from ...logic.base.sentences import told
from ..base import compat, parts, saved
from ..base.blender_types import ArmatureObject
from ..character import runtime

_BONE = re.compile(r'^pose\.bones\["((?:[^"\\]|\\.)*)"\]')
_ARRAYS = (f'["{parts.CHANNELS}"]', f'["{parts.MAPS}"]')
_PER_JOINT = 9  # output rows of a joint in the joint groups
Followed = tuple[bpy.types.ID, str]  # a datablock; name of its bone or property, or ""


def words(cause: str) -> str:
    """The sentence for the user about a circular dependency.

    Args:
        cause: name of the circular rotation or constraint, as the function `cause` gives it.
    """
    return told(
        "{cause} is circular: it follows what the neck poses move. The neck poses follow the "
        "control bones instead.",
        cause=cause,
    )


def cause(rig: ArmatureObject, live: runtime.Runtime, joint: int, bone: bpy.types.PoseBone) -> str:
    """The name of the rotation or constraint because of which a joint's rotation depends on itself.

    The text is empty if the rotation does not depend on itself.

    Args:
        rig: deforming armature.
        live: the character's Runtime.
        joint: index of a joint whose rotation is stored in raw controls.
        bone: bone of the joint.
    """
    moved = _moved_by_poses(live)
    if joint in moved:
        return told("The rotation of {joint}", joint=bone.name)
    names = {
        item.name
        for item in rig.data.bones
        if saved.whole(item, parts.JOINT, -1) in moved or item.name == bone.name
    }
    for hold in bone.constraints:
        seen: set[Followed] = set()
        if any(_leads_to(rig, names, item, seen) for item in _of_constraint(hold)):
            return told("The constraint {name} of {owner}", name=hold.name, owner=bone.name)
    return ""


def _moved_by_poses(live: runtime.Runtime) -> set[int]:
    """The joints that inputs beyond the raw controls (correctives, RBF poses) move."""
    found, raw = set[int](), len(live.dna.raw_control_names)
    for group in live.dna.joint_groups:
        columns = np.asarray(group.input_indices) >= raw
        if columns.any():
            rows = np.asarray(group.values)[:, columns].any(axis=1)
            outputs = np.asarray(group.output_indices)[rows]
            found |= {int(row) // _PER_JOINT for row in outputs}
    return found


def _leads_to(
    rig: ArmatureObject, moved: set[str], followed: Followed, seen: set[Followed]
) -> bool:
    """Whether the neck poses move an object or bone, directly or through dependencies.

    Args:
        rig: deforming armature of the face.
        moved: names of bones that the poses move; their children move too.
        followed: the object or bone to check.
        seen: objects and bones that were checked already; updated.
    """
    owner, name = followed
    if owner == rig and (name in _ARRAYS or _hangs_on(rig, name, moved)):
        return True
    if isinstance(owner, bpy.types.Key) or owner in parts.meshes_of(rig):
        return not isinstance(owner, bpy.types.Key) or owner in _keys_of(rig)
    if followed in seen or not isinstance(owner, bpy.types.Object):
        return False
    seen.add(followed)
    return any(_leads_to(rig, moved, item, seen) for item in _followed_by(owner, name))


def _hangs_on(rig: ArmatureObject, name: str, moved: set[str]) -> bool:
    bone = rig.data.bones.get(name)
    if bone is None:
        return False
    above = cast("list[bpy.types.Bone]", bone.parent_recursive)
    return any(each.name in moved for each in (bone, *above))


def _keys_of(rig: ArmatureObject) -> list[bpy.types.Key]:
    keys = (item.data.shape_keys for item in parts.meshes_of(rig))
    return [key for key in keys if key is not None]


def _followed_by(owner: bpy.types.Object, bone: str) -> Iterator[Followed]:
    """Objects and bones on which an object, or the given bone of this object, depends directly."""
    if owner.parent is not None:
        yield owner.parent, owner.parent_bone if owner.parent_type == "BONE" else ""
    for hold in owner.constraints:
        yield from _of_constraint(hold)
    own = owner.pose.bones.get(bone) if owner.pose is not None else None
    if own is not None:
        above = cast("list[bpy.types.PoseBone]", own.parent_recursive)
        for each in (own, *above):
            for hold in each.constraints:
                yield from _of_constraint(hold)
    for modifier in owner.modifiers:
        target = getattr(modifier, "object", None) or getattr(modifier, "target", None)
        if isinstance(target, bpy.types.Object):
            yield target, ""
    data = owner.animation_data
    for curve in data.drivers if data else ():
        for variable in compat.driver_of(curve).variables:
            yield from _of_variable(variable)


def _of_constraint(hold: bpy.types.Constraint) -> Iterator[Followed]:
    several = getattr(hold, "targets", ())
    for item, end in ((hold, ""), (hold, "pole_"), *((each, "") for each in several)):
        target = getattr(item, f"{end}target", None)
        if target is not None:
            yield target, getattr(item, f"{end}subtarget", "")


def _of_variable(variable: bpy.types.DriverVariable) -> Iterator[Followed]:
    for target in variable.targets:
        if target.id is None:
            continue
        if variable.type != "SINGLE_PROP":
            yield target.id, target.bone_target
            continue
        bone = _BONE.match(target.data_path)
        array = next((each for each in _ARRAYS if target.data_path.startswith(each)), "")
        yield target.id, bpy.utils.unescape_identifier(bone[1]) if bone else array
