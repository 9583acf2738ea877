# SPDX-License-Identifier: MIT
"""All expressions of a template on another head: the way through."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...author.geometry.skeleton import Doubles
from ..errors import AnyHeadError, Stopped
from ..surface import Surface
from .carrying import Carrying
from .spreading import Spreading
from .template import Floats, Pose, Progress, TemplateFace

_AT_ONCE = 24  # poses that are solved together
_LEAST = 1e-3  # cm: a vertex that moves less rests
_PARTING = ("jawOpen", "eyeBlinkL", "eyeBlinkR", "mouthUpperLipRaiseL", "mouthUpperLipRaiseR",
            "mouthLowerLipDepressL", "mouthLowerLipDepressR")  # fmt: skip
STRENGTHS = (0.0, 1.5)


@dataclass(frozen=True)
class TransferOptions:
    """Attributes:
    strength: 0 to 1.5, what all expressions are multiplied with.
    threads: 0: one for each core.
    """

    strength: float = 1.0
    threads: int = 0


@dataclass
class Transferred:
    """Expressions of another head.

    Attributes:
        ways: float32[V, 3] by pose: what a control does alone, or what is left over where the
            controls of a corrective meet. Cm, of the head's own vertices.
        known: float64[V], 0 to 1: how sure each vertex' place on the template is.
    """

    ways: dict[Pose, Floats]
    known: Doubles


def transfer(
    face: TemplateFace,
    target: Surface,
    points: Doubles,
    trusted: Doubles,
    options: TransferOptions | None = None,
    progress: Progress | None = None,
) -> Transferred:
    """Carries all poses of a template to a head that it lies on.

    Args:
        face: the template.
        target: the head, standing, in cm.
        points: float64[T, 3], the template's vertices on the head.
        trusted: bool or float[T], 0 to 1: how sure the place of each is.
        options: how strong expressions are.
        progress: told the share that is done, 0 to 1; False stops.

    Raises:
        AnyHeadError: no vertex of the head lies near the template, or a strength out of range.
        Stopped: progress said False.
    """
    o = options or TransferOptions()
    if not STRENGTHS[0] <= o.strength <= STRENGTHS[1]:
        raise AnyHeadError(f"strength: a number from 0 to 1.5 was expected, found {o.strength:g}")
    trust = np.asarray(trusted, np.float64)
    ways = Carrying(face, points, trust).ways(o.strength)
    _tell(progress, 0.1)
    lying = Surface(points, face.surface.triangles)
    spreading = Spreading(target, lying, trust, _parting(face, ways), o.threads)
    if not (spreading.known > 0.1).any():
        raise AnyHeadError("the fitted template touches no part of the head: check the landmarks")
    _tell(progress, 0.2)
    out: dict[Pose, Floats] = {}
    poses = list(ways)
    for start in range(0, len(poses), _AT_ONCE):
        some = poses[start : start + _AT_ONCE]
        found = spreading.spread(np.concatenate([ways[pose] for pose in some], axis=1))
        for pose, way in zip(some, np.split(found, len(some), axis=1), strict=True):
            length = np.linalg.norm(way, axis=1, keepdims=True)
            out[pose] = (way * (length > _LEAST)).astype(np.float32)
        _tell(progress, 0.2 + 0.8 * (start + len(some)) / len(poses))
    return Transferred(out, spreading.known)


def _tell(progress: Progress | None, share: float) -> None:
    if progress is not None and progress(share) is False:
        raise Stopped


def _parting(face: TemplateFace, ways: dict[Pose, Doubles]) -> Doubles | None:
    """float64[T, n, 3]: ways in which lips and lids part; the longest where no name is known."""
    named: list[Pose] = [(name,) for name in _PARTING if (name,) in ways]
    far = {pose: float(np.square(way).sum()) for pose, way in face.ways.items() if len(pose) == 1}
    chosen = named or sorted(far, key=lambda pose: -far[pose])[: len(_PARTING)]
    chosen = [pose for pose in chosen if ways[pose].any()]
    return np.stack([ways[pose] for pose in chosen], axis=1) if chosen else None
