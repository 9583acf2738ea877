# SPDX-License-Identifier: MIT
"""Finds the opening between the lids of an eye by rays from the eye's centre.

A ray that hits no lid leaves through the opening. This distinguishes the upper from the lower lid
on a mesh of any topology, without names and without a template.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..._native import ClosestPoints
from ...author.geometry.skeleton import Doubles, Ints
from ..surface import Surface
from .eyeballs import Eyeball

Mask = npt.NDArray[np.bool_]
FAR = 1.9  # radii of the eye: largest distance of a lid from the eye's centre
COLUMNS = 48  # directions across the opening at which the edges are known
_WIDE, _HIGH = 72.0, 60.0  # degrees across and up from the front that are searched
_STEP = 2.0  # degrees between the rays of the first search
_FINE = 0.5  # degrees between the rays of the second search, before the edges are bisected
_HALVINGS = 6
_ABOVE = 1.001  # rays begin at this multiple of the distance of the eye's surface
_LEAST = 6  # least number of rays of the first search in an opening, after repeated erosion
_SURE = 12  # least number of rays of the first search in an opening, after the first erosion
_CUTS = 4  # largest number of erosions


@dataclass(frozen=True)
class Frame:
    """Axes at an eye's centre: across (to the character's left), up and front, float64[3] each.

    A lid turns about `across`: this changes the angle up and keeps the angle across.
    """

    middle: Doubles
    across: Doubles
    up: Doubles
    front: Doubles

    def angles(self, points: Doubles) -> tuple[Doubles, Doubles, Doubles]:
        """Angle across and angle up in radians, and distance from the centre, float64[n] each.

        Args:
            points: float64[n, 3], positions in the space of the head.
        """
        arm = points - self.middle
        length = np.linalg.norm(arm, axis=1)
        ray = arm / np.maximum(length, 1e-12)[:, None]
        across = np.arcsin(np.clip(ray @ self.across, -1.0, 1.0))
        return across, np.arctan2(ray @ self.up, ray @ self.front), length

    def rays(self, across: Doubles, up: Doubles) -> Doubles:
        """float64[..., 3]: unit directions of angles.

        Args:
            across: float64[...], radians.
            up: float64[...], radians.
        """
        c = np.cos(across)[..., None]
        return np.asarray(
            np.sin(across)[..., None] * self.across
            + c * (np.sin(up)[..., None] * self.up + np.cos(up)[..., None] * self.front)
        )


@dataclass(frozen=True)
class Opening:
    """The opening between the lids of an eye in the rest pose.

    Attributes:
        frame: axes at the eye's centre; `across` is parallel to the line between the eye corners.
        across: float64[columns], angle across of each column from corner to corner, in radians,
            ascending; there are at most COLUMNS (48) columns.
        low, high: float64[columns], angle up of the lower and of the upper lid's edge in each
            column, in radians.
    """

    frame: Frame
    across: Doubles
    low: Doubles
    high: Doubles

    def line(self, across: Doubles, share: float = 0.5) -> Doubles:
        """float64[n]: angles up, in radians, of a line between both edges.

        Args:
            across: float64[n], angles across in radians.
            share: 0: the lower edge, 1: the upper edge.
        """
        return np.interp(across, self.across, self.low + share * (self.high - self.low))


def near_eye(surface: Surface, ball: Eyeball) -> Surface:
    """The skin triangles near an eye, which may belong to lids; vertex indices are unchanged.

    Args:
        surface: the skin.
        ball: the eye.
    """
    # Bounding boxes of the triangles are tested, because a large triangle may pass near the eye
    # although all of its corners are far away.
    corners = surface.points[surface.triangles]
    low, high = corners.min(axis=1), corners.max(axis=1)
    off = ball.middle - np.clip(ball.middle, low, high)
    return Surface(surface.points, surface.triangles[(off**2).sum(axis=1) < _far(ball) ** 2])


def _far(ball: Eyeball) -> float:
    return FAR * ball.radius


def find_opening(lids: Surface, ball: Eyeball) -> Opening | None:
    """The opening of an eye; None if skin covers the eye or if there are no lids.

    Args:
        lids: the skin near the eye, the result of near_eye.
        ball: the eye.
    """
    if not len(lids.triangles):
        return None
    used, triangles = np.unique(lids.triangles, return_inverse=True)
    tree = ClosestPoints(lids.points[used], triangles.reshape(-1, 3).astype(np.int32))
    x, y, z = np.eye(3)
    frame = Frame(ball.middle, x, y, z)
    across = np.radians(np.arange(-_WIDE, _WIDE + 1e-9, _STEP))
    up = np.radians(np.arange(-_HIGH, _HIGH + 1e-9, _STEP))
    blob = None
    for _ in range(3):  # each round aligns the frame better with both eye corners
        frame = frame if blob is None else _turned(frame, across, up, blob)
        seen = _seen(tree, ball, frame.rays(*np.meshgrid(across, up, indexing="ij")))
        blob = _between_lids(seen)
        if blob is None:
            return None
    assert blob is not None
    columns = np.flatnonzero(blob.any(axis=1))
    bounds = [(up[blob[c]].min(), up[blob[c]].max()) for c in columns]
    return _refined(tree, ball, frame, across[columns], np.array(bounds))


def _seen(tree: ClosestPoints, ball: Eyeball, rays: Doubles, turn: Doubles | None = None) -> Mask:
    """bool[...]: whether a ray from the eye's centre hits no lid."""
    flat = rays if rays.ndim == 2 else rays.reshape(-1, 3)
    # Rays begin at the eye's surface, so that skin inside the eye does not stop them.
    begin = ball.middle + (_ABOVE * ball.reach(flat, turn))[:, None] * flat
    triangle, _, _ = tree.first_hit(begin, flat, farthest=(FAR - 1.0) * ball.radius)
    return np.asarray(triangle).reshape(rays.shape[:-1]) < 0


