# SPDX-License-Identifier: MIT
"""Fits similarity transforms (rotation, scale and translation) to points by least squares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...author.geometry.skeleton import Doubles


@dataclass(frozen=True)
class Similarity:
    """The transform p -> scale * turn @ (p - before) + after.

    Attributes:
        turn: float64[3, 3], the rotation.
        scale: the scale factor.
        before, after: float64[3], a point and its image.
    """

    turn: Doubles
    scale: float
    before: Doubles
    after: Doubles

    def point(self, points: Doubles) -> Doubles:
        """float64[..., 3]: transformed points.

        Args:
            points: float64[..., 3], positions.
        """
        return np.asarray(self.way(points - self.before) + self.after)

    def way(self, ways: Doubles) -> Doubles:
        """float64[..., 3]: vectors, rotated and scaled but not translated.

        Args:
            ways: float64[..., 3], vectors.
        """
        return np.asarray(self.scale * (ways @ self.turn.T))

    def shifted(self, by: Doubles) -> Similarity:
        """This transform, followed by a translation.

        Args:
            by: float64[3], the translation.
        """
        return Similarity(self.turn, self.scale, self.before, self.after + by)


def similarity(before: Doubles, after: Doubles) -> Similarity:
    """The least-squares similarity between two sets of points (Umeyama 1991).

    Args:
        before, after: float64[n, 3], corresponding points; n at least 3.
    """
    first, then = before.mean(axis=0), after.mean(axis=0)
    a, b = before - first, after - then
    u, s, vt = np.linalg.svd(b.T @ a)
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    scale = float((s * sign).sum() / max(float((a**2).sum()), 1e-12))
    return Similarity((u * sign) @ vt, scale, first, then)
