# SPDX-License-Identifier: MIT
"""Finds the raw controls that hold the rotation of a joint, and computes their values.

A MetaHuman head has twelve: `neck_01`, `neck_02` and `head`, each with `.qx .qy .qz .qw`. Its RBF
poses, which correct neck and jaw when the head turns, read them. The evaluator neither rotates
these joints nor sets these controls: the host must do both before evaluation
(EpicGames/MetaHuman-DNA-Calibration, issue 51). The four controls hold the rotation of their joint
relative to the neutral pose, about the joint's own axes, in the file's coordinate system.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .._native import Dna
from .rotation import Convention, Doubles, product

PARTS = ("x", "y", "z", "w")
ANGLES = {
    "neck": ("neck.yaw", "neck.pitch", "neck.roll"),
    "head": ("head.yaw", "head.pitch", "head.roll"),
}
"""Names of curves in a clip that rotate neck and head, in radians; see head_turns."""
_NOTHING = 1e-7  # quaternion components smaller than this count as 0
# File axis -> direction in the face's own axes: x to its left, y to its back, z up. "right" in a
# file is the right side of a viewer in front of the face, and so the face's left.
_FACE_AXES = {
    "right": (1.0, 0.0, 0.0),
    "left": (-1.0, 0.0, 0.0),
    "up": (0.0, 0.0, 1.0),
    "down": (0.0, 0.0, -1.0),
    "front": (0.0, -1.0, 0.0),
    "back": (0.0, 1.0, 0.0),
}


@dataclass(frozen=True)
class JointControl:
    """The four raw controls that hold the rotation of one joint.

    Attributes:
        joint: index of the joint.
        name: name of the joint in the file.
        controls: indices of the raw controls of x, y, z and w.
        axes: float64[3, 3], converts a rotation's vector part from the face's axes (x to the face's
            left, y to its back, z up) to the joint's axes.
    """

    joint: int
    name: str
    controls: tuple[int, int, int, int]
    axes: Doubles

    def values(self, turns: npt.ArrayLike) -> Doubles:
        """The values of the four controls for rotations of the joint.

        Args:
            turns: float[..., 4], unit quaternions x, y, z, w: rotation of the joint relative to its
                neutral pose, about the face's axes.

        Returns:
            float64[..., 4], quaternions x, y, z, w whose last nonzero component is positive.
        """
        given = np.asarray(turns, np.float64)
        return one_sign(np.concatenate([given[..., :3] @ self.axes.T, given[..., 3:]], axis=-1))


def one_sign(turns: Doubles) -> Doubles:
    """float64[..., 4]: q or -q, which are the same rotation, whichever has a positive last nonzero
    component.

    RBF solvers with Euclidean distances distinguish q from -q.

    Args:
        turns: float64[..., 4], quaternions x, y, z, w.
    """
    there = np.abs(turns) > _NOTHING
    last = 3 - np.argmax(there[..., ::-1], axis=-1)
    leading = np.take_along_axis(turns, last[..., None], axis=-1)
    return np.where(leading < 0.0, -turns, turns)


def joint_controls(dna: Dna) -> tuple[list[JointControl], list[str]]:
    """Finds the raw controls that hold rotations of joints.

    Args:
        dna: face with definition and behavior.

    Returns:
        A JointControl for each joint that has all four controls, in the order of the controls; and
        a sentence for each rotation that an RBF solver, twist or swing reads, if one of its
        controls or its joint is missing, or if one of its controls exists twice.
    """
    read = _read_by_solvers(dna)
    named: dict[str, dict[str, list[int]]] = defaultdict(lambda: defaultdict(list))
    for index, name in enumerate(dna.raw_control_names):
        stem, dot, end = name.rpartition(".")
        part = end[1:] if len(end) == 2 and end[0] == "q" else end
        if dot and part in PARTS and (end != part or index in read):
            named[stem][part].append(index)
    where: dict[str, int] = {}
    for joint, name in enumerate(dna.joint_names):
        where.setdefault(name, joint)
    found, said = list[JointControl](), list[str]()
    for stem, by_part in named.items():
        wrong = _what_is_wrong(stem, by_part, where)
        if wrong and any(index in read for indices in by_part.values() for index in indices):
            said.append(wrong)
        if stem in where and len(by_part) == len(PARTS):
            x, y, z, w = (by_part[part][0] for part in PARTS)
            joint = where[stem]
            found.append(JointControl(joint, stem, (x, y, z, w), turn_axes(dna, joint)))
    return found, said


def _what_is_wrong(stem: str, by_part: dict[str, list[int]], where: dict[str, int]) -> str:
    """A sentence if the four raw controls of a rotation are incomplete or ambiguous, else empty.

    Args:
        stem: name of the controls before the dot.
        by_part: "x", "y", "z", "w" -> indices of the controls.
        where: name of a joint -> its index.
    """
    missing = ", ".join(part for part in PARTS if part not in by_part)
    kept = "the controls stay as they are set"
    if missing:
        return f"the rotation of {stem!r} has no raw control for {missing}: {kept}"
    if stem not in where:
        return f"raw controls hold the rotation of {stem!r}, and no joint has that name: {kept}"
    if any(len(indices) > 1 for indices in by_part.values()):
        return f"{stem!r} has two raw controls for one part of its rotation: the first counts"
    return ""


def _read_by_solvers(dna: Dna) -> set[int]:
    """Indices of raw controls that RBF solvers, twists and swings read as quaternions."""
    behavior = dna.twist_swing_behavior
    read = [solver.raw_control_indices for solver in dna.rbf_behavior.solvers]
    read += [setup.input_control_indices for setup in (*behavior.twists, *behavior.swings)]
    return {int(i) for indices in read for i in indices}


def turn_axes(dna: Dna, joint: int) -> Doubles:
    """float64[3, 3]: converts a rotation's vector part from the face's axes (x to the face's left,
    y to its back, z up) to the axes of a joint.

    Args:
        dna: the face.
        joint: index of the joint.
    """
    convention, parents = Convention.of(dna), dna.joint_parents
    chain = [joint]
    while int(parents[chain[-1]]) != chain[-1] and len(chain) <= len(parents):
        chain.append(int(parents[chain[-1]]))
    rest = np.array([0.0, 0.0, 0.0, 1.0])
    for link in reversed(chain):
        rest = product(rest, convention.quaternion(dna.neutral_joint_rotations[link]))
    known = all(word in _FACE_AXES for word in dna.coordinate_system)
    words = dna.coordinate_system if known else ("right", "up", "front")
    face = np.array([_FACE_AXES[word] for word in words]).T  # converts file axes to face axes
    sign = -1.0 if np.linalg.det(face) < 0.0 else 1.0
    return sign * matrix(rest).T @ face.T


def matrix(q: Doubles) -> Doubles:
    """float64[3, 3]: rotation matrix of a unit quaternion (x, y, z, w), for column vectors."""
    x, y, z, w = q
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross


def turned_joints(names: Sequence[str]) -> dict[int, tuple[str, float]]:
    """The joints that rotate as neck and head, by their usual names in any letter case.

    Args:
        names: names of the file's joints.

    Returns:
        Index of a joint -> ("neck" or "head", fraction of that rotation which the joint gets);
        `neck_01` and `neck_02` divide the neck's rotation.
    """
    where: dict[str, int] = {}
    for index, name in enumerate(names):
        where.setdefault(name.lower().replace(".", "_"), index)
    neck = [where[name] for name in ("neck_01", "neck_02") if name in where]
    if not neck and "neck" in where:
        neck = [where["neck"]]
    found = {joint: ("neck", 1.0 / len(neck)) for joint in neck}
    if "head" in where:
        found[where["head"]] = ("head", 1.0)
    return found


def shared(turns: Doubles, share: float) -> Doubles:
    """The fraction `share` of rotations, along the shorter way.

    Args:
        turns: float64[..., 4], unit quaternions x, y, z, w.
        share: the fraction, 0 to 1.
    """
    turns = np.where(turns[..., 3:] < 0.0, -turns, turns)
    sine = np.linalg.norm(turns[..., :3], axis=-1, keepdims=True)
    half = share * np.arctan2(sine, turns[..., 3:])
    axis = turns[..., :3] / np.where(sine > 0.0, sine, 1.0)
    return np.concatenate([axis * np.sin(half), np.cos(half)], axis=-1)


def bone_turns(bone: str, curves: Mapping[str, npt.NDArray[np.float32]]) -> Doubles | None:
    """The rotation of the neck or the head in each frame of a clip.

    Args:
        bone: "neck" or "head".
        curves: name -> float32[frames], all curves of the clip.

    Returns:
        float64[frames, 4], quaternions x, y, z, w about the face's axes (x to its left, y to its
        back, z up); None if the clip has no yaw, pitch or roll of this bone.
    """
    rows = [curves.get(name) for name in ANGLES.get(bone, ())]
    some = next((row for row in rows if row is not None), None)
    if some is None:
        return None
    nothing = np.zeros(len(some), np.float32)
    return head_turns(np.stack([nothing if row is None else row for row in rows], axis=1))


def head_turns(angles: npt.NDArray[Any]) -> Doubles:
    """Quaternions of a head or a neck from a clip's angles.

    Args:
        angles: float[n, 3], radians: yaw to the face's own left, pitch up, roll towards its own
            left shoulder; applied in this order, each about the already rotated axes.

    Returns:
        float64[n, 4], x, y, z, w about the face's axes: x to its left, y to its back, z up.
    """
    half = np.asarray(angles, np.float64) / 2.0
    (sy, sp, sr), (cy, cp, cr) = np.sin(half.T), np.cos(half.T)
    # The product of rotations: yaw about z, pitch about -x, roll about y.
    return np.stack(
        [
            -cp * sr * sy - cr * cy * sp,
            cp * cy * sr - cr * sp * sy,
            cp * cr * sy - cy * sp * sr,
            cp * cr * cy + sp * sr * sy,
        ],
        axis=1,
    )
