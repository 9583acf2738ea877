# SPDX-License-Identifier: MIT
"""Fits a mesh' skin weights on the joints of a LOD. The joints' motions are already known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .. import Mesh
from .between import Between, Ways
from .fitting import FitOptions, fit_weights
from .geometry import skeleton as sk
from .geometry.blocks import SparseWeights
from .geometry.skeleton import Doubles, Ints
from .work import (
    Work,
    carried_shares,
    carried_shift,
    carried_shifts,
    carriers,
    dense,
    given,
    resting,
)

# Weight of the displacements at the control value 0.5, at which expressions that move vertices on
# arcs are also fitted. Displacements at the value 1 have the weight 1.
_HALVES = 1.5


def level_weights(
    ways: Ways,
    options: FitOptions,
    lod: int,
    mesh: Mesh,
    wanted: Doubles,
    start: Doubles,
) -> Doubles:
    """float64[V, joints]: skin weights on the joints of a LOD.

    The fit gets two kinds of additional expressions. The first kind shifts a joint that no
    expression moves, such as the neck, with all its children, so that vertices keep following this
    joint. The second kind is the pose at the value 0.5 of expressions that move vertices along
    arcs. At LOD 0 without additional expressions, `start` is returned and nothing is fitted.

    Args:
        ways: motions of the face; the parents of new joints must be known.
        options: options of the fit.
        lod: index of the LOD. Coarser LODs use less smoothness, because their vertices are farther
            apart.
        mesh: the mesh with its weights in the source.
        wanted: float64[E, V, 3], displacements of the mesh with each expression at 1.
        start: float64[V, joints], weights to start with.
    """
    work = ways.work
    extra, shifted, used = _carried(work, mesh)
    halves, half_motions = _halves(ways, mesh, wanted)
    if lod == 0 and not len(extra) and not len(halves):
        return start
    joints = np.concatenate([used, len(work.source.joint_names) + work.new[lod]])
    asked = np.concatenate([wanted, shifted, halves])
    # The fit takes smoothness relative to all displacements. The factor makes it relative to the
    # displacements by real expressions.
    even = options.smoothness * float((wanted**2).sum() / max((asked**2).sum(), 1e-30))
    fit = fit_weights(
        np.asarray(mesh.positions, np.float64),
        asked.astype(np.float32),
        sk.mesh_edges(mesh),
        given=ways.rest[joints],
        motions=np.concatenate([ways.whole, extra, half_motions])[:, joints],
        mirrored=np.array([joints.tolist().index(work.mirrored[j]) for j in joints.tolist()]),
        start=_inherited(work, start, set(joints.tolist()))[:, joints],
        options=replace(options, smoothness=even if lod == 0 else 0.1 * even),
    )
    return dense(fit, joints, len(ways.rest))


def _carried(work: Work, mesh: Mesh) -> tuple[Doubles, Doubles, Ints]:
    """Additional expressions that shift joints that no real expression moves, such as the neck.

    Because of the additional expressions, vertices keep following these joints.

    Returns: motions [n, joints, 3, 4], displacements [n, V, 3], and the indices of the joints of
        the source that the fit uses.
    """
    still, shares = resting(work), carried_shares(work, mesh)
    used = set(carriers(work)[len(work.source.joint_names) :].tolist())
    own = [at for at, j in enumerate(still) if j == work.head or shares[:, at].any() or j in used]
    carrying = [at for at in own if still[at] != work.head]
    shifts = carried_shifts(work, still[carrying])
    motions = np.zeros((*shifts.shape[:2], 3, 4)) + np.eye(3, 4)
    motions[..., 3] = shifts
    shifted = np.zeros((len(carrying), len(mesh.positions), 3))
    shifted[..., 1] = carried_shift(work) * shares[:, carrying].T
    return motions, shifted, np.concatenate([still[own], given(work)[1:]])


def _halves(ways: Ways, mesh: Mesh, wanted: Doubles) -> tuple[Doubles, Doubles]:
    """Additional expressions: the pose at the value 0.5 of expressions along an arc.

    Returns: displacements float64[n, V, 3] and motions float64[n, joints, 3, 4], both multiplied
        by _HALVES.
    """
    between = Between(ways, mesh)
    rows = sorted({*ways.middles, *np.flatnonzero(ways.turning).tolist()})
    halves = np.zeros((len(rows), len(mesh.positions), 3))
    for at, row in enumerate(rows):
        (halves[at],) = between.truth(row, wanted[row], (0.5,))
    still = np.eye(3, 4)
    return _HALVES * halves, still + _HALVES * (ways.made[0.5][rows] - still)


def inherited(work: Work, rows: SparseWeights, lod: int) -> SparseWeights:
    """Weights at a LOD: weights on joints that the LOD lacks move to the joints that replace them.

    Args:
        work: the face.
        rows: weights at LOD 0.
        lod: index of the LOD.
    """
    before = len(work.source.joint_names)
    there = {*range(before), *(before + work.new[lod]).tolist()}
    heirs = np.array([_heir(work, joint, there) for joint in range(rows.count)], np.int32)
    return SparseWeights(heirs[rows.joints], rows.weights, rows.count)


def _heir(work: Work, joint: int, there: set[int]) -> int:
    """The joint of a LOD that takes a joint's vertices; the joint itself if the LOD has it."""
    while joint not in there and joint in work.heirs:
        joint = work.heirs[joint]
    return joint


def _inherited(work: Work, start: Doubles, there: set[int]) -> Doubles:
    """Move the weights of joints that a LOD lacks to the joints that replace them.

    Args:
        work: the face.
        start: float64[V, joints], weights at the next finer LOD.
        there: indices of the joints in the LOD.
    """
    rows = start.copy()
    for joint in np.flatnonzero(rows.any(axis=0)).tolist():
        heir = _heir(work, joint, there)
        if heir != joint:
            rows[:, heir] += rows[:, joint]
            rows[:, joint] = 0
    return rows
