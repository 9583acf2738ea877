# SPDX-License-Identifier: MIT
"""Calls the native fit of joints, skin weights and joint motions to the shapes of expressions."""

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
    """Options of a fit."""

    joints: int = 120  # number of new joints
    influences: int = 8  # largest number of joints per vertex
    smoothness: float = 1.0  # 0: only the error counts; 1: as smooth as the default of Dem Bones
    emphasis: float = 3.0  # weight of large errors; 0: least squares only
    rounds: int = 40  # number of iterations
    symmetric: bool = True  # symmetric joints if the mesh is symmetric
    threads: int = 0  # number of threads; 0: all cores; the result does not depend on it
    # A joint does not move in an expression in which it would move every vertex by less than this
    # distance, in the mesh' unit.
    least_effect: float = 0.0
    # The result is the round with the smallest maximum error: among the second half of the rounds
    # if True, among the last four rounds if False.
    bound: bool = False


def bounded(options: FitOptions) -> FitOptions:
    """The options with at least 200 rounds and `bound` True, so that the largest error is
    smaller."""
    return replace(options, rounds=max(options.rounds, 200), bound=True)


def split_motions(motions: Doubles, positions: Doubles) -> tuple[Doubles, Doubles]:
    """Split rigid motions into rotation vectors about the joints, and shifts of the joints.

    Args:
        motions: float64[E, J, 3, 4], motion of each joint in each expression, as a matrix from
            neutral to posed positions.
        positions: float64[J, 3], neutral positions of the joints.

    Returns:
        The rotation vectors (axis times angle in radians) and the shifts, float64[E, J, 3] each.
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
    """Fit positions and motions of new joints in addition to given joints, and weights of all
    joints. A motion is a matrix from neutral to posed positions.

    Args:
        neutral: float64[V, 3], neutral vertices; the face's middle is x = 0.
        displacements: float32[E, V, 3], displacements with each expression at 1.
        edges: uint32[n, 2], edges of the polygons.
        given: float64[J, 3], positions of the given joints.
        motions: float64[E, J, 3, 4], motions of the given joints; at least one joint must not move
            in any expression.
        importance: float64[V], weight of a vertex' squared error; None: 1.
        pivots: points at which joints of some expressions are placed.
        options: options of the fit.
        progress: gets the finished fraction; returns False to stop with DnaError "stopped".

    Raises:
        DnaError: a value is not finite, nothing moves, or an option is out of range.
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
    """Fit positions and motions of new joints whose weights are known from another face.

    A motion is a matrix from neutral to posed positions.

    Args:
        neutral: float64[V, 3], neutral vertices.
        displacements: float32[E, V, 3], displacements with each expression at 1.
        edges: uint32[n, 2], edges of the polygons.
        given: float64[J, 3], positions of the given joints.
        motions: float64[E, J, 3, 4], motions of the given joints; at least one joint must not move
            in any expression.
        weights: float64[V, J + new joints], skin weights: given joints first, then new ones.
        pivots: points at which joints may be placed.
        at: index of the pivot of each new joint; None: the joint is placed in the middle of its
            vertices.
        options: options of the fit; only emphasis, threads and least_effect are used.

    Raises:
        DnaError: a value is not finite, nothing moves, or a joint or pivot does not exist.
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
    """Fit the skin weights of a mesh on joints with known motions, for example at a coarser LOD.

    Args:
        neutral: float64[V, 3], neutral vertices.
        displacements: float32[E, V, 3], displacements with each expression at 1.
        edges: uint32[n, 2], edges of the polygons.
        given: float64[J, 3], positions of all joints.
        motions: float64[E, J, 3, 4], matrices of all joints from neutral to posed positions.
        importance: float64[V], weight of a vertex' squared error; None: 1.
        mirrored: int64[J], the joint of the other side; None: found by place and motion.
        start: float64[V, J], weights to start with, for example of the finer mesh.
        options: options of the fit; only influences, smoothness, symmetric and threads are used.

    Raises:
        DnaError: a value is not finite, nothing moves, or an option is out of range.
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
    """A mesh and its expressions as an object of the native module; see fit_joints() for the
    arguments."""
    return _native.FitShapes(
        neutral, displacements, edges, np.zeros(0) if importance is None else importance
    )


def _given(
    positions: Doubles, motions: Doubles, mirrored: Ints | None = None
) -> _native.GivenJoints:
    """Joints and their motions as an object of the native module.

    Args:
        positions: float64[J, 3], neutral positions of the joints.
        motions: float64[E, J, 3, 4], motion of each joint in each expression.
        mirrored: int64[J], the joint of the other side; None: found by place and motion.
    """
    rotations, translations = split_motions(motions, positions)
    others = np.zeros(0, np.uint32) if mirrored is None else mirrored.astype(np.uint32)
    return _native.GivenJoints(positions, rotations, translations, others)


def _settings(options: FitOptions | None, pivots: Sequence[Pivot] = ()) -> _native.FitSettings:
    """The options as an object of the native module, whose fields have the same names."""
    settings = _native.FitSettings()
    for name, value in asdict(options or FitOptions()).items():
        setattr(settings, name, value)
    settings.pivots = [_native.FitPivot(p.position, list(p.expressions)) for p in pivots]
    return settings


def _weights(dense: Doubles) -> _native.FitWeights:
    """Dense weights float64[V, J] as an object of the native module, which stores only the weights
    above 0."""
    return _native.FitWeights(*_rows(dense))


def _rows(dense: Doubles) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.float32]]:
    """Joints and weights [V, n] of dense weights [V, J], largest first, padded with weight 0.

    n is the largest number of joints with a weight above 0 at one vertex.
    """
    most = int((dense > 0).sum(axis=1).max(initial=0)) if dense.size else 0
    joints = np.argsort(-dense, axis=1, kind="stable")[:, :most]
    return joints.astype(np.uint32), np.take_along_axis(dense, joints, axis=1).astype(np.float32)
