# SPDX-License-Identifier: MIT
"""Measures skin that cuts into teeth and gums and moves it out; counts stretched polygons.

The target is the head to which expressions were transferred.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..._native import ClosestPoints, SkinChecker, SkinFaults
from ...author.geometry.skeleton import Doubles, Ints
from ..fittings.fitted import Bodies
from ..surface import Surface
from .report import MM

_NEAR = 0.8  # cm around the box of the teeth: skin in it is checked
_DEEP = 0.01  # cm: smaller depths are ignored
_AGAINST = 0.3  # least cosine between the inward normal and the direction to a point inside
_INSIDE = 0.4  # cm: a deeper point counts as behind the teeth, not inside
_STRETCH = 2.5  # area / area in the rest pose above which a polygon is stretched, as in SkinChecker
LEAST = 0.5  # mm3: a smaller volume is not repaired
_AWAY = 1e4  # cm: shift of solids so that they touch no skin
_ROUNDS = 4
_MOVED = 1e-4  # cm: smaller motions are ignored
_AROUND = 15.0  # cm: length of the rays that test visibility
_WAYS = 3  # number of the 15 tested directions from which a visible vertex must be seen
_SHORT = 0.2  # cm: the visible region does not grow over longer edges
_RIM = 2  # rings of neighbours that are added to the visible vertices
_LARGE = 60_000  # vertices: larger skins are only pushed along normals, without SkinChecker
Mask = npt.NDArray[np.bool_]


class Contacts:
    """Contacts of the skin of a target with its teeth and gums."""

    def __init__(self, skin: Surface, faces: Sequence[Sequence[int]], bodies: Bodies) -> None:
        """Measure the contacts in the rest pose.

        Args:
            skin: the skin in the rest pose.
            faces: polygons of the skin.
            bodies: teeth and gums.
        """
        self.skin, self.bodies = skin, bodies
        sizes = np.fromiter(map(len, faces), np.int64, len(faces))
        self._offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.uint32)
        corners = itertools.chain.from_iterable(faces)
        self._corners = np.fromiter(corners, np.int64, int(sizes.sum()))
        of_triangle = np.repeat(np.arange(len(faces)), np.maximum(sizes - 2, 0))
        self._face_of = of_triangle if len(of_triangle) == len(skin.triangles) else None
        self._area = self._areas(skin.points, np.arange(len(skin.triangles)))
        self._checker: SkinChecker | None = None
        self._rest: SkinFaults | None = None
        self._edges: Ints | None = None
        self._near = self._near_teeth()
        self._rest_depth = self._depth(skin.points[self._near], bodies.rest)
        area = np.zeros(len(skin.points))
        of_triangle = np.linalg.norm(skin.face_normals(), axis=1) / 6
        for k in range(3):
            area += np.bincount(skin.triangles[:, k], of_triangle, len(area))
        self._share = area[self._near]  # cm2: area of each vertex

    def stretched(self, displacement: Doubles) -> int:
        """The number of polygons with more than 2.5 times their area in the rest pose.

        Args:
            displacement: float64[V, 3], displacements of the skin vertices.
        """
        moved = np.abs(displacement).max(axis=1) > _MOVED
        own = np.flatnonzero(moved[self.skin.triangles].any(axis=1))
        if self._face_of is not None:  # include all triangles of each moved polygon
            polygons = np.zeros(len(self._area), bool)
            polygons[self._face_of[own]] = True
            own = np.flatnonzero(polygons[self._face_of])
        areas = self._areas(self.skin.points + displacement, own)
        return int((areas > _STRETCH * np.maximum(self._area, 1e-12)).sum())

    def volume(self, displacement: Doubles, controls: tuple[str, ...]) -> float:
        """Volume in mm3 (depth times area) of skin deeper in teeth and gums than in the rest pose.

        Args:
            displacement: float64[V, 3], displacements of the skin vertices.
            controls: names of the raw controls with value 1.
        """
        if not len(self._near):
            return 0.0
        own = displacement[self._near]
        posed = self.bodies.posed(controls)
        if posed is self.bodies.rest and np.abs(own).max(initial=0.0) < _DEEP:
            return 0.0
        depth = self._depth(self.skin.points[self._near] + own, posed)
        beyond = np.maximum(depth - self._rest_depth - _DEEP, 0.0)
        return float(beyond @ self._share) * MM**3

    def volume_by_checker(self, displacement: Doubles, controls: tuple[str, ...]) -> float:
        """The same volume in mm3 as the result of `volume`, measured by SkinChecker, which is
        slower. Contacts of the skin with itself do not count.

        Args:
            displacement: float64[V, 3], displacements of the skin vertices.
            controls: names of the raw controls with value 1.
        """
        points, checker = self.skin.points + displacement, self._made()
        faults = checker.look(points, self.bodies.posed(controls))
        return float(checker.sum(faults, self._allowed(points)).volume)

    def pushed(self, displacement: Doubles, controls: tuple[str, ...]) -> Doubles:
        """float64[V, 3]: displacements of an expression with the skin moved out of teeth and gums.

        Args:
            displacement: float64[V, 3], displacements of the skin vertices.
            controls: names of the raw controls with value 1.
        """
        posed = self.bodies.posed(controls)
        if len(self.skin.points) > _LARGE:
            return self._lifted(displacement, posed)
        points = self.skin.points + displacement
        moved, _, _ = self._made().repair(points, posed, self._allowed(points), [])
        out = displacement + np.asarray(moved)
        return self._lifted(out, posed) if self.volume(out, controls) > LEAST else out

    def _lifted(self, displacement: Doubles, posed: list[Doubles]) -> Doubles:
        """float64[V, 3]: displacements with skin pushed out of teeth along the teeth's normals,
        and a smooth fall-off around the pushed skin."""
        if self._edges is None:
            self._edges = self._edges_near_teeth()
        out = displacement.copy()
        points = self.skin.points[self._near] + displacement[self._near]
        for _ in range(_ROUNDS):
            depth, normal = self._depths(points, posed)
            lack = np.maximum(depth - self._rest_depth, 0.0)
            if lack.max(initial=0.0) < _DEEP:
                break
            moved = _spread(lack[:, None] * normal, self._edges)
            points = points + moved
            out[self._near] += moved
        return out

    def _edges_near_teeth(self) -> Ints:
        """int64[E, 2]: edges between vertices near teeth and gums. The numbers are indices into
        self._near, the list of these vertices."""
        place = np.full(len(self.skin.points), -1)
        place[self._near] = np.arange(len(self._near))
        edges = place[self.skin.edges()]
        return np.asarray(edges[(edges >= 0).all(axis=1)])

    def _made(self) -> SkinChecker:
        if self._checker is None:
            solids = [
                (np.ascontiguousarray(triangles, np.uint32), len(points))
                for triangles, points in zip(self.bodies.triangles, self.bodies.rest, strict=True)
            ]
            self._checker = SkinChecker(
                self.skin.points, self._offsets, self._corners.astype(np.uint32), solids, MM
            )
            self._rest = self._checker.look(self.skin.points, self.bodies.rest)
        return self._checker

    def _allowed(self, points: Doubles) -> SkinFaults:
        """The faults that do not count: depths in the rest pose, and contacts of the skin with
        itself in this pose, because lips press on each other."""
        checker = self._made()
        assert self._rest is not None
        away = [solid + _AWAY for solid in self.bodies.rest]
        itself = checker.look(points, away)
        depth = np.maximum(np.asarray(self._rest.depth), np.asarray(itself.depth))
        return SkinFaults(depth, itself.stretch, itself.fold)

    def _areas(self, points: Doubles, own: Ints) -> Doubles:
        """float64[polygons]: twice the area of each polygon. Only triangles with an index in `own`
        are added up."""
        a, b, c = (points[self.skin.triangles[own, k]] for k in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        if self._face_of is None:
            out = np.zeros(len(self.skin.triangles))
            out[own] = area
            return out
        count = int(self._face_of.max(initial=-1)) + 1
        return np.asarray(np.bincount(self._face_of[own], area, minlength=count))

    def _near_teeth(self) -> Ints:
        """int64[n]: vertices near teeth and gums that are visible from the front. The inside of a
        cheek is hidden, so its contacts do not matter."""
        if not self.bodies.rest:
            return np.zeros(0, np.int64)
        points = np.concatenate(self.bodies.rest)
        low, high = points.min(axis=0) - _NEAR, points.max(axis=0) + _NEAR
        inside = ((self.skin.points > low) & (self.skin.points < high)).all(axis=1)
        near = np.flatnonzero(inside)
        return near[self._seen(near)] if len(near) else near

    def _seen(self, vertices: Ints) -> Mask:
        """bool[n]: whether a vertex is visible from at least 3 of 15 directions in front of the
        face, or at most two edges shorter than 0.2 cm away from such a vertex."""
        points, normals = self.skin.points, self.skin.normals()[vertices]
        triangles = np.ascontiguousarray(self.skin.triangles, np.int32)
        tree = ClosestPoints(points, triangles)
        times = np.zeros(len(points), np.int64)
        for x, y in itertools.product((-1.0, -0.4, 0.0, 0.4, 1.0), (-0.7, 0.0, 0.7)):
            way = np.array([x, y, 1.0]) / np.linalg.norm([x, y, 1.0])
            faces = normals @ way > 0.05
            begin = points[vertices[faces]] + 0.01 * normals[faces]
            hit, _, _ = tree.first_hit(begin, np.broadcast_to(way, begin.shape), farthest=_AROUND)
            times[vertices[faces]] += hit < 0
        seen = times >= _WAYS  # fewer rays may pass a slit between the lips
        edges = self.skin.edges()
        ends = points[edges[:, 0]] - points[edges[:, 1]]
        edges = edges[np.linalg.norm(ends, axis=1) < _SHORT]
        for _ in range(_RIM):
            beside = edges[seen[edges].any(axis=1)]
            seen[beside] = True
        return np.asarray(seen[vertices])

    def _depth(self, points: Doubles, posed: list[Doubles]) -> Doubles:
        return self._depths(points, posed)[0]

    def _depths(self, points: Doubles, posed: list[Doubles]) -> tuple[Doubles, Doubles]:
        """float64[n]: depths of points inside teeth and gums, 0 outside; float64[n, 3]: unit
        directions from the points to the outside, 0 for a point outside.

        Args:
            points: float64[n, 3], the points.
            posed: the result of Bodies.posed, the vertices of teeth and gums in the pose.
        """
        deepest, out = np.zeros(len(points)), np.zeros((len(points), 3))
        if not len(points):
            return deepest, out
        for solid, triangles in zip(posed, self.bodies.triangles, strict=True):
            tree = ClosestPoints(solid, np.ascontiguousarray(triangles, np.int32))
            found, shares, distance = tree.nearest(points, farthest=_INSIDE)
            near = np.flatnonzero(found >= 0)
            triangle, shares, distance = found[near].astype(np.int64), shares[near], distance[near]
            surface = Surface(solid, triangles)
            normals = surface.normals()[triangles[triangle]]
            normal = np.einsum("nk,nkd->nd", shares, normals)
            normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
            arm = points[near] - surface.at(triangle, shares)
            # Excludes points next to the open border of gums, because these points are not inside.
            inside = (arm * normal).sum(axis=1) < -_AGAINST * distance
            inside &= distance < _INSIDE
            deeper: Mask = inside & (distance > deepest[near])
            deepest[near[deeper]], out[near[deeper]] = distance[deeper], normal[deeper]
        return deepest, out


def _spread(push: Doubles, edges: Ints) -> Doubles:
    """float64[V, 3]: the displacements `push`, with a smooth fall-off to neighbouring vertices."""
    a, b = edges.T
    count = np.maximum(np.bincount(a, minlength=len(push)) + np.bincount(b, minlength=len(push)), 1)
    need, out = np.linalg.norm(push, axis=1), push.copy()
    for _ in range(5):
        total = np.stack(
            [
                np.bincount(a, out[b, k], len(push)) + np.bincount(b, out[a, k], len(push))
                for k in range(3)
            ],
            axis=1,
        )
        out = np.where(need[:, None] > 0, push, total / count[:, None])
    return out
