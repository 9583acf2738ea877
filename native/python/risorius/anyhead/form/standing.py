# SPDX-License-Identifier: MIT
"""Where in a surface a head is, of any unit and direction: the best of many guesses."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...author.geometry.skeleton import Doubles
from .fitting import FINE, PLACE, ROUGH, Held, Pose, Target, fit, form_normals
from .heads import HeadForm, head_form

TOP, CHIN, BACK, FRONT = 11.5, -11.5, -15.0, 5.0  # of the mean form, cm
_SHARES = (1.0, 0.72, 0.5, 0.32, 0.2, 0.13)  # of the surface's height that the head may have
_KEPT, _TRIED = 10, 4  # guesses that go on to the next stage
_FAR = 1.5  # cm of the form: farther counts as this far


@dataclass(frozen=True)
class Standing:
    """A form in a surface.

    Attributes:
        pose: of the form.
        error: mean distance of the middle of the face, cm of the form; _FAR at most.
    """

    pose: Pose
    error: float


def turns(up: Doubles | None, front: Doubles | None) -> list[Doubles]:
    """float64[3, 3] each: from the form to the surface, along the axes.

    Args:
        up, front: float64[3], where the surface has them; None: anywhere.
    """
    axes = [sign * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    out = []
    for high, ahead in itertools.product(axes, axes):
        if abs(high @ ahead) > 0.5:
            continue
        if (up is None or high @ up > 0.7) and (front is None or ahead @ front > 0.7):
            out.append(np.stack([np.cross(high, ahead), high, ahead], axis=1))
    return out


def guesses(points: Doubles, turn: Doubles, shares: Sequence[float] = _SHARES) -> list[Pose]:
    """Heads of several sizes at the top of a surface.

    Args:
        points: float64[n, 3] of it.
        turn: float64[3, 3], from the form to the surface.
        shares: of the surface's height that the head may have.
    """
    stood = points @ turn
    low, high = stood.min(axis=0), stood.max(axis=0)
    out = []
    for share in shares:
        tall = share * (high[1] - low[1])
        head = stood[stood[:, 1] > high[1] - tall]
        scale = tall / (TOP - CHIN)
        middle = (np.quantile(head, 0.02, axis=0) + np.quantile(head, 0.98, axis=0)) / 2
        if np.ptp(head[:, 0]) > 2.5 * tall or np.ptp(head[:, 2]) > 3.0 * tall:
            middle = np.median(head, axis=0)
        goal = np.array([middle[0], high[1] - scale * TOP, middle[2]])
        shift = turn @ (goal - scale * np.array([0.0, 0.0, (BACK + FRONT) / 2]))
        out.append(Pose(turn, scale, shift))
    return out


def misfit(target: Target, pose: Pose, form: HeadForm, count: int = 900) -> float:
    """Mean distance of the middle of the face from a surface, cm of the form.

    Args:
        target: the surface.
        pose: of the form.
        form: it.
        count: of vertices that are looked at.
    """
    face = np.flatnonzero(form.weights[: form.skin] > 0.6)
    face = face[:: max(1, len(face) // count)]
    points = pose.points(form)
    normals = form_normals(form, points)[face]
    found, near, _ = target.pairs(points[face], normals, 0.5, 2 * _FAR * pose.scale)
    away = np.linalg.norm(points[face] - near, axis=1) / pose.scale
    return float(np.where(found, np.minimum(away, _FAR), _FAR).mean())


def _strange(pose: Pose) -> float:
    """How unlikely the parts of a form are, cm: what a fit pays for them."""
    return 0.004 * float(np.sqrt((pose.parts**2).mean())) + 0.01 * float(pose.expressions.sum())


def find_standing(
    target: Target,
    up: Doubles | None = None,
    front: Doubles | None = None,
    held: Held | None = None,
) -> list[Standing]:
    """The likeliest places of a head in a surface, the best first.

    Args:
        target: the surface.
        up, front: float64[3], where it has them; None: anywhere.
        held: vertices of the form whose places are known.
    """
    form = head_form()
    points = target.surface.points[np.unique(target.surface.triangles)]
    points = points[:: max(1, len(points) // 20000)]
    poses = [g for turn in turns(up, front) for g in guesses(points, turn)]
    rated = _rated(target, [fit(target, pose, PLACE, held) for pose in poses], form, 300)
    rated = _apart(rated)[:_KEPT]
    rated = _apart(_rated(target, [fit(target, s.pose, ROUGH, held) for s in rated], form, 900))
    best = [fit(target, s.pose, FINE, held) for s in rated[:_TRIED]]
    return _rated(target, best, form, 2000)


def _rated(target: Target, poses: Sequence[Pose], form: HeadForm, count: int) -> list[Standing]:
    rated = [Standing(p, misfit(target, p, form, count) + _strange(p)) for p in poses]
    return sorted(rated, key=lambda s: s.error)


def _apart(rated: Sequence[Standing]) -> list[Standing]:
    """Without what is nearly the same as a better one."""
    out: list[Standing] = []
    for one in rated:
        size = 10.0 * one.pose.scale
        for other in out:
            off = np.linalg.norm(one.pose.shift - other.pose.shift) / size
            turned = np.trace(one.pose.rotation.T @ other.pose.rotation)
            grown = abs(np.log(one.pose.scale / other.pose.scale))
            if off < 0.15 and turned > 2.9 and grown < 0.15:
                break
        else:
            out.append(one)
    return out
