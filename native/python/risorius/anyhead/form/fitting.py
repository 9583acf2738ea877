# SPDX-License-Identifier: MIT
"""Fits the statistical head model to a surface by iterative closest points.

Each round pairs vertices of the model with the closest surface points that have a similar normal. A
Gauss-Newton step then solves rotation, translation, scale and weights of the model together.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
import numpy.typing as npt

from ... import _native
from ...author.geometry.skeleton import Doubles, Ints
from ..surface import Surface
from .heads import HeadForm, head_form

_ALIKE = 0.08  # share of the pairs that count as independent, because neighbours err alike
_ALONG = 0.15  # weight of distances along the surface, against 1 across it
_EXPRESSED = 4.0  # prior of an expression against a part: a weight of 0.5 is as rare as 1 of a part
# Expressions with a 20 times stronger prior, because otherwise they would be fitted to the form of
# a person's neutral mouth.
_SELDOM = ("smile", "pucker")
_OPEN = (0.0, 1.2)  # range of the weight of an expression
_BEYOND = 3.5  # standard deviations: largest weight of a part


@dataclass
class Pose:
    """A fitted model and its place: point = scale * rotation @ model + shift.

    Attributes:
        rotation: float64[3, 3], from the space of the model to the space of the surface.
        scale: units of the surface per cm of the model.
        shift: float64[3], the translation.
        parts: float64[K], weights of the principal components in standard deviations.
        expressions: float64[E], weights of the model's expressions, 0 to 1.2.
    """

    rotation: Doubles
    scale: float
    shift: Doubles
    parts: Doubles = field(default_factory=lambda: np.zeros(len(head_form().parts)))
    expressions: Doubles = field(default_factory=lambda: np.zeros(len(head_form().expressions)))

    def points(self, form: HeadForm) -> Doubles:
        """float64[V, 3]: vertices of the fitted model in the space of the surface."""
        return self.place(form.shaped(self.parts, self.expressions))

    def place(self, points: Doubles) -> Doubles:
        """float64[n, 3]: points, transformed from the space of the model to the surface's space."""
        return np.asarray(self.scale * points @ self.rotation.T + self.shift)

    def back(self, points: Doubles) -> Doubles:
        """float64[n, 3]: points, transformed from the surface's space to the space of the model."""
        return np.asarray((points - self.shift) @ self.rotation / self.scale)


class Target:
    """A surface to which the model is fitted.

    Attributes:
        surface: the triangles.
        closest: search tree for closest points.
        normals: float64[T, 3], unit normals of the triangles.
        open_side: bool[T, 3], whether the side opposite to each corner is a border of the surface.
    """

    def __init__(self, surface: Surface) -> None:
        self.surface = surface
        self.closest = _native.ClosestPoints(surface.points, surface.triangles)
        normals = surface.face_normals()
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        self.normals = normals / np.maximum(length, 1e-300)
        self.open_side = _open_sides(surface.triangles, len(surface.points))

    def pairs(
        self, points: Doubles, normals: Doubles, least_cosine: float, farthest: float
    ) -> tuple[npt.NDArray[np.bool_], Doubles, Doubles]:
        """The closest points of the surface.

        Args:
            points, normals: float64[n, 3], points with normals whose partners are searched for.
            least_cosine: least cosine between the normals of a pair.
            farthest: largest distance of a pair.

        Returns:
            bool[n], False for points without a partner or with a partner at a border of the
            surface; float64[n, 3], the partners; float64[n, 3], their normals.
        """
        triangle, shares, _ = self.closest.nearest(points, normals, least_cosine, farthest)
        at = np.maximum(triangle, 0)
        edge = (self.open_side[at] & (shares < 1e-4)).any(axis=1)
        return (triangle >= 0) & ~edge, self.surface.at(at, shares), self.normals[at]


def _open_sides(triangles: Ints, count: int) -> npt.NDArray[np.bool_]:
    sides = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]], axis=2).astype(np.int64)
    key = sides[..., 0] * count + sides[..., 1]
    _, back, times = np.unique(key, return_inverse=True, return_counts=True)
    return np.asarray(times[back].reshape(key.shape) == 1)


