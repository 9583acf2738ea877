# SPDX-License-Identifier: MIT
"""Corrects lid expressions, so that closed lids leave no gap and no lid cuts into the eye.

A lid turns about an axis through the eye's centre, parallel to the line between both eye corners.
The transferred motion is scaled so that the edges meet, and vertices inside the eye are lifted out.
The target is the head to which expressions are transferred.
"""

from __future__ import annotations

import numpy as np

from ..._native import ClosestPoints
from ...author.geometry.skeleton import Doubles, Ints
from ...base.easing import smooth_step
from ..surface import Surface
from .eyeballs import Eyeball
from .opening import FAR, Mask, Opening, find_opening, gap_rays, near_eye, visible_gap

_RADIUS_MM = 12.0  # radius of a human eye; the lengths in mm below are scaled to the actual eye
_BAND = 3.0  # mm from the edge: vertices up to here move with the edge
_FADE = 16.0  # mm from the edge: vertices beyond keep their place
_CORNER = 4.0  # mm beyond an eye corner: vertices beyond keep their place
_CLEAR = 0.3  # mm from the eye in the rest pose: farther vertices are on the outside of a lid
_SKIN = 0.5  # mm: largest height above the eye that a rim vertex has to keep
_PRESSED = 0.15  # mm by which closed edges overlap
_OVER = 0.4  # mm that smoothing may move an edge beyond the gap of its column
_BESIDE = 0.5  # mm beyond the edges in which a visible eye still counts as a gap
_THROUGH = 0.8  # mm that the edges of closed lids may overlap
_LOWER = 0.15  # fraction of the gap that the lower lid closes; the upper lid closes the rest
_VIEW = 80  # rays per axis of the grid of a view of closed lids
# Directions from which closed lids are viewed: degrees to the character's left and up, from front.
_VIEWS = ((0.0, 0.0), (-25.0, 0.0), (25.0, 0.0), (0.0, 20.0), (0.0, -20.0))
_ROUNDS = 8
_CUT = 0.02  # mm: smaller depths of closed lids in the eye are ignored
_ENOUGH = 0.04  # mm: largest visible gap of closed lids
_SOFT = np.array([1.0, 2.0, 3.0, 4.0, 3.0, 2.0, 1.0])  # smoothing weights of neighbouring columns
_HELD = 1.5  # radii from the eye's centre: corrections of lid vertices farther away fade out
_LOOKS = 64  # rays per axis of the grid that finds where the eye comes through the lids
_LIFTS = 4  # largest number of rounds that lift the triangles of lids out of the eye
_SCALES = (0.6, 2.5)  # least and largest factor of the transferred turn
_SPREAD = 6  # smoothing rounds that spread a lift to neighbouring vertices
_DIP = 1.0  # mm: deeper skin is not the part of a lid through which the eye comes
_MOVED = 0.1  # mm: smaller motions are ignored
_WIDE = np.radians(75.0)  # largest angle above or below the front of a lid vertex


