# SPDX-License-Identifier: MIT
"""What a face is to do on the way to an expression, and what its joints do there."""

from __future__ import annotations

import numpy as np

from .. import Mesh
from . import skeleton as sk
from .pivots import arc
from .skeleton import Doubles
from .work import Work

SHARES = (0.25, 0.5, 0.75)


class Ways:
    """Where joints are on the way to 1, of the face that is made and of its source: once for all
    meshes."""

    def __init__(self, work: Work) -> None:
        count = sk.column_count(work.source)
        self.work = work
        self.made = {t: sk.column_motions(work.dna, count, t)[work.columns] for t in SHARES}
        self.before = {t: sk.column_motions(work.source, count, t)[work.columns] for t in SHARES}
        self.middles = {e: p.position for p in work.pivots for e in p.expressions}


class Between:
    """How far joints are off on the way to 1: from the line, or from the arc about a pivot."""

    def __init__(self, ways: Ways, mesh: Mesh) -> None:
        self.ways, self.work = ways, ways.work
        self.positions = np.asarray(mesh.positions, np.float64)
        self.weights = sk.dense_weights(mesh, len(self.work.source.joint_names))

    def truth(self, row: int, wanted: Doubles, share: float) -> Doubles:
        """float64[V, 3], what is added to the neutral positions.

        Args:
            row: the expression.
            wanted: float64[V, 3], what it adds at 1.
            share: of the way, 0 to 1.
        """
        whole = self.work.motions[row]
        if np.allclose(whole, np.eye(3, 4), atol=1e-12):
            middle = self.ways.middles.get(row)
            return share * wanted if middle is None else arc(self.positions, wanted, middle, share)
        # Joints that were there go their own arc; what shapes do beside them is a line.
        goal = self.positions + wanted
        shape = sk.before_skin(goal, self.weights, whole) - self.positions
        part = sk.skinned(
            self.positions + share * shape, self.weights, self.ways.before[share][row]
        )
        return part - self.positions

    def largest(self, row: int, wanted: Doubles, weights: Doubles) -> float:
        """How far the joints are off at most, at the shares, in the file's unit.

        Args:
            row: the expression.
            wanted: float64[V, 3], what it adds at 1.
            weights: float64[V, joints].
        """
        worst = 0.0
        for share in SHARES:
            reached = sk.skinned(self.positions, weights, self.ways.made[share][row])
            off = reached - self.positions - self.truth(row, wanted, share)
            worst = max(worst, float(np.linalg.norm(off, axis=1).max()))
        return worst
