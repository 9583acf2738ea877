# SPDX-License-Identifier: MIT
"""Converts Euler angles and quaternions (x, y, z, w) in double precision; see CONVENTIONS.md."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from .._native import Dna

Doubles = npt.NDArray[np.float64]

SEQUENCES = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx")


class Convention:
    """Order, signs and unit of a file's Euler angles. Undefined values mean, as for the evaluator,
    x y z, positive signs and degrees.

    Attributes:
        order: the axes (0 to 2) in the order in which the rotations are applied.
        signs: float64[3], 1 or -1, the sense of each rotation.
        radians: radians per unit of the file's angles.
    """

    def __init__(self, sequence: str, signs: tuple[int, ...], unit: str) -> None:
        known = sequence if sequence in SEQUENCES else SEQUENCES[0]
        self.order = ["xyz".index(axis) for axis in known]
        self.signs = np.where(np.array(signs) < 0, -1.0, 1.0)
        self.radians = 1.0 if unit == "radians" else math.pi / 180

    @classmethod
    def of(cls, dna: Dna) -> Convention:
        return cls(dna.rotation_sequence, dna.rotation_signs, dna.rotation_unit)

    def quaternion(self, angles: Doubles) -> Doubles:
        """Euler angles float64[3] in the file's unit -> quaternion float64[4]"""
        q = np.array([0.0, 0.0, 0.0, 1.0])
        half = np.asarray(angles, float) * self.signs * self.radians / 2
        for axis in self.order:
            step = np.zeros(4)
            step[axis], step[3] = math.sin(half[axis]), math.cos(half[axis])
            q = product(step, q)
        return q

    def angles(self, q: Doubles) -> Doubles:
        """Quaternion float64[4] -> Euler angles float64[3] in the file's unit; in gimbal lock the
        last angle of the order is 0."""
        m = _matrix(q)
        i, j, k = self.order
        parity = 1 if j == (i + 1) % 3 else -1
        sine = -parity * m[i, k]
        out = np.zeros(3)
        out[j] = math.asin(min(1.0, max(-1.0, sine)))
        if abs(sine) < 1 - 1e-12:
            out[i] = math.atan2(parity * m[j, k], m[k, k])
            out[k] = math.atan2(parity * m[i, j], m[i, i])
        else:
            out[i] = math.atan2(-parity * m[k, j], m[j, j])
        return out * self.signs / self.radians


def product(a: Doubles, b: Doubles) -> Doubles:
    """The quaternion a * b, which rotates by b first, then by a."""
    v = a[3] * b[:3] + b[3] * a[:3] + np.cross(a[:3], b[:3])
    return np.array([*v, a[3] * b[3] - a[:3] @ b[:3]])


def angle_degrees(a: Doubles, b: Doubles) -> float:
    """The angle between two rotations in degrees, 0 to 180.

    Args:
        a, b: float64[4], unit quaternions (x, y, z, w).
    """
    apart = product(a * [-1, -1, -1, 1], b)
    return math.degrees(2 * math.atan2(float(np.linalg.norm(apart[:3])), abs(float(apart[3]))))


def _matrix(q: Doubles) -> Doubles:
    """float64[3, 3]: rotation matrix of a quaternion; its rows are the images of the axes."""
    x, y, z, w = q / np.linalg.norm(q)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return (np.eye(3) + 2 * w * cross + 2 * cross @ cross).T
