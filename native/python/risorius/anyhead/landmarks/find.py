# SPDX-License-Identifier: MIT
"""Landmarks without clicks: the model of form is laid onto a head and says where they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...author.geometry.skeleton import Doubles
from ..form.fitting import FINE, Held, Pose, Target, fit, form_normals
from ..form.heads import head_form
from ..form.standing import NO_FACE, Standing, find_standing
from ..surface import Surface
from .checks import LEAST, check_crossings, check_eyes, check_mesh, completed, lips_apart, pieces
from .marks import FOUND, LandmarkError, Landmarks
from .refine import refined

_HELD, _EYE = 60.0, 8.0  # how much a given landmark counts, and the middle of a given eyeball
_NEAR_EYE = 2.0  # cm of the form: farther from the model's eye an eyeball is none of this head
_ON = 0.4  # cm of the form: a landmark so far from the surface is not on it
_LARGE, _TRIED = 0.3, 4  # of the largest piece: what may be a head too; how many are looked at
_AWAY = 20.0  # cm of the form: what is so far from a face belongs to another


@dataclass(frozen=True)
class Hints:
    """What is known of a head before it is looked at.

    Attributes:
        where: what errors call the head.
        marks: float64[3] by name of landmarks that a person gave.
        up, front: float64[3], where the head has them; None: anywhere.
        eyes: middles (float64[3]) of eyeballs that are meshes of their own.
        open_eyes: whether eyes without openings are refused.
    """

    where: str = "the head"
    marks: Mapping[str, Doubles] = field(default_factory=dict)
    up: Doubles | None = None
    front: Doubles | None = None
    eyes: Sequence[Doubles] = ()
    open_eyes: bool = True


@dataclass(frozen=True)
class Found:
    """A head whose form is known.

    Attributes:
        landmarks: of it.
        pose: of the model of form in it.
        error: how far three quarters of the face are from the model at most, cm of the model.
        lips_apart: whether the lips are two; else they are one surface, which cannot open.
    """

    landmarks: Landmarks
    pose: Pose
    error: float
    lips_apart: bool = True

    def require_lips(self, where: str) -> None:
        """Ends where the lips are one surface.

        Args:
            where: what the error calls the head.

        Raises:
            LandmarkError: they are.
        """
        if not self.lips_apart:
            raise LandmarkError(
                f"{where}: the lips are welded: cut the mesh open along the line between them, "
                "the mouth cannot open otherwise"
            )


def find_landmarks(target: Surface, hints: Hints | None = None) -> Landmarks:
    """The landmarks of a head.

    Args:
        target: the head, standing or not, of any unit.
        hints: what is known of it.

    Raises:
        LandmarkError: there is no face in it, or one that cannot be used; says which.
    """
    return find_form(target, hints).landmarks


def find_form(target: Surface, hints: Hints | None = None) -> Found:
    """The landmarks of a head and the model of form in it.

    Args:
        target: the head, standing or not, of any unit.
        hints: what is known of it.

    Raises:
        LandmarkError: there is no face in it, or one that cannot be used; says which.
    """
    hints = hints or Hints()
    check_mesh(hints.where, target)
    seen, pose, error = _looked_at(target, hints)
    held = _with_eyes(pose, hints)
    if held is not None:
        pose = fit(seen, pose, FINE[1:], held)
    points = refined(seen, pose)
    landmarks = _on_surface(seen, pose, points)
    check_crossings(hints.where, seen, pose)
    if hints.open_eyes:
        check_eyes(hints.where, seen, pose, points)
    for name, point in hints.marks.items():
        landmarks.moved(name, point)
    return Found(landmarks, pose, error, lips_apart(seen, pose, points))


def _looked_at(target: Surface, hints: Hints) -> tuple[Target, Pose, float]:
    """The piece of a surface that is a head, the model's pose in it and its error."""
    seen = Target(target)
    best = _standing(seen, hints)[0]
    parts = [p for p in pieces(target) if len(np.unique(p.triangles)) >= LEAST]
    parts = [p for p in parts if len(p.triangles) > _LARGE * len(parts[0].triangles)][:_TRIED]
    if best.error <= NO_FACE:
        others = [p for p in parts if _off(p, best.pose)]
    else:
        others = parts if len(parts) > 1 else []
    heads = [(part, best) for part, best in _heads(others, hints) if best.error <= NO_FACE]
    if len(heads) + (best.error <= NO_FACE) > 1:
        raise LandmarkError(f"{hints.where}: one head was expected, found two: choose the mesh")
    if best.error <= NO_FACE:
        return seen, best.pose, best.error
    if heads:
        return heads[0][0], heads[0][1].pose, heads[0][1].error
    raise LandmarkError(f"{hints.where}: {_why_none(seen, hints)}")


