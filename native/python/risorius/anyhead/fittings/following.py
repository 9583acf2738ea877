# SPDX-License-Identifier: MIT
"""Moves lashes, brows and other meshes that lie on the skin with the skin at their roots."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from ..._native import ClosestPoints
from ...author.geometry.skeleton import Doubles, Ints
from ..surface import Surface

_PATCH = 16  # skin vertices whose rotation a point follows
_BLOCK = 64  # patches that are computed together, to limit memory
_REACHES = (0.5, 2.0)  # cm around the points in which their patches are searched first
_MOVED = 1e-5  # cm: smaller motions are ignored


class Followers:
    """Points that follow the skin; each has a patch of skin vertices around its root."""

    def __init__(self, skin: Surface, points: Doubles, islands: Ints | None, patch: int = _PATCH):
        """Find the patch of each point.

        Args:
            skin: the skin in the rest pose.
            points: float64[n, 3], the points in the rest pose.
            islands: int64[n], the island of each point. The points of an island closest to the skin
                are its roots, and its other points follow the nearest root. None: each point
                follows the skin nearest to it.
            patch: number of skin vertices around a root.
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
        """float64[n, 3]: positions of the points on the displaced skin.

        Args:
            displacement: float64[V, 3], displacements of the skin vertices.
            sized: whether the points also scale with their patch.
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

    def ways(self, expressions: Mapping[str, Doubles]) -> dict[str, Doubles]:
        """float64[n, 3] by name: displacements of the points; expressions without motion are left
        out.

        Args:
            expressions: float64[V, 3] by name, displacements of the skin.
        """
        out = {}
        for name, displacement in expressions.items():
            way = self.carried(displacement) - self.points
            if np.abs(way).max(initial=0.0) > _MOVED:
                out[name] = way
        return out


def _roots(skin: Surface, points: Doubles, nearest: Ints, distance: Doubles, islands: Ints) -> Ints:
    """int64[n]: for each point, the skin vertex at the nearest root of its island."""
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
    """int64[anchors, size]: the skin vertices nearest to each anchor; a vertex with an opposite
    normal counts as 1 cm farther."""
    normals = skin.normals()
    out = np.zeros((len(anchors), size), np.int64)
    order = np.argsort(skin.points[anchors, 0], kind="stable")
    for begin in range(0, len(anchors), _BLOCK):
        rows = order[begin : begin + _BLOCK]
        places = skin.points[anchors[rows]]
        for reach in (*_REACHES, np.inf):  # most patches lie within the first reach
            low, high = places.min(axis=0) - reach, places.max(axis=0) + reach
            near = np.flatnonzero(((skin.points >= low) & (skin.points <= high)).all(axis=1))
            if len(near) < size:
                continue
            found, farthest = _closest(skin.points, normals, anchors[rows], near, size)
            if farthest < reach:
                break
        out[rows] = found
    return out


def _closest(
    points: Doubles, normals: Doubles, own: Ints, near: Ints, size: int
) -> tuple[Ints, float]:
    """int64[n, size]: for the vertices `own` the nearest vertices among `near`; the largest of
    their distances, in which 1 cm is added for an opposite normal."""
    away = np.sqrt(sum((points[own, k][:, None] - points[near, k][None]) ** 2 for k in range(3)))
    # Vertices with an opposite normal may be on the other lid or on the inside of a lip.
    against: npt.NDArray[np.bool_] = normals[own] @ normals[near].T < 0.0
    away[against] += 1.0
    found = np.argpartition(away, size - 1, axis=1)[:, :size]
    return near[found], float(np.take_along_axis(away, found, axis=1).max())


def _turns(before: Doubles, after: Doubles) -> tuple[Doubles, Doubles]:
    """float64[n, 3, 3]: rotations of patches from `before` to `after`; float64[n]: their scale
    factors (Umeyama 1991)."""
    u, s, vt = np.linalg.svd(np.einsum("npi,npj->nij", after, before))
    sign = np.sign(np.linalg.det(u @ vt))
    u[:, :, 2] *= sign[:, None]
    s[:, 2] *= sign
    spread = np.maximum((before**2).sum(axis=(1, 2)), 1e-12)
    return u @ vt, s.sum(axis=1) / spread
