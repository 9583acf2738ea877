# SPDX-License-Identifier: MIT
"""Cuts or drops hairs that expressions would bring into the skin.

Long hair under the chin would enter the throat if the mouth opens wide. Hair at the rim of a lip
would enter the lip if the lip rolls in. The finished face is posed to find such hairs.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cached_property
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from risorius import Dna, Mesh, Rig
from risorius.author.geometry import skeleton as sk

from ..polygons import Floats, Ints
from .binding import ARM, corners_of, turned
from .strips import ROOT_DEEP, Strips
from .strips import unit as unit_vectors
from .surface import Roots, Surface, about, nearest_places, nearest_rows

_NEAR = 0.3  # decimetres: skin further than this from every hair is ignored
_SOME = 256  # number of hair points that determine which skin is near
# decimetres: smallest allowed height of a hair's edges above the skin, except at the root; edges
# that are lower in the neutral pose may be as low in other poses
_LOW = 0.002
_DEEPER = 0.002  # decimetres by which a root in the skin may be deeper than in the neutral pose
# decimetres: a control that moves no skin farther than this cannot bring a hair into the skin
_STILL = 0.002
# decimetres: a control that moves the skin under a hair by less than this does not affect the hair
_STIRRED = 0.0005
_SUNK = 0.0015  # decimetres: hairs that sink by less in the rough test are not tested exactly
_ROUGHLY = 4  # the rough test uses every fourth vertex
_SHORTER = 0.75  # factor on the length of a hair that is cut
_CUTS = 5  # number of cuts after which a hair is dropped
_EDGE_DEEP = 0.004  # decimetres by which the edge of a card may be in the skin beyond its root
_AHEAD = 8  # number of poses that the thread computes in advance
S = TypeVar("S")
T = TypeVar("T")


def narrow_edges(strips: Strips, surface: Surface) -> None:
    """Narrows cards whose edges would be deep in curved skin, such as at an ear.

    Args:
        strips: hair; changed.
        surface: the head on which the hair grows.
    """
    over = np.maximum(0, -_depths(strips.points, surface))
    most = np.where(np.arange(strips.rows) == 0, ROOT_DEEP, _EDGE_DEEP)
    for side in (1, -1):
        deep = np.maximum(most, _depths(strips.points + side * strips.sides, surface))
        strips.sides *= ((over + most) / (over + deep))[..., None]


def _depths(points: Floats, surface: Surface) -> Floats:
    """float64[...]: depth of points below the nearest skin, negative above the skin.

    Args:
        points: float64[..., 3], in decimetres.
        surface: the head with the skin.
    """
    flat = points.reshape(-1, 3)
    places = surface.nearest(flat)
    normals = unit_vectors(places.of(surface.normals))
    deep = ((places.of(surface.positions) - flat) * normals).sum(axis=1)
    return np.asarray(deep.reshape(points.shape[:-1]))


def cut_clear(
    strips: Strips, dna: Dna, head: Mesh, unit: float, faces: Iterable[NDArray[np.float32]]
) -> Strips:
    """Shortens or drops hairs that would go through the skin; returns all hairs that remain.

    Args:
        strips: hair in decimetres, of which only the roots follow the skin; changed.
        dna: the finished face.
        head: the head mesh of LOD 0.
        unit: length of a decimetre in the unit of the mesh.
        faces: float32[R] each, raw controls of expressions. Each control alone is tested, too;
            because there are many controls, a rough test precedes the exact one.
    """
    ground = _Ground(strips, dna, head, unit)
    count = len(dna.raw_control_names)
    still = ground.posed(np.zeros(count, np.float32))
    cutting = _Cutting(strips, still)
    rough = still.rough(strips)
    under = _nearest(strips.points.reshape(-1, 3), still.skin).reshape(len(strips), -1)

    def stirred(control: int) -> tuple[_Posed, NDArray[np.bool_]] | None:
        pose = ground.posed(np.eye(1, count, control, dtype=np.float32)[0])
        way = np.linalg.norm(pose.skin - still.skin, axis=1)
        moves = way[under].max(axis=1) > _STIRRED
        return (pose, moves) if way.max() > _STILL and moves.any() else None

    for found in _ahead(stirred, range(count)):
        if found is not None:
            pose, moves = found
            some = np.flatnonzero(moves & cutting.stays)
            sunk = pose.rough(strips.taken(some)) < rough[some] - _SUNK
            cutting.cut(pose, some[sunk.any(axis=1)])
    for pose in _ahead(ground.posed, faces):
        cutting.cut(pose, np.flatnonzero(cutting.stays))
    return strips.taken(cutting.stays)


def _ahead(work: Callable[[S], T], rows: Iterable[S]) -> Iterator[T]:
    """The results of `work` for all rows, in the order of the rows; a thread computes the next
    results while the caller uses earlier ones."""
    waiting: deque[Future[T]] = deque()
    with ThreadPoolExecutor(1) as pool:
        for row in rows:
            waiting.append(pool.submit(work, row))
            if len(waiting) > _AHEAD:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


class _Ground:
    """The skin near the hairs, and its motion with the face.

    Args:
        strips: the hair in decimetres.
        dna: the finished face.
        head: the head mesh of LOD 0.
        unit: length of a decimetre in the unit of the mesh.

    Attributes:
        rest: float64[m, 3], neutral positions of the skin's vertices near the hairs, in decimetres.
    """

    def __init__(self, strips: Strips, dna: Dna, head: Mesh, unit: float) -> None:
        self.unit, self._dna, self._rig = unit, dna, Rig(dna)
        positions = np.asarray(head.positions, np.float64) / unit
        points = strips.points.reshape(-1, 3)
        apart = positions[:, None] - points[None, :: 1 + len(points) // _SOME]
        near = (np.square(apart).sum(axis=2) < _NEAR**2).any(axis=1)
        near[strips.roots.corners] = True
        among = np.flatnonzero(near)
        self.row = np.full(len(positions), -1)
        self.row[among] = np.arange(len(among))
        triangles = self.row[corners_of(head)[0]]
        self.triangles = triangles[(triangles >= 0).all(axis=1)]
        self.around = about(self.triangles, len(among))
        self.rest = positions[among]
        self.upright = self.normals(self.rest)
        weights = sk.dense_weights(head, len(dna.joint_names))[among]
        self._joints = np.flatnonzero(weights.any(axis=0))
        self._weights = weights[:, self._joints].astype(np.float32)
        neutral = sk.world_matrices(dna, np.zeros((len(dna.joint_names), 9)))
        self._back = np.linalg.inv(neutral)
        self._shapes = []
        for target in head.blend_shape_targets:
            rows = self.row[np.asarray(target.vertex_indices, np.int64)]
            if (rows >= 0).any():
                deltas = np.asarray(target.deltas, np.float64)[rows >= 0] / unit
                self._shapes.append(
                    (int(target.blend_shape_channel_index), rows[rows >= 0], deltas)
                )

    def roots(self, strips: Strips) -> Roots:
        """The roots of strips on the skin near the hairs; their corners are rows of `rest`."""
        return Roots(self.row[strips.roots.corners], strips.roots.shares)

    def normals(self, skin: Floats) -> Floats:
        """float64[m, 3]: unit normals of the vertices."""
        a, b, c = (skin[self.triangles[:, k]] for k in range(3))
        faces = np.repeat(np.cross(b - a, c - a), 3, axis=0)
        rows = self.triangles.ravel()
        sums = [np.bincount(rows, faces[:, k], len(skin)) for k in range(3)]
        return unit_vectors(np.stack(sums, axis=1))

    def posed(self, raw: NDArray[np.float32]) -> _Posed:
        """The skin posed by raw controls float32[R]."""
        pose = self._rig.evaluate(raw)
        shaped, shares = self.rest.copy(), np.asarray(pose.blend_shapes).tolist()
        for channel, rows, deltas in self._shapes:
            if shares[channel]:
                shaped[rows] += shares[channel] * deltas
        moves = sk.world_matrices(self._dna, np.asarray(pose.joints, np.float64)) @ self._back
        moves = moves[self._joints, :3]
        moves[..., 3] /= self.unit
        beside = (moves - np.eye(3, 4)).reshape(-1, 12).astype(np.float32)
        return _Posed(self, shaped, np.eye(3, 4) + (self._weights @ beside).reshape(-1, 3, 4))


class _Posed:
    """The skin near the hairs in one pose.

    Attributes:
        skin: float64[m, 3], posed positions in decimetres.
    """

    def __init__(self, ground: _Ground, shaped: Floats, moves: Floats) -> None:
        self._ground, self._shaped, self._moves = ground, shaped, moves
        self.skin = np.einsum("vij,vj->vi", moves[..., :3], shaped) + moves[..., 3]

    @cached_property
    def _normals(self) -> Floats:
        return self._ground.normals(self.skin)

    @cached_property
    def _turned(self) -> Floats:
        is_shaped = (self._shaped != self._ground.rest).any()
        return self._ground.normals(self._shaped) if is_shaped else self._ground.upright

    def _carried(self, strips: Strips) -> Floats:
        """float64[n, rows, 2, 3]: positions of the left and right edges in the pose.

        The edges move like cards that follow their roots: with the joints that move the skin at the
        root, and rotated if a blend shape tilts the skin.
        """
        ground = self._ground
        roots = ground.roots(strips)
        was, now = (unit_vectors(roots.of(n)) for n in (ground.upright, self._turned))
        edges = np.stack([strips.points + strips.sides, strips.points - strips.sides], axis=2)
        off = edges - roots.of(ground.rest)[:, None, None]
        far = np.linalg.norm(off, axis=-1, keepdims=True)
        arm = off * np.minimum(1.0, ARM / ground.unit / far.clip(1e-12))
        off = off + turned(arm, was[:, None, None], now[:, None, None])
        there = roots.of(self._shaped)[:, None, None] + off
        moves = roots.of(self._moves.reshape(-1, 12)).reshape(-1, 3, 4)
        return np.asarray(
            np.einsum("nij,nrsj->nrsi", moves[..., :3], there) + moves[:, None, None, :, 3]
        )

    def rough(self, strips: Strips) -> Floats:
        """float64[n, rows]: approximate heights of the guides above the skin.

        The heights are measured from the tangent plane of the nearest vertex. Only every fourth
        vertex is considered.
        """
        points = self._carried(strips).mean(axis=2).reshape(-1, 3)
        some = slice(None, None, _ROUGHLY)
        near = _nearest(points, self.skin[some])
        height = ((points - self.skin[some][near]) * self._normals[some][near]).sum(axis=1)
        return np.asarray(height.reshape(strips.points.shape[:2]))

    def heights(self, strips: Strips) -> Floats:
        """float64[n, rows, 2]: heights of the left and the right edges above the skin."""
        edges = self._carried(strips)
        points, ground = edges.reshape(-1, 3), self._ground
        vertex = _nearest(points, self.skin)
        places = nearest_places(self.skin, ground.triangles, ground.around, points, vertex)
        normals = unit_vectors(places.of(self._normals))
        height = ((points - places.of(self.skin)) * normals).sum(axis=1)
        return np.asarray(height.reshape(edges.shape[:3]))


class _Cutting:
    """Cuts hairs, and sets `stays`, bool[n], to False for dropped hairs."""

    def __init__(self, strips: Strips, still: _Posed) -> None:
        self._strips, self._still = strips, still
        self._rest = self._still.heights(strips)
        self.stays = np.ones(len(strips), bool)

    def cut(self, pose: _Posed, some: Ints) -> None:
        """Shortens or drops the hairs `some` that come too near to the skin in a pose.

        Args:
            pose: the skin in the pose.
            some: indices of hairs.
        """
        strips = self._strips
        for _ in range(_CUTS):
            some = some[_deep(pose.heights(strips.taken(some)), self._rest[some])]
            if not len(some):
                return
            root = strips.points[some, :1]
            strips.points[some] = root + _SHORTER * (strips.points[some] - root)
            strips.sides[some] *= _SHORTER
            self._rest[some] = self._still.heights(strips.taken(some))
        self.stays[some] = False


def _deep(heights: Floats, rest: Floats) -> NDArray[np.bool_]:
    """bool[n]: whether a hair comes too near to the skin, and nearer than in the neutral pose.

    Args:
        heights: float64[n, rows, 2], heights of the hairs' edges above the skin in a pose.
        rest: float64[n, rows, 2], the heights in the neutral pose.
    """
    lower = heights - np.minimum(rest, _LOW)
    ends, roots = lower[:, 1:].min(axis=(1, 2)), lower[:, 0].min(axis=1)
    return np.asarray((ends < -1e-4) | (roots < -_DEEPER))


def _nearest(points: Floats, others: Floats) -> Ints:
    """int64[n]: index of the point of `others` nearest to each point.

    The search uses float32, which halves the time; the rounding errors are about a micrometre.

    Args:
        points: float64[n, 3], in decimetres.
        others: float64[m, 3], in decimetres.
    """
    middle = others.mean(axis=0)
    return nearest_rows((points - middle).astype(np.float32), (others - middle).astype(np.float32))
