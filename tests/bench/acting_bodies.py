# SPDX-License-Identifier: MIT
"""Measures the depth of skin inside eyeballs and teeth, and of hair inside skin.

Eyeballs and rows of teeth are rigid bodies. Each has a table of its outer radius around a middle or
an axis, made from the neutral face. In each frame, samples of the skin are transformed by the
inverse of the body's motion, and compared with the table, which takes little time. Lengths are in
the file's unit. Places are float64[n, 3] with x to the side, y up and z to the front.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def rigid_motion(rest: Floats, now: Floats) -> tuple[Floats, Floats]:
    """The rotation R [3, 3] and shift t [3] for which now = rest R^T + t fits best.

    Args:
        rest, now: [n, 3], positions of the same points in the neutral pose and in a frame.
    """
    a, b = rest.mean(axis=0), now.mean(axis=0)
    u, _, vt = np.linalg.svd((now - b).T @ (rest - a))
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    turn = u @ flip @ vt
    return turn, b - turn @ a


@dataclass(frozen=True)
class Skin:
    """Samples of the skin: vertices, middles of edges and of faces.

    Attributes:
        corners: int64[n, 4], vertices whose mean is the sample; a vertex may occur twice.
        normals: float64[n, 3] of the samples in the neutral pose.
        places: float64[n, 3] in the neutral pose.
    """

    corners: Ints
    normals: Floats
    places: Floats

    def kept(self, mask: npt.NDArray[np.bool_]) -> Skin:
        """The samples for which mask [n] is true."""
        return Skin(self.corners[mask], self.normals[mask], self.places[mask])


def skin_samples(places: Floats, faces: Sequence[Sequence[int]]) -> Skin:
    """All samples of a mesh.

    Args:
        places: [V, 3], neutral.
        faces: vertex indices of each face, three or more. The middle of a face is the mean of its
            first four vertices.
    """
    normals = np.zeros_like(places)
    rows: list[tuple[int, int, int, int]] = []
    for face in faces:
        ring = places[list(face)]
        normal = np.cross(ring[1] - ring[0], ring[-1] - ring[0])
        normals[list(face)] += normal
        middle = [face[0], face[1], face[2], face[3] if len(face) > 3 else face[0]]
        rows.append((middle[0], middle[1], middle[2], middle[3]))
        for a, b in zip(face, [*face[1:], face[0]], strict=True):
            if a < b:
                rows.append((a, b, a, b))
    rows += [(v, v, v, v) for v in range(len(places))]
    corners = np.array(rows, np.int64)
    mean = normals[corners].sum(axis=1)
    mean /= np.linalg.norm(mean, axis=1, keepdims=True).clip(1e-12)
    return Skin(corners, mean, places[corners].mean(axis=1))


class Ball:
    """An eyeball: its outer radius by direction from its middle."""

    ROWS, COLUMNS = 90, 180

    def __init__(self, places: Floats) -> None:
        """Make the table.

        Args:
            places: [V, 3], neutral vertices; inner layers have no effect.
        """
        low, high = places.min(axis=0), places.max(axis=0)
        around = places - (low + high) / 2
        ones = np.column_stack([2 * around, np.ones(len(around))])
        offset = np.linalg.lstsq(ones, (around**2).sum(axis=1), rcond=None)[0][:3]
        self.middle = (low + high) / 2 + offset
        rays = places - self.middle
        radius = np.linalg.norm(rays, axis=1)
        rays = rays / radius[:, None]
        near = rays @ rays.T > np.cos(np.radians(8.0))
        outer = radius >= 0.97 * np.where(near, radius[None], 0.0).max(axis=1)
        self._table = self._made(rays[outer], radius[outer])

    def _made(self, rays: Floats, radius: Floats) -> Floats:
        up = (np.arange(self.ROWS) + 0.5) / self.ROWS * np.pi
        side = (np.arange(self.COLUMNS) + 0.5) / self.COLUMNS * 2 * np.pi - np.pi
        table = np.empty((self.ROWS, self.COLUMNS))
        for row, angle in enumerate(up):
            ways = np.column_stack(
                [np.sin(angle) * np.sin(side), np.full_like(side, np.cos(angle)),
                 np.sin(angle) * np.cos(side)]
            )  # fmt: skip
            apart = np.arccos((ways @ rays.T).clip(-1.0, 1.0))
            nearest = np.argpartition(apart, 4, axis=1)[:, :4]
            weight = 1.0 / (np.take_along_axis(apart, nearest, axis=1) + 1e-6) ** 2
            table[row] = (weight * radius[nearest]).sum(axis=1) / weight.sum(axis=1)
        return table

    def depth(self, places: Floats) -> Floats:
        """Depth of places [n, 3] below the neutral ball's surface; negative outside."""
        rays = places - self.middle
        far = np.linalg.norm(rays, axis=1).clip(1e-9)
        up = np.arccos((rays[:, 1] / far).clip(-1.0, 1.0)) / np.pi * self.ROWS
        side = (np.arctan2(rays[:, 0], rays[:, 2]) + np.pi) / (2 * np.pi) * self.COLUMNS
        row = up.astype(int).clip(0, self.ROWS - 1)
        column = side.astype(int).clip(0, self.COLUMNS - 1)
        return self._table[row, column] - far


