# SPDX-License-Identifier: MIT
"""Chooses the parent of each new joint: the jaw, or the neck or head joint of its vertices.

A child joint of the jaw follows the jaw's arc. An expression added to an open jaw then turns with
the jaw, like a blend shape, which is added before skinning.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from .geometry.skeleton import Doubles, Ints, matrices_of_vectors
from .geometry.wanted import Wanted
from .work import (
    Joints,
    Work,
    carried_shares,
    carriers,
    given,
    joined_positions,
    new_weights,
    resting,
)

_MINOR = 0.15  # smallest fraction of a joint's weights on another neck joint for a second joint
_ROOM = 0.08  # fraction of the new joints that is reserved for second joints


def joint_motions(fit: Joints) -> Doubles:
    """float64[E, J, 3, 4]: rigid motion of each joint in each expression, from the neutral pose.

    Args:
        fit: the joints; it has rotation vectors and shifts about the joints' positions.
    """
    turns = matrices_of_vectors(fit.rotations)
    centres = fit.joints
    moved = centres + fit.translations - np.einsum("ejik,jk->eji", turns, centres)
    return np.concatenate([turns, moved[..., None]], axis=-1)


def choose_parents(
    work: Work, meshes: Sequence[int], fit: Joints, weights: dict[int, Doubles], jaw: int | None
) -> list[int]:
    """The index of the parent of each new joint. If all joints that no expression moves are in the
    middle of the face, mirrored joints get the same parent.

    Args:
        work: the face.
        meshes: indices of the fitted meshes.
        fit: the joints.
        weights: index of a mesh -> float64[V, joints], skin weights of the mesh.
        jaw: the joint that opens the mouth, or None.
    """
    first = len(given(work))
    mirrored = fit.mirrored[first:] - first
    rows = new_weights(work, meshes, weights)
    still = resting(work)
    held = rows.T @ np.concatenate([carried_shares(work, work.source.meshes[m]) for m in meshes])
    if np.abs(work.positions[still, 0]).max() < 1e-3 * np.ptp(work.positions[:, 1]):
        held += held[mirrored]  # all resting joints are in the middle, so pairs get the same parent
    out = np.where(held.any(axis=1), still[held.argmax(axis=1)], work.head)
    if jaw is not None:
        # Joints whose parent is the neck keep this parent: jaw controls move the throat, but the
        # throat turns with the neck.
        own = out == carriers(work)[jaw]
        out[own & _follow(work, meshes, fit, rows, mirrored, jaw)] = jaw
    return [int(joint) for joint in out]


def room_for_second(
    work: Work, meshes: Sequence[int], wanted: dict[int, Wanted], joints: int
) -> int:
    """The number of new joints reserved for second_joints().

    The number is 0 if each moved vertex has at most 15 % of its weight on a joint that no
    expression moves, other than the head.

    Args:
        work: the face.
        meshes: indices of the meshes to fit.
        wanted: index of a mesh -> displacements of the mesh in each expression.
        joints: number of all new joints.
    """
    for m in meshes:
        shares = carried_shares(work, work.source.meshes[m])
        moved = wanted[m].farthest > 0
        if np.any(shares[moved][:, resting(work) != work.head] > _MINOR):
            return int(_ROOM * joints)
    return 0


def second_joints(
    work: Work,
    meshes: Sequence[int],
    fit: Joints,
    weights: dict[int, Doubles],
    room: int,
) -> tuple[Joints, dict[int, Doubles], list[int]]:
    """Duplicate joints whose vertices follow two joints that no expression moves: neck and head.

    The second joint has the same motions, but the other of these two joints as parent. So the
    vertices move as in the source if an animator rotates the neck.

    Args:
        work: the face; the parents of new joints must be known.
        meshes: indices of the fitted meshes.
        fit: the joints.
        weights: index of a mesh -> float64[V, joints], skin weights of the mesh.
        room: largest number of second joints.

    Returns:
        Joints, weights and parents; the second joints are at the end.
    """
    first, before = len(given(work)), len(work.source.joint_names)
    mirrored = fit.mirrored
    still = resting(work)
    shares = {m: carried_shares(work, work.source.meshes[m]) for m in meshes}
    held = np.sum([weights[m][:, before:].T @ shares[m] for m in meshes], axis=0)
    held += held[mirrored[first:] - first]
    least = _MINOR * held.sum(axis=1, keepdims=True)
    held[carriers(work)[before:, None] == still] = 0
    split: list[tuple[int, int]] = []  # (new joint, resting joint above its second joint)
    for joint, at in sorted(np.argwhere(held > least).tolist(), key=lambda x: (-held[*x], *x)):
        other = int(mirrored[first + joint]) - first
        pair = [(joint, at)] if other == joint else [(joint, at), (other, at)]
        if (joint, at) not in split and held[other, at] > 0 and len(split) + len(pair) <= room:
            split += pair
    return _split(work, fit, weights, shares, split)


def _split(
    work: Work,
    fit: Joints,
    weights: dict[int, Doubles],
    shares: dict[int, Doubles],
    split: list[tuple[int, int]],
) -> tuple[Joints, dict[int, Doubles], list[int]]:
    """Add second joints, and divide the weights of each first joint between it and its
    second joints.

    Args:
        work: the face.
        fit: the joints.
        weights: index of a mesh -> float64[V, joints], skin weights of the mesh.
        shares: mesh -> float64[V, resting joints], result of carried_shares().
        split: for each second joint, the index of its first joint among the new joints, and the
            index of its parent among the joints that no expression moves.
    """
    first, before = len(given(work)), len(work.source.joint_names)
    count = len(fit.joints)
    still, own = resting(work), carriers(work)
    rows = np.array([first + joint for joint, _ in split], np.int64)
    mirrored = fit.mirrored
    numbers = {pair: count + at for at, pair in enumerate(split)}
    others = [numbers[int(mirrored[first + j]) - first, at] for j, at in split]
    out = Joints(
        np.concatenate([fit.joints, fit.joints[rows]]),
        np.concatenate([fit.rotations, fit.rotations[:, rows]], axis=1),
        np.concatenate([fit.translations, fit.translations[:, rows]], axis=1),
        np.concatenate([mirrored, np.array(others, np.int64)]),
    )
    divided = {}
    for m, dense in weights.items():
        divided[m] = np.concatenate([dense, np.zeros((len(dense), len(split)))], axis=1)
        for joint in sorted({joint for joint, _ in split}):
            seconds = [(numbers[j, at] - first + before, at) for j, at in split if j == joint]
            column = before + joint
            part = {to: shares[m][:, at] for to, at in seconds}
            part[column] = shares[m][:, list(still).index(own[column])]
            whole = sum(part.values())
            held = dense[:, column].copy()
            for to, share in part.items():
                none = np.where(whole > 0, 0.0, float(to == column))
                divided[m][:, to] = held * np.where(
                    whole > 0, share / np.maximum(whole, 1e-30), none
                )
    return out, divided, [*work.parents, *(int(still[at]) for _, at in split)]


def _follow(
    work: Work, meshes: Sequence[int], fit: Joints, rows: Doubles, mirrored: Ints, jaw: int
) -> npt.NDArray[np.bool_]:
    """bool[new joints]: whether, in the expressions that move the jaw, the motion of a joint and of
    its mirrored joint is closer to the jaw's motion than to no motion.

    Args:
        work: the face.
        meshes: indices of the fitted meshes.
        fit: the joints.
        rows: float64[V, new joints], weights of the new joints.
        mirrored: int64[new joints], the mirrored new joint.
        jaw: index of the joint that opens the mouth.
    """
    first = len(given(work))
    moving = np.flatnonzero(np.abs(work.motions[:, jaw] - np.eye(3, 4)).max(axis=(1, 2)) > 1e-9)
    own = joint_motions(fit)[moving, first:]
    leading = work.motions[moving, jaw]
    positions = joined_positions(work, meshes)
    points = np.column_stack([positions, np.ones(len(positions))])
    still, beside = np.zeros(rows.shape[1]), np.zeros(rows.shape[1])
    for joint in range(rows.shape[1]):
        held = np.flatnonzero(rows[:, joint])
        at = points[held] * rows[held, joint, None]
        moved = own[:, joint] @ at.T
        still[joint] = ((moved - at[:, :3].T) ** 2).sum()
        beside[joint] = ((moved - leading @ at.T) ** 2).sum()
    return np.asarray(beside + beside[mirrored] < still + still[mirrored])
