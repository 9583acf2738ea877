# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the baked values of all animated properties from the samples of a face.

A track (actions.Track) has the values of one property at all baked frames.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping

import bpy
import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ... import native
from ...logic.animation import key_reduction
from ..animation.actions import Track
from ..base import drivers, parts
from ..base.blender_types import ArmatureObject
from ..character import armatures, runtime
from ..frame import joint_readings
from ..skinning import bone_writer
from . import sampling

_WIDTHS = {"location": 3, "rotation_quaternion": 4, "rotation_euler": 3, "scale": 3}
_TURNS = {"QUATERNION": "rotation_quaternion", "AXIS_ANGLE": "rotation_axis_angle"}
_CHANNEL = re.compile(r'^\["channels"\]\[(\d+)\]$')


def evaluate(live: runtime.Runtime, samples: sampling.Samples, lod: int) -> native.Pose:
    """Evaluate the rig at all frames of the samples.

    Args:
        live: the character's Runtime.
        samples: from sampling.sample, of N frames.
        lod: level of detail.

    Returns:
        A risorius.Pose with arrays of N frames.
    """
    return live.rig.evaluate_batch(samples.raw, lod)


def rig_tracks(
    rig: ArmatureObject,
    live: runtime.Runtime,
    samples: sampling.Samples,
    pose: native.Pose,
    wanted: Collection[str],
    target: ArmatureObject | None = None,
) -> list[Track]:
    """Tracks of the deforming armature.

    Bones and arrays that the rig writes get the values of the first frame in the target.

    Args:
        rig: the character's deforming armature.
        live: the character's Runtime.
        samples: inputs of the face, from sampling.sample.
        pose: from `evaluate`.
        wanted: parts to bake; only "BONES" and "MAPS" have an effect here.
        target: the armature that will play the tracks: a copy of the rig; None: the rig.

    Returns:
        Tracks of bones, animated maps, blend shape channels that the user's drivers read, the
        object transform, and other properties that the user animates.
    """
    target = target or rig
    found = {t.path: t for t in _others(samples.others.get(rig, {}), rig)}
    tracks = [t for path, t in found.items() if not _is_bone_channel(path) and not _is_array(path)]
    if "BONES" in wanted:
        tracks += _bones(rig, live, samples, pose.joints, target)
        tracks += [t for path, t in found.items() if path.endswith(".rotation_axis_angle")]
        tracks += _place(rig, samples, target)
    if "MAPS" in wanted:
        tracks += _array(target, parts.MAPS, pose.animated_maps, "Maps")
    tracks += _array(target, parts.CHANNELS, pose.blend_shapes, "Channels", _read_channels(rig))
    return tracks


def _is_bone_channel(path: str) -> bool:
    return path.startswith("pose.bones[") and path.endswith((*_WIDTHS, "rotation_axis_angle"))


def _is_array(path: str) -> bool:
    return path in (f'["{parts.MAPS}"]', f'["{parts.CHANNELS}"]')


def _others(values: Mapping[str, list[list[float]]], owner: bpy.types.ID) -> Iterator[Track]:
    """A track for each sampled property.

    Args:
        values: data path -> components at each frame.
    """
    for path, rows in values.items():
        group = path.split('"')[1] if '"' in path else "Object Transforms"
        indexed = len(rows[0]) > 1
        yield Track(path, group, np.array(rows, np.float32), None, 0, indexed)


def _bones(
    rig: ArmatureObject,
    live: runtime.Runtime,
    samples: sampling.Samples,
    joints: NDArray[np.float32],
    target: ArmatureObject,
) -> list[Track]:
    bones, writer = rig.pose.bones, bone_writer.writer_of(rig, live)
    owned = {n: np.empty((len(joints), len(writer.where), w), np.float32) for n, w in _OWNED}
    for number, deltas in enumerate(joints):
        for name, values in bone_writer.pose_of(writer, deltas, samples.turns[number]).items():
            owned[name][number] = values
    owned["rotation_quaternion"] = key_reduction.continuous(owned["rotation_quaternion"])
    keyed = joint_readings.of(rig, live).keyed
    row_of = {int(i): row for row, i in enumerate(writer.where) if int(i) not in keyed}
    for name, values in owned.items():
        flat = np.empty((len(bones), _WIDTHS[name]), np.float32)
        target.pose.bones.foreach_get(name, flat.ravel())
        flat[list(row_of)] = values[0][list(row_of.values())]
        target.pose.bones.foreach_set(name, flat.ravel())
    tracks = []
    for i, bone in enumerate(bones):
        turn = _TURNS.get(bone.rotation_mode, "rotation_euler")
        base = f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].'
        for name in ("location", turn, "scale"):
            if i in row_of and name in owned:
                values = owned[name][:, row_of[i]]
                tracks.append(Track(base + name, bone.name, values, values[0]))
            elif samples.bones is not None and name in samples.bones:
                values = samples.bones[name][:, i]
                if name == "rotation_quaternion":
                    values = key_reduction.continuous(values)
                tracks.append(Track(base + name, bone.name, values, getattr(bone, name)[:]))
    return tracks


_OWNED = (("location", 3), ("rotation_quaternion", 4), ("scale", 3))


