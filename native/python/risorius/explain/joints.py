# SPDX-License-Identifier: MIT
"""Explains the moving joints: the contribution of each control to each joint."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

import risorius
from risorius import _native

from ..controls.control_names import ControlNames, named
from ..rigs.rotation import SEQUENCES, Convention, Doubles, angle_degrees, product

# Source of a contribution: index of a control, or the name of a twist, of a swing, or "networks",
# each of which combines several controls.
Key = int | str
Contributions = dict[int, dict[Key, Doubles]]
"""joint -> key -> float64[9]: tx ty tz rx ry rz sx sy sz in the file's units."""


def contributions(
    dna: risorius.Dna, pose: risorius.Pose, lod: int, names: ControlNames
) -> Contributions:
    """Compute the contribution of each control to each joint; they sum to the joint's pose.

    Most joint values are sums over controls. But the rotation of a joint with quaternions is a
    product, so a control's contribution is the change of the Euler angles when its quaternion is
    multiplied, in the order of the columns. A twist, a swing, or a quaternion of a network is one
    contribution.

    Args:
        dna: the face.
        pose: pose of the face's rig, with Euler angles.
        lod: LOD of the pose, from 0.
        names: names of the controls.

    Returns:
        Joint -> source -> float64[9], in the file's units.
    """
    controls = np.asarray(pose.controls, float)
    out = _linear(dna, controls, lod)
    for joint, parts in _quaternions(dna, controls, lod).items():
        _replace_rotation(out, joint, parts)
    by_networks = _networks(dna, controls, lod)
    for setup, joint in _setups(dna, names):
        given = sum((v for v in by_networks.get(joint, {}).values()), np.zeros(9))
        angles = np.asarray(pose.joints[joint, 3:6], float) - given[3:6]
        _replace_rotation(out, joint, {setup: np.array([0, 0, 0, *angles, 0, 0, 0])})
    for joint, parts in by_networks.items():
        mine = out.setdefault(joint, {})
        for key, v in parts.items():
            mine[key] = mine.get(key, np.zeros(9)) + v
    return out


def _replace_rotation(out: Contributions, joint: int, parts: dict[Key, Doubles]) -> None:
    """Replace all contributions to the rotation of a joint by the contributions in `parts`."""
    mine = out.setdefault(joint, {})
    for v in mine.values():
        v[3:6] = 0
    for key, v in parts.items():
        mine[key] = mine.get(key, np.zeros(9)) + v


def _rows(group: risorius.JointGroup, lod: int) -> int:
    return int(group.lods[lod]) if lod < len(group.lods) else 0


def _linear(dna: risorius.Dna, controls: Doubles, lod: int) -> Contributions:
    out: Contributions = {}
    for group in dna.joint_groups:
        rows = _rows(group, lod)
        columns = np.flatnonzero(controls[group.input_indices])
        inputs = group.input_indices[columns]
        outputs = group.output_indices[:rows].tolist()
        parts = group.values[:rows, columns].astype(float) * controls[inputs]
        for row, output in enumerate(outputs):
            joint, attribute = divmod(output, 9)
            mine = out.setdefault(joint, {})
            for v in mine.values():  # groups assign rows, so the last group replaces earlier ones
                v[attribute] = 0
            for c in np.flatnonzero(parts[row]).tolist():
                mine.setdefault(int(inputs[c]), np.zeros(9))[attribute] += parts[row, c]
    return out


