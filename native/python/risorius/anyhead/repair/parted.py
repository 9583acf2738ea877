# SPDX-License-Identifier: MIT
"""Lets the controls that close the mouth also close lips that are apart in the rest pose.

A control such as mouthLipsTogetherUL takes back the motion of the lips by jawOpen. A mouth that is
open in the rest pose is like the mouth of a jaw that is partly open, so a share of this motion
closes it. The share is added to the poses of an open jaw and to the rest pose.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...author.geometry.skeleton import Doubles
from .lips import Lips

Pose = tuple[str, ...]
_PARTED = 1.0  # mm: lips with a larger mean gap in the rest pose are apart
_STILL = 0.1  # of the closing motion: a control that moves the skin less by itself counts as still
# The first share that is tried, the largest change of a share, and the largest share.
_FIRST, _CHANGE, _MOST = 0.02, 0.3, 2.0
# Factor of a change, because the search must not pass the share at which the lips meet: beyond it,
# the gap is not linear.
_SHORTER = 0.8
_QUANTILE = 0.1  # of the gaps of all columns: the gap that the search makes small
_NEAR = 1.0  # mm: a smaller gap ends the search, because Lips.closed closes the rest
_ROUNDS = 20  # largest number of changes
# Factors of the found share, because Lips.closed sometimes leaves a cut near a corner of the mouth.
_TRIED = (1.0, 0.9, 1.1, 0.8, 1.2)
_GOOD = 0.2  # mm: a smaller gap and cut of the closed lips end the trials


@dataclass(frozen=True)
class Closing:
    """The motion that closes lips which are apart in the rest pose.

    Attributes:
        pose: controls that close the lips if all of them are 1. These are the lip controls, or also
            jawOpen if a lip control moves the skin by itself: at a closed jaw, it closes too far.
        parts: float64[V, 3] by lip control, the part of the motion that the control gets by itself.
        rest: float64[V, 3], the other part of the motion, for poses with all controls of `pose`.
    """

    pose: Pose
    parts: Mapping[str, Doubles]
    rest: Doubles

    def motion(self, pose: Pose) -> Doubles:
        """float64[V, 3]: the displacements to add to a pose.

        Args:
            pose: names of the raw controls with value 1.
        """
        out = self.rest if set(self.pose) <= set(pose) else np.zeros_like(self.rest)
        return sum((self.parts[name] for name in pose if name in self.parts), out)


def rest_closing(
    lips: Lips,
    closing: Pose,
    expressions: Mapping[str, Doubles],
    combinations: Mapping[Pose, Doubles],
) -> Closing | None:
    """The motion that closes lips which are apart in the rest pose; None if they are not apart, or
    if the controls do not close them.

    Args:
        lips: the lips of the target.
        closing: jawOpen and the controls that close the lips of an open jaw.
        expressions: float64[V, 3] by raw control, displacements of the skin.
        combinations: float64[V, 3] by controls that are 1 together: their whole displacement, with
            the controls of `closing`.
    """
    if not np.nan_to_num(lips.rest.gap).mean() > _PARTED * lips.mm:
        return None
    by_pose = {frozenset(pose): pose for pose in combinations}
    jaw = np.asarray(expressions[closing[0]], np.float64)
    way = np.asarray(combinations[by_pose[frozenset(closing)]], np.float64) - jaw
    share = _share(lips, way)
    if share is None:
        return None
    names = closing[1:]
    least = _STILL * np.abs(way).max()
    if any(np.abs(expressions[n]).max() > least for n in names if n in expressions):
        return Closing(closing, {}, share * way)
    parts = {}
    for name in names:
        pair = by_pose.get(frozenset((closing[0], name)))
        if pair is not None:
            parts[name] = share * (np.asarray(combinations[pair], np.float64) - jaw)
    return Closing(names, parts, share * way - sum(parts.values(), np.zeros(1)))


def _share(lips: Lips, way: Doubles) -> float | None:
    """The factor of a motion from the rest pose after which Lips.closed closes the lips best; None
    if the motion does not bring the lips together."""
    near = _near(lips, way)
    if near is None:
        return None
    best, least = near, np.inf
    for factor in _TRIED:
        points = lips.closed(lips.skin.points + factor * near * way)
        fault = max(lips.widest(points), lips.deepest(points))
        if fault < least:
            best, least = factor * near, fault
        if least < _GOOD * lips.mm:
            break
    return best


def _near(lips: Lips, way: Doubles) -> float | None:
    """The factor of a motion from the rest pose at which the lips nearly meet in a tenth of the
    columns; None if the motion does not bring the lips together."""

    def gap(share: float) -> float:
        points = lips.skin.points + share * way
        return float(np.quantile(np.nan_to_num(lips.meeting(points).gap), _QUANTILE)) / lips.mm

    share, apart, change = 0.0, gap(0.0), _FIRST
    deepest = min(apart, 0.0)
    for _ in range(_ROUNDS):
        then = gap(share + change)
        if then < deepest:  # the change was too large
            change /= 2
            continue
        if not then < apart or share + change > _MOST:
            return None
        share += change
        if then < _NEAR:
            return share
        change = min(_SHORTER * then / (apart - then) * change, _CHANGE)
        apart = then
    return None
