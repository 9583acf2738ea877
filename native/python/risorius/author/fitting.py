# SPDX-License-Identifier: MIT
"""Joints, weights and motions that repeat shapes; the native fit and its options."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
import numpy.typing as npt

from .. import _native
from .._native import JointFit
from .geometry.skeleton import Doubles, Ints, rotation_vectors
from .pivots import Pivot

__all__ = ["FitOptions", "JointFit", "Progress", "bounded", "fit_joints", "fit_weights"]

Progress = Callable[[float], bool | None]

_IN_THE_MIDDLE = 0xFFFFFFFF  # kInTheMiddle of native/author/fit.h


@dataclass(frozen=True)
class FitOptions:
    """How a fit is made."""

    joints: int = 120  # new ones
    influences: int = 8  # joints of a vertex at most
    smoothness: float = 1.0  # 0: only the error counts; 1: as smooth as Dem Bones' default
    emphasis: float = 3.0  # how far the largest error is fought; 0: least squares alone
    rounds: int = 40
    symmetric: bool = True  # where the mesh is
    threads: int = 0  # 0: all cores; the result does not depend on it
    # A joint takes no part in an expression in which it moves no vertex so far, in the mesh' unit.
    least_effect: float = 0.0
    # Of the second half of the rounds the one is kept whose largest error is the smallest; else of
    # the last four.
    bound: bool = False


def bounded(options: FitOptions) -> FitOptions:
    """The same, with the largest error fought for several times as long."""
    return replace(options, rounds=max(options.rounds, 200), bound=True)


def split_motions(motions: Doubles, positions: Doubles) -> tuple[Doubles, Doubles]:
    """Rotation vectors and shifts float64[E, J, 3] of rigid motions about the joints.

    Args:
        motions: float64[E, J, 3, 4].
        positions: float64[J, 3] of the joints.
    """
    moved = np.einsum("ejik,jk->eji", motions[..., :3], positions) + motions[..., 3]
    return rotation_vectors(motions[..., :3]), moved - positions


def fit_joints(
    neutral: Doubles,
    displacements: npt.NDArray[np.float32],
    edges: npt.NDArray[np.uint32],
    *,
    given: Doubles,
    motions: Doubles,
    importance: Doubles | None = None,
    pivots: Sequence[Pivot] = (),
    options: FitOptions | None = None,
    progress: Progress | None = None,
) -> JointFit:
    """New joints beside those that are there, weights on all, motions of the new ones.

    Args:
        neutral: float64[V, 3]; the left side of the face is +x or -x, its middle x = 0.
        displacements: float32[E, V, 3] of each expression at 1.
        edges: uint32[n, 2] of the polygons.
        given: float64[J, 3], joints that stay where they are.
        motions: float64[E, J, 3, 4] of the given joints; one at least rests in all expressions.
        importance: float64[V], how much a vertex' squared error counts; None: all alike.
        pivots: points that joints of some expressions are placed at.
        options: how.
        progress: told the share that is done; False stops the work, with a DnaError "stopped".

    Raises:
        DnaError: a value that is not finite, no motion at all, options out of their range.
    """
    return _native.fit_joints(
        _shapes(neutral, displacements, edges, importance),
        _given(given, motions),
        _settings(options, pivots),
        progress,
    )


def fit_motions(
    neutral: Doubles,
    displacements: npt.NDArray[np.float32],
    edges: npt.NDArray[np.uint32],
    *,
    given: Doubles,
    motions: Doubles,
    weights: Doubles,
    pivots: Sequence[Pivot],
    at: Sequence[int | None],
    options: FitOptions | None = None,
) -> JointFit:
    """What new joints do on a face of the same topology as the one that their weights are of.

    Args:
        neutral: float64[V, 3].
        displacements: float32[E, V, 3] of each expression at 1.
        edges: uint32[n, 2] of the polygons.
        given: float64[J, 3], joints that stay where they are.
        motions: float64[E, J, 3, 4] of the given joints; one at least rests in all expressions.
        weights: float64[V, J + new joints].
        pivots: points that joints may be placed at.
        at: [new joints] the pivot of each; None: it lies in the middle of what it moves.
        options: emphasis, threads and least_effect of it count.

    Raises:
        DnaError: a value that is not finite, no motion at all, a joint or pivot that is not there.
    """
    settings = _settings(options, pivots)
    settings.joints = len(at)
    return _native.fit_motions(
        _shapes(neutral, displacements, edges),
        _given(given, motions),
        settings,
        _weights(weights),
        [_IN_THE_MIDDLE if pivot is None else pivot for pivot in at],
    )


def fit_weights(
    neutral: Doubles,
    displacements: npt.NDArray[np.float32],
    edges: npt.NDArray[np.uint32],
    *,
    given: Doubles,
    motions: Doubles,
    importance: Doubles | None = None,
    mirrored: Ints | None = None,
    start: Doubles | None = None,
    options: FitOptions | None = None,
) -> JointFit:
    """Weights of another mesh on joints that move as they do: a coarser level of detail.

    Args:
        neutral: float64[V, 3].
        displacements: float32[E, V, 3].
        edges: uint32[n, 2].
        given: float64[J, 3], all joints.
        motions: float64[E, J, 3, 4].
        importance: as fit_joints.
        mirrored: int64[J], the joint of the other side; None: found by place and motion.
        start: float64[V, J], weights to begin with, such as those of the finer mesh.
        options: influences, smoothness, symmetric and threads of it count.

    Raises:
        DnaError: as fit_joints.
    """
    return _native.fit_weights(
        _shapes(neutral, displacements, edges, importance),
        _given(given, motions, mirrored),
        _settings(options),
        _weights(np.zeros((len(neutral), 0)) if start is None else start),
    )


def _shapes(
    neutral: Doubles,
    displacements: npt.NDArray[np.float32],
    edges: npt.NDArray[np.uint32],
    importance: Doubles | None = None,
) -> _native.FitShapes:
    """The native form of a mesh and its expressions."""
    return _native.FitShapes(
        neutral, displacements, edges, np.zeros(0) if importance is None else importance
    )


def _given(
    positions: Doubles, motions: Doubles, mirrored: Ints | None = None
) -> _native.GivenJoints:
    """The native form of joints float64[J, 3] and their motions float64[E, J, 3, 4]."""
    rotations, translations = split_motions(motions, positions)
    others = np.zeros(0, np.uint32) if mirrored is None else mirrored.astype(np.uint32)
    return _native.GivenJoints(positions, rotations, translations, others)


def _settings(options: FitOptions | None, pivots: Sequence[Pivot] = ()) -> _native.FitSettings:
    """The native form of the options; both have fields of the same names."""
    settings = _native.FitSettings()
    for name, value in asdict(options or FitOptions()).items():
        setattr(settings, name, value)
    settings.pivots = [_native.FitPivot(p.position, list(p.expressions)) for p in pivots]
    return settings


def _weights(dense: Doubles) -> _native.FitWeights:
    """The native form of dense weights float64[V, J]: each row without its zeros."""
    return _native.FitWeights(*_rows(dense))


def _rows(dense: Doubles) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.float32]]:
    """Joints and weights [V, n] of dense rows [V, J], n the most of any vertex."""
    most = int((dense > 0).sum(axis=1).max(initial=0)) if dense.size else 0
    joints = np.argsort(-dense, axis=1, kind="stable")[:, :most]
    return joints.astype(np.uint32), np.take_along_axis(dense, joints, axis=1).astype(np.float32)
