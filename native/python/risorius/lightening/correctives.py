# SPDX-License-Identifier: MIT
"""Selects the correctives to remove from a face: the ones that move its vertices least."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import Dna, Mesh, Rig
from ..author.geometry import skeleton as sk
from ..author.geometry.skeleton import Doubles
from ..author.work import listed_meshes
from ..base.errors import ArgumentError
from ..base.words import counted
from .poses import Pose, motions_at

_AT_ONCE = 1 << 15  # limits the number of joints that are posed together
_LOOKED_AT = 6000  # vertices that suffice to rank correctives; fewer than twice as many are used


def needed_correctives(dna: Dna) -> set[int]:
    """Rows of correctives, from 0, that must stay, because networks, RBF solvers, their poses,
    twists, swings or animated maps read or write them."""
    raw = len(dna.raw_control_names)
    read: list[object] = [dna.animated_maps.conditionals.input_indices]
    read += [n.input_indices for n in dna.machine_learned_behavior.neural_networks]
    read += [n.output_indices for n in dna.machine_learned_behavior.neural_networks]
    ext = dna.machine_learned_behavior_ext
    read.append(ext.joints.input_indices)
    for kind in ext.types:
        for part in kind.operations:
            read += [op.parameters for op in part if op.operation_type in (1, 2)]
    for pose in dna.rbf_behavior_ext.poses:
        read += [pose.input_control_indices, pose.output_control_indices]
    for setup in (*dna.twist_swing_behavior.twists, *dna.twist_swing_behavior.swings):
        read.append(setup.input_control_indices)
    read += [solver.raw_control_indices for solver in dna.rbf_behavior.solvers]
    found = {int(c) - raw for values in read for c in np.asarray(values).ravel()}
    return {row for row in found if 0 <= row < dna.psd_count}


def contributions(dna: Dna, rig: Rig, poses: Sequence[Pose]) -> Doubles:
    """float64[correctives]: root of the sum of squared displacements that a corrective adds to the
    vertices of the finest LOD, with all of its controls at 1, in the file's unit.

    Args:
        dna: the face.
        rig: compiled from it.
        poses: poses in which all controls of a corrective are at 1; a corrective without a pose
            gets 0, and poses of single raw controls are ignored.
    """
    out = np.zeros(dna.psd_count)
    mine = [pose for pose in poses if pose.input >= len(dna.raw_control_names)]
    if not mine:
        return out
    found = rig.evaluate_batch(np.stack([pose.raw for pose in mine]))
    controls = np.asarray(found.controls, np.float64)
    inputs = np.array([pose.input for pose in mine])
    values = controls[np.arange(len(mine)), inputs]
    count = sk.column_count(dna)
    deltas = (
        sk.column_deltas(dna, max(count, int(inputs.max()) + 1))[inputs] * values[:, None, None]
    )
    meshes = [dna.meshes[m] for m in listed_meshes(dna, 0) if m < len(dna.meshes)]
    middle = middle_of(dna)
    squares = np.zeros(len(mine))
    every = max(1, sum(len(mesh.positions) for mesh in meshes) // _LOOKED_AT)
    spreads = [_Spread(dna, mesh, middle, every) for mesh in meshes]
    step = max(1, _AT_ONCE // max(1, len(dna.joint_names)))
    for begin in range(0, len(mine), step):
        some = slice(begin, begin + step)
        motions = motions_at(dna, deltas[some], middle) - np.eye(3, 4)
        for spread in spreads:
            squares[some] += spread.squares(motions, inputs[some], values[some])
    out[inputs - len(dna.raw_control_names)] = np.sqrt(squares)
    return out


def middle_of(dna: Dna) -> Doubles:
    """float64[3]: the centre of the bounding box of all meshes, in the file's unit; 0 without
    vertices."""
    points = [np.asarray(mesh.positions, np.float64) for mesh in dna.meshes]
    whole = np.concatenate([*points, np.zeros((0, 3))])
    return (whole.min(axis=0) + whole.max(axis=0)) / 2 if len(whole) else np.zeros(3)


class _Spread:
    """The vertex displacements of one mesh by motions of its joints and by its blend shapes."""

    def __init__(self, dna: Dna, mesh: Mesh, middle: Doubles, step: int) -> None:
        points = np.asarray(mesh.positions, np.float64)[::step] - middle
        weights = sk.dense_weights(mesh, len(dna.joint_names))[::step]
        self.step, self.skin = step, sk.Skin(points, weights)
        shapes = sk.column_shapes(dna, mesh, sk.column_count(dna))
        self.shapes = {column: shape[::step] for column, shape in shapes.items()}

    def squares(self, motions: Doubles, inputs: Doubles, values: Doubles) -> Doubles:
        """float64[n]: sum of squared vertex displacements in each of n poses, estimated from every
        `step`th vertex.

        Args:
            motions: float64[n, J, 3, 4], motions of the joints in each pose, minus the identity.
            inputs: int[n], control whose blend shape each pose adds.
            values: float64[n], value of this control in each pose.
        """
        out = np.zeros(len(motions))
        for at, motion in enumerate(motions):
            way = self.skin.moved(motion + np.eye(3, 4))
            shape = self.shapes.get(int(inputs[at]))
            if shape is not None:
                way = way + values[at] * shape
            out[at] = self.step * float((way**2).sum())
        return out


def least_correctives(dna: Dna, leaving: int, contribution: Doubles) -> list[int]:
    """Rows of the correctives with the least contribution, to be removed; from 0, ascending.

    A corrective that a remaining corrective reads is never removed.

    Args:
        dna: the face.
        leaving: number of correctives to remove.
        contribution: float64[correctives], size of the displacement that each corrective adds.

    Raises:
        ArgumentError: the number can only be reached by removing correctives that networks,
            solvers, twists or maps need.
    """
    raw = len(dna.raw_control_names)
    readers: dict[int, set[int]] = {}
    for row, parts in sk.psd_parts(dna).items():
        for part in parts:
            readers.setdefault(part - raw, set()).add(row - raw)
    needed, out = needed_correctives(dna), set[int]()
    order = [int(row) for row in np.argsort(contribution, kind="stable") if row not in needed]
    while len(out) < leaving:
        # A corrective becomes removable when all of its readers are removed.
        free = (row for row in order if row not in out and readers.get(row, set()) <= out)
        least = next(free, None)
        if least is None:
            raise ArgumentError(
                f"correctives: at least {counted(dna.psd_count - len(out), 'corrective')} that "
                f"networks, solvers or maps read were expected, found {dna.psd_count - leaving:,}"
            )
        out.add(least)
    return sorted(out)


def require_correctives(dna: Dna, correctives: int) -> None:
    """Checks the number of correctives to keep.

    Args:
        dna: the face.
        correctives: number of correctives to keep.

    Raises:
        ArgumentError: the face has no correctives, or fewer than this.
    """
    if not dna.psd_count:
        raise ArgumentError("correctives: the face has none, so that none can be taken out")
    if correctives > dna.psd_count:
        raise ArgumentError(
            f"correctives: at most the {dna.psd_count:,} that the face has were expected, found "
            f"{correctives:,}"
        )
