# SPDX-License-Identifier: MIT
"""Makes the joint groups of a mix: weighted means of the rows of the joint matrices."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .. import Dna, JointGroup
from ..author.geometry.skeleton import Doubles, Ints
from .compatible import alike, turned_groups
from .share import Share

_DENSER = 4  # largest ratio of coefficients in a merged group to those of its source groups
Part = tuple[int, JointGroup]  # (index of a parent face, one of its joint groups)


def mixed_groups(parents: Sequence[Dna], share: Share) -> list[JointGroup]:
    """The joint groups of a mix.

    If all parents have joint groups with equal rows and columns, the mix has these groups too.
    Otherwise joint groups that share a joint are merged into one group with all their rows and
    columns, or into several groups if a single one would have over four times as many
    coefficients as the merged groups together. Groups that move a joint with quaternion rotation
    are never merged.

    Args:
        parents: compatible faces, which are mixed.
        share: weights of the parents for each joint.
    """
    groups = [list(p.joint_groups) for p in parents]
    if share.is_whole and all(alike(groups[0], own) for own in groups[1:]):
        return groups[0]
    lists = [[_lists(g) for g in own] for own in groups]
    if all(own == lists[0] for own in lists[1:]):
        return [_mean(row, share) for row in zip(*groups, strict=True)]
    # The order of columns matters for joints with quaternion rotation. All parents have the same
    # order.
    turned = [turned_groups(p) for p in parents]
    out = [
        _mean([groups[p][g] for p, g in enumerate(row)], share) for row in zip(*turned, strict=True)
    ]
    others = [
        (p, group)
        for p, own in enumerate(groups)
        for g, group in enumerate(own)
        if g not in set(turned[p])
    ]
    for parts in _together(others):
        out += _joined(parts, share, max(1, parents[0].lod_count))
    return out


def _lists(group: JointGroup) -> tuple[bytes, ...]:
    fields = (group.lods, group.input_indices, group.output_indices)
    return tuple(field.tobytes() for field in fields)


def _mean(groups: Sequence[JointGroup], share: Share) -> JointGroup:
    """The weighted mean of joint groups with equal rows and columns, one from each mixed face.

    Args:
        groups: the joint group of each parent.
        share: weights of the parents for each joint.
    """
    first = groups[0]
    rows = np.asarray(first.output_indices, np.int64)
    values = sum(_weights(share, p, rows)[:, None] * g.values for p, g in enumerate(groups))
    return JointGroup(
        lods=first.lods,
        input_indices=first.input_indices,
        output_indices=first.output_indices,
        values=np.asarray(values, np.float32).reshape(first.values.shape),
        joint_indices=first.joint_indices,
    )


def _weights(share: Share, parent: int, rows: Ints) -> Doubles:
    """float64[n]: weights of one parent for rows of the joint matrix.

    The weight of a translation row is multiplied by the scale of the parent's region.

    Args:
        share: weights of the parents for each joint.
        parent: index of the parent.
        rows: int64[n], rows of the joint matrix: 9 * joint + attribute.
    """
    joints = rows // 9
    return np.where(rows % 9 < 3, share.scaled[joints, parent], share.weights[joints, parent])


def _together(parts: Sequence[Part]) -> list[list[Part]]:
    """Collects joint groups that share joints, directly or indirectly, sorted by their first
    joint."""
    above: dict[int, int] = {}  # joint -> a smaller or equal joint of the same set (union-find)

    def root(joint: int) -> int:
        while above[joint] != joint:
            above[joint] = above[above[joint]]
            joint = above[joint]
        return joint

    joints = [_joints(group) for _, group in parts]
    for own in joints:
        for joint in own:
            above.setdefault(joint, joint)
            one, other = sorted((root(joint), root(own[0])))
            above[other] = one
    found: dict[int, list[Part]] = {}
    for part, own in zip(parts, joints, strict=True):
        if own:
            found.setdefault(root(own[0]), []).append(part)
    return [found[first] for first in sorted(found)]


def _joints(group: JointGroup) -> list[int]:
    rows = np.asarray(group.output_indices, np.int64) // 9
    return [int(j) for j in np.union1d(rows, np.asarray(group.joint_indices, np.int64))]


def _joined(parts: Sequence[Part], share: Share, levels: int) -> list[JointGroup]:
    """Merges joint groups into one group, or into several if one group would have too many zeros.

    Each of several groups has the rows that occur in the same source groups.

    Args:
        parts: (index of a parent, one of its joint groups); the groups share joints.
        share: weights of the parents for each joint; groups of parents with weight 0 are dropped.
        levels: number of LODs.
    """
    levels_of: dict[int, int] = {}  # row -> number of LODs that evaluate it
    of_row: dict[int, list[int]] = {}  # row -> indices of the source groups that have it
    used: list[_Source] = []
    for p, group in parts:
        rows = np.asarray(group.output_indices, np.int64)
        if not (share.weights[rows // 9, p] > 0).any():
            continue
        lods = [int(group.lods[lod]) for lod in range(min(levels, len(group.lods)))]
        place = {row: at for at, row in enumerate(rows.tolist())}
        for row, at in place.items():
            levels_of[row] = max(levels_of.get(row, 0), sum(at < n for n in lods))
            of_row.setdefault(row, []).append(len(used))
        used.append(_Source(p, group, place))
    cells = sum(source.group.values.size for source in used)
    columns = {int(c) for source in used for c in source.group.input_indices}
    if len(of_row) * len(columns) <= _DENSER * cells:
        whole = _block(list(of_row), used, share, levels_of, levels)
        for group in whole:
            group.joint_indices = sorted({j for source in used for j in _joints(source.group)})
        return whole
    blocks: dict[tuple[int, ...], list[int]] = {}
    for row, numbers in of_row.items():
        blocks.setdefault(tuple(numbers), []).append(row)
    return [
        group
        for numbers, rows in blocks.items()
        for group in _block(rows, [used[n] for n in numbers], share, levels_of, levels)
    ]


class _Source(NamedTuple):
    parent: int
    group: JointGroup
    place: dict[int, int]  # row of the matrix -> index in the group


def _block(
    rows: list[int],
    sources: Sequence[_Source],
    share: Share,
    levels_of: dict[int, int],
    levels: int,
) -> list[JointGroup]:
    """Merges rows into one joint group with all columns of the sources; [] if there is no column.

    Args:
        rows: rows of the joint matrix.
        sources: joint groups of the parents.
        share: weights of the parents for each joint.
        levels_of: row -> number of LODs that evaluate it.
        levels: number of LODs.
    """
    order = sorted(rows, key=lambda row: -levels_of[row])
    inputs = sorted({int(c) for source in sources for c in source.group.input_indices})
    if not order or not inputs:
        return []
    values = np.zeros((len(order), len(inputs)))
    for source in sources:
        here = [(at, row) for at, row in enumerate(order) if row in source.place]
        at = np.array([at for at, _ in here], np.int64)
        own = np.array([source.place[row] for _, row in here], np.int64)
        part = _weights(share, source.parent, np.array([row for _, row in here], np.int64))
        columns = np.searchsorted(inputs, source.group.input_indices)
        values[at[:, None], columns] += part[:, None] * source.group.values[own]
    counts = np.array([levels_of[row] for row in order])
    return [
        JointGroup(
            lods=[int((counts > lod).sum()) for lod in range(levels)],
            input_indices=inputs,
            output_indices=order,
            values=values.astype(np.float32),
            joint_indices=sorted({row // 9 for row in order}),
        )
    ]
