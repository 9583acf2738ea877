# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the joints of a pose to the bones of the deforming armature in bulk."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix, Quaternion
from numpy.typing import NDArray

from ... import native
from ..base import last_written, parts, saved
from ..base.blender_types import ArmatureObject, Depsgraph
from ..character import runtime


@dataclass
class Writer:
    """Data for writing the bones of one armature, valid until its bones change.

    Attributes:
        count: number of bones of the armature.
        where: int64[n], indices of the pose bones that the evaluator writes.
        space: risorius.BoneSpace of these bones, in the same order.
        turning: for each joint of neck and head: (name of the control bone, row in `where`, share
            of the control bone's rotation that the joint gets, Quaternion of the joint's rest
            rotation in the armature's axes).
        buffers: property such as "location" -> float32, its values for all bones, flat; None if
            the evaluator writes every bone.
        driving: joint -> index of its pose bone, for joints whose rotation is in raw controls.
    """

    count: int
    where: NDArray[np.int64]
    space: native.BoneSpace
    turning: list[tuple[str, int, float, Quaternion]]
    buffers: dict[str, NDArray[np.float32]] | None
    driving: dict[int, int]


_WIDTHS = {"location": 3, "rotation_quaternion": 4, "scale": 3, "rotation_euler": 3}


def write(
    rig: ArmatureObject,
    live: runtime.Runtime,
    deltas: NDArray[np.float32],
    turns: Mapping[str, Quaternion],
    depsgraph: Depsgraph | None,
    keyed: Collection[int] = (),
) -> bool:
    """Write the bones of all joints that the rig moves; other bones keep the user's values.

    Args:
        rig: the deforming armature, the original.
        live: its Runtime.
        deltas: float32[J, 9] of a Pose.
        turns: "neck" and "head" -> additional Quaternion in the armature's axes.
        depsgraph: graph for reading animated values of other bones; None if the other bones have no
            animation.
        keyed: indices of pose bones of neck and head that also keep the user's values.

    Returns:
        Whether Blender accepted the values; it silently refuses bulk writes to overrides.
    """
    bones = rig.pose.bones
    writer = writer_of(rig, live)
    owned = pose_of(writer, deltas, turns)
    if writer.buffers is None and not keyed:
        for name, values in owned.items():
            bones.foreach_set(name, values.ravel())
        return _taken(rig, {n: v.ravel() for n, v in owned.items()})
    # A bulk write sets all bones, so it has to repeat the animated values of the other bones.
    seen = (rig if depsgraph is None else rig.evaluated_get(depsgraph)).pose.bones
    source = seen if len(seen) == writer.count else bones
    buffers = writer.buffers or _buffers(writer.count)
    written_rows = ~np.isin(writer.where, list(keyed))
    where = writer.where[written_rows]
    for name, flat in buffers.items():
        source.foreach_get(name, flat)
        if name in owned:
            flat.reshape(-1, _WIDTHS[name])[where] = owned[name][written_rows]
        bones.foreach_set(name, flat)
    return _taken(rig, buffers)


def _buffers(count: int) -> dict[str, NDArray[np.float32]]:
    return {name: np.empty(count * width, np.float32) for name, width in _WIDTHS.items()}


def pose_of(
    writer: Writer, deltas: NDArray[np.float32], turns: Mapping[str, Quaternion]
) -> dict[str, NDArray[np.float32]]:
    """The values of the bones that the evaluator writes.

    Args:
        writer: the Writer of the armature.
        deltas: float32[J, 9] of a Pose.
        turns: "neck" and "head" -> additional Quaternion in the armature's axes.

    Returns:
        "location", "rotation_quaternion", "scale" -> float32[n, width].
    """
    location, rotation, scale = writer.space.evaluate(deltas)
    for name, row, share, rest in writer.turning:
        if name in turns:
            part = Quaternion().slerp(turns[name], share) if share < 1.0 else turns[name]
            rotation[row] = (rest.inverted() @ part @ rest) @ Quaternion(rotation[row])
    return {"location": location, "rotation_quaternion": rotation, "scale": scale}


def _taken(rig: ArmatureObject, written: Mapping[str, NDArray[np.float32]]) -> bool:
    if not rig.override_library:
        return True
    return all(is_there(rig.pose.bones, name, flat) for name, flat in written.items())


def is_there(values: bpy.types.bpy_prop_collection, name: str, wanted: NDArray[np.float32]) -> bool:
    """Whether a bulk read returns the written values.

    Args:
        values: a collection of properties.
        name: name of the member to read.
        wanted: float32, flat, expected values.
    """
    got = np.empty_like(wanted)
    values.foreach_get(name, got)
    return np.array_equal(got, wanted)


def writer_of(rig: ArmatureObject, live: runtime.Runtime) -> Writer:
    """The Writer of an armature, made again if the number of its bones has changed.

    Args:
        rig: deforming armature.
        live: the character's Runtime.
    """
    kept = last_written.bone_writers.get(rig.session_uid)
    if not isinstance(kept, Writer) or kept.count != len(rig.pose.bones):
        kept = last_written.bone_writers[rig.session_uid] = _make_writer(rig, live)
    return kept


def _make_writer(rig: ArmatureObject, live: runtime.Runtime) -> Writer:
    kept = rig.data.bones  # by name: after undo PoseBone.bone may point into freed memory
    names = [bone.name for bone in rig.pose.bones]
    joints = [saved.whole(kept[n], parts.JOINT, -1) if n in kept else -1 for n in names]
    where = [i for i, joint in enumerate(joints) if joint in live.owned]
    row_of = {joints[i]: row for row, i in enumerate(where)}
    shares = [("neck", joint, 1.0 / len(live.anchors.neck)) for joint in live.anchors.neck]
    if live.anchors.head is not None:
        shares.append(("head", live.anchors.head, 1.0))
    turning = [
        (name, row_of[joint], share, Matrix(live.rest[joint][:3, :3].tolist()).to_quaternion())
        for name, joint, share in shares
        if joint in row_of
    ]
    buffers = _buffers(len(joints)) if len(where) < len(joints) else None
    return Writer(
        count=len(joints),
        where=np.array(where, np.int64),
        space=live.bone_space([joints[i] for i in where]),
        turning=turning,
        buffers=buffers,
        driving={t.joint: joints.index(t.joint) for t in live.turning if t.joint in joints},
    )
