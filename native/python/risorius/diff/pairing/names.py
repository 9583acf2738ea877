# SPDX-License-Identifier: MIT
"""Labels for elements without a name, and matches of renamed joints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import risorius

from .pairs import Ints, Pairs, integers, pair_names, with_renamed
from .spaces import Space, chain

_DEEPEST = 8  # deepest nesting of correctives in a label


def padded(names: Sequence[str], count: int) -> list[str]:
    """The names, extended with empty ones to `count`."""
    return [*names, *[""] * (count - len(names))]


def correctives(
    dna: risorius.Dna, which: str, raw: Space, ml: Space, pose_controls: Space
) -> list[str]:
    """A label for each corrective, e.g. "corrective jaw * smile"; "" if it has no factors.

    Args:
        dna: the face with the correctives.
        which: "a" or "b", the face of the comparison that `dna` is.
        raw, ml, pose_controls: raw controls, outputs of networks, and controls of RBF poses.
    """
    count, first = dna.psd_count, len(dna.raw_control_names)
    # Labels are made before correctives are matched. So no corrective of A has a number that a
    # corrective of B also has.
    nothing = integers([])
    alone = Pairs(nothing, nothing, np.arange(count), nothing)
    own = Space("corrective", [""] * count, [], alone)
    if which == "b":
        alone = Pairs(nothing, nothing, nothing, np.arange(count))
        own = Space("corrective", [], [""] * count, alone)
    space = chain("control", [raw, own, ml, pose_controls])
    numbers = (space.in_a if which == "a" else space.in_b)(dna.psds.columns)
    factors: list[list[tuple[int, str]]] = [[] for _ in range(count)]
    labels = space.labels(numbers)
    for row, column, text in zip(
        dna.psds.rows.tolist(), dna.psds.columns.tolist(), labels, strict=False
    ):
        if first <= row < first + count:
            factors[row - first].append((column - first, text))
    return [f"corrective {text}" if text else "" for text in _products(factors)]


def _products(factors: list[list[tuple[int, str]]]) -> list[str]:
    """Labels of correctives, e.g. "jaw * (brow * smile)".

    A factor that is itself a corrective is written as its own factors in brackets.

    Args:
        factors: for each corrective, (control's index - index of the first corrective, control's
            label) per factor.
    """

    def product(i: int, depth: int) -> str:
        parts = []
        for index, text in factors[i]:
            nested = 0 <= index < len(factors) and depth < _DEEPEST and index != i
            parts.append(f"({product(index, depth + 1)})" if nested else text)
        return " * ".join(sorted(parts))

    return [product(i, 0) for i in range(len(factors))]


def joint_pairs(a: risorius.Dna, b: risorius.Dna) -> Pairs:
    """Match the joints of faces a and b.

    Joints are matched by name. An unmatched joint of each face counts as renamed if their parents
    match, their neutral poses are equal, and neither face has another such joint. If both faces
    have the same number of joints, unmatched joints with the same index and neutral pose also count
    as renamed.
    """
    pairs = pair_names(a.joint_names, b.joint_names)
    neutral_a, neutral_b = _neutral(a), _neutral(b)
    parents_a, parents_b = _parents(a), _parents(b)
    while len(pairs.only_a) and len(pairs.only_b):
        space = Space("joint", a.joint_names, b.joint_names, pairs)
        keys_a = _keys(pairs.only_a, space.in_a(parents_a), neutral_a)
        keys_b = _keys(pairs.only_b, space.in_b(parents_b), neutral_b)
        found = [(keys_a[key], keys_b[key]) for key in keys_a.keys() & keys_b.keys()]
        if not found:
            break
        pairs = with_renamed(pairs, *(integers(column) for column in zip(*found, strict=True)))
    both = np.intersect1d(pairs.only_a, pairs.only_b)
    if len(a.joint_names) == len(b.joint_names):
        same = integers([i for i in both.tolist() if neutral_a[i] == neutral_b[i]])
        pairs = with_renamed(pairs, same, same)
    return pairs


def _neutral(dna: risorius.Dna) -> list[bytes]:
    """The neutral translation and rotation of each joint as bytes, rounded to 4 decimals; the index
    of the joint if the face does not have one translation and rotation for each joint."""
    both = [dna.neutral_joint_translations, dna.neutral_joint_rotations]
    count = len(dna.joint_names)
    if any(len(values) != count for values in both):
        return [str(i).encode() for i in range(count)]
    rounded = np.round(np.concatenate(both, axis=1).astype(np.float64), 4) + 0.0
    return [row.tobytes() for row in rounded]


def _parents(dna: risorius.Dna) -> Ints:
    """The parent of each joint, int64[joints]; 0xFFFF for roots, and for all joints if the face
    does not have one parent for each joint."""
    count = len(dna.joint_names)
    parents = integers(dna.joint_parents)
    if len(parents) != count:
        return np.full(count, 0xFFFF)
    return np.where(parents == np.arange(count), 0xFFFF, parents)


def _keys(joints: Ints, parents: Ints, neutral: list[bytes]) -> dict[tuple[int, bytes], int]:
    """(parent, neutral pose) -> joint; joints with equal keys are left out."""
    found: dict[tuple[int, bytes], list[int]] = {}
    for joint in joints.tolist():
        found.setdefault((int(parents[joint]), neutral[joint]), []).append(joint)
    return {key: joints[0] for key, joints in found.items() if len(joints) == 1}