def _between_lids(seen: Mask) -> Mask | None:
    """The largest region of free rays that does not reach the border of the searched grid, because
    a region at the border lies outside the lids. Before the search the free rays are eroded, which
    separates the opening from holes of a scan. None if no region is large enough.

    Args:
        seen: bool[columns, rows], whether a ray hits no lid.
    """
    core = seen
    for cuts in range(_CUTS):
        core = core & _beside(core, np.minimum.reduce)
        place = _regions(core)
        labels, counts = np.unique(place[core], return_counts=True)
        border = np.concatenate([place[[0, -1]].ravel(), place[:, [0, -1]].ravel()])
        counts = np.where(np.isin(labels, border), 0, counts)
        if not len(labels):
            return None
        if counts.max() >= (_LEAST if cuts else _SURE):
            blob: Mask = place == labels[counts.argmax()]
            for _ in range(cuts + 1):
                blob = seen & _beside(blob, np.maximum.reduce)
            return blob
    return None


def _regions(core: Mask) -> Ints:
    """int64, shape of `core`: a label for each connected region, 0 outside."""
    place = np.where(core, np.arange(1, core.size + 1).reshape(core.shape), 0)
    while True:
        spread = np.where(core, _beside(place, np.maximum.reduce), 0)
        if (spread == place).all():
            return np.asarray(place, np.int64)
        place = spread


def _beside(values: npt.NDArray[Any], of: Callable[..., Any]) -> npt.NDArray[Any]:
    """For each cell of a grid, the minimum or the maximum of the cell and its four neighbours.

    Args:
        values: the grid, two-dimensional.
        of: np.minimum.reduce or np.maximum.reduce, applied to a list of five shifted grids.
    """
    padded = np.pad(values, 1, mode="edge")
    return np.asarray(
        of([padded[1:-1, 1:-1], padded[2:, 1:-1], padded[:-2, 1:-1], padded[1:-1, 2:],
            padded[1:-1, :-2]])
    )  # fmt: skip


def _turned(frame: Frame, across: Doubles, up: Doubles, blob: Mask) -> Frame:
    """A frame with `across` parallel to the line between the eye corners, facing the opening."""
    columns = np.flatnonzero(blob.any(axis=1))
    heights = np.array([up[blob[c]].mean() for c in columns])
    ends = frame.rays(across[columns[[0, -1]]], heights[[0, -1]])
    axis = ends[1] - ends[0]
    axis /= np.linalg.norm(axis)
    front = ends.mean(axis=0)
    front -= (front @ axis) * axis
    front /= np.linalg.norm(front)
    return Frame(frame.middle, axis, np.cross(front, axis), front)