@dataclass(frozen=True)
class Step:
    """Settings of one step of a fit.

    Attributes:
        rounds: number of rounds; each finds new pairs.
        reach: distance in cm of the model; pairs farther apart have little weight.
        vertices: number of vertices of the model that are paired.
        parts: number of principal components whose weights may change.
        prior: strength of the pull of weights towards 0; 1: the model's standard deviations.
        least_cosine: least cosine between the normals of a pair.
        expressions: whether weights of expressions may change.
        noise: standard deviation, in cm of the model, of distances that the model cannot explain.
    """

    rounds: int
    reach: float
    vertices: int
    parts: int
    prior: float = 1.0
    least_cosine: float = 0.3
    expressions: bool = True
    noise: float = 0.1


PLACE = (
    Step(3, 4.0, 200, 0, expressions=False),
    Step(6, 4.0, 300, 0, expressions=False),
)
ROUGH = (Step(6, 2.0, 500, 6, 4.0), Step(6, 1.2, 700, 14, 3.0))
FINE = (
    Step(6, 0.9, 1600, 24, 2.0, 0.4),
    Step(6, 0.6, 4000, 40, 1.0, 0.5),
    Step(6, 0.4, 4000, 40, 0.5, 0.5),
)


def fit(
    target: Target,
    pose: Pose,
    steps: tuple[Step, ...],
    held: Held | None = None,
    weights: Doubles | None = None,
    form: HeadForm | None = None,
) -> Pose:
    """Fit the model to a surface, beginning with an approximate pose.

    Args:
        target: the surface.
        pose: the pose to begin with; it is not changed.
        steps: the steps of the fit in order.
        held: vertices of the model with known positions.
        weights: float64[V], weight of each vertex of the model; all skin vertices with a weight
            other than 0 are paired, and `vertices` of the steps is ignored. None: the weights in
            the model.
        form: the model, with the triangles of `head_form()`; None: `head_form()` itself.
    """
    form = form or head_form()
    if weights is not None:
        form = replace(form, weights=weights)
    for step in steps:
        chosen = (
            _chosen(form, step.vertices)
            if weights is None
            else np.flatnonzero(weights[: form.skin])
        )
        for _ in range(step.rounds):
            pose = _round(form, target, pose, step, chosen, held)
    return pose


@dataclass(frozen=True)
class Held:
    """Vertices of the model with known positions.

    Attributes:
        vertices: int64[n], indices of vertices of the model.
        points: float64[n, 3], their positions in the surface's space.
        weights: float64[n]; 1 is the weight of a pair in the middle of the face.
    """

    vertices: Ints
    points: Doubles
    weights: Doubles


def _chosen(form: HeadForm, count: int) -> Ints:
    """int64[n]: vertices spread over the model, denser where its fit weights are high."""
    if count >= form.skin:
        return np.arange(form.skin)
    areas = np.zeros(form.skin)
    size = np.linalg.norm(Surface(form.mean, form.triangles).face_normals(), axis=1)
    for k in range(3):
        np.add.at(areas, form.triangles[:, k], size)
    share = np.sqrt(areas) * form.weights[: form.skin]
    steps = np.cumsum(share) / share.sum() * count
    return np.flatnonzero(np.diff(np.floor(steps), prepend=-1.0) > 0)


