# SPDX-License-Identifier: MIT
"""What a face is to do on the way to an expression, and what its joints do there."""

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
    """Where joints are at 1 and on the way there, of the face that is made and of its source: once
    for all meshes.

    Attributes:
        rest: float64[joints, 3], where all joints lie.
        whole: float64[C, joints, 3, 4], how they move at 1.
        made: the same at each of SHARES.
        before: of the source's joints at each of SHARES.
        turning: bool[C], whether an input moves joints of the source.
        middles: float64[3], what an input's motion goes round.
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
    """How far joints are off on the way to 1: from the line, or from the arc about a pivot."""

    def __init__(self, ways: Ways, mesh: Mesh) -> None:
        self.ways = ways
        self.positions = np.asarray(mesh.positions, np.float64)
        self.weights = sk.dense_weights(mesh, len(ways.work.source.joint_names))

    def truth(self, row: int, wanted: Doubles, shares: Sequence[float]) -> list[Doubles]:
        """float64[V, 3] of each share, what is added to the neutral positions.

        Args:
            row: the expression.
            wanted: float64[V, 3], what it adds at 1.
            shares: of the way, some of SHARES.
        """
        if not self.ways.turning[row]:
            middle = self.ways.middles.get(row)
            if middle is None:
                return [share * wanted for share in shares]
            return [arc(self.positions, wanted, middle, share) for share in shares]
        # Joints that were there go their own arc; what shapes do beside them is a line.
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
        """How far the joints are off at most, at the shares, in the file's unit.

        Args:
            row: the expression.
            wanted: float64[V, 3], what it adds at 1.
            skin: the mesh on the joints of the face that is made.
        """
        worst = 0.0
        for share, truth in zip(SHARES, self.truth(row, wanted, SHARES), strict=True):
            off = skin.moved(self.ways.made[share][row]) - truth
            worst = max(worst, float(np.linalg.norm(off, axis=1).max()))
        return worst