class Eyelids:
    """The lids of one eye of a target in its rest pose.

    Attributes:
        ball: the eye.
        opening: the opening between the lids.
        upper, lower: int64[n], vertices of each lid.
    """

    def __init__(self, skin: Surface, ball: Eyeball, opening: Opening) -> None:
        """Find the lid vertices.

        Args:
            skin: the skin of the target in the rest pose.
            ball: the eye.
            opening: the opening between the lids in this skin.
        """
        self.ball, self.opening = ball, opening
        self.mm = ball.radius / _RADIUS_MM  # length of 1 mm of a human eye in the target's unit
        lids = near_eye(skin, ball)
        near, triangles = np.unique(lids.triangles, return_inverse=True)
        self._around = skin.points[near]  # lids, and all corners of triangles near the eye
        self._triangles: Ints = triangles.reshape(-1, 3)
        across, up, away = opening.frame.angles(skin.points[near])
        lid = (away < FAR * ball.radius) & (np.abs(up) < _WIDE) & (away > 0.8 * ball.radius)
        self.vertices = near[lid]
        self._lid = np.flatnonzero(lid)
        self.rest = skin.points[self.vertices]
        across, up, away = across[lid], up[lid], away[lid]
        self._above = up > opening.line(across)
        self.upper, self.lower = self.vertices[self._above], self.vertices[~self._above]
        self._height = away - ball.reach(opening.frame.rays(across, up))
        self._outside = self._height > _CLEAR * self.mm
        edge = np.where(self._above, opening.line(across, 1.0), opening.line(across, 0.0))
        off = np.where(self._above, up - edge, edge - up)
        self._from_edge = np.maximum(off, 0.0) * ball.radius * np.cos(across) / self.mm
        beyond = np.maximum(opening.across[0] - across, across - opening.across[-1])
        aside = smooth_step(np.maximum(beyond, 0) * ball.radius / self.mm / _CORNER)
        far = smooth_step((away / ball.radius - _HELD) / (FAR - 0.05 - _HELD))
        high = smooth_step(np.abs(up) / _WIDE * 3 - 2)
        self._held = (1 - aside) * (1 - far) * (1 - high)
        self._number()
        margin = np.radians(25.0)
        grid = np.meshgrid(
            np.linspace(opening.across[0] - margin / 3, opening.across[-1] + margin / 3, _LOOKS),
            np.linspace(opening.low.min() - margin, opening.high.max() + margin, _LOOKS),
            indexing="ij",
        )
        self._looks = opening.frame.rays(*grid).reshape(-1, 3)
        off = np.abs(grid[0].ravel()[:, None] - opening.across)
        self._look_columns: Ints = off.argmin(axis=1)  # the column closest to each ray
        ball.keep(self._looks)
        self._through = gap_rays(opening)
        ball.keep(self._through)

    def _number(self) -> None:
        """Store the edges and triangles of the lids as indices into `self.vertices`."""
        place = np.full(len(self._around), -1)
        place[self._lid] = np.arange(len(self._lid))
        self._own = place[self._triangles]  # -1: not a lid vertex
        whole: Ints = self._own[(self._own >= 0).all(axis=1)]
        sides = np.sort(whole[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        self._edges: Ints = np.unique(sides, axis=0)

    def _posed(self, points: Doubles) -> ClosestPoints:
        """The skin near the eye with the lid vertices at the given points."""
        posed = self._around.copy()
        posed[self._lid] = points
        return ClosestPoints(posed, np.ascontiguousarray(self._triangles, np.int32))

    def rim(self, reach: float) -> tuple[Ints, Doubles]:
        """Vertices of both lid edges that touch the eye in the rest pose, and their distances from
        the eye's surface (float64[n], in the target's unit; negative inside the eye).

        Args:
            reach: largest distance from the edges, in mm of a human eye.
        """
        own = (self._from_edge < reach) & (np.abs(self._height) < 0.08 * self.ball.radius)
        own &= self._held > 0
        return self.vertices[own], self._height[own]

    def apart(self, points: Doubles) -> float:
        """The mean distance between the upper and the lower edge, divided by the upper edge's
        width; 0 if an edge has no vertices.

        Args:
            points: float64[V, 3], vertex positions of the target in any pose or shape.
        """
        across = self.opening.frame.angles(self.rest)[0]
        edge = (self._from_edge < _BAND / 3) & (self._held > 0)
        upper, lower = np.flatnonzero(edge & self._above), np.flatnonzero(edge & ~self._above)
        if not len(upper) or not len(lower):
            return 0.0
        facing = lower[np.abs(across[upper, None] - across[lower]).argmin(axis=1)]
        off = points[self.vertices[upper]] - points[self.vertices[facing]]
        ends = upper[[across[upper].argmin(), across[upper].argmax()]]
        wide = np.linalg.norm(np.diff(points[self.vertices[ends]], axis=0))
        return float(np.linalg.norm(off, axis=1).mean() / max(float(wide), 1e-12))

    def moves(self, displacement: Doubles) -> bool:
        """Whether an expression moves these lids.

        Args:
            displacement: float64[V, 3], displacements of all vertices of the target.
        """
        near = self.vertices[self._from_edge < _FADE / 2]
        far = np.linalg.norm(displacement[near], axis=1).max(initial=0.0)
        return bool(far > _MOVED * self.mm)

    def gap(self, displacement: Doubles, turn: Doubles | None = None) -> float:
        """The largest vertical extent of the visible part of the eye, in the target's unit.

        Args:
            displacement: float64[V, 3], displacements of all vertices of the target.
            turn: float64[3, 3], the eye's rotation from its rest pose; None: not rotated.
        """
        return self._gap(self.rest + displacement[self.vertices], turn)

    def cut(self, displacement: Doubles, turn: Doubles | None = None) -> float:
        """The largest depth to which a lid's outer surface enters the eye, in the target's unit.

        Args:
            displacement: float64[V, 3], displacements of all vertices of the target.
            turn: float64[3, 3], the eye's rotation from its rest pose; None: not rotated.
        """
        points = self.rest + displacement[self.vertices]
        return float(self._lacks(points, turn, 0.0).max(initial=0.0))

    def closed(self, displacement: Doubles, turn: Doubles | None = None) -> Doubles:
        """float64[V, 3]: the displacements of a blink, corrected so that the lid edges meet and no
        lid cuts into the eye.

        Args:
            displacement: float64[V, 3], displacements of all vertices of the target.
            turn: float64[3, 3], the eye's rotation from its rest pose; None: not rotated.
        """
        rest_up = self.opening.frame.angles(self.rest)[1]
        points = self.rest + displacement[self.vertices]
        # A cornea that comes through a lid is no gap between the edges, so the lids are lifted
        # before the edges are turned towards each other.
        if self._lacks(points, turn, 0.0).max(initial=0.0) > _CUT * self.mm:
            points = self._lifted(points, turn)
        best, least = points, max(self._gap(points, turn), _ENOUGH * self.mm)
        for number in range(_ROUNDS):
            apart, bare = self._apart(points, turn)
            if not apart.any():
                break
            points = self._approached(points, turn, apart, rest_up if number == 0 else None)
            points = self._lifted(points, turn, bare)
            wrong = self._gap(points, turn)
            if wrong < least:
                best, least = points, wrong
            if number and wrong < _ENOUGH * self.mm:
                break
        out = displacement.copy()
        out[self.vertices] = self._level(best, turn) - self.rest
        return out

    def _approached(
        self, points: Doubles, turn: Doubles | None, apart: Doubles, rest_up: Doubles | None
    ) -> Doubles:
        """The points with the edges of both lids turned towards each other.

        Args:
            points: float64[n, 3], the lid vertices in a pose.
            turn: float64[3, 3], the eye's rotation from its rest pose; None: not rotated.
            apart: the result of _apart.
            rest_up: float64[n], each lid vertex's angle up in the rest pose, in radians; with it
                the upper lid's rotation since the rest pose is multiplied by a factor first. None:
                every lid vertex rotates by a fraction of its edge's rotation, the result of _fade.
        """
        frame = self.opening.frame
        across, up, away = frame.angles(points)
        turned = np.interp(across, self.opening.across, apart)
        turned *= self._fade(float(np.abs(apart).max()))
        lowered = (1 - _LOWER) * turned
        if rest_up is not None:
            lowered = self._scaled(across, up - rest_up, points, turn, (1 - _LOWER) * apart)
        new = up + np.where(self._above, -lowered, _LOWER * turned)
        return np.asarray(frame.middle + away[:, None] * frame.rays(across, new))

    def _level(self, points: Doubles, turn: Doubles | None) -> Doubles:
        """Closed lids with both edges at the same distance from the eye's centre, so that no gap
        is visible from the side or from above; `points` unchanged if this does not help."""
        seen = self._viewed(points)
        if not seen:
            return points
        high, low = (self._edge_line(points, turn, upper=upper)[1] for upper in (True, False))
        step = low - high
        known = ~np.isnan(step)
        if not known.any():
            return points
        columns = np.arange(len(step))
        step = _even(np.interp(columns, columns[known], step[known]))
        across, up, away = self.opening.frame.angles(points)
        fade = self._fade(0.0) * np.interp(across, self.opening.across, step)
        away = away + np.where(self._above, (1 - _LOWER) * fade, -_LOWER * fade)
        rays = self.opening.frame.rays(across, up)
        leveled = self._lifted(self.opening.frame.middle + away[:, None] * rays, turn)
        closed = self._gap(leveled, turn) <= _ENOUGH * self.mm
        return leveled if closed and self._viewed(leveled) < seen else points

    def _viewed(self, points: Doubles) -> int:
        """The number of parallel rays that pass the lids and reach the eyeball (as a sphere), from
        the front, both sides, above and below."""
        frame, radius, tree, seen = self.opening.frame, self.ball.radius, self._posed(points), 0
        at = radius * np.linspace(-1, 1, _VIEW)
        x, y = (grid.ravel()[:, None] for grid in np.meshgrid(at, at))
        on = ((x**2 + y**2) < (0.95 * radius) ** 2).ravel()
        for aside, above in _VIEWS:
            way = frame.rays(np.radians(aside), np.radians(above))
            side = np.cross(frame.up, way)
            side /= np.linalg.norm(side)
            begin = (frame.middle + x * side + y * np.cross(way, side) + 3 * radius * way)[on]
            rays = np.broadcast_to(-way, begin.shape)
            lid, _, distance = tree.first_hit(begin, rays)
            away = np.sqrt(radius**2 - (x**2 + y**2)[on, 0])  # height of the ball's front
            seen += int(((lid < 0) | (distance > 3 * radius - away)).sum())
        return seen

    def lifted(self, displacement: Doubles, turn: Doubles | None = None) -> Doubles:
        """float64[V, 3]: the displacements of an expression with the lids lifted out of the eye.

        Args:
            displacement: float64[V, 3], displacements of all vertices of the target.
            turn: float64[3, 3], the eye's rotation from its rest pose; None: not rotated.
        """
        points = self._lifted(self.rest + displacement[self.vertices], turn)
        out = displacement.copy()
        out[self.vertices] = points - self.rest
        return out

    def _gap(self, points: Doubles, turn: Doubles | None) -> float:
        return float(self._seen(points, turn).max(initial=0.0))

    def _seen(self, points: Doubles, turn: Doubles | None) -> Doubles:
        """float64[columns]: vertical extent of the visible part of the eye in each column of the
        opening, in the target's unit."""
        low, high = self._edge(points, turn, upper=False), self._edge(points, turn)
        beside = _BESIDE * self.mm / self.ball.radius
        edges = np.minimum(low, high) - beside, np.maximum(low, high) + beside
        return visible_gap(self._posed(points), self.ball, self.opening, self._through, edges, turn)

    def _apart(self, points: Doubles, turn: Doubles | None) -> tuple[Doubles, Mask]:
        """float64[columns]: for each column of the opening, the angle in radians by which the edges
        have to approach each other; negative if they overlap by more than closed lids may; zeros if
        an edge was found in no column. bool[columns]: whether the eye is visible although the edges
        meet, because it comes through a lid."""
        low, high = self._edge(points, turn, upper=False), self._edge(points, turn)
        unit = self.mm / self.ball.radius
        apart = high - low
        known = ~np.isnan(apart)
        if not known.any():
            return np.zeros(len(apart)), known
        columns = np.arange(len(apart))
        apart = np.interp(columns, columns[known], apart[known])
        # In columns in which the eye is still visible, the edges approach by an additional overlap.
        seen = self._seen(points, turn) / self.ball.radius
        lacks = np.where(seen > 0, np.maximum(apart, seen) + _PRESSED * unit, 0.0)
        through = np.minimum(apart + _THROUGH * unit, 0.0)
        most = self.opening.high - self.opening.low  # limits the motion near the eye corners
        even = np.minimum(_even(lacks), np.maximum(apart, 0.0) + _OVER * unit)
        return np.clip(even + _even(through), -most, most), (seen > 0) & (apart < 0)

    def _fade(self, most: float) -> Doubles:
        """float64[n], 0 to 1: the fraction of the edge's rotation by which each lid vertex rotates.

        most: the largest angle of an edge in radians; it widens the fade.
        """
        reach = max(_FADE, 2.5 * most * self.ball.radius / self.mm)
        along = (self._from_edge - _BAND) / (reach - _BAND)
        return np.asarray((1 - smooth_step(along)) * self._held)

    def _scaled(
        self,
        across: Doubles,
        turned: Doubles,
        points: Doubles,
        turn: Doubles | None,
        wanted: Doubles,
    ) -> Doubles:
        """float64[n]: the angles, in radians, by which the lid vertices rotate down so that the
        edge of the upper lid rotates down by `wanted`.

        First, the lid's rotation by the expression is multiplied by a factor. The factor has
        limits, so an angle may remain; each vertex then rotates by a fraction of this angle, the
        result of _fade.

        Args:
            across: float64[n], angle across of each lid vertex, in radians.
            turned: float64[n], rotation of each vertex up since the rest pose, in radians.
            points: float64[n, 3], the lid vertices in the pose.
            turn: float64[3, 3], the eye's rotation from its rest pose; None: not rotated.
            wanted: float64[columns], angle by which the edge must rotate down, in radians.
        """
        columns = self.opening.across
        high = self._edge(points, turn)
        own = np.nan_to_num(self.opening.high - high)  # downward turn of the edge
        least = np.radians(2.0)
        scale = np.where(own > least, 1 + wanted / np.maximum(own, least), 1.0)
        scale = np.clip(scale, *_SCALES)
        rest = wanted - (scale - 1) * np.where(own > least, own, 0.0)
        whole = (np.interp(across, columns, scale) - 1) * self._held
        fade = self._fade(float(np.abs(rest).max()))
        return np.asarray(-turned * whole + np.interp(across, columns, rest) * fade)

    def _edge(self, points: Doubles, turn: Doubles | None, *, upper: bool = True) -> Doubles:
        return self._edge_line(points, turn, upper=upper)[0]

    def _edge_line(
        self, points: Doubles, turn: Doubles | None, *, upper: bool
    ) -> tuple[Doubles, Doubles]:
        """float64[columns] each: angle up of a lid's edge, and distance of the edge from the eye's
        centre, in each column of the opening. The edge is the lowest point of the upper lid, or the
        highest point of the lower lid, among points outside the eye; NaN if there is none.
        """
        across, up, away = self.opening.frame.angles(points)
        own = self._above == upper
        a, b = self._edges[own[self._edges].all(axis=1)].T
        near = (self._from_edge[a] < 2 * _BAND) | (self._from_edge[b] < 2 * _BAND)
        a, b = a[near], b[near]
        columns = self.opening.across
        out, far = np.full((2, len(columns)), np.nan)
        clear = away - self.ball.reach(self.opening.frame.rays(across, up), turn)
        edge, column = _crossings(columns, across[a], across[b])
        a, b = a[edge], b[edge]
        s = (columns[column] - across[a]) / (across[b] - across[a])
        over = (1 - s) * clear[a] + s * clear[b] > -0.02 * self.mm
        a, b, s, column = a[over], b[over], s[over], column[over]
        places = (1 - s) * up[a] + s * up[b]
        order = np.lexsort((places if upper else -places, column))
        best = order[np.diff(column[order], prepend=-1) > 0]  # the first of each column
        out[column[best]] = places[best]
        far[column[best]] = ((1 - s) * away[a] + s * away[b])[best]
        return out, far

    def _lacks(
        self, points: Doubles, turn: Doubles | None, above: float, bare: Mask | None = None
    ) -> Doubles:
        """float64[n]: distance by which each lid vertex must move outwards, so that all of its
        triangles are at least the distance `above` from the eye's surface; 0 if they already are.
        Only triangles that are outside the eye in the rest pose count, and in the columns `bare`
        (see _apart) also triangles just below its surface."""
        frame, ball, lacks = self.opening.frame, self.ball, np.zeros(len(points))
        tree = self._posed(points)
        rays = self._looks
        begin = FAR * ball.radius
        triangle, _, distance = tree.first_hit(frame.middle + begin * rays, -rays)
        triangle, height = np.asarray(triangle), begin - np.asarray(distance)
        corners = self._own[np.maximum(triangle, 0)]
        clear = (corners >= 0).all(axis=1)
        outside = self._outside[corners].all(axis=1)
        lack = ball.reach(rays, turn) + above - height
        if bare is not None and bare.any():
            outside |= bare[self._look_columns] & (lack < _DIP * self.mm)
        hit = (triangle >= 0) & clear & outside & (height > 0.7 * ball.radius)
        lack = lack[hit]
        for k in range(3):
            np.maximum.at(lacks, corners[hit, k], lack)
        return lacks

    def _lifted(self, points: Doubles, turn: Doubles | None, bare: Mask | None = None) -> Doubles:
        """float64[n, 3]: the points of the lids, lifted out of the eye. Points that are too near to
        the eye's surface, or below it, are moved away from the eye's centre.

        Points near these points are lifted too, with a smooth fall-off.

        Args:
            points: float64[n, 3], the vertices of the lids in a pose.
            turn: float64[3, 3], the eye's rotation from its rest pose; None: not rotated.
            bare: bool[columns], see _apart; None: no column.
        """
        arm = points - self.opening.frame.middle
        length = np.linalg.norm(arm, axis=1)
        ray = arm / np.maximum(length, 1e-12)[:, None]
        # The rim of a moved lid is lifted to the distance from the eye's surface that it has in the
        # rest pose, but to no more than _SKIN mm.
        moved = np.linalg.norm(points - self.rest, axis=1) > _MOVED * self.mm
        rim = (self._from_edge < _BAND) & (moved | (turn is not None))
        need = np.maximum(self.ball.reach(ray, turn) + np.minimum(self._height, _SKIN * self.mm)
                          - length, 0.0)  # fmt: skip
        need = np.where(rim, need, 0.0)
        lift = self._spread(need)
        for _ in range(_LIFTS):
            lacks = self._lacks(points + lift[:, None] * ray, turn, 0.5 * _CLEAR * self.mm, bare)
            if not lacks.any():
                break
            need = lift + lacks
            lift = self._spread(need)
        return np.asarray(points + lift[:, None] * ray)

    def _spread(self, need: Doubles) -> Doubles:
        """float64[n]: heights by which the lid vertices are lifted. A vertex is lifted by at least
        its height in `need`; vertices near it are lifted too, with a smooth fall-off."""
        lift = need.copy()
        a, b = self._edges.T
        count = np.bincount(a, minlength=len(lift)) + np.bincount(b, minlength=len(lift))
        for _ in range(_SPREAD):
            total = np.bincount(a, lift[b], len(lift)) + np.bincount(b, lift[a], len(lift))
            lift = np.maximum(need, total / np.maximum(count, 1))
        return lift


def _crossings(columns: Doubles, begins: Doubles, ends: Doubles) -> tuple[Ints, Ints]:
    """int64[n] each: edges and columns that cross.

    Args:
        columns: float64[k], angle across of each column in radians, ascending.
        begins, ends: float64[E], angles across of both ends of each edge in radians.
    """
    low, high = np.minimum(begins, ends), np.maximum(begins, ends)
    first = np.searchsorted(columns, low, "left")
    number = np.searchsorted(columns, high, "right") - first
    number[high == low] = 0
    edge = np.repeat(np.arange(len(number)), number)
    step = np.arange(len(edge)) - np.repeat(np.cumsum(number) - number, number)
    return edge, first[edge] + step


def _even(values: Doubles) -> Doubles:
    """Values smoothed over neighbouring columns, so that edges of coarse lids have no notches."""
    wide = np.pad(values, len(_SOFT) // 2, mode="edge")
    return np.convolve(wide, _SOFT / _SOFT.sum(), mode="valid")


def find_eyelids(skin: Surface, ball: Eyeball) -> Eyelids | None:
    """The lids of an eye; None if skin covers the eye, or if there are no lids.

    Args:
        skin: the skin of the target in the rest pose.
        ball: the eye.
    """
    opening = find_opening(near_eye(skin, ball), ball)
    return Eyelids(skin, ball, opening) if opening is not None else None
