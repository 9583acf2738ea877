# SPDX-License-Identifier: MIT
"""How the form of a skin changes from one head to another, at each vertex and beside it.

The local change of form (Sumner and Popovic, "Deformation Transfer for Triangle Meshes", 2004, as
a matrix at each vertex) is evened out over some centimetres: it says how long a lid or a lip is on
the other head, not how each wrinkle of it lies.
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

_EVENED = 0.24  # of the skin's spread, which is 8.4 cm of a head of 24: 2 cm
_CELL = 0.4  # of that: vertices so close are one to the others
_STEADY = 1e-6
_NORMAL = 0.25  # of the squares of edges: how much the normal counts, whose stretch nobody sees
_AT_ONCE = 1024
# The same place of the texture counts where it is not much farther than the nearest place: times,
# and of the reach; _SAME_TEXEL of the texture's width.
_LONGER, _BESIDE, _SAME_TEXEL = 2.0, 0.2, 2e-3
_NO_TEXTURE = 1e-6  # a texture as small as that is none
_TURNED = 0.5  # what a turn leaves of the difference at most, where the head is turned


@dataclass(frozen=True)
class Similar:
    """A scaled turn about a point, and where the point comes to: float64[3, 3], float64[3]."""

    linear: Doubles
    middle: Doubles
    becomes: Doubles

    @property
    def size(self) -> float:
        """What lengths are multiplied with."""
        return float(np.cbrt(max(np.linalg.det(self.linear), 0.0)))

    def __call__(self, points: Doubles) -> Doubles:
        """float64[n, 3] of float64[n, 3]."""
        return self.becomes + (points - self.middle) @ self.linear.T


@dataclass(frozen=True)
class Hold:
    """Points that a skin holds: the triangle nearest to each, and the place on it.

    Attributes:
        triangle: int64[n].
        shares: float64[n, 3], barycentric.
        away: float64[n, 3], from that place to the point.
    """

    triangle: Ints
    shares: Doubles
    away: Doubles


def surface_of(mesh: Mesh, points: Doubles) -> Surface:
    """The mesh with its vertices at other places.

    Args:
        mesh: has the polygons.
        points: float64[V, 3].
    """
    places = np.asarray(mesh.layout_positions, np.int64)
    return Surface(points, places[fan_triangles(mesh)])


class Change:
    """From a skin to the same skin on another head.

    Attributes:
        before, after: the skin of either head.
        turn: float64[3, 3], the rotation that the second head is turned by.
        linear: float64[V, 3, 3], the evened change of form at each vertex.
    """

    def __init__(self, mesh: Mesh, before: Doubles, after: Doubles) -> None:
        """Compares two heads.

        Args:
            mesh: has the polygons.
            before: float64[V, 3], on the one.
            after: float64[V, 3], on the other one.
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
        """Sums over the vertices around each, which count less the farther off they are."""
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
        """float64[n, m]: how much each of the others counts at each point."""
        square = (points**2).sum(axis=1)[:, None] + (others**2).sum(axis=1) - 2 * points @ others.T
        return np.exp(-np.maximum(square, 0.0) / (2 * self.reach**2))

    @cached_property
    def _closest(self) -> _native.ClosestPoints:
        return _native.ClosestPoints(self.before.points, self.before.triangles.astype(np.int32))

    @cached_property
    def _texture(self) -> _native.ClosestPoints | None:
        """The skin laid flat as its texture is; None: it has none."""
        rows, corners = self._flat
        if not len(rows) or np.ptp(rows, axis=0).max() < _NO_TEXTURE:
            return None
        return _native.ClosestPoints(rows, corners.astype(np.int32))

    def hold(self, points: Doubles, mesh: Mesh | None = None) -> Hold:
        """Where the skin of the first head holds points that lie near it.

        Lips and lids lie on each other, so the nearest place may be on the wrong one: places that
        look the same way go first, and the same place of the texture where it is near enough.

        Args:
            points: float64[n, 3].
            mesh: whose vertices the points are; None: they look no way.
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
        """int64[V], float64[V, 3]: the triangle that has a vertex' place of the texture, -1: none
        has, and the place in it."""
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
        """bool[n]: whether no skin of the first head lies before its own points.

        Args:
            points: float64[n, 3], of the skin.
            ways: float64[n, 3], directions of length 1.
            far: how far they look.
        """
        triangle, _, _ = self._closest.first_hit(points + 1e-3 * far * ways, ways, far)
        return np.asarray(triangle < 0)

    def at(self, hold: Hold) -> Doubles:
        """float64[n, 3, 3]: the change of form where points are held."""
        corners = self.before.triangles[hold.triangle]
        return np.einsum("nk,nkij->nij", hold.shares, self.linear[corners])

    def carried(self, hold: Hold, linear: Doubles | None = None) -> Doubles:
        """float64[n, 3]: where the skin of the second head brings the points.

        Args:
            hold: of the points.
            linear: float64[n, 3, 3] of them, as `at` gives it.
        """
        linear = self.at(hold) if linear is None else linear
        there = self.after.at(hold.triangle, hold.shares)
        return there + np.einsum("nij,nj->ni", linear, hold.away)

    def around(self, middle: Doubles, reach: float) -> Similar:
        """The similarity that fits the skin around a point best.

        Args:
            middle: float64[3].
            reach: vertices as far away count for e^-0.5.
        """
        square = ((self.before.points - middle) ** 2).sum(axis=1)
        share = np.exp(-(square - square.min()) / (2 * reach**2))
        share /= share.sum()
        a, b = share @ self.before.points, share @ self.after.points
        linear = np.tensordot(share, self.linear, 1)
        size = float(np.cbrt(max(np.linalg.det(linear), 1e-30)))
        return Similar(size * self.turn, middle, b + linear @ (middle - a))


def similar(before: Doubles, after: Doubles, change: Change) -> Similar:
    """The similarity that fits points best, with the turn of the whole head.

    Args:
        before, after: float64[n, 3].
        change: of the head.
    """
    a, b = before.mean(axis=0), after.mean(axis=0)
    square = max(float(((before - a) ** 2).sum()), 1e-300)
    size = float(((after - b) * ((before - a) @ change.turn.T)).sum()) / square
    return Similar((size if size > 0 else change.size) * change.turn, a, b)


def turn_of(before: Doubles, after: Doubles) -> tuple[Doubles, float]:
    """The rotation of a head that is turned, float64[3, 3], and how much larger it is.

    Heads of another form fit each other better after some small turn, as a longer chin counts: that
    is form. A turn is one only where it explains most of the difference.

    Args:
        before, after: float64[n, 3].
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
    """float64[n, 3] of texture coordinates float64[n, 2]; none where one is no number."""
    rows = coordinates.reshape(-1, 2)
    if not np.isfinite(rows).all():
        return np.zeros((0, 3))
    return np.column_stack([rows, np.zeros(len(rows))])


def _sums(rows: Ints, values: Doubles, count: int) -> Doubles:
    """float64[count, ...]: the sums of the values of each row."""
    flat = values.reshape(len(values), -1)
    out = np.empty((count, flat.shape[1]))
    for k in range(flat.shape[1]):
        out[:, k] = np.bincount(rows, weights=flat[:, k], minlength=count)
    return out.reshape(count, *values.shape[1:])