class Arch:
    """A row of teeth: outer and inner radius around a vertical axis, by angle and height."""

    DEGREES, STEP = 1.0, 0.05
    _FINE = 14  # samples along the edge of a triangle

    def __init__(self, places: Floats, triangles: Ints, back: float) -> None:
        """Make the table.

        Args:
            places: [V, 3], neutral.
            triangles: [F, 3] of one row of teeth, upper or lower.
            back: z of the vertical axis; its x is 0.
        """
        self.back = back
        points = _dense(places, triangles, self._FINE)
        self._low = float(points[:, 1].min())
        rows = int((points[:, 1].max() - self._low) / self.STEP) + 1
        columns = int(180 / self.DEGREES)
        self.outer = np.full((rows, columns), -np.inf)
        self.inner = np.full((rows, columns), np.inf)
        row, column, radius, there = self._cells(points)
        np.maximum.at(self.outer, (row[there], column[there]), radius[there])
        np.minimum.at(self.inner, (row[there], column[there]), radius[there])

    def _cells(self, places: Floats) -> tuple[Ints, Ints, Floats, npt.NDArray[np.bool_]]:
        x, z = places[:, 0], places[:, 2] - self.back
        column = np.floor((np.degrees(np.arctan2(x, z)) + 90) / self.DEGREES).astype(np.int64)
        row = np.floor((places[:, 1] - self._low) / self.STEP).astype(np.int64)
        there = (column >= 0) & (column < self.outer.shape[1])
        there &= (row >= 0) & (row < self.outer.shape[0])
        return row, column, np.hypot(x, z), there

    def depth(self, places: Floats, may_be_behind: npt.NDArray[np.bool_]) -> Floats:
        """Depth of places behind the outer surface of the row; 0 in front of it.

        Args:
            places: [n, 3], transformed to the neutral position of the row.
            may_be_behind: [n], whether a place may be behind the whole row, as the lip of the other
                jaw may. The depth of such a place is 0 behind the row's inner surface.
        """
        row, column, radius, there = self._cells(places)
        row, column = np.where(there, row, 0), np.where(there, column, 0)
        outside = self.outer[row, column] - radius
        within = np.minimum(outside, radius - self.inner[row, column])
        deep = np.where(may_be_behind, within, outside)
        return np.where(there & np.isfinite(deep), deep, 0.0).clip(0.0)


def _dense(places: Floats, triangles: Ints, fine: int) -> Floats:
    """Points spread evenly over triangles, with `fine` steps along each edge."""
    steps = [(i, j) for i in range(fine + 1) for j in range(fine + 1 - i)]
    shares = np.array([(i, j, fine - i - j) for i, j in steps], np.float64) / fine
    return np.einsum("sk,fkd->fsd", shares, places[triangles]).reshape(-1, 3)


