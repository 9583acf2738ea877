# SPDX-License-Identifier: MIT
"""Computes the jaw of a face on the target head: its place, size, and the motion of its joint."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ... import Dna
from ...author.geometry import skeleton as sk
from ...author.geometry.skeleton import Doubles, Ints
from ...author.heads.sizes import UNITS
from ...web.kinds import kind_of
from ..form.teeth import JawChange, jaw_change, shown_by, standing_pose
from .axes import mm_of, standing_axes, standing_skin
from .change import Change, Similar
from .parts import finest

_HELD = 0.9  # a vertex hangs on the jaw if the jaw's joints have more than this weight of it


def jaw_between(
    dna: Dna,
    skin: int,
    jaw: int,
    change: Change,
    given: Mapping[str, Doubles],
    teeth: Doubles | None = None,
) -> JawChange | None:
    """The change of the lower jaw, in the axes and the unit of the file.

    The statistical head model predicts it from the skin. If both heads have lower teeth, the teeth
    correct the prediction. None if the face has no jaw, or if the model finds no face in the skin.

    Args:
        dna: the source face.
        skin: the index of its skin mesh.
        jaw: the index of its jaw joint, -1: none.
        change: the deformation of the skin.
        given: float64[V, 3] by mesh name, the new vertex positions.
        teeth: float64[n, 3], the lower teeth of the target head, of any topology.
    """
    if jaw < 0:
        return None
    axes, size = standing_axes(dna), mm_of(dna) / UNITS["cm"]
    surface = standing_skin(dna, skin)
    pose = standing_pose(surface)
    if pose is None:
        return None
    told = jaw_change(surface, size * change.after.points @ axes, surface, pose)
    if told is None:
        return None
    before, after = _lower_teeth(dna, jaw, given)
    if teeth is not None and not len(after):
        after = teeth
    if len(before) and len(after):
        told = shown_by(told, size * before @ axes, size * after @ axes)
    one, other = (p @ axes.T / size for p in (told.before, told.after))
    return JawChange(one, other, axes @ told.linear @ axes.T)


def _lower_teeth(dna: Dna, jaw: int, given: Mapping[str, Doubles]) -> tuple[Doubles, Doubles]:
    """float64[n, 3]: the lower teeth of LOD 0 on the source head, and on the target head. The
    latter are empty unless the positions of all teeth are given."""
    before, after = [np.zeros((0, 3))], [np.zeros((0, 3))]
    own = {
        m: _carried_by(dna, m, jaw) for m in finest(dna) if kind_of(dna.mesh_names[m]) == "teeth"
    }
    known = all(dna.mesh_names[m] in given for m in own)
    for m, vertices in own.items():
        before.append(np.asarray(dna.meshes[m].positions, np.float64)[vertices])
        if known:
            after.append(given[dna.mesh_names[m]][vertices])
    return np.concatenate(before), np.concatenate(after)


def _carried_by(dna: Dna, m: int, jaw: int) -> Ints:
    """Vertices of a mesh with most of their skin weights on a joint and its descendants."""
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
        turn: float64[3, 3], the rotation from the whole source head to the target head.
    """
    size = float(np.cbrt(max(np.linalg.det(jaw.linear), 1e-30)))
    return Similar(size * turn, jaw.before, jaw.after)


def joint_shifts(
    dna: Dna, joint: int, jaw: JawChange, turn: Doubles, places: tuple[Doubles, Doubles]
) -> Doubles:
    """float64[columns, 3]: the jaw joint's translation on the target head, for each input alone at
    the value 1.

    The columns are the inputs of the joint matrix; translations are in world axes, in file units.

    The jaw rotates by the same angle on both heads. The motion of the teeth is scaled with the
    teeth, and the joint's translation is chosen so that the teeth make this motion.

    Args:
        dna: the source face.
        joint: the index of the jaw joint.
        jaw: the change of the jaw.
        turn: float64[3, 3], the rotation from the whole source head to the target head.
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
