# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks and coordinates for skin folds, computed from the form of a face without texture maps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .animated_maps import AREAS

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Points = Float | Float32

# Area -> ellipses (x, z, half width, half height) in face_coordinates, each also mirrored in x.
_SPOTS: dict[str, tuple[tuple[float, float, float, float], ...]] = {
    "forehead": ((0.0, 0.82, 0.75, 0.42),),
    "glabella": ((0.0, 0.36, 0.26, 0.32),),
    "eye": ((1.0, 0.0, 0.26, 0.34),),
    "nose": ((0.16, -0.22, 0.24, 0.22),),
    "smile": ((0.50, -0.80, 0.26, 0.40),),
    "lips": ((0.0, -1.0, 0.46, 0.24),),
    "chin": ((0.0, -1.45, 0.34, 0.22),),
    "neck": ((0.0, -2.6, 1.3, 0.75),),
}
_EYES_APART = 6.2  # centimetres between the eyes
_AT_ONCE = 2048  # points per step, which limits memory
_NEVER_BEHIND = {"neck"}  # areas that reach farther back behind the eyes than the others


@dataclass(frozen=True)
class FaceFrame:
    """The place and size of a face in Blender units.

    The face looks along -y, z is up, and the face's left is +x.

    Attributes:
        origin: float64[3], the midpoint between the centres of the eyes.
        unit: distance between the centres of the eyes.
        drop: distance from the eyes down to the mouth.
    """

    origin: NDArray[np.float64]
    unit: float
    drop: float


def find_frame(eyes: Sequence[Float], head: Points, mouth: Points | None) -> FaceFrame:
    """Find the FaceFrame of a head.

    Unknown eyes or an unknown mouth, and places that do not fit the size of the head, are replaced
    by the proportions of a usual head.

    Args:
        eyes: float64[3] each, centres of one eye or both; empty if unknown.
        head: float[V, 3] vertices of the head, in Blender units.
        mouth: float[3], a point inside the mouth, or None.
    """
    low, high = head.min(axis=0).astype(float), head.max(axis=0).astype(float)
    middle, size = (low + high) / 2, np.maximum(high - low, 1e-9)
    unit = 2 * float(np.mean([abs(e[0] - middle[0]) for e in eyes])) if len(eyes) else 0.0
    if not 0.15 * size[0] < unit < 0.8 * size[0]:
        unit = 0.36 * float(size[0])
        eyes = []
    if eyes:
        eye = np.mean(np.asarray(eyes, float), axis=0)
        origin = np.array([middle[0], eye[1], eye[2]])
    else:
        origin = np.array([middle[0], low[1] + 0.25 * size[1], high[2] - 1.75 * unit])
    drop = float(origin[2] - mouth[2]) if mouth is not None else 0.0
    if not 0.6 * unit < drop < 2.0 * unit:
        drop = 1.12 * unit
    return FaceFrame(origin, unit, drop)


def face_coordinates(points: Points, frame: FaceFrame) -> NDArray[np.float64]:
    """float64[V, 3]: x, depth and height of points relative to the midpoint between the eyes.

    The depth grows towards the back of the head. The unit is the distance between the eyes. Below
    the eyes, the unit of the height is the distance from the eyes down to the mouth.

    Args:
        points: float[V, 3], in Blender units.
        frame: place and size of the face.
    """
    local = (np.asarray(points, float) - frame.origin) / frame.unit
    below = local[:, 2] < 0
    local[below, 2] *= frame.unit / frame.drop
    return local


def area_masks(points: Points, frame: FaceFrame) -> dict[str, Float32]:
    """Weight of each vertex in each area.

    Args:
        points: float[V, 3] in Blender units.
        frame: place and size of the face.

    Returns:
        Area -> float32[V], 0 to 1, soft at the border.
    """
    local = face_coordinates(points, frame)
    x, depth, z = np.abs(local[:, 0]), local[:, 1], local[:, 2]
    masks = {}
    for area in AREAS:
        reach = 1.2 if area in _NEVER_BEHIND else 0.55
        front = _smooth((reach + 0.3 - depth) / 0.3)
        mask = np.zeros(len(local))
        for cx, cz, wide, high in _SPOTS[area]:
            away = np.hypot((x - cx) / wide, (z - cz) / high)
            mask = np.maximum(mask, _smooth((1.35 - away) / 0.85))
        masks[area] = (mask * front).astype(np.float32)
    # The wings of the nose have no eye folds.
    masks["eye"] *= 1 - masks["nose"]
    return masks


def fold_coordinates(points: Points, frame: FaceFrame) -> Float32:
    """float32[V, 3]: x and height of each point in face_coordinates, and distance from the mouth.

    The distance is computed from x and from 0.8 times the height above the mouth.

    Args:
        points: float[V, 3], in Blender units.
        frame: place and size of the face.
    """
    local = face_coordinates(points, frame)
    x, z = local[:, 0], local[:, 2]
    return np.stack([x, z, np.hypot(x, (z + 1.0) * 0.8)], axis=1).astype(np.float32)


def border_share(points: Points, border: NDArray[np.int64], frame: FaceFrame) -> Float32:
    """float32[V]: 1 within 1 cm of an open border, falling to 0 at 2.5 cm.

    The material has no subsurface scattering where the value is 1. Rims of lids, lips and nostrils
    do not count as borders, so that the skin around them keeps its subsurface scattering.

    Args:
        points: float[V, 3], in Blender units.
        border: int[B], vertices on open borders.
        frame: place and size of the face.
    """
    local = face_coordinates(points, frame)
    ahead = np.abs(local[border])
    rims = (ahead[:, 0] < 1.3) & (ahead[:, 1] < 1.2) & (local[border, 2] > -1.7)
    ends = np.asarray(points, np.float64)[border[~rims]]
    centimetre = frame.unit / _EYES_APART
    away = np.full(len(points), np.inf)
    for begin in range(0, len(points) if len(ends) else 0, _AT_ONCE):
        some = np.asarray(points[begin : begin + _AT_ONCE], np.float64)
        gaps = np.linalg.norm(some[:, None] - ends[None], axis=2)
        away[begin : begin + _AT_ONCE] = gaps.min(axis=1)
    return _smooth((2.5 - away / centimetre) / 1.5).astype(np.float32)


def left_share(points: Points, frame: FaceFrame) -> Float32:
    """float32[V]: 1 on the character's left, 0 on its right, with a soft transition.

    Args:
        points: float[V, 3], in Blender units.
        frame: place and size of the face.
    """
    x = face_coordinates(points, frame)[:, 0]
    return _smooth(x / 0.3 + 0.5).astype(np.float32)


def _smooth(values: Float) -> Float:
    """Smoothstep: 0 for values below 0, 1 for values above 1, with slope 0 at both ends."""
    t = np.clip(values, 0.0, 1.0)
    return t * t * (3 - 2 * t)