class Cards:
    """Vertices of hair, each with the skin triangles that are near it in the neutral pose."""

    # In a pose, the triangle nearest to a hair vertex is searched among the triangles that are
    # nearest to this vertex in the neutral pose: the first NEAR of them, or in deep folds AROUND.
    NEAR, AROUND = 48, 400

    def __init__(self, hairs: Floats, places: Floats, triangles: Ints) -> None:
        """Find the triangles near each hair vertex in the neutral pose.

        Args:
            hairs: [n, 3], neutral vertices of hair.
            places: [V, 3] of the neutral skin.
            triangles: [F, 3] of the skin.
        """
        first = np.zeros(len(places), np.int64)
        first[triangles.ravel()] = np.repeat(np.arange(len(triangles)), 3)
        nearest = np.empty(len(hairs), np.int64)
        count = min(self.AROUND, len(triangles))
        self.around = np.empty((len(hairs), count, 3), np.int64)
        middles = places[triangles].mean(axis=1)
        for begin in range(0, len(hairs), 256):
            part = slice(begin, begin + 256)
            nearest[part] = _away(hairs[part], places).argmin(axis=1)
            away = _away(hairs[part], middles)
            some = np.argpartition(away, count - 1, axis=1)[:, :count]
            order = np.take_along_axis(away, some, axis=1).argsort(axis=1)
            self.around[part] = triangles[np.take_along_axis(some, order, axis=1)]
        self.corners = triangles[first[nearest]]
        self.rest = self.height(hairs, places[self.corners])

    @staticmethod
    def height(hairs: Floats, corners: Floats) -> Floats:
        """Signed distance of hairs [n, 3] above the planes of triangles [n, 3, 3]."""
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        normal = np.cross(b - a, c - a)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True).clip(1e-12)
        return np.einsum("nd,nd->n", hairs - a, normal)

    @staticmethod
    def height_over_nearest(hairs: Floats, corners: Floats) -> Floats:
        """Signed distance of hairs [n, 3] from the nearest of triangles [n, k, 3, 3]; inside < 0.

        If several triangles share the nearest point, the one whose normal points most directly at
        the hair determines the sign.
        """
        a, u, v = corners[:, :, 0], corners[:, :, 1] - corners[:, :, 0], corners[:, :, 2]
        v = v - a
        ray = hairs[:, None] - a - _nearest_in(u, v, hairs[:, None] - a)
        far = np.linalg.norm(ray, axis=2)
        normal = np.cross(u, v)
        normal /= np.linalg.norm(normal, axis=2, keepdims=True).clip(1e-12)
        over = np.einsum("nkd,nkd->nk", ray, normal)
        least = far.min(axis=1)
        there = far <= least[:, None] * 1.0001 + 1e-9
        chosen = np.where(there, np.abs(over), -1.0).argmax(axis=1)
        return least * np.sign(np.take_along_axis(over, chosen[:, None], axis=1)[:, 0])


def _away(points: Floats, others: Floats) -> Floats:
    """Squared distances [n, m] between points and others."""
    return (points**2).sum(axis=1)[:, None] - 2 * points @ others.T + (others**2).sum(axis=1)


def _nearest_in(u: Floats, v: Floats, way: Floats) -> Floats:
    """The point nearest to `way` in each triangle with the corners 0, u and v; all are [..., 3]."""

    def dot(p: Floats, q: Floats) -> Floats:
        return np.einsum("...d,...d->...", p, q)[..., None]

    uu, uv, vv, wu, wv = dot(u, u), dot(u, v), dot(v, v), dot(way, u), dot(way, v)
    area = (uu * vv - uv * uv).clip(1e-18)
    s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    inside = (s >= 0) & (t >= 0) & (s + t <= 1)
    side = v - u
    on_side = (dot(way - u, side) / dot(side, side).clip(1e-18)).clip(0, 1)
    found = np.where(inside, s * u + t * v, u + on_side * side)
    best = np.where(inside, -1.0, dot(way - found, way - found))
    for place in ((wu / uu.clip(1e-18)).clip(0, 1) * u, (wv / vv.clip(1e-18)).clip(0, 1) * v):
        away = dot(way - place, way - place)
        found = np.where(away < best, place, found)
        best = np.minimum(best, away)
    return found