def _quaternions(dna: risorius.Dna, controls: Doubles, lod: int) -> dict[int, dict[Key, Doubles]]:
    """Contributions to joints whose rotation is a quaternion according to the file."""
    kinds = dna.joint_behavior_metadata.joint_representations
    if len(kinds) == 0:
        return {}
    convention, out = Convention.of(dna), dict[int, dict[Key, Doubles]]()
    orders = _native.quaternion_column_orders(dna)
    for group, order in zip(dna.joint_groups, orders, strict=True):
        outputs = group.output_indices.tolist()
        here = {o // 9 for o in outputs[: _rows(group, lod)] if 3 <= o % 9 < 6}
        for joint in here:
            if joint < len(kinds) and kinds[joint, 1] == 1:
                rows = {o % 9 - 3: r for r, o in enumerate(outputs) if o // 9 == joint}
                rows = {a: r for a, r in rows.items() if 0 <= a < 3}
                out[joint] = _product(convention, group, order, rows, controls)
    return out


def _product(
    convention: Convention,
    group: risorius.JointGroup,
    order: npt.NDArray[np.uint32],
    rows: dict[int, int],
    controls: Doubles,
) -> dict[Key, Doubles]:
    """Contributions of the columns of one joint, whose quaternions are multiplied in `order`.

    Args:
        convention: rotation convention of the file.
        group: the joint group.
        order: order in which the rotations of the columns are multiplied.
        rows: axis (0 to 2) -> row of the group with the joint's rotation about this axis.
        controls: float64[controls], of the pose.
    """
    total, before = np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3)
    out: dict[Key, Doubles] = {}
    for column in order.tolist():
        control = int(group.input_indices[column])
        angles = np.zeros(3)
        for axis, row in rows.items():
            angles[axis] = group.values[row, column]
        if not angles.any() or controls[control] == 0:
            continue
        q = convention.quaternion(angles)
        part = q * controls[control]
        part[3] += (1 - controls[control]) * (1 if q[3] >= 0 else -1)
        total = product(part / np.linalg.norm(part), total)
        after = convention.angles(total)
        out.setdefault(control, np.zeros(9))[3:6] += after - before
        before = after
    return out


def _setups(dna: risorius.Dna, names: ControlNames) -> Iterator[tuple[str, int]]:
    """The name of each twist and swing, with each joint that it rotates; twists come last."""
    layer = dna.twist_swing_behavior
    for word, setups in (("swing", layer.swings), ("twist", layer.twists)):
        for setup in setups:
            if len(setup.input_control_indices) != 4:
                continue
            key = f"{word} of {names.short(int(setup.input_control_indices[0]))} ..."
            yield from ((key, int(joint)) for joint in setup.output_joint_indices)


# ---- joints of networks

_AXES = np.array([[-1, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
_WORDS = ("left", "right", "up", "down", "front", "back")
_BY_NETWORKS = "networks"


def _networks(dna: risorius.Dna, controls: Doubles, lod: int) -> Contributions:
    """Contributions of networks to joints.

    A quaternion, or a rotation that is converted from the networks' axes to the face's axes, is one
    contribution.
    """
    joints = dna.machine_learned_behavior_ext.joints
    settings = {
        int(k): int(v) for k, v in zip(joints.parameter_keys, joints.parameter_values, strict=True)
    }
    stride = 10 if settings.get(1) == 1 else 9
    there = set(dna.lod_joint_mapping[lod].tolist()) if lod < len(dna.lod_joint_mapping) else set()
    inputs: dict[int, dict[int, int]] = {}
    for control, output in zip(joints.input_indices, joints.output_indices, strict=True):
        joint, attribute = divmod(int(output), stride)
        if joint in there:
            inputs.setdefault(joint, {})[attribute] = int(control)
    theirs, basis = _system(dna, settings)
    return {
        joint: _moved(dna, attributes, controls, stride, theirs, basis)
        for joint, attributes in inputs.items()
    }


def _system(dna: risorius.Dna, settings: dict[int, int]) -> tuple[Convention | None, Doubles]:
    """The rotation convention of the neural networks that move joints, and the matrix from the
    networks' axes to the face's axes.

    None and the identity matrix if the file does not give all parameters of the networks' axes and
    convention; the networks then use those of the face.

    Args:
        dna: the face.
        settings: key of a parameter of layer mlbe -> its value.

    Returns:
        The convention or None; and float64[3, 3], whose row i is the networks' axis i in the
        face's axes.
    """
    if not all(key in settings for key in range(3, 10)):
        return None, np.eye(3)
    signs = tuple(1 if settings[key] == 1 else -1 for key in (6, 7, 8))
    sequence = SEQUENCES[settings[9]] if settings[9] < len(SEQUENCES) else ""
    theirs = Convention(sequence, signs, dna.rotation_unit)
    ours = np.array([_axis(_number(word)) for word in dna.coordinate_system])
    return theirs, np.array([_axis(settings[key]) for key in (3, 4, 5)]) @ ours.T


def _number(word: str) -> int:
    """The number of a direction from its name. "#7" gives 7, which the format does not define."""
    return _WORDS.index(word) if word in _WORDS else int(word.removeprefix("#"))


def _axis(number: int) -> Doubles:
    """The vector of a direction; for an undefined number, the same axis as in the evaluator."""
    if number < len(_AXES):
        return _AXES[number]
    return np.eye(3)[number // 2 % 3]


def _moved(
    dna: risorius.Dna,
    attributes: dict[int, int],
    controls: Doubles,
    stride: int,
    theirs: Convention | None,
    basis: Doubles,
) -> dict[Key, Doubles]:
    ours = Convention.of(dna)
    is_same = theirs is None or (
        np.array_equal(basis, np.eye(3))
        and theirs.order == ours.order
        and np.array_equal(theirs.signs, ours.signs)
    )
    out: dict[Key, Doubles] = {}
    rotation = np.zeros(stride - 6)
    for attribute, control in sorted(attributes.items()):
        v = controls[control]
        mine = np.zeros(9)
        if attribute < 3:
            mine[:3] = v * basis[attribute]
        elif attribute >= stride - 3:
            mine[6:] = v * np.abs(basis[attribute - (stride - 3)])
        elif stride == 9 and is_same:
            mine[attribute] = v
        else:
            rotation[attribute - 3] = v
        if mine.any():
            out[control] = out.get(control, np.zeros(9)) + mine
    if (stride == 10 and rotation.any()) or (not is_same and rotation.any()):
        q = rotation if stride == 10 else (theirs or ours).quaternion(rotation)
        q = q / np.linalg.norm(q)
        q = np.array([*(np.linalg.det(basis) * (q[:3] @ basis)), q[3]])
        angles = ours.angles(q)
        if angles.any():
            out[_BY_NETWORKS] = np.array([0, 0, 0, *angles, 0, 0, 0])
    return out


# ---- joints by movement


def explain_joints(
    dna: risorius.Dna, pose: risorius.Pose, lod: int, names: ControlNames
) -> list[dict[str, Any]]:
    """Each joint that differs from its neutral pose; the joint that moves most is first.

    Movement is the length of a vector of nine elements: translations, angles in radians times the
    bone length, and changes of scale times the bone length. The bone length is bone_length(), the
    same for all joints. A control's share is the component of its contribution along the joint's
    movement, divided by the length of the movement. The shares of a joint sum to 1; a control that
    works against the movement has a negative share.

    Args:
        dna: the face.
        pose: pose of the face's rig, with Euler angles.
        lod: LOD of the pose, from 0.
        names: names of the controls.
    """
    parts = contributions(dna, pose, lod, names)
    convention = Convention.of(dna)
    lever = bone_length(dna)
    measure = np.array([1.0] * 3 + [lever * convention.radians] * 3 + [lever] * 3)
    joints = np.asarray(pose.joints, float)
    rows = [
        _joint(dna, j, joints[j], parts.get(j, {}), measure, names)
        for j in np.flatnonzero(np.any(joints != 0, axis=1)).tolist()
    ]
    return sorted(rows, key=lambda row: -row["movement"])


def bone_length(dna: risorius.Dna) -> float:
    """The median distance of a joint from its parent, in the file's translation unit. Distances of
    0 do not count; 1 if all are 0."""
    lengths = np.linalg.norm(np.asarray(dna.neutral_joint_translations, float), axis=1)
    lengths = lengths[lengths > 0]
    return float(np.median(lengths)) if len(lengths) else 1.0


def _joint(
    dna: risorius.Dna,
    joint: int,
    values: Doubles,
    parts: dict[Key, Doubles],
    measure: Doubles,
    names: ControlNames,
) -> dict[str, Any]:
    whole = values * measure
    convention = Convention.of(dna)
    neutral = np.zeros(3)
    if joint < len(dna.neutral_joint_rotations):
        neutral = np.asarray(dna.neutral_joint_rotations[joint], float)
    turned = convention.quaternion(neutral + values[3:6])
    by = [_part(key, v, measure, whole, names) for key, v in parts.items() if v.any()]
    return {
        "name": named(dna.joint_names, joint, "joint"),
        "index": joint,
        "distance": float(np.linalg.norm(values[:3])),
        "degrees": angle_degrees(convention.quaternion(neutral), turned),
        "scale": float(np.abs(values[6:]).max()),
        "movement": float(np.linalg.norm(whole)),
        "values": [float(v) for v in values],
        "by": sorted(by, key=lambda part: -abs(part["share"])),
    }


def _part(
    key: Key, v: Doubles, measure: Doubles, whole: Doubles, names: ControlNames
) -> dict[str, Any]:
    is_control = isinstance(key, int)
    return {
        "control": key if is_control else None,
        "name": names.name(key) if isinstance(key, int) else key,
        "kind": names.kind(key) if isinstance(key, int) else "setup",
        "share": float((v * measure) @ whole / (whole @ whole)),
        "values": [float(x) for x in v],
    }
