# SPDX-License-Identifier: MIT
"""The template's skin laid onto a head, from landmarks to the last vertex."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..author.geometry.skeleton import Doubles
from .errors import Stopped
from .landmarks.find import Found, Hints, find_form
from .landmarks.start import pairs_of, start_of
from .registration import Registered, RegisterOptions, StoppedError, register
from .surface import Surface
from .transfer.template import Progress, TemplateFace


@dataclass(frozen=True)
class Laid:
    """A template on a head.

    Attributes:
        points: float64[V, 3], the template's vertices.
        trust: float64[V], 0 to 1: how sure the place of each is.
        registered: None: the head has the template's own triangles.
    """

    points: Doubles
    trust: Doubles
    registered: Registered | None = None


def lay(
    face: TemplateFace,
    target: Surface,
    found: Found,
    threads: int = 0,
    progress: Progress | None = None,
) -> Laid:
    """Lay a template onto a head.

    Args:
        face: the template.
        target: the head, standing, cm.
        found: its form and landmarks.
        threads: 0: one for each core.
        progress: told the share that is done, 0 to 1; False stops.

    Raises:
        LandmarkError: the template has no face.
        RegistrationError: nothing of the head near the template.
        Stopped: progress said False.
    """
    if np.array_equal(face.surface.triangles, target.triangles):
        return Laid(target.points, np.ones(len(target.points)))
    standing = Hints(face.name or "the template", {}, np.eye(3)[1], np.eye(3)[2])
    own = find_form(face.surface, standing)
    start = start_of(face.surface, target, own, found)
    pairs = [(v, goal.tolist()) for v, goal in pairs_of(face.surface, own, found)]
    options = RegisterOptions(threads=threads)
    try:
        laid = register(face.surface, target, pairs, options, start, progress)
    except StoppedError:
        raise Stopped from None
    return Laid(laid.points, laid.trusted.astype(np.float64), laid)
