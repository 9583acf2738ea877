# SPDX-License-Identifier: MIT
"""Lashes, brows and what else lies on a skin: carried and turned by the skin at their roots."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..._native import ClosestPoints
from ...author.geometry.skeleton import Doubles, Ints
from ..surface import Surface

_PATCH = 16  # vertices of the skin that turn a point
_BLOCK = 256  # patches whose distances are looked at together
_MOVED = 1e-5  # cm: a patch that moves less rests


class Followers:
    """Points that the skin carries along, each with a patch of skin around its root."""

    def __init__(self, skin: Surface, points: Doubles, islands: Ints | None, patch: int = _PATCH):
        """Begins.

        Args:
            skin: at rest.
            points: float64[n, 3], at rest.
            islands: int64[n], the island of each point; the points of an island that are nearest
                to the skin are its root, and all of it goes with roots. None: each point goes with
                the skin nearest to it.
            patch: vertices of the skin around a root.
        """
        self.skin, self.points = skin, points
        tree = ClosestPoints(skin.points, np.ascontiguousarray(skin.triangles, np.int32))
        triangle, shares, distance = tree.nearest(points)
        corners = skin.triangles[triangle]
        nearest = corners[np.arange(len(points)), shares.argmax(axis=1)]
        if islands is not None:
            nearest = _roots(skin, points, nearest, distance, islands)
        self._anchors, self._anchor = np.unique(nearest, return_inverse=True)
        self._anchor = self._anchor.ravel()
        self._patches = _patches(skin, self._anchors, min(patch, len(skin.points)))

    def carried(self, displacement: Doubles, *, sized: bool = False) -> Doubles:
        """float64[n, 3]: where the points are when the skin is displaced.

        Args:
            displacement: float64[V, 3].
            sized: whether they become larger and smaller with the skin.
        """
        out = self.points.copy()
        moving = np.abs(displacement[self._patches]).max(axis=(1, 2)) > _MOVED
        if not moving.any():
            return out
        patches = self._patches[moving]
        before = self.skin.points[patches]
        after = before + displacement[patches]
        middle, there = before.mean(axis=1), after.mean(axis=1)
        turn, scale = _turns(before - middle[:, None], after - there[:, None])
        if sized:
            turn = turn * scale[:, None, None]
        place = np.full(len(self._anchors), -1)
        place[moving] = np.arange(len(patches))
        own = place[self._anchor]
        on = own >= 0
        arm = self.points[on] - middle[own[on]]
        out[on] = there[own[on]] + np.einsum("nij,nj->ni", turn[own[on]], arm)
        return out

    def ways(self, expressions: dict[str, Doubles]) -> dict[str, Doubles]:
        """float64[n, 3] by name of what moves the points.

        Args:
            expressions: float64[V, 3] of the skin by name.
        """
        out = {}
        for name, displacement in expressions.items():
            way = self.carried(displacement) - self.points
            if np.abs(way).max(initial=0.0) > _MOVED:
                out[name] = way
        return out


def _roots(skin: Surface, points: Doubles, nearest: Ints, distance: Doubles, islands: Ints) -> Ints:
    """int64[n]: the skin's vertex at the root nearest to each point, on its own island."""
    out = nearest.copy()
    for island in np.unique(islands):
        own = np.flatnonzero(islands == island)
        near = distance[own]
        rooted = own[near <= near.min() + 0.25 * max(float(np.ptp(near)), 1e-9)]
        roots = np.unique(nearest[rooted])
        away = np.linalg.norm(points[own][:, None] - skin.points[roots][None], axis=2)
        out[own] = roots[away.argmin(axis=1)]
    return out


def _patches(skin: Surface, anchors: Ints, size: int) -> Ints:
    """int64[anchors, size]: the nearest vertices of the skin, those that look the same way."""
    normals = skin.normals()
    out = np.zeros((len(anchors), size), np.int64)
    for begin in range(0, len(anchors), _BLOCK):
        own = anchors[begin : begin + _BLOCK]
        away = np.linalg.norm(skin.points[own][:, None] - skin.points[None], axis=2)
        # The other lid, or the inside of a lip, looks elsewhere.
        against: npt.NDArray[np.bool_] = normals[own] @ normals.T < 0.0
        away = np.where(against, away + 1.0, away)
        out[begin : begin + _BLOCK] = np.argpartition(away, size - 1, axis=1)[:, :size]
    return out


def _turns(before: Doubles, after: Doubles) -> tuple[Doubles, Doubles]:
    """float64[n, 3, 3] rotations and float64[n] sizes of patches (Umeyama 1991)."""
    u, s, vt = np.linalg.svd(np.einsum("npi,npj->nij", after, before))
    sign = np.sign(np.linalg.det(u @ vt))
    u[:, :, 2] *= sign[:, None]
    s[:, 2] *= sign
    spread = np.maximum((before**2).sum(axis=(1, 2)), 1e-12)
    return u @ vt, s.sum(axis=1) / spread
