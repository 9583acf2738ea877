# SPDX-License-Identifier: MIT
"""The jaw of a face on the target head: its place, its size, and the motion of its joint."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ... import Dna
from ...author.geometry import skeleton as sk
from ...author.geometry.skeleton import Doubles, Ints
from ...author.heads.sizes import UNITS
from ...web.kinds import kind_of
from ..form.teeth import JawChange, jaw_change, standing_pose
from .axes import mm_of, standing_axes, standing_skin
from .change import Change, Similar

_HELD = 0.9  # a vertex hangs on the jaw if the jaw's joints have more than this weight of it
_FEW = 8  # vertices: fewer teeth do not show the form of a jaw
_STEADY = 1e-6


def jaw_between(
    dna: Dna, skin: int, jaw: int, change: Change, given: Mapping[str, Doubles]
) -> JawChange | None:
    """The change of the lower jaw, in the axes and the unit of the file.

    Lower teeth whose new vertex positions are given show it. Otherwise the model of form tells it
    by the skin. None if the face has no jaw, or if the model finds no face in the skin.

    Args:
        dna: the source face.
        skin: the index of its skin mesh.
        jaw: the index of its jaw joint, -1: none.
        change: the deformation of the skin.
        given: float64[V, 3] by mesh name, the new vertex positions.
    """
    if jaw < 0:
        return None
    teeth = _by_teeth(dna, jaw, given)
    if teeth is not None:
        return teeth
    axes, size = standing_axes(dna), mm_of(dna) / UNITS["cm"]
    surface = standing_skin(dna, skin)
    pose = standing_pose(surface)
    if pose is None:
        return None
    found = jaw_change(surface, size * change.after.points @ axes, surface, pose)
    if found is None:
        return None
    before, after = (p @ axes.T / size for p in (found.before, found.after))
    return JawChange(before, after, axes @ found.linear @ axes.T)


def _by_teeth(dna: Dna, jaw: int, given: Mapping[str, Doubles]) -> JawChange | None:
    before: list[Doubles] = []
    after: list[Doubles] = []
    for m, name in enumerate(dna.mesh_names):
        if name in given and kind_of(name) == "teeth":
            own = _carried_by(dna, m, jaw)
            before.append(np.asarray(dna.meshes[m].positions, np.float64)[own])
            after.append(given[name][own])
    if sum(map(len, before)) < _FEW:
        return None
    one, other = np.concatenate(before), np.concatenate(after)
    a, b = one - one.mean(axis=0), other - other.mean(axis=0)
    steady = _STEADY * float((a**2).sum()) * np.eye(3)
    linear = np.linalg.solve(a.T @ a + steady, a.T @ b + steady).T
    return JawChange(one.mean(axis=0), other.mean(axis=0), linear)


def _carried_by(dna: Dna, m: int, jaw: int) -> Ints:
    """Vertices of a mesh that hang on a joint or on joints below it."""
    below = np.zeros(len(dna.joint_names), bool)
    below[jaw] = True
    for at in sk.parent_order(dna):
        below[at] |= below[int(dna.joint_parents[at])]
    vertex, joint, weight = sk.skin_entries(dna.meshes[m])
    held = np.bincount(
        vertex, weights=weight * below[joint], minlength=len(dna.meshes[m].positions)
    )
    return np.flatnonzero(held > _HELD)


def mouth_of(jaw: JawChange, turn: Doubles) -> Similar:
    """The similarity transform of the inside of the mouth.

    Args:
        jaw: the change of the jaw.
        turn: float64[3, 3], the rotation of the whole head.
    """
    size = float(np.cbrt(max(np.linalg.det(jaw.linear), 1e-30)))
    return Similar(size * turn, jaw.before, jaw.after)


def joint_shifts(
    dna: Dna, joint: int, jaw: JawChange, turn: Doubles, places: tuple[Doubles, Doubles]
) -> Doubles:
    """float64[columns, 3]: the motion of the jaw joint on the target head by input, in world axes.

    The jaw rotates by the same angle on both heads. The motion of the teeth has the size of the
    teeth, and the joint moves so that the teeth do.

    Args:
        dna: the source face.
        joint: the index of the jaw joint.
        jaw: the change of the jaw.
        turn: float64[3, 3], the rotation of the whole head.
        places: float64[3] each, the joint on the source head and on the target head.
    """
    columns = sk.column_count(dna)
    alone = np.zeros((columns, len(dna.joint_names), 9))
    alone[:, joint] = sk.column_deltas(dna, columns)[:, joint]
    rest = sk.world_matrices(dna, np.zeros((len(dna.joint_names), 9)))[joint]
    motion = (sk.world_matrices(dna, alone)[:, joint] @ np.linalg.inv(rest))[:, :3]
    rotation = turn @ motion[:, :, :3] @ turn.T
    teeth = motion[:, :, :3] @ jaw.before + motion[:, :, 3] - jaw.before
    away = jaw.after - places[1]
    return np.asarray(teeth @ jaw.linear.T + away - rotation @ away)
