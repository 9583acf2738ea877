# SPDX-License-Identifier: MIT
"""Finds the points about which lids and jaws turn, and computes arcs about them.

A blend shape moves a vertex along a line, but a lid slides around the eyeball. Joints at the centre
of the eye move lids along arcs. The points come from existing joints or from the expressions.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .geometry.rigid import rigid_fit
from .geometry.skeleton import Doubles, rotation_vectors

_LID = re.compile(r"eye(Blink|Widen|Squint|LidPress|Relax|UpperLid|LowerLid|LookUp|LookDown)")
_JAW = re.compile(r"jaw(Open|OpenExtreme|Left|Right)$")
_EYE_JOINT = re.compile(r"(^|_)([LR])_?eye$|eye_?([LR])$|(left|right)_?eye$", re.IGNORECASE)
_LEAST_TURN = 0.05  # radians; the hinge of a jaw that turns less cannot be found


@dataclass(frozen=True)
class Pivot:
    """A point, and the indices of the expressions that turn vertices about the point."""

    position: Doubles  # float64[3]
    expressions: tuple[int, ...]


def find_pivots(
    names: Sequence[str],
    positions: Doubles,
    displacements: Doubles,
    joint_names: Sequence[str],
    joints: Doubles,
    *,
    jaw: bool,
) -> list[Pivot]:
    """Find the centre of each eye, as the pivot of its lids, and the hinge of the jaw.

    Args:
        names: names of the E expressions.
        positions: float64[V, 3], neutral vertices.
        displacements: float64[E, V, 3], displacements with each expression at 1.
        joint_names: names of the existing joints.
        joints: float64[J, 3], positions of the existing joints.
        jaw: whether an existing joint opens the mouth; then no hinge is needed.
    """
    out = []
    eyes = {_side(n): p for n, p in zip(joint_names, joints, strict=True) if _EYE_JOINT.search(n)}
    for side in "LR":
        rows = [e for e, n in enumerate(names) if _LID.search(n) and n.endswith(side)]
        shut = [e for e in rows if "eyeBlink" in names[e]]
        if side in eyes:
            out.append(Pivot(eyes[side], tuple(rows)))
        elif shut:
            middle = _sphere(positions, displacements[shut[0]])
            if middle is not None:
                out.append(Pivot(middle, tuple(rows)))
    rows = [e for e, n in enumerate(names) if _JAW.search(n)]
    opening = [e for e in rows if names[e].endswith("jawOpen")]
    if opening and not jaw:  # with a jaw joint, joints that follow the jaw are its children
        hinge = _hinge(positions, displacements[opening[0]])
        if hinge is not None:
            out.append(Pivot(hinge, tuple(rows)))
    return out


def _side(joint: str) -> str:
    found = _EYE_JOINT.search(joint)
    assert found is not None
    word = found.group(2) or found.group(3) or found.group(4)
    return word[0].upper()


def _sphere(positions: Doubles, displacement: Doubles) -> Doubles | None:
    """The centre of the sphere on which the open and the shut lid lie; None if fewer than 6
    vertices move far enough, or if no sphere fits them."""
    length = np.linalg.norm(displacement, axis=1)
    edge = length > 0.5 * length.max()
    if np.count_nonzero(edge) < 6:
        return None
    points = np.concatenate([positions[edge], positions[edge] + displacement[edge]])
    origin = points.mean(axis=0)
    rows = np.column_stack([2 * (points - origin), np.ones(len(points))])
    solution, _, rank, _ = np.linalg.lstsq(rows, ((points - origin) ** 2).sum(axis=1), rcond=1e-6)
    middle = solution[:3]
    radius = np.linalg.norm(points - origin - middle, axis=1)
    size = np.ptp(points, axis=0).max()
    if rank < 4 or radius.mean() > 3 * size or radius.std() > 0.2 * radius.mean():
        return None
    return np.asarray(origin + middle)


def _hinge(positions: Doubles, displacement: Doubles) -> Doubles | None:
    """The point on the jaw's rotation axis that is nearest to the jaw; None if the jaw turns by
    less than _LEAST_TURN (0.05 radians)."""
    length = np.linalg.norm(displacement, axis=1)
    held = length > 0.7 * length.max()
    before, after = positions[held], positions[held] + displacement[held]
    turn, shift = rigid_fit(before, after)
    if np.linalg.norm(rotation_vectors(turn)) < _LEAST_TURN:
        return None
    a = before.mean(axis=0)
    arm, *_ = np.linalg.lstsq(np.eye(3) - turn, shift - (a - turn @ a), rcond=1e-3)
    return np.asarray(a + arm)


def arc(positions: Doubles, displacement: Doubles, middle: Doubles, share: float) -> Doubles:
    """float64[V, 3]: displacements on arcs about a point; the radius changes linearly with `share`.

    Args:
        positions: float64[V, 3], neutral vertices.
        displacement: float64[V, 3] with the control at 1.
        middle: float64[3], the point.
        share: value of the control, 0 to 1.
    """
    before, after = positions - middle, positions + displacement - middle
    near, far = (np.linalg.norm(x, axis=1, keepdims=True) for x in (before, after))
    a, b = before / np.maximum(near, 1e-30), after / np.maximum(far, 1e-30)
    angle = np.arccos(np.clip((a * b).sum(axis=1, keepdims=True), -1, 1))
    sine = np.sin(angle)
    small = sine < 1e-9
    safe = np.where(small, 1, sine)
    one = np.where(small, 1 - share, np.sin((1 - share) * angle) / safe)
    two = np.where(small, share, np.sin(share * angle) / safe)
    return np.asarray((one * a + two * b) * ((1 - share) * near + share * far) - before)
