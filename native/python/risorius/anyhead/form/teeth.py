# SPDX-License-Identifier: MIT
"""Predicts the lower teeth of a head from its skin, and their change between two heads.

The size and the place of the lower teeth determine the motion of the jaw, but the skin hides the
teeth. The statistical head model contains the teeth of many heads and predicts the teeth from the
skin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...author.geometry.skeleton import Doubles, Ints
from ..surface import Surface
from .fitting import Pose, Target, form_normals
from .heads import head_form
from .standing import SURE, find_standing

_NEAR = 1.0  # cm of the model: largest distance of a vertex of the model from the face
_LEAST = 0.9  # least fraction of the vertices of the regression that must be on the face
# cm of the model: largest error of a fit (form.standing.Standing) for which the regression counts.
# The model describes other heads too poorly to tell the size of their jaws.
_DESCRIBED = 0.075
_BEYOND = 3.0  # limit of each predicted value in standard deviations
_OTHER_SIZE = 0.1  # teeth with a larger relative difference from the predicted size are ignored
_OTHER_PLACE = 0.4  # cm: teeth farther from their predicted place are ignored
_UP, _FRONT = np.eye(3)[1], np.eye(3)[2]


@dataclass(frozen=True)
class JawChange:
    """The change of the lower jaw from one head to another head.

    Attributes:
        before, after: float64[3], the same point of the jaw on the first and the second head.
        linear: float64[3, 3], maps vectors on the first jaw to vectors on the second jaw.
        sure: whether the head model describes both heads well, or their teeth confirm the change.
    """

    before: Doubles
    after: Doubles
    linear: Doubles
    sure: bool = True


def standing_pose(surface: Surface) -> Pose | None:
    """The head model fitted to an upright head; None if no face was found.

    Args:
        surface: the head, y up, the face towards +z.
    """
    best = find_standing(Target(surface), _UP, _FRONT)[0]
    return best.pose if best.error <= SURE else None


def jaw_change(
    surface: Surface, points: Doubles, on: Surface, pose: Pose, error: float = 0.0
) -> JawChange | None:
    """The change of the lower jaw between two heads with the same triangles.

    Args:
        surface: the first head.
        points: float64[V, 3], vertex positions of the second head.
        on: the surface of one of these heads, to which the head model was fitted.
        pose: the fitted model.
        error: the larger error of the model's fits to both heads, in cm of the model.

    Returns:
        The change; None if the head lacks a part of the face.
    """
    places = _places(on, pose)
    if places is None:
        return None
    used, corners, shares = places
    one, other = (
        _teeth(used, np.einsum("nk,nkd->nd", shares, p[corners])) for p in (surface.points, points)
    )
    linear = other[1] @ np.linalg.inv(one[1])
    return JawChange(one[0], other[0], linear, error <= _DESCRIBED)


def _places(surface: Surface, pose: Pose) -> tuple[Ints, Ints, Doubles] | None:
    """The vertices of the teeth regression that are on a surface: their indices among the vertices
    of the regression, the corners int64[n, 3] of the triangles at these points, and barycentric
    coordinates float64[n, 3]. None if too few are on the surface."""
    form = head_form()
    shaped = form.shaped(pose.parts, pose.expressions)
    chosen = form.teeth.vertices
    normals = form_normals(form, shaped)[chosen] @ pose.rotation.T
    near = Target(surface).closest
    triangle, shares, _ = near.nearest(pose.place(shaped[chosen]), normals, 0.3, _NEAR * pose.scale)
    there = np.flatnonzero(triangle >= 0)
    if len(there) < _LEAST * len(chosen):
        return None
    return there, surface.triangles[triangle[there]], shares[there]


def _teeth(used: Ints, points: Doubles) -> tuple[Doubles, Doubles]:
    """The predicted centre float64[3] of the lower teeth of a head, and the matrix float64[3, 3]
    that maps the teeth of the mean head to these teeth.

    Args:
        used: int64[n], indices among the vertices of the regression.
        points: float64[n, 3], positions of these vertices on the head.
    """
    form = head_form()
    told, mean = form.teeth, form.mean[form.teeth.vertices[used]]
    middle, goal = points.mean(axis=0), mean.mean(axis=0)
    u, s, vt = np.linalg.svd((points - middle).T @ (mean - goal))
    flip = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    turn = (u * flip) @ vt
    scale = float((s * flip).sum() / ((points - middle) ** 2).sum())
    away = (points - middle) @ turn * scale + goal - mean
    values = told.usual + np.einsum("kni,ni->k", told.ways[:, used], away)
    values = np.clip(values, told.mean - _BEYOND * told.spread, told.mean + _BEYOND * told.spread)
    return (
        (values[:3] - goal) @ turn.T / scale + middle,
        turn @ values[3:].reshape(3, 3) / scale,
    )


def shown_by(told: JawChange, before: Doubles, after: Doubles) -> JawChange:
    """The predicted change of the jaw, corrected by the lower teeth of both heads.

    The bounding boxes of the teeth give the position of the jaw. Its size is the geometric mean of
    the predicted size and the size by width and depth of the boxes; the height of the boxes is not
    used, because it does not depend on the jaw. Teeth that differ too much from the prediction are
    a different kind of model, so the prediction is returned unchanged.

    Args:
        told: the change that the head model predicts from the skin.
        before, after: float64[n, 3], the lower teeth of the first and of the second head, of any
            topology.
    """
    sizes = [np.ptp(points, axis=0) for points in (before, after)]
    if min(size.min() for size in sizes) <= 0:
        return told
    middle, there = ((p.min(axis=0) + p.max(axis=0)) / 2 for p in (before, after))
    scale = float(np.cbrt(max(np.linalg.det(told.linear), 1e-9)))
    goal = told.after + told.linear @ (middle - told.before)
    wide = np.log((sizes[1] / sizes[0])[[0, 2]] / scale)
    if np.abs(there - goal).max() > _OTHER_PLACE * scale or np.abs(wide).max() > _OTHER_SIZE:
        return told
    return JawChange(middle, there, float(np.exp(wide.mean() / 2)) * told.linear)
