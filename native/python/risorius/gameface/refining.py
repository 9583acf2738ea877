# SPDX-License-Identifier: MIT
"""Fits more combinations to the errors that combinations of two targets leave at typical poses.

The combination of two targets is exact if both are fully on. At other poses errors remain, such as
lids that are half shut and look half down, or three targets on together. Additional morph targets
correct them. The weight of each is a function of other weights that is 0 at the exact poses. Of
many such functions, the ones that reduce the error most in least squares are chosen greedily.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
import numpy.typing as npt

from .._native import Rig
from ..controls.shares import share_of
from .combining import (
    CUBIC,
    EARLY,
    LATE,
    MIDDLE,
    PRODUCT,
    SHUT,
    TRIPLE,
    Combination,
    Sums,
    weight_of,
)
from .parts import Points
from .targets import Target

Doubles = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]

MOST = 120
POSES = 1500
_BATCH = 50
_LOUDEST = 1200  # vertices with the largest errors, by which combinations are chosen
_MAIN = 80  # principal components of the errors that are kept
_RIDGE = 1e-4
_LEAST_GAIN = 0.001  # share of the initial squared error that a combination must remove
_OFTEN = 12  # a function that differs from 0 in this number of poses or fewer is not used
_NEW = 0.05  # share of a function's length that the chosen functions must not explain
_LEAST = 2e-6  # metres: shorter displacements are set to 0


class Refiner:
    """Corrects the errors that linear sums and combinations of pairs leave at given poses.

    Attributes:
        before, after: float64[n], the largest vertex error in mm at every fifth pose, without and
            with the new combinations.
    """

    def __init__(
        self, points: Points, rig: Rig, sums: Sums, targets: Sequence[Target],
        made: Sequence[Combination],
    ) -> None:  # fmt: skip
        """Prepares the fit at one LOD.

        Args:
            points: vertices of the LOD.
            rig: the face's rig.
            sums: linear sums of its targets.
            targets: targets of the group arkit, which face capture drives.
            made: the combinations of pairs.
        """
        self._points, self._targets, self._made = points, list(targets), list(made)
        self._rest = np.asarray(rig.initial_raw_controls, np.float32)
        self._column = {t.name: i for i, t in enumerate(self._targets)}
        self._deltas = [sums.delta(t.name) for t in self._targets]
        self._pairs = [sums.combination(one) for one in self._made]
        self.before = self.after = np.zeros(0)

    def found(self, poses: Doubles, most: int) -> list[tuple[Combination, Floats]]:
        """New combinations with their displacements, the most useful first.

        Args:
            poses: float64[n, targets], weights from 0 to 1.
            most: largest number of combinations; never more than MOST (120) are made.
        """
        wanted = list(self._candidates(poses))
        if not wanted or most < 1:
            return []
        chosen = self._choose(wanted, poses, min(most, MOST))
        if not chosen:
            return []
        deltas = self._fit(chosen, poses)
        return list(zip(chosen, deltas, strict=True))

    def _left(self, weights: Doubles) -> Doubles:
        """float64[P, 3]: the error of the linear sum with its pair combinations at a pose, in m."""
        out = self._points.at(pose_of(self._targets, self._rest, weights)) - self._points.rest
        for weight, delta in zip(weights, self._deltas, strict=True):
            if weight:
                out -= weight * delta
        for weight, delta in zip(
            self._weights(self._made, weights[None])[0], self._pairs, strict=True
        ):
            if weight:
                out -= weight * delta
        return out

    def _weights(self, of: Sequence[Combination], poses: Doubles) -> Doubles:
        """float64[poses, combinations]: the weight of each combination at each pose."""
        rows = [weight_of(one.weight, *(poses[:, self._column[n]] for n in one.of)) for one in of]
        return np.array(rows).reshape(len(of), len(poses)).T

    def _candidates(self, poses: Doubles) -> Iterator[Combination]:
        pairs = [one.of for one in self._made if one.weight == PRODUCT]
        kinds: list[tuple[str, tuple[str, ...]]] = [
            (CUBIC, (t.name,)) for t in self._targets if not t.needs
        ]
        kinds += [(kind, of) for of in pairs for kind in (EARLY, LATE, MIDDLE)]
        on_top = {t.name: t.needs for t in self._targets if t.needs}
        for of in pairs:
            for top, other in (of, of[::-1]):
                if top in on_top:
                    kinds.append((SHUT, (top, on_top[top], other)))
        known = set(map(frozenset, pairs))
        names = sorted({name for of in pairs for name in of}, key=self._column.__getitem__)
        for three in combinations(names, 3):
            if sum(frozenset(two) in known for two in combinations(three, 2)) >= 2:
                kinds.append((TRIPLE, three))
        for kind, of in kinds:
            one = Combination(f"{'_x_'.join(of)}_{kind}", of, kind, 0.0)
            if np.count_nonzero(self._weights([one], poses)) > _OFTEN:
                yield one

    def _choose(
        self, wanted: Sequence[Combination], poses: Doubles, most: int
    ) -> list[Combination]:
        """Chooses greedily: each step adds the combination that most reduces the error left.

        Args:
            wanted: the candidates.
            poses: float64[n, targets], weights from 0 to 1.
            most: largest number of combinations.
        """
        left = self._main_directions(poses)
        own = self._weights(wanted, poses)
        at_first, whole = float(np.square(left).sum()), np.linalg.norm(own, axis=0)
        out = list[Combination]()
        while len(out) < most:
            length = np.linalg.norm(own, axis=0)
            is_new = length > _NEW * whole
            gains = np.linalg.norm(own.T @ left, axis=1) / np.maximum(length, 1e-12) * is_new
            best = int(gains.argmax())
            if gains[best] ** 2 <= _LEAST_GAIN * at_first:
                break
            out.append(wanted[best])
            along = own[:, best] / length[best]
            left = left - np.outer(along, along @ left)
            own = own - np.outer(along, along @ own)
        return out

    def _main_directions(self, poses: Doubles) -> Doubles:
        """float64[poses, at most 80]: the coordinates of each pose's error along the largest
        principal components of the errors of all poses.

        Only the 1,200 vertices with the largest errors are used.
        """
        loud = np.zeros(len(self._points.rest))
        for pose in poses[:: max(1, len(poses) // 100)]:
            np.maximum(loud, np.square(self._left(pose)).sum(axis=1), out=loud)
        places = np.argsort(-loud)[:_LOUDEST]
        found = np.stack([self._left(pose)[places].ravel() for pose in poses])
        sizes, turns = np.linalg.eigh(found @ found.T)
        return np.asarray(turns[:, -_MAIN:] * np.sqrt(np.maximum(sizes[-_MAIN:], 0.0)), np.float64)

    def _fit(self, chosen: Sequence[Combination], poses: Doubles) -> list[Floats]:
        """float32[P, 3] of each combination, fitted in least squares over all poses."""
        weights = self._weights(chosen, poses)
        right = np.zeros((len(chosen), self._points.rest.size))
        for begin in range(0, len(poses), _BATCH):
            left = [self._left(pose).ravel() for pose in poses[begin : begin + _BATCH]]
            right += weights[begin : begin + _BATCH].T @ np.array(left)
        square = weights.T @ weights + _RIDGE * len(poses) * np.eye(len(chosen))
        deltas = np.linalg.solve(square, right).reshape(len(chosen), -1, 3)
        tried = poses[::5]
        ends = [self._left(pose) for pose in tried]
        self.before = np.array([_farthest(end) for end in ends])
        self.after = np.array(
            [
                _farthest(end - np.tensordot(row, deltas, 1))
                for end, row in zip(ends, weights[::5], strict=True)
            ]
        )
        deltas[np.abs(deltas).max(axis=2) < _LEAST] = 0.0
        return list(deltas.astype(np.float32))


def pose_of(targets: Sequence[Target], rest: Floats, weights: Doubles) -> Floats:
    """float32[R]: raw controls of the rig at given weights of ARKit units.

    Args:
        targets: targets of the group arkit.
        rest: float32[R], values of the raw controls in the rest pose.
        weights: float64[targets], 0 to 1.
    """
    column = {target.name: i for i, target in enumerate(targets)}
    raw = rest.astype(np.float64)
    for target, weight in zip(targets, weights, strict=True):
        if weight and target.needs:
            whole = np.array(weights[column[target.needs]])
            raw += float(share_of(np.array(weight), whole)) * (target.raw - target.base)
        elif weight:
            raw += weight * (target.raw - target.base)
    return np.clip(raw, -1.0, 1.0).astype(np.float32)


def _farthest(delta: Doubles) -> float:
    """Length of the largest displacement in mm. Args: delta: float64[P, 3], metres."""
    return 1000.0 * float(np.sqrt(np.square(delta).sum(axis=1).max(initial=0.0)))
