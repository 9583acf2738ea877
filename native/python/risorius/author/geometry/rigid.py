# SPDX-License-Identifier: MIT
"""Computes rigid motions of points: least squares fit, change of pivot, partial rotations."""

from __future__ import annotations

import numpy as np

from .polygon_mesh import Floats


def rigid_fit(before: Floats, after: Floats) -> tuple[Floats, Floats]:
    """The least-squares rigid motion of points (Kabsch 1976).

    Args:
        before, after: float64[n, 3], positions of the points before and after the motion.

    Returns:
        Rotation [3, 3] and translation [3]: after is near rotation @ before + translation.
    """
    a, b = before - before.mean(0), after - after.mean(0)
    u, _, vt = np.linalg.svd(a.T @ b)
    flip = np.diag([1, 1, np.sign(np.linalg.det(u @ vt))])
    rotation = (u @ flip @ vt).T
    return rotation, after.mean(0) - rotation @ before.mean(0)


def about(pivot: Floats, rotation: Floats, translation: Floats) -> tuple[Floats, Floats]:
    """Express a rigid motion as a rotation about a pivot and a shift of the pivot.

    Args:
        pivot: [3], the new centre of rotation.
        rotation: [3, 3], the rotation matrix.
        translation: [3], the translation after a rotation about the origin.
    """
    return rotation, translation - pivot + rotation @ pivot


def rigid_way(points: Floats, pivot: Floats, rotation: Floats, shift: Floats) -> Floats:
    """float64[n, 3]: displacements of points by a rotation about a pivot and a shift.

    Args:
        points: float64[n, 3], positions before the motion.
        pivot: [3], the centre of rotation.
        rotation: [3, 3], the rotation matrix.
        shift: [3], shift of the pivot.
    """
    way: Floats = pivot + shift + (points - pivot) @ rotation.T - points
    return way


def part_rotation(rotation: Floats, share: float) -> Floats:
    """The rotation about the same axis by a fraction of the angle (Rodrigues).

    Args:
        rotation: [3, 3], the rotation matrix.
        share: the fraction of the angle.
    """
    angle = np.arccos(np.clip((np.trace(rotation) - 1) / 2, -1, 1)) * share
    axis = np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    axis /= max(np.linalg.norm(axis), 1e-12)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * (k @ k)
