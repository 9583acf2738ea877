# SPDX-License-Identifier: MIT
"""Landmarks without clicks: the model of form is laid onto a head and says where they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ...author.geometry.skeleton import Doubles
from ..form.fitting import Held, Pose, Target
from ..form.heads import head_form
from ..form.standing import find_standing
from ..surface import Surface
from .marks import FOUND, MOVED, LandmarkError, Landmarks

_NO_FACE = 0.25  # cm of the form: a surface that fits worse has no face
_HELD = 60.0  # how much a given landmark counts


@dataclass(frozen=True)
class Hints:
    """What is known of a head before it is looked at.

    Attributes:
        where: what errors call the head.
        marks: float64[3] by name of landmarks that a person gave.
        up, front: float64[3], where the head has them; None: anywhere.
    """

    where: str = "the head"
    marks: Mapping[str, Doubles] = field(default_factory=dict)
    up: Doubles | None = None
    front: Doubles | None = None


@dataclass(frozen=True)
class Found:
    """A head whose form is known.

    Attributes:
        landmarks: of it.
        pose: of the model of form in it.
        error: mean distance of the middle of the face from the model, in cm of the model.
    """

    landmarks: Landmarks
    pose: Pose
    error: float


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
    form = head_form()
    seen = Target(target)
    best = find_standing(seen, hints.up, hints.front, _held(hints))[0]
    if best.error > _NO_FACE:
        raise LandmarkError(f"{hints.where}: no face was found in the mesh")
    points = best.pose.points(form)
    landmarks = Landmarks()
    for name, vertex in form.places.items():
        landmarks.points[name], landmarks.how[name] = points[vertex], FOUND
    for name, point in hints.marks.items():
        landmarks.points[name], landmarks.how[name] = np.asarray(point, np.float64), MOVED
    return Found(landmarks, best.pose, best.error)


def _held(hints: Hints) -> Held | None:
    places = head_form().places
    names = [name for name in hints.marks if name in places]
    if not names:
        return None
    points = np.array([hints.marks[name] for name in names], np.float64)
    return Held(np.array([places[name] for name in names]), points, np.full(len(names), _HELD))
