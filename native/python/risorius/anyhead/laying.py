# SPDX-License-Identifier: MIT
"""Registers the skin of a template onto a head, beginning with landmarks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..author.geometry.skeleton import Doubles
from .errors import Stopped
from .form.teeth import JawChange, jaw_change
from .landmarks.find import Found, Hints, find_form
from .landmarks.start import pairs_of, start_of
from .registration import Registered, RegisterOptions, StoppedError, register
from .surface import Surface
from .telling import telling
from .transfer.template import Progress, TemplateFace

_FOUND = 0.15  # share of the work at whose end the template's own form is known


@dataclass(frozen=True)
class Laid:
    """A template that was registered onto a head.

    Attributes:
        points: float64[V, 3], positions of the template's vertices on the head.
        trust: float64[V], 0 to 1: confidence in the position of each vertex.
        registered: the registration; None: none was needed because the head has the template's
            triangles.
        jaw: change of the lower jaw from the template to the head; None: unknown.
    """

    points: Doubles
    trust: Doubles
    registered: Registered | None = None
    jaw: JawChange | None = None


def lay(
    face: TemplateFace,
    target: Surface,
    found: Found,
    threads: int = 0,
    progress: Progress | None = None,
) -> Laid:
    """Register a template onto a head.

    Args:
        face: the template.
        target: the head in cm, y up, the face towards +z.
        found: the fitted model and landmarks of the head.
        threads: number of threads; 0: one for each core.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.

    Raises:
        LandmarkError: no face was found in the template.
        RegistrationError: no surface of the head is near the template.
        Stopped: `progress` returned False.
    """
    return lay_surface(face.surface, face.name or "the template", target, found, threads, progress)


def lay_surface(
    template: Surface,
    name: str,
    target: Surface,
    found: Found,
    threads: int = 0,
    progress: Progress | None = None,
) -> Laid:
    """Register the skin of a face onto a head.

    Args:
        template: the skin in cm, y up, the face towards +z.
        name: name of the skin in error messages.
        target: the head in cm, y up, the face towards +z.
        found: the fitted model and landmarks of the head.
        threads: number of threads; 0: one for each core.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.

    Raises:
        LandmarkError: no face was found in the template.
        RegistrationError: no surface of the head is near the template.
        Stopped: `progress` returned False.
    """
    if np.array_equal(template.triangles, target.triangles):
        jaw = jaw_change(template, target.points, target, found.pose, found.error)
        return Laid(target.points, np.ones(len(target.points)), None, jaw)
    hints = Hints(name, up=np.eye(3)[1], front=np.eye(3)[2])
    own = find_form(template, hints, telling(progress, 0.0, _FOUND))
    start = start_of(template, target, own, found)
    pairs = [(v, goal.tolist()) for v, goal in pairs_of(template, own, found)]
    options = RegisterOptions(threads=threads)
    try:
        laid = register(template, target, pairs, options, start, _rest(progress))
    except StoppedError:
        raise Stopped from None
    error = max(own.error, found.error)
    jaw = jaw_change(template, laid.points, template, own.pose, error)
    return Laid(laid.points, laid.trusted.astype(np.float64), laid, jaw)


def _rest(progress: Progress | None) -> Progress | None:
    return None if progress is None else lambda share: progress(_FOUND + (1 - _FOUND) * share)