def _place(rig: ArmatureObject, samples: sampling.Samples, target: ArmatureObject) -> list[Track]:
    """Tracks of the rig's object transform.

    Empty if the rig does not follow the control armature, has a parent or constraints, or does not
    move.

    Args:
        rig: the character's deforming armature.
        samples: inputs of the face, from sampling.sample.
        target: the armature that will play the tracks; if the rig does not move, it gets the
            transform.
    """
    if not rig.get(parts.FOLLOW) or rig.parent or rig.constraints:
        return []
    matrices = samples.places
    if (matrices == matrices[0]).all():
        target.matrix_basis = Matrix(matrices[0].tolist())
        return []
    before = target.matrix_basis.copy()
    mode = target.rotation_mode
    turn = _TURNS.get(mode, "rotation_euler")
    rows = {"location": [], turn: [], "scale": []}
    last = None
    for matrix in matrices:
        target.matrix_basis = Matrix(matrix.tolist())
        if turn == "rotation_euler" and last is not None:
            target.rotation_euler.make_compatible(last)
        last = target.rotation_euler.copy()
        for name, values in rows.items():
            values.append(list(getattr(target, name)))
    target.matrix_basis = before
    rows = {name: np.array(values, np.float32) for name, values in rows.items()}
    if turn == "rotation_quaternion":
        rows[turn] = key_reduction.continuous(rows[turn])
    return [Track(name, "Object Transforms", values) for name, values in rows.items()]


def _array(
    target: ArmatureObject,
    name: str,
    values: NDArray[np.float32],
    group: str,
    indices: Iterable[int] | None = None,
) -> list[Track]:
    """Tracks of an array property, one for each of the given indices; None: all indices.

    The property gets the values of the first frame. Empty if the property has another length than
    `values` has columns.

    Args:
        target: the armature with the property.
        name: name of the property.
        values: float32[N, width], the values at N frames.
        group: name of the group of the F-curves.
        indices: indices of the entries to bake.
    """
    if len(target.get(name, ())) != values.shape[1] or not values.shape[1]:
        return []
    target[name][:] = values[0].tolist()
    chosen = range(values.shape[1]) if indices is None else indices
    return [
        Track(f'["{name}"]', group, values[:, [i]], values[0, i], i)
        for i in chosen
        if i < values.shape[1]
    ]


def _read_channels(rig: ArmatureObject) -> list[int]:
    """The indices of the blend shape channels that the user's own drivers read."""
    ours = {m.data.shape_keys for m in parts.meshes_of(rig)}
    found = set()
    for owner, target in drivers.targets_at(rig):
        entry = _CHANNEL.match(target.data_path)
        if entry and owner not in ours:
            found.add(int(entry.group(1)))
    return sorted(found)


def key_tracks(
    key: bpy.types.Key,
    names: Mapping[int, str],
    weights: NDArray[np.float32],
    others: Mapping[str, list[list[float]]] | None = None,
) -> list[Track]:
    """Tracks of the shape keys of a mesh. The shape keys get the values of the first frame.

    Args:
        key: the Key datablock.
        names: index of a blend shape channel -> name of its shape key.
        weights: float32[N, B], blend shape weights at N frames.
        others: data path -> values at the N frames, of shape keys that the user animates.

    Returns:
        One track for each key in `names`, and for each path in `others`.
    """
    tracks = list(_others(others or {}, key))
    for channel, name in names.items():
        values = weights[:, [channel]]
        key.key_blocks[name].value = float(values[0, 0])
        tracks.append(Track(key_path(name), "Shape Keys", values, values[0], indexed=False))
    return tracks


def key_path(name: str) -> str:
    """The data path of a shape key's value, relative to the Key datablock."""
    return f'key_blocks["{bpy.utils.escape_identifier(name)}"].value'


def control_tracks(
    controls: ArmatureObject, live: runtime.Runtime, samples: sampling.Samples
) -> list[Track]:
    """Tracks of the control armature: sliders, control bones, and other animated properties.

    Args:
        controls: control armature.
        live: the character's Runtime.
        samples: inputs of the face, from sampling.sample.

    Returns:
        Tracks. `actions.write` makes no curve for a slider that has its rest value now and at all
        frames, or for a property of a bone that has its current value at all frames.
    """
    face = controls.pose.bones[parts.FACE]
    found = {t.path: t for t in _others(samples.others.get(controls, {}), controls)}
    for i, label in enumerate(live.labels):
        path = parts.property_path(label)
        at_rest = np.float32(face.get(label, 0.0)) == np.float32(live.rests[i])
        found[path] = Track(
            path,
            armatures.key_group(label),
            samples.sliders[:, [i]],
            live.rests[i] if at_rest else None,
            indexed=False,
        )
    for name, matrices in samples.basis.items():
        found.update((t.path, t) for t in _control_bone(controls.pose.bones[name], matrices))
    return list(found.values())


def _control_bone(bone: bpy.types.PoseBone, matrices: NDArray[np.float64]) -> Iterator[Track]:
    """Tracks of location, rotation and scale of a control bone, in the bone's rotation mode."""
    turn = _TURNS.get(bone.rotation_mode, "rotation_euler")
    rows = {"location": [], turn: [], "scale": []}
    last = None
    for matrix in matrices:
        location, rotation, scale = Matrix(matrix.tolist()).decompose()
        rows["location"].append(location[:])
        rows["scale"].append(scale[:])
        if turn == "rotation_quaternion":
            rows[turn].append(rotation[:])
        elif turn == "rotation_axis_angle":
            axis, angle = rotation.to_axis_angle()
            rows[turn].append((angle, *axis))
        else:
            last = rotation.to_euler(bone.rotation_mode, *([last] if last else []))
            rows[turn].append(last[:])
    base = f'pose.bones["{bpy.utils.escape_identifier(bone.name)}"].'
    for name, listed in rows.items():
        values = np.array(listed, np.float32)
        smooth = key_reduction.continuous(values) if name == "rotation_quaternion" else values
        yield Track(base + name, bone.name, smooth, getattr(bone, name)[:])
