# SPDX-License-Identifier: MIT
"""The few joints of a game face: root, neck, head, jaw and eyes, wherever the face has them."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .._native import Dna
from ..author.geometry.skeleton import world_matrices

Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

# What clients call a joint, and what faces call it; the first in the tree counts.
_JOINTS = (
    ("Neck", re.compile(r"neck([_.]?0?1)?$")),
    ("Head", re.compile(r"head$")),
    ("Jaw", re.compile(r"(facial_c_)?jaw$")),
    ("LeftEye", re.compile(r"(facial_l_eye|eye_?l(eft)?|left_?eye)$")),
    ("RightEye", re.compile(r"(facial_r_eye|eye_?r(ight)?|right_?eye)$")),
)


@dataclass(frozen=True)
class Skeleton:
    """Attributes:
    names: of its joints, the root first; each stands behind its parent.
    parents: -1 for the root.
    places: float64[n, 3], metres, in the axes of glTF.
    of_joint: int64[joints of the file], which of these each hangs on.
    head: the joint that takes what hangs on none.
    """

    names: list[str]
    parents: list[int]
    places: Doubles
    of_joint: Ints
    head: int


def find_skeleton(dna: Dna, axes: Doubles) -> Skeleton:
    """Args: dna: with its joints; axes: float64[3, 3] from the file's to those of glTF."""
    found: dict[int, str] = {}
    for name, pattern in _JOINTS:
        at = [i for i, joint in enumerate(dna.joint_names) if pattern.match(joint.lower())]
        if at and at[0] not in found:
            found[at[0]] = name
    parents = np.asarray(dna.joint_parents, np.int64)
    world = world_matrices(dna, np.zeros((len(parents), 9)))[:, :3, 3] @ axes.T
    # Parents of a file stand before their children or behind them: each is followed to the root.
    chains = [_chain(parents, joint) for joint in range(len(parents))]
    order = sorted(found, key=lambda joint: len(chains[joint]))
    numbers = {joint: i + 1 for i, joint in enumerate(order)}
    names = ["Root", *(found[joint] for joint in order)]
    of_joint = np.array(
        [next((numbers[j] for j in chain if j in numbers), 0) for chain in chains], np.int64
    )
    ours = [-1, *(next((numbers[j] for j in chains[o][1:] if j in numbers), 0) for o in order)]
    places = np.concatenate([np.zeros((1, 3)), world[order].reshape(-1, 3)])
    return Skeleton(names, ours, places, of_joint, names.index("Head") if "Head" in names else 0)


def _chain(parents: Ints, joint: int) -> list[int]:
    """A joint and those above it."""
    out = [joint]
    while parents[out[-1]] != out[-1] and len(out) <= len(parents):
        out.append(int(parents[out[-1]]))
    return out
