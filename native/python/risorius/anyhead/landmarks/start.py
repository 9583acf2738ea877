# SPDX-License-Identifier: MIT
"""A head brought near another by the forms and the landmarks of both."""

from __future__ import annotations

import numpy as np

from ...author.geometry.skeleton import Doubles
from ..form.heads import head_form
from ..surface import Surface
from .find import Found, find_form
from .marks import MOVED
from .names import vague_landmarks

_NEIGHBOURS = 12  # vertices of the form that say where a place goes
_REACH = 2.5  # cm of the form: how far a landmark takes its surroundings along
_ROWS = 2000  # places that are looked at together


def start_of(
    template: Surface,
    target: Surface,
    of_template: Found | None = None,
    of_target: Found | None = None,
) -> Doubles:
    """float64[V, 3]: the template's vertices near the target, in the target's space.

    Args:
        template: what is brought there.
        target: where to.
        of_template, of_target: what `find_form` found in them; None: it is found here.
    """
    one, other = of_template or find_form(template), of_target or find_form(target)
    return carried(template.points, one, other)


def carried(points: Doubles, one: Found, other: Found) -> Doubles:
    """float64[n, 3]: places on or near a head, at their places on another.

    Args:
        points: float64[n, 3] in the space of the one.
        one, other: the heads.
    """
    form = head_form()
    before = form.shaped(one.pose.parts, one.pose.expressions)
    after = form.shaped(other.pose.parts, other.pose.expressions)
    inside = one.pose.back(points)
    moved = inside + _between(inside, before[: form.skin], (after - before)[: form.skin])
    return other.pose.place(moved + _to_landmarks(inside, moved, one, other))


def common(one: Found, other: Found) -> list[str]:
    """Names of the landmarks that both heads have, without vague ones that no person moved.

    Args:
        one, other: the heads.
    """
    moved = [
        n
        for n in one.landmarks.points
        if MOVED in (one.landmarks.how[n], other.landmarks.how.get(n))
    ]
    return [
        n
        for n in one.landmarks.points
        if n in other.landmarks.points and (n in moved or n not in vague_landmarks())
    ]


def _between(places: Doubles, points: Doubles, ways: Doubles) -> Doubles:
    """float64[n, 3]: ways of points, at places between them.

    Args:
        places: float64[n, 3].
        points: float64[m, 3].
        ways: float64[m, 3], of the points.
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
    """float64[n, 3]: what is left from each landmark of the one to that of the other, spread."""
    names = common(one, other)
    if not names:
        return np.zeros_like(inside)
    form = head_form()
    begin = one.pose.back(np.array([one.landmarks.points[n] for n in names]))
    goal = other.pose.back(np.array([other.landmarks.points[n] for n in names]))
    before = form.shaped(one.pose.parts, one.pose.expressions)[: form.skin]
    after = form.shaped(other.pose.parts, other.pose.expressions)[: form.skin]
    left = goal - begin - _between(begin, before, after - before)

    def kernel(a: Doubles, b: Doubles) -> Doubles:
        away = np.linalg.norm(a[:, None] - b[None], axis=2) / _REACH
        return np.asarray(np.maximum(1 - away, 0) ** 4 * (4 * away + 1))  # Wendland 1995

    weights = np.linalg.solve(kernel(begin, begin) + 0.02 * np.eye(len(begin)), left)
    out = np.zeros_like(inside)
    for first in range(0, len(inside), _ROWS):
        out[first : first + _ROWS] = kernel(inside[first : first + _ROWS], begin) @ weights
    return out


def pairs_of(template: Surface, one: Found, other: Found) -> list[tuple[int, Doubles]]:
    """The template's vertex nearest each landmark, and where it belongs on another head.

    What lies between the vertex and the landmark is carried along, so that a coarse template is
    not pulled by its own edges.

    Args:
        template: the surface of the one.
        one: what was found in it.
        other: what was found in the other head.
    """
    names = common(one, other)
    places = np.array([one.landmarks.points[n] for n in names]).reshape(-1, 3)
    vertices = [int(((template.points - place) ** 2).sum(axis=1).argmin()) for place in places]
    goals = carried(template.points[vertices], one, other)
    out: dict[int, Doubles] = {}
    for vertex, goal in zip(vertices, goals, strict=True):
        out.setdefault(vertex, goal)
    return list(out.items())
