# SPDX-License-Identifier: MIT
"""Closes the lips in poses that close the mouth, so that they meet and do not cut each other.

At a point of contact, positions do not distinguish the upper from the lower lip, but the motion by
jawOpen does. So the lips of a mesh of any topology are found by its expressions. The target is the
head to which expressions were transferred.
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..._native import ClosestPoints
from ...author.geometry.skeleton import Doubles, Ints
from ...base.easing import smooth_step
from ..surface import Surface

_ROUND = ("mouthLipsPurse", "mouthFunnel", "mouthPucker")  # prefixes of controls that move the lips
# A vertex is a lip vertex if the controls of _ROUND together move it by more than this fraction of
# the largest motion of a vertex.
_LIP = 0.25
# Largest motion of an upper lip vertex and least motion of a lower lip vertex by jawOpen, as
# fractions of the motion that 90 % of the lip vertices do not exceed.
_STILL, _TAKEN = 0.35, 0.6
COLUMNS = 40  # sections of the mouth from corner to corner
_WIDTH_MM = 50.0  # width of a human mouth; lengths in mm below are scaled to the actual mouth
_RIM = 1.2  # mm beyond the nearest vertex of a column that still belong to the rim
_FADE = 14.0  # mm from the rim along the skin: vertices beyond keep their place
_BAND = 2.5  # mm from the rim along the skin: vertices up to here move with the rim
# Fraction of the mouth's width: distance of the outermost columns from the corners of the mouth,
# because the lips may be joined at the corners.
_CORNER = 0.08
_TOUCH = 0.8  # mm: lips touch in the rest pose if their gap is below half of it
_SPACING = 0.7  # mm between samples: less than the width of a column
_GOAL = 0.05  # mm: gap between closed lips
_DEEP = 0.1  # mm that lips may press into each other, or their depth in the rest pose if larger
_ROUNDS = 12
_UPPER_MM, _LEAST_SHARE = 2.0, 0.15  # mm that the upper lip moves, and its least share of the gap
_FAR_MM = 6.0  # mm: wider gaps are not closed
_OVER = 0.3  # mm that smoothing may move a column beyond its gap
_SOFTER = 2.0  # length of the fade / widest gap; the fade is at least _FADE mm long
_SMOOTH = 24  # limit of the smoothing rounds over columns
_AGAINST = 0.3  # least cosine between the inward normal and the direction to a point inside
_NEAR = 3.0  # mm: a point that is deeper counts as outside


@dataclass(frozen=True)
class Meeting:
    """The gap between the lips in a pose, for each of COLUMNS (40) columns, from the right to the
    left corner of the mouth.

    Attributes:
        gap: float64[COLUMNS], in the target's unit, negative if the lips intersect; all NaN if no
            column has lips.
        way: float64[COLUMNS, 3], unit directions from the lower to the upper lip.
    """

    gap: Doubles
    way: Doubles


class Lips:
    """The lips of a target, found in the rest pose, and their gap in poses."""

    def __init__(
        self,
        skin: Surface,
        expressions: Mapping[str, Doubles],
        corners: Doubles | None = None,
    ) -> None:
        """Find the lips; `found` is False if the face has no lips that part.

        Args:
            skin: the skin of the target in the rest pose.
            expressions: float64[V, 3] by raw control, displacements of the skin, with jawOpen.
            corners: float64[2, 3], the right and the left corner of the mouth; None: the ends of
                the line in which the lips touch in the rest pose.
        """
        self.skin = skin
        self.found = False
        upper, lower = _labels(expressions, len(skin.points))
        if min(len(upper), len(lower)) < 6:
            return
        self._upper, self._lower = _of(skin, upper), _of(skin, lower)
        if not len(self._upper) or not len(self._lower):
            return
        both = skin.points[np.concatenate([upper, lower])]
        ends = both[[both[:, 0].argmin(), both[:, 0].argmax()]] if corners is None else corners
        self._place(ends, both)
        if corners is None:
            touching = self._touching()
            if touching is None:
                return
            self._place(touching, both)
        rims = [
            self._rim(a, b) for a, b in ((self._upper, self._lower), (self._lower, self._upper))
        ]
        if not all(len(rim) for rim in rims):
            return
        self.found = True
        self.rest = self.meeting(skin.points)
        self._rims = rims

    def _place(self, ends: Doubles, lips: Doubles) -> None:
        """Divide the mouth between two corners into columns."""
        width = float(np.linalg.norm(ends[1] - ends[0]))
        self.mm = width / _WIDTH_MM
        middle = ends.mean(axis=0)
        near = np.abs(lips[:, 0] - middle[0]) < 0.1 * width
        front = lips[near, 2].max() if near.any() else lips[:, 2].max()
        self._axis = np.array([middle[0], middle[1], front - 0.7 * width])
        first, last = np.sort(self._around(ends))
        inset = _CORNER * (last - first)
        self._edges = np.linspace(first + inset, last - inset, COLUMNS + 1)
        columns = (self._edges[1:] + self._edges[:-1]) / 2
        self._places = np.array([first, *columns, last])  # corrections are 0 at the corners
        self._grids = [
            _grid(self.skin.points, own, _SPACING * self.mm) for own in (self._upper, self._lower)
        ]

    def _touching(self) -> Doubles | None:
        """float64[2, 3]: both ends of the line in which the lips touch in the rest pose; None if
        they do not touch."""
        # `least` is halved, because `mm` derives from the first estimate of the mouth's width,
        # which is about twice too large.
        half, least = COLUMNS // 2, _TOUCH * self.mm / 2
        for _ in range(3):  # each round narrows the columns
            gap = self.meeting(self.skin.points).gap
            touch = np.nan_to_num(gap, nan=np.inf) < least
            if not touch[half - 2 : half + 2].any():
                return None
            apart = np.flatnonzero(~touch)
            first = int(apart[apart < half].max(initial=-1)) + 1
            last = int(apart[apart >= half].min(initial=COLUMNS)) - 1
            angles = self._edges[[first, last + 1]]
            points = self.skin.points[np.unique(self._upper)]
            around = self._around(points)
            ends = np.array([points[np.abs(around - angle).argmin()] for angle in angles])
            self._place(ends, points)
        return ends

    def meeting(self, points: Doubles) -> Meeting:
        """Measure the gap between the lips.

        Args:
            points: float64[V, 3], vertex positions of the posed target.
        """
        gap, way = np.full(COLUMNS, np.inf), np.zeros((COLUMNS, 3))
        upper, lower = self._grids
        for sign, (corners, shares), other in ((1, upper, self._lower), (-1, lower, self._upper)):
            samples = np.einsum("nk,nkd->nd", shares, points[corners])
            apart, toward = self._apart(points, samples, other)
            column = self._column(samples)
            order = np.argsort(-apart)  # the nearest is written last
            order = order[(column[order] >= 0) & (apart[order] < gap[column[order]])]
            gap[column[order]], way[column[order]] = apart[order], sign * toward[order]
        known = np.flatnonzero(np.isfinite(gap))
        if len(known):  # interpolate columns without samples, beside the ends of a lip
            every = np.arange(COLUMNS)
            nearest = known[np.abs(every[:, None] - known).argmin(axis=1)]
            gap, way = np.interp(every, known, gap[known]), way[nearest]
        return Meeting(np.where(np.isfinite(gap), gap, np.nan), way)

    def welded(self) -> int:
        """The number of columns in which a triangle connects both lips."""
        lips = np.zeros(len(self.skin.points), np.int64)
        lips[np.unique(self._upper)] |= 1
        lips[np.unique(self._lower)] |= 2
        corners = lips[self.skin.triangles]
        both = (corners == 1).any(axis=1) & (corners == 2).any(axis=1)
        middles = self.skin.points[self.skin.triangles[both]].mean(axis=1)
        columns = self._column(middles)
        return len(np.unique(columns[columns >= 0]))

    def widest(self, points: Doubles) -> float:
        """The widest gap between the lips, in the target's unit.

        Args:
            points: float64[V, 3], vertex positions of the posed target.
        """
        return float(np.nan_to_num(self.meeting(points).gap).max(initial=0.0))

    def deepest(self, points: Doubles) -> float:
        """The largest depth of one lip in the other, minus the depth at the same column in the rest
        pose, in the target's unit; 0 if no column is deeper than in the rest pose.

        Args:
            points: float64[V, 3], vertex positions of the posed target.
        """
        least = np.fmin(np.nan_to_num(self.rest.gap), 0.0)
        return float(np.nan_to_num(least - self.meeting(points).gap).max(initial=0.0))

    def too_far(self, points: Doubles) -> bool:
        """Whether the gap is too wide to close without damage, for example because the mouth is
        open in the rest pose.

        Args:
            points: float64[V, 3], vertex positions of the posed target.
        """
        return self.widest(points) > _FAR_MM * self.mm

    def closed(self, points: Doubles) -> Doubles:
        """float64[V, 3]: the posed target with closed lips; unchanged if they are `too_far` apart.

        Args:
            points: float64[V, 3], vertex positions of the posed target.
        """
        if self.too_far(points):
            return points
        best, least = points, np.inf
        widest = max(self.widest(points), 0.0) / self.mm
        upper, lower = (self._fade(rim, widest) for rim in self._rims)
        # The lower lip closes most of a wide gap, because the upper lip is fixed to the skull.
        share = float(np.clip(_UPPER_MM / max(widest, 1e-9), _LEAST_SHARE, 0.5))
        field = (1 - share) * lower - share * upper
        for _ in range(_ROUNDS + 1):
            meeting = self.meeting(points)
            wrong = self._wrong(meeting)
            cost = float(np.abs(wrong).max())
            if cost < least:
                best, least = points, cost
            if not wrong.any():
                break
            rounds = 2 + min(int(2 * cost / self.mm), _SMOOTH)
            most = np.maximum(wrong, 0.0) + _OVER * self.mm
            even = np.minimum(_even(wrong, rounds // 2), most)
            by = np.pad(even[:, None] * _straight(meeting.way, wrong, rounds), ((1, 1), (0, 0)))
            around = self._around(points)
            way = np.stack([np.interp(around, self._places, by[:, k]) for k in range(3)], axis=1)
            points = points + way * field[:, None]
        return best

    def _wrong(self, meeting: Meeting) -> Doubles:
        """float64[COLUMNS]: distance by which the lips have to approach each other in each column;
        negative if they have to move apart, 0 if their gap is right."""
        gap = np.nan_to_num(meeting.gap)
        deepest = np.fmin(np.nan_to_num(self.rest.gap), -_DEEP * self.mm)
        far = np.where(gap > 2 * _GOAL * self.mm, gap - _GOAL * self.mm, 0.0)
        return far + np.minimum(gap - deepest, 0.0)

    def _around(self, points: Doubles) -> Doubles:
        """float64[n]: angles in radians about a vertical axis behind the lips."""
        arm = points - self._axis
        return np.arctan2(arm[:, 0], arm[:, 2])

    def _column(self, points: Doubles) -> Ints:
        """int64[n]: the index of the column in which each point lies; -1 for a point that lies
        outside all columns."""
        at = np.searchsorted(self._edges, self._around(points)) - 1
        return np.where((at >= 0) & (at < COLUMNS), at, -1)

    def _apart(self, points: Doubles, samples: Doubles, other: Ints) -> tuple[Doubles, Doubles]:
        """float64[n]: signed distances of samples from the other lip, negative inside it;
        float64[n, 3]: unit directions away from that lip."""
        used, local = np.unique(other, return_inverse=True)
        surface = Surface(points[used], local.reshape(-1, 3))
        tree = ClosestPoints(surface.points, np.ascontiguousarray(surface.triangles, np.int32))
        triangle, shares, distance = tree.nearest(samples)
        nearest = surface.at(triangle.astype(np.int64), shares)
        normals = surface.normals()[surface.triangles[triangle]]
        normal = np.einsum("nk,nkd->nd", shares, normals)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        arm = samples - nearest
        # The cosine excludes points next to the border of an open lip surface.
        inside = (arm * normal).sum(axis=1) < -_AGAINST * distance
        inside &= distance < _NEAR * self.mm
        signed = np.where(inside, -distance, distance)
        close = distance < 1e-6 * self.mm
        way = arm / np.maximum(distance, 1e-12)[:, None] * np.where(inside, -1, 1)[:, None]
        return signed, np.where(close[:, None], normal, way)

    def _rim(self, own: Ints, other: Ints) -> Ints:
        """int64[n]: vertices of a lip that are nearest to the other lip in their column."""
        points, vertices = self.skin.points, np.unique(own)
        apart, _ = self._apart(points, points[vertices], other)
        apart = np.abs(apart)
        column = self._column(points[vertices])
        least = np.full(COLUMNS + 1, np.inf)
        np.minimum.at(least, column, apart)
        near = (column >= 0) & (apart <= least[column] + _RIM * self.mm)
        return vertices[near]

    def _fade(self, rim: Ints, widest: float) -> Doubles:
        """float64[V]: weights of a correction, 1 at the rim, 0 far from it. widest: gap in mm."""
        reach = max(_FADE, _SOFTER * widest)
        away = _along(self.skin, rim, reach * self.mm) / self.mm
        return np.asarray(1 - smooth_step((away - _BAND) / (reach - _BAND)))


def _labels(expressions: Mapping[str, Doubles], count: int) -> tuple[Ints, Ints]:
    """int64[n] each: vertices of the upper and of the lower lip; empty if they are unknown."""
    none = np.zeros(0, np.int64)
    strength, jaw = np.zeros(count), expressions.get("jawOpen")
    for name, delta in expressions.items():
        if name.startswith(_ROUND):
            strength += np.linalg.norm(delta, axis=1)
    if jaw is None or not strength.any():
        return none, none
    lips = np.flatnonzero(strength > _LIP * strength.max())
    travel = np.linalg.norm(jaw, axis=1)[lips]
    whole = np.quantile(travel, 0.9)
    if not whole > 0:
        return none, none
    return lips[travel < _STILL * whole], lips[travel > _TAKEN * whole]


def _of(skin: Surface, vertices: Ints) -> Ints:
    """int64[T, 3]: the triangles with all corners among the vertices."""
    own = np.zeros(len(skin.points), bool)
    own[vertices] = True
    return np.asarray(skin.triangles[own[skin.triangles].all(axis=1)], np.int64)


def _grid(points: Doubles, triangles: Ints, spacing: float) -> tuple[Ints, Doubles]:
    """Sample points on triangles: int64[n, 3], the triangle of each sample, and float64[n, 3], its
    barycentric coordinates.

    Args:
        points: float64[V, 3], vertex positions in the rest pose.
        triangles: int64[T, 3].
        spacing: largest distance of neighbouring samples of a triangle in the rest pose; it is
            larger in triangles with sides longer than 16 times this distance.
    """
    sides = np.linalg.norm(points[triangles] - points[np.roll(triangles, 1, axis=1)], axis=2)
    parts = np.clip(np.ceil(sides.max(axis=1) / spacing), 2, 16).astype(np.int64)
    corners, shares = [], []
    for count in np.unique(parts):
        own, steps = triangles[parts == count], np.arange(count + 1)
        a, b = (grid.ravel() for grid in np.meshgrid(steps, steps))
        inside = a + b <= count
        rows = np.stack([a, b, count - a - b], axis=1)[inside] / count
        corners.append(np.repeat(own, len(rows), axis=0))
        shares.append(np.tile(rows, (len(own), 1)))
    return np.concatenate(corners), np.concatenate(shares)


def _along(skin: Surface, begin: Ints, farthest: float) -> Doubles:
    """float64[V]: distances along edges from the vertices `begin`, at most `farthest`."""
    out = np.full(len(skin.points), farthest)
    near = np.linalg.norm(skin.points - skin.points[begin].mean(axis=0), axis=1)
    reach = near[begin].max() + farthest
    edges = skin.edges()
    edges = edges[(near[edges] <= reach).all(axis=1)]
    length = np.linalg.norm(skin.points[edges[:, 0]] - skin.points[edges[:, 1]], axis=1)
    beside: dict[int, list[tuple[int, float]]] = {}
    for (a, b), size in zip(edges.tolist(), length.tolist(), strict=True):
        beside.setdefault(a, []).append((b, size))
        beside.setdefault(b, []).append((a, size))
    out[begin] = 0.0
    heap = [(0.0, int(v)) for v in begin]
    heapq.heapify(heap)
    while heap:
        away, vertex = heapq.heappop(heap)
        if away > out[vertex]:
            continue
        for other, size in beside.get(vertex, ()):
            if away + size < out[other]:
                out[other] = away + size
                heapq.heappush(heap, (away + size, other))
    return out


def _straight(ways: Doubles, weights: Doubles, rounds: int) -> Doubles:
    """float64[COLUMNS, 3]: unit directions, smoothed over neighbouring columns.

    Args:
        ways: float64[COLUMNS, 3], the directions.
        weights: float64[COLUMNS]; the size of a weight is the influence of its column.
        rounds: number of smoothing rounds; each averages a column with its two neighbours.
    """
    out = np.abs(weights)[:, None] * ways
    for _ in range(rounds):
        wide = np.pad(out, ((1, 1), (0, 0)), mode="edge")
        out = (wide[:-2] + 2 * wide[1:-1] + wide[2:]) / 4
    length = np.linalg.norm(out, axis=1, keepdims=True)
    return np.where(length > 1e-12, out / np.maximum(length, 1e-12), [0.0, 1.0, 0.0])


def _even(values: Doubles, rounds: int) -> Doubles:
    for _ in range(rounds):
        wide = np.pad(values, 1, mode="edge")
        values = (wide[:-2] + 2 * wide[1:-1] + wide[2:]) / 4
    return values
