# SPDX-License-Identifier: MIT
"""Finds the landmarks of a head automatically: the statistical head model is fitted to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...author.geometry.skeleton import Doubles
from ..form.fitting import FINE, Held, Pose, Target, fit, form_normals
from ..form.heads import head_form
from ..form.standing import NO_FACE, SURE, Standing, find_standing
from ..surface import Surface
from ..telling import Progress, telling
from .checks import LEAST, check_crossings, check_eyes, check_mesh, completed, lips_apart, pieces
from .groups import Box, part_in
from .marks import FOUND, LandmarkError, Landmarks
from .refine import refined

_HELD, _EYE = 60.0, 8.0  # weights of a landmark by the user and of the centre of an eyeball
_NEAR_EYE = 2.0  # cm of the model: eyeballs farther from the model's eyes are ignored
_ON = 0.4  # cm of the model: landmarks farther from the surface are left out
_LARGE, _TRIED = 0.3, 4  # smallest piece / largest piece that may be a head; most pieces tried
_LOOKED, _FITTED, _REFINED = 0.8, 0.85, 0.95  # progress after each step
_AWAY = 20.0  # cm of the model: pieces farther from a face belong to another head


@dataclass(frozen=True)
class Hints:
    """Known facts about a head, which help to find its landmarks.

    Attributes:
        where: name of the head in error messages.
        marks: float64[3] by name, landmarks that the user placed.
        up, front: float64[3], the head's directions in the axes of the surface; None: unknown.
        eyes: float64[3] each, centres of eyeballs that are separate meshes.
        open_eyes: whether a head with closed or painted eyes is refused.
        box: the head is likely in this box, see groups.head_box; None: unknown. Another place is
            searched if there is no certain face in the box.
    """

    where: str = "the head"
    marks: Mapping[str, Doubles] = field(default_factory=dict)
    up: Doubles | None = None
    front: Doubles | None = None
    eyes: Sequence[Doubles] = ()
    open_eyes: bool = True
    box: Box | None = None


@dataclass(frozen=True)
class Found:
    """A head with its landmarks and the fitted head model.

    Attributes:
        landmarks: the landmarks of the head.
        pose: the head model fitted to the head.
        error: error of the fit in cm of the model, the attribute `error` of
            form.standing.Standing; a well fitted head has at most 0.13.
        lips_apart: whether the lips are separate; connected lips cannot open.
    """

    landmarks: Landmarks
    pose: Pose
    error: float
    lips_apart: bool = True

    def require_lips(self, where: str) -> None:
        """Refuse a head whose lips are connected.

        Args:
            where: name of the head in the error message.

        Raises:
            LandmarkError: the lips are connected.
        """
        if not self.lips_apart:
            raise LandmarkError(
                f"{where}: the lips are welded: cut the mesh open along the line between them, "
                "the mouth cannot open otherwise"
            )


def find_landmarks(
    target: Surface, hints: Hints | None = None, progress: Progress | None = None
) -> Landmarks:
    """Find the landmarks of a head.

    Args:
        target: the head in any direction and unit.
        hints: known facts about the head.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.

    Raises:
        LandmarkError: no face was found, or the face is unusable; the message says why.
        Stopped: `progress` returned False.
    """
    return find_form(target, hints, progress).landmarks


def find_form(
    target: Surface, hints: Hints | None = None, progress: Progress | None = None
) -> Found:
    """Find the landmarks of a head, and fit the head model to it.

    Args:
        target: the head in any direction and unit.
        hints: known facts about the head.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.

    Raises:
        LandmarkError: no face was found, or the face is unusable; the message says why.
        Stopped: `progress` returned False.
    """
    hints, tell = hints or Hints(), telling(progress)
    tell(0.0)
    check_mesh(hints.where, target)
    seen, pose, error = _looked_at(target, hints, telling(progress, 0.0, _LOOKED))
    tell(_LOOKED)
    held = _with_eyes(pose, hints)
    if held is not None:
        pose = fit(seen, pose, FINE[1:], held)
        tell(_FITTED)
    points = refined(seen, pose)
    tell(_REFINED)
    landmarks = _on_surface(seen, pose, points)
    check_crossings(hints.where, seen, pose)
    tell(1.0)
    if hints.open_eyes:
        check_eyes(hints.where, seen, pose, points)
    for name, point in hints.marks.items():
        landmarks.moved(name, point)
    return Found(landmarks, pose, error, lips_apart(seen, pose, points))


def _looked_at(target: Surface, hints: Hints, tell: Progress) -> tuple[Target, Pose, float]:
    """The surface or the piece of it in which a face was found, the fitted head model, and the
    error of the fit.

    Raises:
        LandmarkError: no face was found, or faces were found in two pieces.
    """
    seen = Target(target)
    named = _in_box(seen, hints, tell)
    if named is not None:
        return seen, named.pose, named.error
    best = _standing(seen, hints, tell)[0]
    parts = [p for p in pieces(target) if len(np.unique(p.triangles)) >= LEAST]
    parts = [p for p in parts if len(p.triangles) > _LARGE * len(parts[0].triangles)][:_TRIED]
    if best.error <= NO_FACE:
        others = [p for p in parts if _off(p, best.pose)]
    else:
        others = parts if len(parts) > 1 else []
    heads = [(part, best) for part, best in _heads(others, hints, tell) if best.error <= NO_FACE]
    if len(heads) + (best.error <= NO_FACE) > 1:
        raise LandmarkError(
            f"{hints.where}: one head was expected, found two: choose the mesh of one head"
        )
    if best.error <= NO_FACE:
        return seen, best.pose, best.error
    if heads:
        return heads[0][0], heads[0][1].pose, heads[0][1].error
    raise LandmarkError(f"{hints.where}: {_why_none(seen, hints, tell)}")


def _in_box(seen: Target, hints: Hints, tell: Progress) -> Standing | None:
    """The only face in the box of the hints; None if there is none that is certain, or several.

    The model is fitted to the whole surface at last, so that a box that cuts the head does no harm.
    """
    part = part_in(seen.surface, hints.box)
    if part is None or len(part.points) < LEAST:
        return None
    tell = _at_begin(tell)
    best = _standing(Target(part), hints, tell)[0]
    if best.error > SURE:
        return None
    others = [p for p in pieces(part)[:_TRIED] if _off(p, best.pose)]
    if any(other.error <= SURE for _, other in _heads(others, hints, tell)):
        return None
    pose = fit(seen, best.pose, FINE[1:], _held(hints))
    return replace(best, pose=pose)


def _standing(seen: Target, hints: Hints, tell: Progress) -> list[Standing]:
    return find_standing(seen, hints.up, hints.front, _held(hints), tell)


def _heads(parts: Sequence[Surface], hints: Hints, tell: Progress) -> list[tuple[Target, Standing]]:
    return [(seen, _standing(seen, hints, _at_end(tell))[0]) for seen in map(Target, parts)]


def _at_begin(tell: Progress) -> Progress:
    """Progress of work that may have to be repeated: it reports 0.0 always, and can be stopped."""
    return lambda _share: tell(0.0)


def _at_end(tell: Progress) -> Progress:
    """The progress function of extra work after the usual work. It always reports 1.0 to `tell`,
    because the extra work is rarely necessary; `tell` can stop the work."""
    return lambda _share: tell(1.0)


def _off(part: Surface, pose: Pose) -> bool:
    """Whether a piece is far from the head at `pose`, and large enough to be another head."""
    inside = pose.back(part.points[np.unique(part.triangles)])
    middle = (inside.min(axis=0) + inside.max(axis=0)) / 2
    large = float(np.ptp(inside, axis=0).max()) > 0.5 * _AWAY
    return large and float(np.linalg.norm(middle - [0.0, 0.0, -5.0])) > _AWAY


def _why_none(seen: Target, hints: Hints, tell: Progress) -> str:
    """The reason why no face was found, as the end of an error message."""
    halves, tell = completed(seen.surface), _at_end(tell)
    if any(_standing(Target(whole), hints, tell)[0].error <= NO_FACE for whole in halves):
        return "half of the face is missing: mirror it (in Blender: the modifier Mirror)"
    turned = Target(Surface(seen.surface.points, seen.surface.triangles[:, ::-1]))
    if _standing(turned, hints, tell)[0].error <= NO_FACE:
        return (
            "the mesh is inside out: turn its faces (in Blender: Mesh, Normals, Recalculate "
            "Outside)"
        )
    if hints.up is not None or hints.front is not None:
        return "no face was found that stands as the axes say: leave them to be guessed"
    return "no face was found in the mesh"


def _on_surface(seen: Target, pose: Pose, points: Mapping[str, Doubles]) -> Landmarks:
    """Move landmarks to the closest points of the surface. Landmarks far from it are left out."""
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
    """The user's landmarks, and the given eyeballs as positions of the eyes of the head model.

    None if no given eyeball is near an eye of the model.
    """
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
