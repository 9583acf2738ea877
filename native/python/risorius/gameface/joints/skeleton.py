# SPDX-License-Identifier: MIT
"""Finds the joints of a game face: root, neck, head, jaw and eyes, or the bones of a humanoid."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from ..._native import Dna
from ...author.geometry.skeleton import world_matrices
from ...base.words import joined
from ..avatar import humanoid
from ..errors import GameFaceError

Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

# Bone -> pattern of joint names in files; the first matching joint of a file is used.
_JOINTS = {
    "neck": re.compile(r"neck([_.]?0?1)?$"),
    "head": re.compile(r"head$"),
    "jaw": re.compile(r"(facial_c_)?jaw$"),
    "leftEye": re.compile(r"(facial_l_eye|eye_?l(eft)?|left_?eye)$"),
    "rightEye": re.compile(r"(facial_r_eye|eye_?r(ight)?|right_?eye)$"),
}
ROOT = {"mixamo": "Armature"}  # TalkingHead looks for this name


@dataclass(frozen=True)
class Skeleton:
    """The joints of the exported file.

    Attributes:
        names: names of the n joints, the root first, parents before children.
        parents: index of each parent, -1 for the root.
        places: float64[n, 3], positions in metres in glTF's axes.
        of_joint: int64[joints of the DNA file], index of the exported joint with which each of
            them moves.
        head: index of the head's joint, which also moves vertices without a joint.
        turns: float64[n, 3, 3], rotation from each joint's axes to glTF's.
        bones: VRM name of a bone -> index of its joint.
        hooks: joint -> node of the body that becomes its parent; for the root, the node that
            replaces it.
    """

    names: list[str]
    parents: list[int]
    places: Doubles
    of_joint: Ints
    head: int
    turns: Doubles
    bones: dict[str, int] = field(default_factory=dict)
    hooks: dict[int, int] = field(default_factory=dict)


def find_skeleton(
    dna: Dna, axes: Doubles, *, kind: str = "", is_body: bool = False, is_turned: bool = False
) -> Skeleton:
    """The joints that a face is exported with.

    Args:
        dna: the face with its joints.
        axes: from parts.axes_of; maps the file's axes and unit to glTF's.
        kind: "minimal" or "mixamo", a kind of humanoid whose missing bones are added; "": only
            joints of the face.
        is_body: whether to include the bones of the body that the face has.
        is_turned: whether bones have the axes of Mixamo's bones.

    Raises:
        GameFaceError: a humanoid was requested, but the face has no head, or lacks needed bones.
    """
    found = _own(dna, is_body=is_body or bool(kind))
    if kind and "head" not in found:
        raise GameFaceError("a joint called head was expected, because the humanoid bones need it")
    parents = np.asarray(dna.joint_parents, np.int64)
    world = world_matrices(dna, np.zeros((len(parents), 9)))[:, :3, 3] @ axes.T
    # A file may list parents before or after their children: each chain is followed to the root.
    chains = [_chain(parents, joint) for joint in range(len(parents))]
    if is_body or kind:
        bones, above = _humanoid(found, kind)
    else:
        of_joint = {joint: name for name, joint in found.items()}
        bones = sorted(found, key=lambda name: len(chains[found[name]]))
        above = [_first(chains[found[name]][1:], of_joint, "") for name in bones]
    number = {name: i + 1 for i, name in enumerate(bones)}
    joints = {joint: number[name] for name, joint in found.items()}
    trunk = _first(["hips", "spine", "chest", "upperChest", "neck"], found, found.get("head", 0))
    places, turns = [np.zeros(3)], [np.eye(3)]
    for name in bones:
        own = found.get(name)
        made = own is None
        places.append(
            humanoid.place_of(name, world[found["head"]], world[trunk]) if made else world[own]
        )
        turns.append(humanoid.turn_of(name) if is_turned else np.eye(3))
    # Joints of the file that have no exported bone among their ancestors move with this joint.
    rest = number.get(humanoid.parent_of("neck", bones), 0)
    return Skeleton(
        [ROOT.get(kind, "Root"), *(humanoid.BONES[name].node for name in bones)],
        [-1, *(number.get(name, 0) for name in above)],
        np.array(places),
        np.array([_first(chain, joints, rest) for chain in chains], np.int64),
        number.get("head", 0),
        np.array(turns),
        number,
    )


def facing_back(skeleton: Skeleton) -> Skeleton:
    """A skeleton rotated by 180° about y, for VRM 0.x. Args: skeleton: facing +z."""
    turns = np.tile(np.eye(3), (len(skeleton.names), 1, 1))  # VRM 0.x turns no bone
    return replace(skeleton, places=skeleton.places * [-1.0, 1.0, -1.0], turns=turns)


def _own(dna: Dna, *, is_body: bool) -> dict[str, int]:
    """Bone name -> index of the face's joint with that role."""
    found: dict[str, int] = {}
    for name, pattern in _JOINTS.items():
        at = [i for i, joint in enumerate(dna.joint_names) if pattern.match(joint.lower())]
        if at and at[0] not in found.values():
            found[name] = at[0]
    if is_body:
        for joint, called in enumerate(dna.joint_names):
            name = humanoid.bone_of(called)
            if name and joint not in found.values():
                found.setdefault(name, joint)
    return found


def _humanoid(found: Mapping[str, int], kind: str) -> tuple[list[str], list[str]]:
    """The bones of a humanoid, both found and added ones, and the parent of each.

    Raises:
        GameFaceError: needed bones are missing, and `kind` does not add them.
    """
    bones = humanoid.wanted(found, kind)
    if missing := [name for name in humanoid.NEEDED if name not in bones]:
        raise GameFaceError(
            f"a humanoid has {len(humanoid.NEEDED)} bones, the face has no {joined(missing)}: "
            "--humanoid minimal makes them up"
        )
    return bones, [humanoid.parent_of(name, bones) for name in bones]


def _first(keys: Iterable[Any], table: Mapping[Any, Any], otherwise: Any) -> Any:
    """The table's value for the first key that it has, else `otherwise`."""
    return next((table[key] for key in keys if key in table), otherwise)


def _chain(parents: Ints, joint: int) -> list[int]:
    """A joint and its ancestors, from the joint to the root."""
    out = [joint]
    while parents[out[-1]] != out[-1] and len(out) <= len(parents):
        out.append(int(parents[out[-1]]))
    return out
