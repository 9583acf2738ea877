# SPDX-License-Identifier: MIT
"""Computes where vertices should be at control values between 0 and 1, and the joints' errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import Dna, Mesh
from .geometry import skeleton as sk
from .geometry.skeleton import Doubles
from .pivots import arc
from .work import Work

SHARES = (0.25, 0.5, 0.75)


class Ways:
    """Joint motions by single inputs at 1 and at SHARES (0.25, 0.5, 0.75), in the new face and in
    its source face.

    Attributes:
        rest: float64[joints, 3], neutral positions of the new face's joints.
        whole: float64[C, joints, 3, 4], motions of the new face's joints with each of C inputs at
            1, as matrices from positions in the rest pose to posed positions.
        made: control value of SHARES -> motions of the new face's joints, shaped as `whole`, with
            each input at this value.
        before: control value of SHARES -> float64[C, J, 3, 4], motions of the source's J joints
            with each input at this value.
        turning: bool[C], whether an input moves joints of the source.
        middles: index of an input in the C inputs -> float64[3], the pivot about which the input
            turns vertices; inputs without a pivot have no entry.
    """

    def __init__(self, work: Work) -> None:
        count = sk.column_count(work.source)

        def motions(dna: Dna, value: float) -> Doubles:
            return sk.column_motions(dna, count, value)[work.columns]

        self.work = work
        neutral = np.zeros((len(work.dna.joint_names), 9))
        self.rest = sk.world_matrices(work.dna, neutral)[:, :3, 3]
        self.whole = motions(work.dna, 1.0)
        self.made = {t: motions(work.dna, t) for t in SHARES}
        self.before = {t: motions(work.source, t) for t in SHARES}
        still = np.isclose(work.motions, np.eye(3, 4), atol=1e-12)
        self.turning = ~still.all(axis=(1, 2, 3))
        self.middles = {e: p.position for p in work.pivots for e in p.expressions}


class Between:
    """Measures the errors of a mesh with an input at SHARES (0.25, 0.5, 0.75): the distances of its
    vertices from their wanted positions.

    The wanted positions are on straight lines, on arcs about a pivot, or on the arcs of the
    source's joints.
    """

    def __init__(self, ways: Ways, mesh: Mesh) -> None:
        self.ways = ways
        self.positions = np.asarray(mesh.positions, np.float64)
        self.weights = sk.dense_weights(mesh, len(ways.work.source.joint_names))

    def truth(self, row: int, wanted: Doubles, shares: Sequence[float]) -> list[Doubles]:
        """The wanted displacements float64[V, 3] at each control value in `shares`.

        Args:
            row: index of the expression among the C inputs.
            wanted: float64[V, 3], its displacements at 1.
            shares: values of the control, some of SHARES.
        """
        if not self.ways.turning[row]:
            middle = self.ways.middles.get(row)
            if middle is None:
                return [share * wanted for share in shares]
            return [arc(self.positions, wanted, middle, share) for share in shares]
        # Joints of the source move vertices on arcs, and its blend shapes on lines. So only the
        # shape before skinning is scaled.
        goal = self.positions + wanted
        whole = self.ways.work.motions[row]
        shape = sk.before_skin(goal, self.weights, whole) - self.positions
        out = []
        for share in shares:
            shaped = self.positions + share * shape
            moved = sk.skinned(shaped, self.weights, self.ways.before[share][row])
            out.append(moved - self.positions)
        return out

    def largest(self, row: int, wanted: Doubles, skin: sk.Skin) -> float:
        """The largest error of the joints at SHARES, in the file's unit.

        Args:
            row: index of the expression among the C inputs.
            wanted: float64[V, 3], its displacements at 1.
            skin: the mesh with its weights on the joints of the new face.
        """
        worst = 0.0
        for share, truth in zip(SHARES, self.truth(row, wanted, SHARES), strict=True):
            off = skin.moved(self.ways.made[share][row]) - truth
            worst = max(worst, float(np.linalg.norm(off, axis=1).max()))
        return worst
