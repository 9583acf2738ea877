# SPDX-License-Identifier: MIT
"""Moves the vertices of a head to approximate places on another head.

The places follow from the head models that were fitted to both heads, and from their landmarks.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...author.geometry.skeleton import Doubles
from ..form.fitting import Held, Pose, Step, Target, fit, pose_normals
from ..form.heads import HeadForm, head_form
from ..surface import Surface
from .find import Found, find_form
from .marks import MOVED
from .names import vague_landmarks

_NEIGHBOURS = 12  # vertices of the model from which the displacement of a point is interpolated
_REACH = 2.5  # cm of the model: radius in which a landmark moves the skin
_ROWS = 2000  # points that are computed together, to limit memory
_ALL_PARTS = 1 << 20  # a limit above any number of principal components: all of them are fitted
_CLOSER = (  # a fit with all parts, before the template's own vertices are known
    Step(6, 0.6, 4000, _ALL_PARTS, 1.0, 0.5),
    Step(8, 0.3, 4000, _ALL_PARTS, 0.5, 0.5),
)
_AS_TEMPLATE = (  # a fit of the model that has the template's surface
    Step(6, 1.0, 4000, _ALL_PARTS, 1.0, 0.5),
    Step(8, 0.5, 4000, _ALL_PARTS, 0.6, 0.5, noise=0.06),
    Step(8, 0.3, 4000, _ALL_PARTS, 0.4, 0.5, noise=0.04),
)
_ON = 1.0  # cm of the form: farthest place of the template that a vertex of the form is moved to
# cm of the form: a vertex of the form at this distance from its place on the template moves by 1/e
# of the distance, a nearer vertex by more of it, and a farther vertex by less.
_SURE = 0.6
_HELD = 30.0  # weight of a landmark that the user moved, against a pair in the middle of the face


def start_of(
    template: Surface,
    target: Surface,
    of_template: Found | None = None,
    of_target: Found | None = None,
) -> Doubles:
    """float64[V, 3]: the template's vertices moved near the target, in the target's space.

    Args:
        template: the surface to move.
        target: the surface of the other head.
        of_template, of_target: results of `find_form` for both; None: computed here.
    """
    one, other = of_template or find_form(template), of_target or find_form(target)
    seen = Target(template)
    pose = fit(seen, one.pose, _CLOSER)
    form = _like(seen, pose)
    goal = fit(Target(target), other.pose, _AS_TEMPLATE, _moved(one, other), form=form)
    before, after = (form.shaped(p.parts, p.expressions)[: form.skin] for p in (pose, goal))
    inside = pose.back(template.points)
    moved = inside + _between(inside, before, after - before)
    names = [n for n in common(one, other) if _by_hand(n, one, other)]
    if names:
        begin, end = _places(names, one, pose), _places(names, other, goal)
        left = end - begin - _between(begin, before, after - before)
        moved += _smooth(inside, begin, left)
    return goal.place(moved)


def _like(seen: Target, pose: Pose) -> HeadForm:
    """The model with another mean: with the weights of the pose, its vertices lie on the surface.
    The farther a vertex is from the surface, the smaller is the part of the way that it moves; a
    vertex farther than 1 cm does not move.

    So a later fit to another head compares the two surfaces. Details of the first surface that the
    model cannot represent are then in the mean, and do not count as a difference.
    """
    form = head_form()
    shaped = form.shaped(pose.parts, pose.expressions)
    normals = pose_normals(form, pose, shaped)
    on, near, _ = seen.pairs(pose.place(shaped[: form.skin]), normals, 0.3, _ON * pose.scale)
    away = (pose.back(near) - shaped[: form.skin]) * on[:, None]
    away *= np.exp(-((np.linalg.norm(away, axis=1, keepdims=True) / _SURE) ** 2))
    mean = form.mean.copy()
    mean[: form.skin] += away
    return replace(form, mean=mean)


def _by_hand(name: str, one: Found, other: Found) -> bool:
    return MOVED in (one.landmarks.how.get(name), other.landmarks.how.get(name))


def _moved(one: Found, other: Found) -> Held | None:
    """The landmarks that the user moved on one of the heads or on both, with their positions on the
    head `other`. Only landmarks that both heads and the model have count; None if there are
    none."""
    places = head_form().places
    names = [n for n in common(one, other) if n in places and _by_hand(n, one, other)]
    if not names:
        return None
    points = np.array([other.landmarks.points[n] for n in names])
    return Held(np.array([places[n] for n in names]), points, np.full(len(names), _HELD))


def _places(names: list[str], found: Found, pose: Pose) -> Doubles:
    return pose.back(np.array([found.landmarks.points[n] for n in names]))


def carried(points: Doubles, one: Found, other: Found) -> Doubles:
    """float64[n, 3]: positions on the second head of points on or near the first head.

    Args:
        points: float64[n, 3], in the space of the first head.
        one, other: results of `find_form` for the first and the second head.
    """
    form = head_form()
    before = form.shaped(one.pose.parts, one.pose.expressions)
    after = form.shaped(other.pose.parts, other.pose.expressions)
    inside = one.pose.back(points)
    moved = inside + _between(inside, before[: form.skin], (after - before)[: form.skin])
    return other.pose.place(moved + _to_landmarks(inside, moved, one, other))


def common(one: Found, other: Found) -> list[str]:
    """Names of the landmarks that both heads have, without vague ones that the user did not move.

    Args:
        one, other: results of `find_form` for both heads.
    """
    moved = [n for n in one.landmarks.points if _by_hand(n, one, other)]
    return [
        n
        for n in one.landmarks.points
        if n in other.landmarks.points and (n in moved or n not in vague_landmarks())
    ]


def _between(places: Doubles, points: Doubles, ways: Doubles) -> Doubles:
    """float64[n, 3]: displacements of points, interpolated at other places.

    Args:
        places: float64[n, 3], positions of the results.
        points: float64[m, 3], positions of the given displacements.
        ways: float64[m, 3], the displacements.
    """
    out = np.empty_like(places)
    square = (points**2).sum(axis=1)
    for first in range(0, len(places), _ROWS):
        block = places[first : first + _ROWS]
        away = square[None] - 2 * block @ points.T
        near = np.argpartition(away, _NEIGHBOURS, axis=1)[:, :_NEIGHBOURS]
        off = np.linalg.norm(block[:, None] - points[near], axis=2)
        share = 1 / (off + 0.05 * off.max(axis=1, keepdims=True) + 1e-6)
        share *= np.maximum(1.0001 - off / off.max(axis=1, keepdims=True), 0)
        share /= share.sum(axis=1, keepdims=True)
        out[first : first + _ROWS] = np.einsum("nk,nkd->nd", share, ways[near])
    return out


def _to_landmarks(inside: Doubles, moved: Doubles, one: Found, other: Found) -> Doubles:
    """A smooth correction, float64[n, 3], in addition to the displacement by the fitted models.

    With the displacement and the correction, the landmarks of the first head meet the landmarks of
    the second head."""
    names = common(one, other)
    if not names:
        return np.zeros_like(inside)
    form = head_form()
    begin, goal = _places(names, one, one.pose), _places(names, other, other.pose)
    before = form.shaped(one.pose.parts, one.pose.expressions)[: form.skin]
    after = form.shaped(other.pose.parts, other.pose.expressions)[: form.skin]
    left = goal - begin - _between(begin, before, after - before)
    return _smooth(inside, begin, left)


def _smooth(places: Doubles, points: Doubles, ways: Doubles) -> Doubles:
    """float64[n, 3]: a smooth displacement at places, which is about `ways` at `points`.

    Args:
        places: float64[n, 3].
        points, ways: float64[m, 3].
    """

    def kernel(a: Doubles, b: Doubles) -> Doubles:
        away = np.linalg.norm(a[:, None] - b[None], axis=2) / _REACH
        return np.asarray(np.maximum(1 - away, 0) ** 4 * (4 * away + 1))  # Wendland 1995

    weights = np.linalg.solve(kernel(points, points) + 0.02 * np.eye(len(points)), ways)
    out = np.zeros_like(places)
    for first in range(0, len(places), _ROWS):
        out[first : first + _ROWS] = kernel(places[first : first + _ROWS], points) @ weights
    return out


def pairs_of(template: Surface, one: Found, other: Found) -> list[tuple[int, Doubles]]:
    """The template's vertex nearest to each landmark, and the vertex's goal on another head.

    The goal is the vertex's own position on the other head and not the landmark. This keeps the
    distance between vertex and landmark, so that a coarse template is not distorted.

    Args:
        template: the surface of the template.
        one: result of `find_form` for the template.
        other: result of `find_form` for the other head.
    """
    names = common(one, other)
    places = np.array([one.landmarks.points[n] for n in names]).reshape(-1, 3)
    vertices = [int(((template.points - place) ** 2).sum(axis=1).argmin()) for place in places]
    goals = carried(template.points[vertices], one, other)
    out: dict[int, Doubles] = {}
    for vertex, goal in zip(vertices, goals, strict=True):
        out.setdefault(vertex, goal)
    return list(out.items())
