# SPDX-License-Identifier: MIT
"""Represents places on the skin, where hair grows, by triangles that all people share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from risorius.author.geometry.polygon_mesh import vertex_normals

from ..polygons import Floats, Ints, Polygons

_CHUNK = 256
_AT_ONCE = 64  # points per block, so that distances to all others fit into the processor's cache


@dataclass
class Roots:
    """Places on a mesh, as weighted corners of triangles.

    Attributes:
        corners: int64[n, 3], vertices of each place's triangle.
        shares: float64[n, 3], weights of the corners; rows sum to 1.
    """

    corners: Ints
    shares: Floats

    def of(self, values: Floats) -> Floats:
        """float64[n, k]: values of vertices float64[V, k], interpolated at the places."""
        return np.asarray(np.einsum("nc,nck->nk", self.shares, values[self.corners]))

    def __len__(self) -> int:
        return len(self.corners)

    def taken(self, rows: Ints) -> Roots:
        """The places with these indices, or with True in a mask."""
        return Roots(self.corners[rows], self.shares[rows])


def joined_roots(parts: list[Roots]) -> Roots:
    """Joins places, one part after the other."""
    return Roots(
        np.concatenate([p.corners for p in parts]), np.concatenate([p.shares for p in parts])
    )


class Surface:
    """The head of a person, with the position of each vertex on the man's head.

    Attributes:
        positions: float64[V, 3] of the person, in decimetres.
        normals: float64[V, 3], unit normals of the person.
        man: float64[V, 3], the man's positions, by which the areas of hair are defined. y and z are
            relative to the middle of his left eye, x to the middle of the face.
        scale: size of the person's head relative to the man's.
    """

    def __init__(self, polygons: Polygons, positions: Floats, man: Floats, eye: Floats) -> None:
        """Prepares the surface.

        Args:
            polygons: polygons of the head.
            positions: float64[V, 3] of the person, in decimetres.
            man: float64[V, 3] of the man, in decimetres.
            eye: float64[3], middle of the man's left eye.
        """
        self.positions = positions
        self.normals = vertex_normals(positions, polygons.faces)
        self.man = man - [0.0, eye[1], eye[2]]
        self.eye = float(eye[0])
        self.man_normals = vertex_normals(man, polygons.faces)
        self.triangles = np.array(
            [[f[0], f[k], f[k + 1]] for f in polygons.faces for k in range(1, len(f) - 1)]
        )
        self.scale = float(np.ptp(positions[:, 1]) / np.ptp(man[:, 1]))
        self._around = about(self.triangles, len(positions))

    def scattered(self, density: Floats, spacing: float, random: np.random.Generator) -> Roots:
        """Random places, at least the spacing divided by the square root of the density apart.

        Args:
            density: float64[V], 0 to 1; 0 means no places.
            spacing: smallest distance at density 1, in decimetres on the man's head.
            random: generator of the places.
        """
        rows = self.triangles[density[self.triangles].max(axis=1) > 0]
        a, b, c = (self.man[rows[:, k]] for k in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
        count = int(6 * area.sum() / spacing**2)
        chosen = random.choice(len(rows), count, p=area / area.sum())
        u, v = random.random((2, count))
        shares = np.column_stack([1 - np.sqrt(u), np.sqrt(u) * (1 - v), np.sqrt(u) * v])
        roots = Roots(rows[chosen], shares)
        thick = roots.of(density[:, None])[:, 0]
        return roots.taken(_apart(roots.of(self.man), thick, spacing))

    def nearest(self, points: Floats) -> Roots:
        """The nearest place on the skin for each point.

        Args:
            points: float64[n, 3], on the person's head, in decimetres.
        """
        return nearest_places(self.positions, self.triangles, self._around, points)

    def below(self, points: Floats, among: Ints) -> tuple[Floats, Floats, Ints]:
        """Approximate height above the skin, the skin's normal, and the nearest vertex of each
        point.

        Args:
            points: float64[n, 3], in decimetres.
            among: indices of the vertices to search.
        """
        vertex = among[nearest_rows(points, self.positions[among])]
        height = ((points - self.positions[vertex]) * self.normals[vertex]).sum(axis=1)
        return height, self.normals[vertex], vertex


def about(triangles: Ints, count: int) -> Ints:
    """int64[count, n]: numbers of the triangles at each vertex; short rows repeat their last one.

    Args:
        triangles: int64[T, 3], vertices of the triangles.
        count: number of vertices.
    """
    counts = np.bincount(triangles.ravel(), minlength=count)
    order = np.argsort(triangles.ravel(), kind="stable")
    starts = np.cumsum(counts) - counts
    at = starts[:, None] + np.minimum(np.arange(counts.max()), np.maximum(counts - 1, 0)[:, None])
    return np.asarray(order[np.minimum(at, len(order) - 1)] // 3)


def nearest_rows(points: Floats, others: Floats) -> Ints:
    """int64[n]: index of the nearest of `others` for each point.

    Args:
        points: float64[n, 3].
        others: float64[m, 3].
    """
    half = (others**2).sum(axis=1) / 2
    room = np.empty((min(_AT_ONCE, len(points)), len(others)), half.dtype)
    out = np.empty(len(points), np.int64)
    for at in range(0, len(points), _AT_ONCE):
        some = points[at : at + _AT_ONCE]
        # Reuses one buffer, because new memory for each block takes longer than the computation.
        near = np.matmul(some, others.T, out=room[: len(some)])
        np.subtract(half, near, out=near).argmin(axis=1, out=out[at : at + len(some)])
    return out


def nearest_places(
    positions: Floats, triangles: Ints, around: Ints, points: Floats, vertex: Ints | None = None
) -> Roots:
    """The nearest place for each point, on the triangles at its nearest vertex.

    Args:
        positions: float64[V, 3], positions of the vertices.
        triangles: int64[T, 3], vertices of the triangles.
        around: int64[V, n], numbers of the triangles at each vertex; numbers may be repeated.
        points: float64[n, 3], the points.
        vertex: int64[n], nearest vertex of each point; None: it is searched.
    """
    if vertex is None:
        vertex = nearest_rows(points, positions)
    corners = triangles[around[vertex]]  # [n, k, 3]
    a, b, c = (positions[corners[..., k]] for k in range(3))
    u, v, w = b - a, c - a, points[:, None] - a
    uu, uv, vv = (u * u).sum(-1), (u * v).sum(-1), (v * v).sum(-1)
    wu, wv = (w * u).sum(-1), (w * v).sum(-1)
    area = np.maximum(uu * vv - uv * uv, 1e-30)
    s, t = (vv * wu - uv * wv) / area, (uu * wv - uv * wu) / area
    shares = np.clip(np.stack([1 - s - t, s, t], axis=-1), 0, None)
    shares /= shares.sum(axis=-1, keepdims=True)
    place = np.einsum("nkc,nkcx->nkx", shares, positions[corners])
    best = ((place - points[:, None]) ** 2).sum(axis=-1).argmin(axis=1)
    rows = np.arange(len(points))
    return Roots(corners[rows, best], shares[rows, best])


def _apart(points: Floats, density: Floats, spacing: float) -> Ints:
    """Indices of points that are not too near to each other; earlier points have priority.

    Args:
        points: float64[n, 3].
        density: float64[n], 0 to 1; the smallest distance is spacing / sqrt(density).
        spacing: smallest distance at density 1.
    """
    reach = (spacing / np.sqrt(np.maximum(density, 1e-6))) ** 2
    keep = np.zeros(0, np.int64)
    rest = np.flatnonzero(density > 0.02)
    for begin in range(0, len(rest), _CHUNK):
        own = rest[begin : begin + _CHUNK]
        if len(keep):
            apart = ((points[own][:, None] - points[keep]) ** 2).sum(axis=2)
            own = own[apart.min(axis=1) >= reach[own]]
        between = ((points[own][:, None] - points[own]) ** 2).sum(axis=2)
        chosen: list[int] = []
        for k in range(len(own)):
            if not chosen or between[k, chosen].min() >= reach[own[k]]:
                chosen.append(k)
        keep = np.concatenate([keep, own[chosen]])
    return keep
