# SPDX-License-Identifier: MIT
"""The lower teeth of a head by its skin, and how they differ between two heads.

The jaw moves by the size and the place of the lower teeth, which the skin hides. The model of form
knows both of many heads and tells them by the form of the face.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...author.geometry.skeleton import Doubles, Ints
from ..surface import Surface
from .fitting import Pose, Target, form_normals
from .heads import head_form
from .standing import SURE, find_standing

_NEAR = 1.0  # cm of the form: a vertex of the model farther from a face is not on it
_LEAST = 0.9  # of the vertices that tell the teeth: so many must lie on the face
_BEYOND = 3.0  # standard deviations that a quantity of the teeth may have
_OTHER_SIZE = 0.1  # teeth that differ from the expected size by a larger share are other models
_OTHER_PLACE = 0.4  # cm: teeth farther from their expected place are other models
_UP, _FRONT = np.eye(3)[1], np.eye(3)[2]


@dataclass(frozen=True)
class JawChange:
    """The lower jaw of one head and of another.

    Attributes:
        before, after: float64[3], a place of the jaw on the one head and on the other.
        linear: float64[3, 3], what makes a small vector of the one jaw that of the other.
    """

    before: Doubles
    after: Doubles
    linear: Doubles


def standing_pose(surface: Surface) -> Pose | None:
    """The model of form in a head that stands; None: there is none.

    Args:
        surface: y up, the face towards z.
    """
    best = find_standing(Target(surface), _UP, _FRONT)[0]
    return best.pose if best.error <= SURE else None


def jaw_change(surface: Surface, points: Doubles, on: Surface, pose: Pose) -> JawChange | None:
    """The change of the lower jaw between two heads with the same triangles.

    Args:
        surface: the one head.
        points: float64[V, 3], its vertices on the other.
        on: that of both in which the model of form lies.
        pose: of the model.

    Returns:
        None: the head lacks a part of the face.
    """
    places = _places(on, pose)
    if places is None:
        return None
    used, corners, shares = places
    one, other = (
        _teeth(used, np.einsum("nk,nkd->nd", shares, p[corners])) for p in (surface.points, points)
    )
    return JawChange(one[0], other[0], other[1] @ np.linalg.inv(one[1]))


def _places(surface: Surface, pose: Pose) -> tuple[Ints, Ints, Doubles] | None:
    """Which of the vertices that tell the teeth lie on a surface, the corners int64[n, 3] of their
    triangles and the shares float64[n, 3]."""
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
    """The middle float64[3] of the lower teeth, and what makes the mean head's teeth those of this
    head, float64[3, 3].

    Args:
        used: int64[n], which of the vertices that tell them are there.
        points: float64[n, 3], where.
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
    """The change of the jaw as the lower teeth of both heads and the skin show it together.

    Boxes around the teeth give the place, and half of the size by width and depth: how high teeth
    are says nothing of a jaw. Teeth that differ more from the expected ones are other models, and
    what the skin tells stays.

    Args:
        told: what the skin tells.
        before, after: float64[n, 3], the lower teeth of the one head and of the other; they may
            have other vertices.
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
