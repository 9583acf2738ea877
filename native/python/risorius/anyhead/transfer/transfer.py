# SPDX-License-Identifier: MIT
"""Transfers all expressions of a template to another head."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...author.geometry.skeleton import Doubles
from ...author.geometry.sparse import SparseShapes
from ..errors import AnyHeadError, Stopped
from ..form.teeth import JawChange
from ..surface import Surface
from .carrying import Carrying
from .spreading import Spreading
from .template import Pose, Progress, TemplateFace

_AT_ONCE = 24  # most poses that are solved together
_AT_ONCE_NUMBERS = 10_000_000  # coordinates that are solved together
_LEAST = 1e-3  # cm: smaller motions are set to 0
_PARTING = ("jawOpen", "eyeBlinkL", "eyeBlinkR", "mouthUpperLipRaiseL", "mouthUpperLipRaiseR",
            "mouthLowerLipDepressL", "mouthLowerLipDepressR")  # fmt: skip
STRENGTHS = (0.0, 1.5)


@dataclass(frozen=True)
class TransferOptions:
    """Options of the transfer.

    Attributes:
        strength: factor of all expressions, 0 to 1.5.
        threads: number of threads; 0: one for each core.
    """

    strength: float = 1.0
    threads: int = 0


@dataclass
class Transferred:
    """The expressions of another head.

    Attributes:
        ways: displacements [V, 3] of the head's vertices in cm, by pose. A corrective has only
            its addition to the displacements of its controls.
        known: float64[V], 0 to 1: confidence in the template's point of each vertex.
    """

    ways: SparseShapes[Pose]
    known: Doubles


def transfer(
    face: TemplateFace,
    target: Surface,
    points: Doubles,
    trusted: Doubles,
    options: TransferOptions | None = None,
    progress: Progress | None = None,
    teeth: JawChange | None = None,
) -> Transferred:
    """Transfer all poses of a template to a head onto which it was registered.

    Args:
        face: the template.
        target: the head in cm, y up, the face towards +z.
        points: float64[T, 3], positions of the template's vertices on the head.
        trusted: bool or float[T], 0 to 1: confidence in the position of each vertex.
        options: strength and threads; None: the defaults.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.
        teeth: change of the lower jaw from the template to the head; None or not sure: estimated
            from the skin.

    Raises:
        AnyHeadError: no vertex of the head is near the template, or the strength is out of range.
        Stopped: `progress` returned False.
    """
    o = options or TransferOptions()
    if not STRENGTHS[0] <= o.strength <= STRENGTHS[1]:
        raise AnyHeadError(f"strength: a number from 0 to 1.5 was expected, found {o.strength:g}")
    trust = np.asarray(trusted, np.float64)
    ways = Carrying(face, points, trust, teeth).ways(o.strength)
    _tell(progress, 0.1)
    lying = Surface(points, face.surface.triangles)
    begun = None if progress is None else lambda share: progress(0.1 + 0.1 * share)
    spreading = Spreading(target, lying, trust, _parting(face, ways), o.threads, begun)
    if not (spreading.known > 0.1).any():
        raise AnyHeadError("the fitted template touches no part of the head: check the landmarks")
    _tell(progress, 0.2)
    out = SparseShapes[Pose](len(target.points))
    poses = list(ways)
    count = int(np.clip(_AT_ONCE_NUMBERS // max(3 * len(target.points), 1), 2, _AT_ONCE))
    for start in range(0, len(poses), count):
        some = poses[start : start + count]
        found = spreading.spread(np.concatenate([ways[pose] for pose in some], axis=1))
        for pose, way in zip(some, np.split(found, len(some), axis=1), strict=True):
            length = np.linalg.norm(way, axis=1, keepdims=True)
            out[pose] = way * (length > _LEAST)
        _tell(progress, 0.2 + 0.8 * (start + len(some)) / len(poses))
    return Transferred(out, spreading.known)


def _tell(progress: Progress | None, share: float) -> None:
    if progress is not None and progress(share) is False:
        raise Stopped


def _parting(face: TemplateFace, ways: dict[Pose, Doubles]) -> Doubles | None:
    """float64[T, n, 3]: displacements of poses that part lips and lids. If the template has no
    controls with the known names, the controls that move most are used. None if nothing moves."""
    named: list[Pose] = [(name,) for name in _PARTING if (name,) in ways]
    far = {pose: float(np.square(way).sum()) for pose, way in face.ways.items() if len(pose) == 1}
    chosen = named or sorted(far, key=lambda pose: -far[pose])[: len(_PARTING)]
    chosen = [pose for pose in chosen if ways[pose].any()]
    return np.stack([ways[pose] for pose in chosen], axis=1) if chosen else None
