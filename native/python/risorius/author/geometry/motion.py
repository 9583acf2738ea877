# SPDX-License-Identifier: MIT
"""Computes the displacements of vertices by single inputs, without a large table.

A table of all inputs, joints and vertices would be far larger than the face. So one input after the
other is computed, and only for the vertices that it moves.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ... import Dna, Mesh
from ...base.budget import Budget
from .skeleton import STILL, Doubles, Ints, joint_levels, skin_entries, world_matrices

_HELD = 1 << 14  # number of matrices that are computed at once
# Estimated work in steps of the Budget. For each input: _OF_A_JOINT for each joint, and _OF_A_LEVEL
# for each level of the joint hierarchy. _OF_A_WEIGHT: for each skin weight of a moving joint, and
# for each delta of a blend shape.
_OF_A_JOINT = 256
_OF_A_LEVEL = 4096
_OF_A_WEIGHT = 32


class Motion(NamedTuple):
    """The joints' motions with one input at 1."""

    column: int  # index of the input
    joints: Ints  # [n] indices of the moving joints
    apart: Doubles  # [n, 3, 4], motion of each joint minus the identity


def motions_of(dna: Dna, columns: Sequence[int], budget: Budget) -> Iterator[Motion]:
    """Yields a Motion for each input; the arrays of the Motion are empty if no joint moves.

    Inputs that the joint groups read come first, in ascending order, then all others.

    Args:
        dna: the face.
        columns: indices of the inputs.
        budget: the work that the face's size allows.

    Raises:
        BudgetError: the inputs need more work than the budget.
    """
    count, levels = len(dna.joint_names), len(joint_levels(dna))
    inputs, outputs, values = _entries(dna, columns)
    order = np.argsort(inputs, kind="stable")
    inputs, outputs, values = inputs[order], outputs[order], values[order]
    driving = np.unique(inputs)
    rest = world_matrices(dna, np.zeros((count, 9)))
    back = np.linalg.inv(rest)
    step = max(1, _HELD // max(1, count))
    for begin in range(0, len(driving), step):
        part = driving[begin : begin + step]
        budget.work(
            len(part) * (_OF_A_JOINT * count + _OF_A_LEVEL * levels), "joints that controls move"
        )
        first, end = np.searchsorted(inputs, [part[0], part[-1] + 1])
        deltas = np.zeros((len(part), count * 9))
        rows = np.searchsorted(part, inputs[first:end])
        np.add.at(deltas, (rows, outputs[first:end]), values[first:end])
        posed = world_matrices(dna, deltas.reshape(len(part), count, 9))
        apart = (posed @ back)[..., :3, :] - np.eye(3, 4)
        moves = np.abs(apart).max(axis=(2, 3)) > STILL
        for row, column in enumerate(part.tolist()):
            joints = np.flatnonzero(moves[row])
            yield Motion(column, joints, apart[row, joints])
    none = np.zeros(0, np.int64)
    for column in sorted(set(columns) - set(driving.tolist())):
        yield Motion(column, none, np.zeros((0, 3, 4)))


def _entries(dna: Dna, columns: Sequence[int]) -> tuple[Ints, Ints, Doubles]:
    """For each value other than 0 that an input in `columns` has in the joint groups: index of the
    input, index of the output, and the value."""
    known = np.zeros(1 << 16, bool)  # one for each index, because the format has 16 bits
    known[np.asarray(columns, np.int64)] = True
    parts = []
    for group in dna.joint_groups:
        values = np.asarray(group.values)
        row, column = np.nonzero(values)
        inputs = np.asarray(group.input_indices, np.int64)[column]
        kept = known[inputs]
        outputs = np.asarray(group.output_indices, np.int64)[row]
        parts.append((inputs[kept], outputs[kept], values[row, column][kept].astype(np.float64)))
    if not parts:
        return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)
    inputs, outputs = (np.concatenate([part[i] for part in parts]) for i in range(2))
    return inputs, outputs, np.concatenate([part[2] for part in parts])


class Mover:
    """Moves a mesh by an input: first by blend shapes, then by skinning."""

    def __init__(self, dna: Dna, mesh: Mesh) -> None:
        """Prepare a mesh.

        Args:
            dna: the face with the blend shape channels.
            mesh: a mesh of the face.
        """
        self._positions = np.asarray(mesh.positions, np.float64)
        self._vertex, self._joint, self._weight = skin_entries(mesh)
        self._targets = mesh.blend_shape_targets
        of_channel: dict[int, list[int]] = {}
        for number, target in enumerate(self._targets):
            of_channel.setdefault(int(target.blend_shape_channel_index), []).append(number)
        self._channels: dict[int, list[int]] = {}  # input -> channels that have targets here
        channels = dna.blend_shape_channels
        for source, channel in zip(channels.input_indices, channels.output_indices, strict=True):
            if int(channel) in of_channel:
                self._channels.setdefault(int(source), []).append(int(channel))
        self._of_channel = of_channel
        self._shift = np.zeros_like(self._positions)  # by blend shapes; all 0 outside moved()
        # Joint -> its row in the Motion that moved() applies, or -1; all are -1 outside moved().
        self._place = np.full(len(dna.joint_names), -1)

    def sums(self, amounts: Doubles) -> Doubles:
        """float64[V]: for each vertex, the sum over its joints of weight times the joint's amount.

        Args:
            amounts: float64[joints], a number for each joint.
        """
        weights = self._weight * amounts[self._joint]
        sums = np.bincount(self._vertex, weights=weights, minlength=len(self._positions))
        return sums.astype(np.float64)

    def moved(self, motion: Motion, budget: Budget) -> tuple[Ints, Doubles]:
        """The vertices that an input may move, and their displacements float64[n, 3].

        Args:
            motion: the joints' motions with the input at 1.
            budget: the work that the face's size allows.

        Raises:
            BudgetError: the inputs need more work than the budget.
        """
        if not len(motion.joints) and motion.column not in self._channels:
            return np.zeros(0, np.int64), np.zeros((0, 3))
        shaped = self._shape(motion.column, budget)
        self._place[motion.joints] = np.arange(len(motion.joints))
        entries = np.flatnonzero(self._place[self._joint] >= 0)
        steps = len(self._joint) / 8 + _OF_A_WEIGHT * len(entries)
        budget.work(steps, "vertices that controls move")
        vertex = self._vertex[entries]
        points = self._positions[vertex] + self._shift[vertex]
        apart = motion.apart[self._place[self._joint[entries]]]
        shifts = np.einsum("nij,nj->ni", apart[..., :3], points) + apart[..., 3]
        shifts *= self._weight[entries, None]
        first = np.flatnonzero(np.diff(vertex, prepend=-1))  # entries are sorted by vertex
        vertices = np.union1d(vertex[first], shaped)
        out = self._shift[vertices]
        if len(first):
            out[np.searchsorted(vertices, vertex[first])] += np.add.reduceat(shifts, first, axis=0)
        self._place[motion.joints] = -1
        self._shift[shaped] = 0
        return vertices, out

    def _shape(self, column: int, budget: Budget) -> Ints:
        """Add an input's blend shapes to the displacements. Returns the vertices of the shapes."""
        found = [np.zeros(0, np.int64)]
        for channel in self._channels.get(column, ()):
            for number in self._of_channel[channel]:
                target = self._targets[number]
                at = np.asarray(target.vertex_indices, np.int64)
                budget.work(_OF_A_WEIGHT * len(at), "vertices that controls move")
                np.add.at(self._shift, at, np.asarray(target.deltas, np.float64))
                found.append(at)
        return np.concatenate(found)
