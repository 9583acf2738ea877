# SPDX-License-Identifier: MIT
"""What a VRM says of a face and is measured at it: how far eyes turn, what goes with a feeling."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from .avatar.vrm import BLINKS, FEELINGS, KINDS, Manner
from .combining import Sums
from .parts import Points
from .targets import Target

Doubles = npt.NDArray[np.float64]

HELD_MM = 2.0
"""Millimetres: an expression holds back what its sum with that is farther from the rig."""
_LEAST_DEGREES = 1.0


def measured(points: Points, sums: Sums, targets: Mapping[str, Target]) -> Manner:
    """Of a level.

    Args:
        points: of it.
        sums: of its targets.
        targets: of the group vrm, by name.
    """
    look = {}
    for name in KINDS["LookAt"]:
        if name in targets and (degrees := _turn(points, sums.delta(name))) > _LEAST_DEGREES:
            look[name] = round(degrees, 2)
    pairs = [(name, kind) for name in FEELINGS for kind in KINDS]
    pairs += [(name, "LookAt") for name in BLINKS]
    held: dict[str, list[str]] = {}
    for own, kind in pairs:
        there = [name for name in KINDS[kind] if name in targets and own in targets]
        if any(sums.apart((own, name)) > HELD_MM for name in there):
            held.setdefault(own, []).append(kind)
    return Manner(look, held)


def _turn(points: Points, delta: npt.NDArray[np.float32]) -> float:
    """Degrees that the eyeballs turn, in the mean; 0 for a face without eyes."""
    found = list[float]()
    for part in points.parts:
        rows = np.unique(part.rows)
        if part.kind == "eyes" and len(rows) > 3 and delta[rows].any():
            rest, at = points.rest[rows], points.rest[rows] + delta[rows]
            turn = _rotation(rest - rest.mean(axis=0), at - at.mean(axis=0))
            found.append(float(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))))
    return float(np.mean(found)) if found else 0.0


def _rotation(rest: Doubles, at: Doubles) -> Doubles:
    """The rotation that brings points nearest to others, in least squares."""
    left, _, right = np.linalg.svd(rest.T @ at)
    sign = np.sign(np.linalg.det(left @ right))
    return np.asarray((left * [1.0, 1.0, sign]) @ right, np.float64).T
