# SPDX-License-Identifier: MIT
"""Computes neutral joint positions and the translations of joint groups on the target head.

Joints keep their orientation, so that rotation columns keep their meaning. If the whole head is
rotated, the root joints take the rotation. Translation columns are transformed by the deformation
gradient of the skin that the joint carries.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence

import numpy as np

from ... import Dna, JointGroup
from ...author.geometry import skeleton as sk
from ...author.geometry.skeleton import Doubles
from ...rigs.rotation import Convention
from .change import Change
from .jaw import joint_shifts
from .parts import Stiff, finest

_HELD = 1e-6  # sum of skin weights: a joint with less counts as a joint without vertices
_SOME = (
    0.05  # a jaw carries more than this share of the weights in the mouth, and less than 1 - _SOME
)
Carried = Mapping[int, tuple[Doubles, Doubles, Doubles]]  # mesh -> before, after, linear


class Places:
    """Positions of all joints.

    Attributes:
        before, after: float64[J, 3], world positions on the source and the target head.
        turns: float64[J, 3, 3], rotations from the joints' axes to world axes on the source head.
        linear: float64[J, 3, 3], the mean deformation gradient of the skin of each joint.
    """

    def __init__(self, dna: Dna, carried: Carried, change: Change, stiff: Stiff) -> None:
        """Compute the positions.

        Args:
            dna: the source face.
            carried: vertices and gradients of the meshes of LOD 0, by mesh index.
            change: the deformation of the skin.
            stiff: the rigid parts of the face.
        """
        count = len(dna.joint_names)
        frames = sk.world_matrices(dna, np.zeros((count, 9)))
        self.turns, self.before = frames[:, :3, :3], frames[:, :3, 3]
        sums = _means(dna, carried)
        none = np.flatnonzero(np.isnan(sums[:, 0]))
        for joint in none.tolist():  # no joint above or below has vertices
            way = change.around(self.before[joint], change.reach)
            sums[joint] = np.concatenate([way.middle, way.becomes, way.linear.ravel()])
        self.linear = sums[:, 6:].reshape(-1, 3, 3)
        away = self.before - sums[:, :3]
        self.after = sums[:, 3:6] + np.einsum("jik,jk->ji", self.linear, away)
        for eye in stiff.eyes:
            own = list(eye.joints)
            self.after[own] = eye.way(self.before[own])
        if stiff.mouth is not None and stiff.joint >= 0:  # the jaw bone is rigid with its teeth
            self.after[stiff.joint] = stiff.mouth(self.before[stiff.joint])


def _means(dna: Dna, carried: Carried) -> Doubles:
    """float64[J, 15]: weighted means over the vertices of each joint: source position, target
    position, deformation gradient.

    A joint without vertices takes the mean of its children, else the values of its parent. NaN if
    no joint of its branch has vertices.
    """
    count = len(dna.joint_names)
    sums, held = np.zeros((count, 15)), np.zeros(count)
    for m in finest(dna):
        if m not in carried:
            continue
        vertex, joint, weight = sk.skin_entries(dna.meshes[m])
        rows = np.concatenate([part.reshape(len(part), -1) for part in carried[m]], axis=1)[vertex]
        held += np.bincount(joint, weights=weight, minlength=count)
        for k in range(15):
            sums[:, k] += np.bincount(joint, weights=weight * rows[:, k], minlength=count)
    out = np.full_like(sums, np.nan)
    own = held > _HELD
    out[own] = sums[own] / held[own, None]
    order = sk.parent_order(dna)
    below, many = np.zeros((count, 15)), np.zeros(count)
    for at in reversed(order):
        if np.isnan(out[at, 0]) and many[at]:
            out[at] = below[at] / many[at]
        parent = int(dna.joint_parents[at])
        if parent != at and not np.isnan(out[at, 0]):
            below[parent] += out[at]
            many[parent] += 1
    for at in order:
        if np.isnan(out[at, 0]):
            out[at] = out[int(dna.joint_parents[at])]
    return out


def place_joints(out: Dna, places: Places, turn: Doubles) -> None:
    """Write the neutral joint translations, and the rotations of the roots if the head is rotated.

    Args:
        out: a copy of the source face, changed in place.
        places: the joint positions.
        turn: float64[3, 3], the rotation from the whole source head to the target head.
    """
    parents = np.asarray(out.joint_parents, np.int64)
    roots = parents == np.arange(len(parents))
    above = np.where(roots[:, None, None], np.eye(3), turn @ places.turns[parents])
    from_above = np.where(roots[:, None], places.after, places.after - places.after[parents])
    out.neutral_joint_translations = np.einsum("jki,jk->ji", above, from_above)
    if not np.allclose(turn, np.eye(3), atol=1e-12):
        rotations = np.asarray(out.neutral_joint_rotations, np.float64).copy()
        turned = turn @ places.turns[roots]
        rotations[roots] = sk.euler_angles(Convention.of(out), turned)
        out.neutral_joint_rotations = rotations


def jaw_of(dna: Dna, mouth: Sequence[int]) -> int:
    """The index of the jaw joint, -1 if there is none.

    The jaw is the joint with a rotation column that carries a part of the meshes in the mouth (the
    lower teeth) and not all of them.

    Args:
        dna: the source face.
        mouth: indices of the meshes in the mouth.
    """
    count = len(dna.joint_names)
    held = np.zeros(count)
    for m in mouth:
        _, joint, weight = sk.skin_entries(dna.meshes[m])
        held += np.bincount(joint, weights=weight, minlength=count)
    whole = held.sum()
    for at in reversed(sk.parent_order(dna)):
        if int(dna.joint_parents[at]) != at:
            held[int(dna.joint_parents[at])] += held[at]
    turned = np.zeros(count, bool)
    for group in dna.joint_groups:
        rows = np.asarray(group.output_indices, np.int64)
        turned[rows[(rows % 9 >= 3) & (rows % 9 < 6)] // 9] = True
    able = np.flatnonzero(turned & (held > _SOME * whole) & (held < (1 - _SOME) * whole))
    return max(able.tolist(), key=lambda j: (held[j], -j), default=-1)


def shifts_carried(dna: Dna, places: Places, turn: Doubles, stiff: Stiff) -> list[JointGroup]:
    """The joint groups with the translation columns of the target head.

    Args:
        dna: the source face.
        places: the joint positions and gradients.
        turn: float64[3, 3], the rotation from the whole source head to the target head.
        stiff: the rigid parts of the face.
    """
    parents = np.asarray(dna.joint_parents, np.int64)
    roots = parents == np.arange(len(parents))
    old = np.where(roots[:, None, None], np.eye(3), places.turns[parents])
    new = np.where(roots[:, None, None], np.eye(3), turn @ old)
    groups = [_carried(group, old, new, places) for group in dna.joint_groups]
    if stiff.jaw is not None:
        at = stiff.joint
        own = places.before[at], places.after[at]
        _set_shifts(groups, at, joint_shifts(dna, at, stiff.jaw, turn, own) @ new[at])
    return groups


def _set_shifts(groups: Sequence[JointGroup], joint: int, shifts: Doubles) -> None:
    """Write the translation columns of a joint. If two joint groups have the same column of the
    joint, the first group gets the translation and the second group gets zeros.

    Args:
        groups: copies of the face's joint groups, changed in place.
        joint: index of the joint.
        shifts: float64[columns, 3], translations in the axes of the joint's parent.
    """
    left = shifts.copy()
    for group in groups:
        rows = np.asarray(group.output_indices, np.int64)
        own = np.flatnonzero((rows // 9 == joint) & (rows % 9 < 3))
        inputs = np.asarray(group.input_indices, np.int64)
        if not len(own) or not len(inputs):
            continue
        values = np.asarray(group.values, np.float64).copy()
        at = np.ix_(inputs, rows[own] % 9)
        values[own] = left[at].T
        left[at] = 0.0
        group.values = values


def _carried(group: JointGroup, old: Doubles, new: Doubles, places: Places) -> JointGroup:
    rows = np.asarray(group.output_indices, np.int64)
    values = np.asarray(group.values, np.float64).copy()
    shift = np.flatnonzero((rows % 9 < 3) & (rows // 9 < len(old)))
    if not len(shift) or not values.size:
        return copy.copy(group)
    for joint in np.unique(rows[shift] // 9).tolist():
        own = shift[rows[shift] // 9 == joint]
        axes = rows[own] % 9
        mixing = new[joint].T @ places.linear[joint] @ old[joint]
        values[own] = mixing[np.ix_(axes, axes)] @ values[own]
    out = copy.copy(group)
    out.values = values
    return out
