# SPDX-License-Identifier: MIT
"""Finds a head of unknown unit and direction in a surface: the best fit of many guesses."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ...author.geometry.skeleton import Doubles
from ..surface import Surface
from ..telling import Progress, telling
from .fitting import FINE, PLACE, ROUGH, Held, Pose, Step, Target, fit, pose_normals
from .heads import HeadForm, head_form

TOP, CHIN, BACK, FRONT = 11.5, -11.5, -15.0, 5.0  # cm: extent of the mean head in y, then in z
_SHARES = (1.0, 0.72, 0.5, 0.32, 0.2, 0.13)  # tried heights of the head / height of the surface
_PLACED, _KEPT, _TRIED = 48, 10, 3  # number of guesses that each stage keeps
_WORSE = 1.6  # guesses with an error above this multiple of the least error are dropped
_OBLIQUE = 48  # number of rotations of `oblique`
# In cm of the model. A head whose Standing.error is at most SURE was found with certainty; above
# NO_FACE, no face was found.
SURE, NO_FACE = 0.13, 0.21
# Cells of a grid along the longest side of a surface. The first grid with which the coarsened
# surface has at most _CELLS vertices is used, otherwise the last grid.
_GRIDS = (400, 280, 200, 140, 100, 70, 50)
_CELLS = 9000
_FAR = 1.5  # cm of the model: larger distances count as this distance


@dataclass(frozen=True)
class Standing:
    """The head model fitted to a surface.

    Attributes:
        pose: the fitted model.
        error: the result of `misfit` plus a penalty for unlikely weights, in cm of the model.
    """

    pose: Pose
    error: float


def turns(up: Doubles | None, front: Doubles | None) -> list[Doubles]:
    """float64[3, 3] each: rotations from the model to the surface that map axes to axes.

    Args:
        up, front: float64[3], the head's directions in the axes of the surface; rotations more than
            about 45 degrees away are left out. None: the direction is unknown.
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
    """Approximate poses of heads of several sizes at the top of a surface.

    Args:
        points: float64[n, 3], points of the surface.
        turn: float64[3, 3], the rotation from the model to the surface.
        shares: heights of the heads as fractions of the surface's height.
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
    """Distance from the surface within which 3/4 of the model's face vertices are, cm of the model.

    The remaining quarter may be at holes, hair and inner sides of the surface.

    Args:
        target: the surface.
        pose: the pose of the model.
        form: the model.
        count: approximate number of face vertices that are measured.
    """
    face = np.flatnonzero(form.weights[: form.skin] > 0.6)
    face = face[:: max(1, len(face) // count)]
    shaped = form.shaped(pose.parts, pose.expressions)
    normals, points = pose_normals(form, pose, shaped)[face], pose.place(shaped[face])
    found, near, _ = target.pairs(points, normals, 0.5, 2 * _FAR * pose.scale)
    away = np.linalg.norm(points - near, axis=1) / pose.scale
    return float(np.quantile(np.where(found, np.minimum(away, _FAR), _FAR), 0.75))


def _strange(pose: Pose) -> float:
    """The penalty of a fit for unlikely weights of components and expressions, in cm."""
    return 0.02 * float(np.sqrt((pose.parts**2).mean())) + 0.01 * float(pose.expressions.sum())


def find_standing(
    target: Target,
    up: Doubles | None = None,
    front: Doubles | None = None,
    held: Held | None = None,
    progress: Progress | None = None,
) -> list[Standing]:
    """The likeliest poses of a head in a surface, the smallest error first.

    Args:
        target: the surface.
        up, front: float64[3], the head's directions in the axes of the surface; None: unknown.
        held: vertices of the model with known positions.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.

    Raises:
        Stopped: `progress` returned False.
    """
    coarse = Target(coarsened(target.surface))
    best = _best(target, coarse, turns(up, front), held, telling(progress, 0.0, 0.5))
    if best[0].error > SURE and up is None and front is None:
        more = _best(target, coarse, oblique(), held, telling(progress, 0.5, 1.0))
        best = sorted(best + more, key=lambda s: s.error)
    return best


def oblique() -> list[Doubles]:
    """float64[3, 3] each: rotations spread evenly over all rotations (Alexa 2022)."""
    k = np.arange(_OBLIQUE) + 0.5
    share = k / _OBLIQUE
    a, b = 2 * np.pi * k / 2**0.5, 2 * np.pi * k / 1.533751168755204288118041
    quarter = np.stack(
        [
            np.sqrt(share) * np.sin(a), np.sqrt(share) * np.cos(a),
            np.sqrt(1 - share) * np.sin(b), np.sqrt(1 - share) * np.cos(b),
        ],
        axis=1,
    )  # fmt: skip
    out = []
    for x, y, z, w in quarter:
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        out.append(np.eye(3) + 2 * w * cross + 2 * cross @ cross)
    return out


def _best(
    target: Target,
    coarse: Target,
    ways: Sequence[Doubles],
    held: Held | None,
    tell: Callable[[float], bool],
) -> list[Standing]:
    """The best poses of a head with one of the rotations `ways`, the smallest error first."""
    form = head_form()
    poses = [g for turn in ways for g in guesses(coarse.surface.points, turn)]

    def fitted(on: Target, rated: Sequence[Pose], steps: Sequence[Step], share: int) -> list[Pose]:
        out = list(rated)
        for number in range(len(out)):
            for step in steps:
                tell((share + number / len(out)) / 4)
                out[number] = fit(on, out[number], (step,), held)
        return out

    rated = _rated(coarse, fitted(coarse, poses, PLACE[:1], 0), form, 200)[:_PLACED]
    rated = _rated(coarse, fitted(coarse, [s.pose for s in rated], PLACE[1:], 1), form, 300)
    rated = _apart(rated)[:_KEPT]
    rated = _rated(coarse, fitted(coarse, [s.pose for s in rated], ROUGH, 2), form, 900)
    rated = _apart(rated)
    rated = [s for s in rated if s.error < _WORSE * rated[0].error][:_TRIED]
    return _rated(target, fitted(target, [s.pose for s in rated], FINE, 3), form, 2000)


def coarsened(surface: Surface) -> Surface:
    """A simplified surface: all vertices in a cell of a grid are replaced by their mean. Triangles
    that become a line or a point are left out.

    Args:
        surface: the surface; it is not changed.
    """
    used = np.unique(surface.triangles)
    low = surface.points[used].min(axis=0)
    extent = float(np.ptp(surface.points[used], axis=0).max())
    for parts in _GRIDS:
        place = np.floor((surface.points - low) / (extent / parts)).astype(np.int64)
        key = (place[:, 0] * (parts + 1) + place[:, 1]) * (parts + 1) + place[:, 2]
        _, back = np.unique(key, return_inverse=True)
        count = int(back.max()) + 1
        if count <= _CELLS:
            break
    sums = np.stack([np.bincount(back, surface.points[:, k], count) for k in range(3)], axis=1)
    points = sums / np.bincount(back, minlength=count)[:, None]
    corners = back[surface.triangles]
    whole = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    kept = corners[whole]
    own = np.unique(kept)
    return Surface(points[own], np.searchsorted(own, kept))


def _rated(target: Target, poses: Sequence[Pose], form: HeadForm, count: int) -> list[Standing]:
    rated = [Standing(p, misfit(target, p, form, count) + _strange(p)) for p in poses]
    return sorted(rated, key=lambda s: s.error)


def _apart(rated: Sequence[Standing]) -> list[Standing]:
    """Drops each pose that is nearly the same as a pose with a smaller error."""
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