def _refined(
    tree: ClosestPoints, ball: Eyeball, frame: Frame, columns: Doubles, bounds: Doubles
) -> Opening | None:
    """The opening with finer columns than a coarse search found. The lid edges of each column are
    bisected to a hundredth of a degree. None if no ray between the coarse edges is free.

    Args:
        tree: the skin near the eye.
        ball: the eye.
        frame: axes at the eye's centre.
        columns: float64[n], angles across at which the coarse search found the opening, radians.
        bounds: float64[n, 2], lowest and highest angle of a free ray of each column, radians.
    """
    step = np.radians(_STEP)
    ends = columns[[0, -1]] + [-step / 2, step / 2]
    across = np.linspace(ends[0], ends[1], COLUMNS + 2)[1:-1]
    low, high = (np.interp(across, columns, bounds[:, k]) for k in (0, 1))
    up = np.radians(np.arange(-_HIGH, _HIGH + 1e-9, _FINE))
    seen = _seen(tree, ball, frame.rays(*np.meshgrid(across, up, indexing="ij")))
    seen &= (up > low[:, None] - 1.5 * step) & (up < high[:, None] + 1.5 * step)
    kept = seen.any(axis=1)
    if not kept.any():
        return None
    across, seen = across[kept], seen[kept]
    first = seen.argmax(axis=1)
    last = seen.shape[1] - 1 - seen[:, ::-1].argmax(axis=1)
    fine = np.radians(_FINE)
    edges = []
    for open_at, way in ((up[first], -fine), (up[last], fine)):
        inside, outside = open_at, open_at + way
        for _ in range(_HALVINGS):
            middle = (inside + outside) / 2
            free = _seen(tree, ball, frame.rays(across, middle))
            inside, outside = np.where(free, middle, inside), np.where(free, outside, middle)
        edges.append((inside + outside) / 2)
    return Opening(frame, across, edges[0], edges[1])


_MARGIN = np.radians(4.0)  # angle by which the rays of visible_gap go beyond the lid edges at rest
_HEIGHTS = 240  # rays of visible_gap per column


def gap_rays(opening: Opening) -> Doubles:
    """float64[columns * heights, 3]: unit directions for visible_gap.

    Args:
        opening: the opening in the rest pose.
    """
    return opening.frame.rays(*_grid(opening)).reshape(-1, 3)


def visible_gap(
    lids: ClosestPoints,
    ball: Eyeball,
    opening: Opening,
    rays: Doubles,
    edges: tuple[Doubles, Doubles],
    turn: Doubles | None = None,
) -> Doubles:
    """float64[columns]: vertical extent of the visible part of the eye, in the skin's unit.

    Args:
        lids: the skin near the eye in some pose.
        ball: the eye.
        opening: the opening of the same skin in the rest pose.
        rays: the result of gap_rays for this opening.
        edges: float64[columns] each, lowest and highest angle, in radians, that count as between
            the lids in this pose; NaN if unknown. Free rays beyond are holes of the skin.
        turn: float64[3, 3], the eye's rotation from its rest pose; None: not rotated.
    """
    up = _grid(opening)[1]
    seen = _seen(lids, ball, rays, turn).reshape(up.shape)
    low = np.fmax(edges[0], opening.low - _MARGIN)[:, None]
    high = np.fmin(edges[1], opening.high + _MARGIN)[:, None]
    seen &= (up > low) & (up < high)
    step = (up[0, 1] - up[0, 0]) * ball.radius
    return np.asarray(seen.sum(axis=1) * step * np.cos(opening.across))


def _grid(opening: Opening) -> list[Doubles]:
    low, high = opening.low.min() - _MARGIN, opening.high.max() + _MARGIN
    return np.meshgrid(opening.across, np.linspace(low, high, _HEIGHTS), indexing="ij")