def _standing(seen: Target, hints: Hints) -> list[Standing]:
    return find_standing(seen, hints.up, hints.front, _held(hints))


def _heads(parts: Sequence[Surface], hints: Hints) -> list[tuple[Target, Standing]]:
    return [(seen, _standing(seen, hints)[0]) for seen in map(Target, parts)]


def _off(part: Surface, pose: Pose) -> bool:
    """Whether a piece lies away from the head of a pose and is as large as one."""
    inside = pose.back(part.points[np.unique(part.triangles)])
    middle = (inside.min(axis=0) + inside.max(axis=0)) / 2
    large = float(np.ptp(inside, axis=0).max()) > 0.5 * _AWAY
    return large and float(np.linalg.norm(middle - [0.0, 0.0, -5.0])) > _AWAY


def _why_none(seen: Target, hints: Hints) -> str:
    """Why no face was found, for a sentence."""
    halves = completed(seen.surface)
    if any(_standing(Target(whole), hints)[0].error <= NO_FACE for whole in halves):
        return "half of the face is missing: mirror it (in Blender: the modifier Mirror)"
    turned = Target(Surface(seen.surface.points, seen.surface.triangles[:, ::-1]))
    if _standing(turned, hints)[0].error <= NO_FACE:
        return (
            "the mesh is inside out: turn its faces (in Blender: Mesh, Normals, Recalculate "
            "Outside)"
        )
    if hints.up is not None or hints.front is not None:
        return "no face was found that stands as the axes say: leave them to be guessed"
    return "no face was found in the mesh"


def _on_surface(seen: Target, pose: Pose, points: Mapping[str, Doubles]) -> Landmarks:
    """The landmarks that are near the surface, on it."""
    form = head_form()
    names = list(points)
    places = np.array([points[name] for name in names])
    normals = form_normals(form, form.shaped(pose.parts, pose.expressions)) @ pose.rotation.T
    normals = normals[[form.places[name] for name in names]]
    reach = _ON * pose.scale
    out = Landmarks()
    triangle, shares, _ = seen.closest.nearest(places, normals, 0.3, reach)
    any_side, other_shares, _ = seen.closest.nearest(places, farthest=reach)
    shares = np.where((triangle < 0)[:, None], other_shares, shares)
    triangle = np.where(triangle < 0, any_side, triangle)
    on = seen.surface.at(np.maximum(triangle, 0), shares)
    for k, name in enumerate(names):
        if triangle[k] >= 0:
            out.points[name], out.how[name] = on[k], FOUND
    return out


def _held(hints: Hints) -> Held | None:
    places = head_form().places
    names = [name for name in hints.marks if name in places]
    if not names:
        return None
    points = np.array([hints.marks[name] for name in names], np.float64)
    return Held(np.array([places[name] for name in names]), points, np.full(len(names), _HELD))


def _with_eyes(pose: Pose, hints: Hints) -> Held | None:
    """The places of given landmarks and of given eyeballs, each at the nearer eye of the model."""
    held = _held(hints)
    form = head_form()
    middles = pose.points(form)[[form.skin, form.skin + 2]]
    rows: list[tuple[int, Doubles]] = []
    for eye in hints.eyes:
        away = np.linalg.norm(middles - eye, axis=1) / pose.scale
        if away.min() < _NEAR_EYE:
            rows.append((form.skin + 2 * int(away.argmin()), np.asarray(eye, np.float64)))
    if not rows:
        return None
    vertices = np.array([row[0] for row in rows], np.int64)
    points, weights = np.array([row[1] for row in rows]), np.full(len(rows), _EYE)
    if held is not None:
        vertices = np.concatenate([held.vertices, vertices])
        points = np.concatenate([held.points, points])
        weights = np.concatenate([held.weights, weights])
    return Held(vertices, points, weights)
