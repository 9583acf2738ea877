# SPDX-License-Identifier: MIT
"""Measures values of VRM expressions on a face.

The values are the angles of the gaze, and the presets that must fade out while an emotion preset is
active, because the sum of the two presets' morph targets would deform the face.
"""

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
"""Millimetres: an expression blocks a kind of preset if their sum deviates farther from the rig."""
_LEAST_DEGREES = 1.0  # degrees: smaller turns of the eyes count as none


def measured(points: Points, sums: Sums, targets: Mapping[str, Target]) -> Manner:
    """Measures the values of VRM expressions on a face, at one LOD.

    Args:
        points: vertices of the LOD.
        sums: linear sums of the face's morph targets.
        targets: name -> target of the group vrm.
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
    """Mean rotation of the eyeballs that a target moves, in degrees; 0 if it moves none.

    Args:
        points: vertices of the LOD, in the rest pose.
        delta: float32[P, 3], the displacement of the vertices by the target, in metres.
    """
    found = list[float]()
    for part in points.parts:
        rows = np.unique(part.rows)
        if part.kind == "eyes" and len(rows) > 3 and delta[rows].any():
            rest, at = points.rest[rows], points.rest[rows] + delta[rows]
            turn = _rotation(rest - rest.mean(axis=0), at - at.mean(axis=0))
            found.append(float(np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1)))))
    return float(np.mean(found)) if found else 0.0


def _rotation(rest: Doubles, at: Doubles) -> Doubles:
    """float64[3, 3]: the rotation that best maps `rest` onto `at` in least squares, both [n, 3]."""
    left, _, right = np.linalg.svd(rest.T @ at)
    sign = np.sign(np.linalg.det(left @ right))
    return np.asarray((left * [1.0, 1.0, sign]) @ right, np.float64).T