def form_normals(form: HeadForm, shaped: Doubles) -> Doubles:
    """float64[skin, 3]: unit vertex normals of a shaped model in its own space.

    Args:
        form: gives the triangles.
        shaped: float64[V, 3], the vertex positions.
    """
    a, b, c = (shaped[form.triangles[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    order, first = _around()
    out = np.add.reduceat(across[order // 3], first, axis=0)
    return np.asarray(out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-300))


@cache
def _around() -> tuple[Ints, Ints]:
    """The triangle corners sorted by vertex, and the index of the first corner of each vertex."""
    flat = head_form().triangles.ravel()
    order = np.argsort(flat, kind="stable")
    return order, np.searchsorted(flat[order], np.arange(head_form().skin))


@cache
def _mean_normals() -> Doubles:
    return form_normals(head_form(), head_form().mean)


def pose_normals(form: HeadForm, pose: Pose, shaped: Doubles) -> Doubles:
    """float64[skin, 3]: unit vertex normals of a shaped model in the surface's space.

    Args:
        form: the model.
        pose: the pose of the model.
        shaped: float64[V, 3], vertex positions of the model with the weights of the pose.
    """
    as_mean = form is head_form() and not (pose.parts.any() or pose.expressions.any())
    normals = _mean_normals() if as_mean else form_normals(form, shaped)
    return np.asarray(normals @ pose.rotation.T)


def _round(
    form: HeadForm, target: Target, pose: Pose, step: Step, chosen: Ints, held: Held | None
) -> Pose:
    shaped = form.shaped(pose.parts, pose.expressions)
    placed = pose.place(shaped[chosen])
    normals = pose_normals(form, pose, shaped)[chosen]
    found, near, across = target.pairs(
        placed, normals, step.least_cosine, 3.0 * step.reach * pose.scale
    )
    used = chosen[found]
    if len(used) < 30:
        return pose
    # The equations are in the space of the model; points of the surface are transformed to it.
    away = shaped[used] - pose.back(near[found])
    across = across[found] @ pose.rotation
    weight = form.weights[used] / (1 + (np.linalg.norm(away, axis=1) / step.reach) ** 2) ** 2
    system = _System(form, shaped, step)
    system.add(used, away, across, weight)
    if held is not None:
        apart = shaped[held.vertices] - pose.back(held.points)
        system.add(held.vertices, apart, None, held.weights)
    return system.solved(pose)


class _System:
    """The normal equations of a round. Unknowns: rotation (3), translation (3), log scale (1), then
    the weights of principal components and of expressions."""

    def __init__(self, form: HeadForm, shaped: Doubles, step: Step) -> None:
        self.form, self.shaped, self.step = form, shaped, step
        self.parts = min(step.parts, len(form.parts))
        self.more = len(form.expressions) if step.expressions else 0
        size = 7 + self.parts + self.more
        self.left, self.right = np.zeros((size, size)), np.zeros(size)

    def add(self, used: Ints, away: Doubles, across: Doubles | None, weight: Doubles) -> None:
        """Add equations that reduce the distances of pairs.

        Args:
            used: int64[n], vertices of the model.
            away: float64[n, 3], vectors from their partners to these vertices.
            across: float64[n, 3], normals at the partners; None: all directions have equal weight.
            weight: float64[n], weights of the pairs.
        """
        ways = self._ways(used)
        amount = _ALIKE * weight / self.step.noise**2
        if across is not None:
            slope = np.einsum("vdi,vd->vi", ways, across)
            self.left += (slope * amount[:, None]).T @ slope
            self.right -= (slope * amount[:, None]).T @ np.einsum("vd,vd->v", away, across)
            amount = amount * _ALONG**2
        for k in range(3):
            self.left += (ways[:, k] * amount[:, None]).T @ ways[:, k]
            self.right -= (ways[:, k] * amount[:, None]).T @ away[:, k]

    def _ways(self, used: Ints) -> Doubles:
        """float64[n, 3, unknowns]: derivatives of the positions of the vertices `used` by each
        unknown of the system."""
        points, form = self.shaped[used], self.form
        turn = np.cross(np.eye(3)[None], points[:, None])  # [n, axis, 3]
        out = [turn.transpose(0, 2, 1), np.broadcast_to(np.eye(3), (len(used), 3, 3))]
        out += [points[:, :, None], form.parts[: self.parts, used].transpose(1, 2, 0)]
        if self.more:
            out.append(form.expressions[:, used].transpose(1, 2, 0))
        return np.concatenate(out, axis=2)

    def solved(self, pose: Pose) -> Pose:
        """The pose after a Gauss-Newton step from `pose`."""
        values = np.concatenate([pose.parts[: self.parts], pose.expressions[: self.more]])
        hold = np.full(len(values), float(self.step.prior))
        hold[self.parts :] *= _EXPRESSED
        for k, name in enumerate(self.form.expression_names[: self.more]):
            if name in _SELDOM:
                hold[self.parts + k] *= 20.0
        at = np.arange(7, 7 + len(values))
        self.left[at, at] += hold
        self.right[at] -= hold * values
        self.left[np.arange(7), np.arange(7)] += 1e-6 * np.trace(self.left) / len(self.left)
        change = np.linalg.solve(self.left, self.right)
        values = values + change[7:]
        parts, expressions = pose.parts.copy(), pose.expressions.copy()
        parts[: self.parts] = np.clip(values[: self.parts], -_BEYOND, _BEYOND)
        expressions[: self.more] = np.clip(values[self.parts :], *_OPEN)
        grow = float(np.clip(1 + change[6], 0.7, 1.4))
        scale = pose.scale * grow
        shift = pose.shift + pose.scale * pose.rotation @ change[3:6]
        rotation = pose.rotation @ _turn(change[:3])
        return replace(
            pose, rotation=rotation, scale=scale, shift=shift, parts=parts, expressions=expressions
        )


def _turn(vector: Doubles) -> Doubles:
    """float64[3, 3]: the rotation about a vector by its length in radians, at most 0.5."""
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    angle = min(angle, 0.5)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
