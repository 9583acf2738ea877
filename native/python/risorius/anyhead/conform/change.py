# SPDX-License-Identifier: MIT
"""Computes the deformation of a skin mesh from its own head (source) to another head (target).

Each vertex has a deformation gradient (Sumner and Popovic, "Deformation Transfer for Triangle
Meshes", 2004). The gradients are smoothed over about 2 cm, because expressions scale with the size
of a lid or a lip and not with the direction of single wrinkles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ... import Mesh, _native
from ...author.geometry import skeleton as sk
from ...author.geometry.rigid import rigid_fit
from ...author.geometry.simplify import fan_triangles
from ...author.geometry.skeleton import Doubles, Ints
from ..surface import Surface

_EVENED = 0.24  # smoothing radius / RMS radius of the skin; 2 cm on a head of 24 cm (RMS 8.4 cm)
_CELL = 0.4  # smoothing radii: edge length of the grid cells whose vertices are summed first
_STEADY = 1e-6  # weight of the whole head's transform, which keeps the systems regular
_NORMAL = 0.25  # weight of the normal; edges do not measure the stretch along it
_AT_ONCE = 1024  # vertices that are smoothed together
# A point is bound to the skin point with the same texture coordinates if the distance to it is at
# most _LONGER times the distance to the closest skin point, plus _BESIDE times the smoothing
# radius. _SAME_TEXEL: largest UV distance at which texture coordinates count as the same.
_LONGER, _BESIDE, _SAME_TEXEL = 2.0, 0.2, 2e-3
_NO_TEXTURE = 1e-6  # texture coordinates with a smaller extent are unusable
_TURNED = 0.5  # a rotation counts if it leaves at most this share of the RMS difference


@dataclass(frozen=True)
class Similar:
    """A similarity transform.

    Attributes:
        linear: float64[3, 3], rotation times scale, from the source to the target head; it
            multiplies column vectors.
        middle: float64[3], a point of the source head.
        becomes: float64[3], the position of that point on the target head.
    """

    linear: Doubles
    middle: Doubles
    becomes: Doubles

    @property
    def size(self) -> float:
        """The factor by which the transform scales lengths."""
        return float(np.cbrt(max(np.linalg.det(self.linear), 0.0)))

    def __call__(self, points: Doubles) -> Doubles:
        """float64[n, 3]: points of the source head, transformed to the target head."""
        return self.becomes + (points - self.middle) @ self.linear.T


@dataclass(frozen=True)
class Hold:
    """Points bound to a skin: for each, a triangle, a point on it, and the offset from that point.

    Attributes:
        triangle: int64[n], a triangle of the skin for each point.
        shares: float64[n, 3], barycentric coordinates in the triangle.
        away: float64[n, 3], the offset from the point on the triangle to the bound point.
    """

    triangle: Ints
    shares: Doubles
    away: Doubles


def surface_of(mesh: Mesh, points: Doubles) -> Surface:
    """The triangles of a mesh with other vertex positions.

    Args:
        mesh: gives the polygons.
        points: float64[V, 3], the vertex positions.
    """
    places = np.asarray(mesh.layout_positions, np.int64)
    return Surface(points, places[fan_triangles(mesh)])


class Change:
    """The deformation from the source head to the target head.

    Attributes:
        before, after: the skin on the source head and on the target head.
        turn: float64[3, 3], the rotation from the whole source head to the target head.
        size: the size of the target head divided by the size of the source head.
        reach: the smoothing radius in the file's unit, 2 cm on a head of 24 cm.
        linear: float64[V, 3, 3], the smoothed deformation gradient of each vertex, which maps
            offsets on the source head to offsets on the target head.
    """

    def __init__(self, mesh: Mesh, before: Doubles, after: Doubles) -> None:
        """Compute the deformation gradients.

        Args:
            mesh: gives the polygons.
            before: float64[V, 3], vertex positions on the source head.
            after: float64[V, 3], vertex positions on the target head.
        """
        self.before, self.after = surface_of(mesh, before), surface_of(mesh, after)
        coordinates = np.asarray(mesh.layout_texture_coordinates, np.int64)
        rows = _flat(np.asarray(mesh.texture_coordinates, np.float64))
        self._flat = rows, coordinates[fan_triangles(mesh)]
        self.turn, self.size = turn_of(before, after)
        spread = float(np.sqrt(((before - before.mean(axis=0)) ** 2).sum(axis=1).mean()))
        self.reach = _EVENED * max(spread, 1e-12)
        self.linear = self._evened(sk.mesh_edges(mesh).astype(np.int64))

    def _evened(self, edges: Ints) -> Doubles:
        count = len(self.before.points)
        whole = np.tile(self.size * self.turn, (count, 1, 1))
        if not len(edges):
            return whole
        ends = np.concatenate([edges, edges[:, ::-1]])
        start = ends[:, 0]
        a, b = (s.points[ends[:, 1]] - s.points[start] for s in (self.before, self.after))
        mixed = _sums(start, np.einsum("ni,nj->nij", b, a), count)
        own = _sums(start, np.einsum("ni,nj->nij", a, a), count)
        square = np.einsum("vii->v", own)
        grown = _sums(start, np.einsum("ni,ni->n", b, b)[:, None, None], count)[:, 0, 0]
        grown = np.sqrt(grown / np.maximum(square, 1e-300))
        flat, bent = self.before.normals(), self.after.normals()
        mixed += (_NORMAL * square * grown)[:, None, None] * bent[:, :, None] * flat[:, None, :]
        own += (_NORMAL * square)[:, None, None] * flat[:, :, None] * flat[:, None, :]
        both = self._spread(np.concatenate([mixed.reshape(-1, 9), own.reshape(-1, 9)], axis=1))
        mixed, own = both[:, :9].reshape(-1, 3, 3), both[:, 9:].reshape(-1, 3, 3)
        steady = np.einsum("vii->v", own)[:, None, None] * _STEADY
        mixed, own = mixed + steady * whole, own + steady * np.eye(3)
        able = steady[:, 0, 0] > 0
        out = whole
        right = np.swapaxes(mixed[able], 1, 2)
        out[able] = np.swapaxes(np.linalg.solve(own[able], right), 1, 2)
        return out

    def _spread(self, rows: Doubles) -> Doubles:
        """float64[V, n]: for each vertex, the Gaussian-weighted sum of the rows of all vertices."""
        points = self.before.points
        at = np.floor((points - points.min(axis=0)) / (_CELL * self.reach)).astype(np.int64)
        at = np.ravel_multi_index(tuple(at.T), tuple(at.max(axis=0) + 1))
        cell = np.unique(at, return_inverse=True)[1].ravel()
        counts = np.bincount(cell)
        sums = _sums(cell, np.concatenate([rows, points], axis=1)[:, :, None], len(counts))[..., 0]
        middles = sums[:, -3:] / counts[:, None]
        out = np.empty_like(rows)
        for begin in range(0, len(points), _AT_ONCE):
            own = points[begin : begin + _AT_ONCE]
            out[begin : begin + _AT_ONCE] = self._near(own, middles) @ sums[:, :-3]
        return out

    def _near(self, points: Doubles, others: Doubles) -> Doubles:
        """float64[n, m]: Gaussian weights between n `points` and m `others`, by their distance."""
        square = (points**2).sum(axis=1)[:, None] + (others**2).sum(axis=1) - 2 * points @ others.T
        return np.exp(-np.maximum(square, 0.0) / (2 * self.reach**2))

    @cached_property
    def _closest(self) -> _native.ClosestPoints:
        return _native.ClosestPoints(self.before.points, self.before.triangles.astype(np.int32))

    @cached_property
    def _texture(self) -> _native.ClosestPoints | None:
        """The triangles in texture space; None if the texture coordinates are unusable."""
        rows, corners = self._flat
        if not len(rows) or np.ptp(rows, axis=0).max() < _NO_TEXTURE:
            return None
        return _native.ClosestPoints(rows, corners.astype(np.int32))

    def hold(self, points: Doubles, mesh: Mesh | None = None) -> Hold:
        """Bind points to the skin of the source head.

        The closest point may lie on the wrong lip or lid. Triangles with a similar normal are
        therefore preferred, and points with the same texture coordinates if they are close enough.

        Args:
            points: float64[n, 3], positions on or near the source skin.
            mesh: the mesh that the points are the vertices of; None: points without normals.
        """
        found, places, far = self._closest.nearest(points)
        triangle, shares = found.astype(np.int64), np.asarray(places)
        if mesh is not None:
            normals = surface_of(mesh, points).normals()
            found, places, _ = self._closest.nearest(points, normals, 0.0, self.reach)
            facing = found >= 0
            triangle[facing], shares[facing] = found[facing], places[facing]
            same, places = self._by_texture(mesh)
            there = self.before.at(np.maximum(same, 0), places)
            off = np.linalg.norm(there - points, axis=1)
            near = (same >= 0) & (off <= _LONGER * np.asarray(far) + _BESIDE * self.reach)
            triangle[near], shares[near] = same[near], places[near]
        return Hold(triangle, shares, points - self.before.at(triangle, shares))

    def _by_texture(self, mesh: Mesh) -> tuple[Ints, Doubles]:
        """int64[V], float64[V, 3]: for each vertex of a mesh the skin triangle that contains its
        texture coordinates (-1: no triangle does), and the barycentric coordinates."""
        count = len(mesh.positions)
        none = np.full(count, -1), np.full((count, 3), 1 / 3)
        rows = _flat(np.asarray(mesh.texture_coordinates, np.float64))
        if self._texture is None or not len(rows):
            return none
        at = np.full(count, -1)
        own = np.asarray(mesh.layout_texture_coordinates, np.int64)
        at[np.asarray(mesh.layout_positions, np.int64)] = own
        found, places, _ = self._texture.nearest(rows[at], farthest=_SAME_TEXEL)
        triangle = np.where(at >= 0, found.astype(np.int64), -1)
        return triangle, np.where(triangle[:, None] >= 0, np.asarray(places), none[1])

    def sees(self, points: Doubles, ways: Doubles, far: float) -> npt.NDArray[np.bool_]:
        """bool[n]: for each ray from a skin point, True if it hits no skin of the source head.

        Args:
            points: float64[n, 3], on the skin.
            ways: float64[n, 3], unit directions of the rays.
            far: the length of the rays.
        """
        triangle, _, _ = self._closest.first_hit(points + 1e-3 * far * ways, ways, far)
        return np.asarray(triangle < 0)

    def at(self, hold: Hold) -> Doubles:
        """float64[n, 3, 3]: the deformation gradient at bound points."""
        corners = self.before.triangles[hold.triangle]
        return np.einsum("nk,nkij->nij", hold.shares, self.linear[corners])

    def carried(self, hold: Hold, linear: Doubles | None = None) -> Doubles:
        """float64[n, 3]: positions of bound points on the target head.

        Args:
            hold: the binding of the points.
            linear: float64[n, 3, 3], the result of `at` for the same points; None: computed here.
        """
        linear = self.at(hold) if linear is None else linear
        there = self.after.at(hold.triangle, hold.shares)
        return there + np.einsum("nij,nj->ni", linear, hold.away)

    def around(self, middle: Doubles, reach: float) -> Similar:
        """The similarity transform of the skin around a point.

        Args:
            middle: float64[3], the point.
            reach: standard deviation of the Gaussian weights of the vertices by their distance
                from the point, in the file's unit.
        """
        square = ((self.before.points - middle) ** 2).sum(axis=1)
        share = np.exp(-(square - square.min()) / (2 * reach**2))
        share /= share.sum()
        a, b = share @ self.before.points, share @ self.after.points
        linear = np.tensordot(share, self.linear, 1)
        size = float(np.cbrt(max(np.linalg.det(linear), 1e-30)))
        return Similar(size * self.turn, middle, b + linear @ (middle - a))


def similar(before: Doubles, after: Doubles, change: Change) -> Similar:
    """The least-squares similarity from `before` to `after`, with the rotation of the whole head.

    Args:
        before, after: float64[n, 3], positions on the source and the target head.
        change: gives the rotation.
    """
    a, b = before.mean(axis=0), after.mean(axis=0)
    square = max(float(((before - a) ** 2).sum()), 1e-300)
    size = float(((after - b) * ((before - a) @ change.turn.T)).sum()) / square
    return Similar((size if size > 0 else change.size) * change.turn, a, b)


def turn_of(before: Doubles, after: Doubles) -> tuple[Doubles, float]:
    """The rotation (float64[3, 3]) and the scale from the whole source head to the target head.

    If only the chin is longer, a small rotation already fits better, although the head is not
    rotated. So the fitted rotation is returned only if it removes more than half of the RMS
    difference of the vertex positions; otherwise the identity is returned.

    Args:
        before, after: float64[n, 3], vertex positions on the source and the target head.
    """
    turn, _ = rigid_fit(before, after)
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    square = max(float((a**2).sum()), 1e-300)
    left = []
    for rotation in (np.eye(3), turn):
        size = max(float((b * (a @ rotation.T)).sum()) / square, 0.0)
        left.append(float(((b - size * a @ rotation.T) ** 2).sum()))
    turn = turn if left[1] < _TURNED**2 * left[0] else np.eye(3)
    size = float((b * (a @ turn.T)).sum()) / square
    return turn, size if size > 0 else 1.0


def _flat(coordinates: Doubles) -> Doubles:
    """float64[n, 3]: texture coordinates with z = 0; empty if one of them is not finite."""
    rows = coordinates.reshape(-1, 2)
    if not np.isfinite(rows).all():
        return np.zeros((0, 3))
    return np.column_stack([rows, np.zeros(len(rows))])


def _sums(rows: Ints, values: Doubles, count: int) -> Doubles:
    """float64[count, ...]: row r is the sum of all values[i] with rows[i] = r."""
    flat = values.reshape(len(values), -1)
    out = np.empty((count, flat.shape[1]))
    for k in range(flat.shape[1]):
        out[:, k] = np.bincount(rows, weights=flat[:, k], minlength=count)
    return out.reshape(count, *values.shape[1:])
