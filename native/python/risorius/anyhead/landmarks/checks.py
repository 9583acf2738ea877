# SPDX-License-Identifier: MIT
"""Checks that a mesh is a head that a rig can be made of; an error explains why it is not."""

from __future__ import annotations

import numpy as np

from ...author.geometry.simplify import connected
from ...author.geometry.skeleton import Doubles, Ints
from ..form.fitting import Pose, Target
from ..surface import Surface
from .marks import LandmarkError

LEAST, MOST = 200, 1_000_000  # smallest and largest number of vertices of a head
# A border vertex counts as lying at a side of the mesh's bounding box if its distance from the side
# is below this fraction of the longest side.
_FLAT = 0.02
# A mesh counts as cut at a side of its bounding box if at least this fraction of its border
# vertices lies at the side.
_CUT = 0.3
_DEEP = 0.12  # cm of the model: least depth of a step between the lids that counts as an opening
_ROWS, _COLUMNS = 25, 5  # grid of rays through an eye
_LOOKED_AT = 100_000  # largest number of edges that are tested
_CROSSED = 0.06  # largest share of the edges of a face that may pass through the face


def check_mesh(where: str, surface: Surface) -> None:
    """Refuse a mesh in which no landmarks can be searched for.

    Args:
        where: name of the mesh in error messages.
        surface: the mesh.

    Raises:
        LandmarkError: a vertex position is not finite, or there are too few or too many vertices.
    """
    bad = np.flatnonzero(~np.isfinite(surface.points).all(axis=1))
    if len(bad):
        raise LandmarkError(
            f"{where}: vertex {bad[0]}: three finite numbers were expected, found "
            f"{', '.join(f'{x:g}' for x in surface.points[bad[0]])}"
        )
    used = len(np.unique(surface.triangles))
    if used < LEAST:
        raise LandmarkError(
            f"{where}: a head of {LEAST} vertices or more was expected, found {used}"
        )
    if used > MOST:
        raise LandmarkError(
            f"{where}: at most {MOST:,} vertices were expected, found {used:,}: decimate the mesh"
        )


def pieces(surface: Surface) -> list[Surface]:
    """The connected pieces of a surface, the piece with most triangles first. Pieces with
    overlapping bounding boxes count as one.

    Args:
        surface: the surface; it is not changed.
    """
    corners = surface.triangles
    label = connected(len(surface.points), corners.ravel(), np.full(len(corners), 3))
    own, of_triangle = np.unique(label[corners[:, 0]], return_inverse=True)
    low = np.full((len(own), 3), np.inf)
    high = np.full((len(own), 3), -np.inf)
    for k in range(3):
        np.minimum.at(low, of_triangle, surface.points[corners[:, k]])
        np.maximum.at(high, of_triangle, surface.points[corners[:, k]])
    group = _overlapping(low, high)[of_triangle]
    out = [Surface(surface.points, corners[group == g]) for g in np.unique(group)]
    return sorted(out, key=lambda s: -len(s.triangles))


def _overlapping(low: Doubles, high: Doubles) -> Ints:
    """int64[n]: a group number for each box. Boxes that overlap, directly or through other boxes,
    have the same number. More than 2000 boxes all get the number 0, to save time."""
    out = np.arange(len(low))
    if len(low) > 2000:  # hair of many strands
        return np.zeros(len(low), np.int64)
    for _ in range(len(low)):
        met = ((low[:, None] <= high[None]) & (low[None] <= high[:, None])).all(axis=2)
        new = np.where(met, out[None], len(low)).min(axis=1)
        if np.array_equal(new, out):
            break
        out = new
    return out


def completed(surface: Surface) -> list[Surface]:
    """Completes a half head in each possible way.

    Args:
        surface: the surface; it is not changed.

    Returns:
        For each side of the bounding box at which the surface has a flat cut: the surface together
        with its mirror image at this side. A flat cut of the neck counts too. The list is empty if
        there is no flat cut.
    """
    points = surface.points
    border = points[surface.border()]
    if not len(border):
        return []
    out = []
    low, high = points.min(axis=0), points.max(axis=0)
    for axis in range(3):
        for end in (low[axis], high[axis]):
            at_end = np.abs(border[:, axis] - end) < _FLAT * (high - low).max()
            if at_end.mean() < _CUT:
                continue
            mirrored = points.copy()
            mirrored[:, axis] = 2 * end - points[:, axis]
            other = surface.triangles[:, ::-1] + len(points)
            out.append(
                Surface(
                    np.concatenate([points, mirrored]),
                    np.concatenate([surface.triangles, other]),
                )
            )
    return out


def check_eyes(where: str, target: Target, pose: Pose, points: dict[str, Doubles]) -> None:
    """Refuse a head if neither eye has an opening between its lids.

    Args:
        where: name of the head in error messages.
        target: the surface.
        pose: the pose of the model in the surface.
        points: float64[3] by landmark name.

    Raises:
        LandmarkError: both eyes are closed or painted on.
    """
    if not any(_opens(target, pose, points, side) for side in "LR"):
        raise LandmarkError(
            f"{where}: the eyes have no openings between the lids (painted or closed): cut them "
            "open, lids cannot move otherwise"
        )


def _opens(target: Target, pose: Pose, points: dict[str, Doubles], side: str) -> bool:
    """Whether the depth along rays from the front has a step between the lids."""
    names = [f"{n}_{side}" for n in ("eye_inner", "eye_outer", "lid_upper", "lid_lower")]
    inner, outer, upper, lower = (pose.back(points[name][None])[0] for name in names)
    rows = np.linspace(-0.6, 1.6, _ROWS)[:, None, None]
    columns = np.linspace(-0.2, 0.2, _COLUMNS)[None, :, None]
    places = lower + rows * (upper - lower) + columns * (outer - inner)
    places[..., 2] += 3.0
    start = pose.place(places.reshape(-1, 3))
    ahead = np.broadcast_to(-pose.rotation[:, 2], start.shape)
    triangle, _, far = target.closest.first_hit(start, ahead, 12.0 * pose.scale)
    depth = np.where(triangle >= 0, far / pose.scale, 12.0).reshape(_ROWS, _COLUMNS)
    apart = float(np.linalg.norm(upper - lower)) * 2.2 / (_ROWS - 1)
    steps = np.abs(np.diff(depth, axis=0))
    return bool((steps > _DEEP + 1.5 * apart).any(axis=0).mean() > 0.5)


def lips_apart(target: Target, pose: Pose, points: dict[str, Doubles]) -> bool:
    """Whether the lips are separate: no triangles near the mouth line connect them.

    Args:
        target: the surface.
        pose: the pose of the model in the surface.
        points: float64[3] by landmark name.
    """
    left, right = (pose.back(points[f"mouth_corner_{s}"][None])[0] for s in "LR")
    upper, lower = (pose.back(points[f"lip_{n}_outer"][None])[0] for n in ("upper", "lower"))
    surface = target.surface
    inside = pose.back(surface.points)
    middle, wide = (left + right) / 2, 0.3 * float(np.linalg.norm(left - right))
    tall = 0.5 * float(np.linalg.norm(upper - lower))
    box = np.abs(inside - [middle[0], (upper[1] + lower[1]) / 2, upper[2] - 0.5])
    kept = (box < [wide, 1.3 * tall, 1.1]).all(axis=1)[surface.triangles].all(axis=1)
    corners = surface.triangles[kept]
    if not len(corners):
        return True
    label = connected(len(inside), corners.ravel(), np.full(len(corners), 3))
    own = np.unique(corners)
    ends = []
    for place in (upper, lower):
        ends.append(label[own[((inside[own] - place) ** 2).sum(axis=1).argmin()]])
    return bool(ends[0] != ends[1])


def check_crossings(where: str, target: Target, pose: Pose) -> None:
    """Refuse a face that intersects itself in many places.

    Args:
        where: name of the head in error messages.
        target: the surface.
        pose: the pose of the model in the surface.

    Raises:
        LandmarkError: more than 6 % of its edges pass through the face. A few edges are allowed,
            because the skin of nostrils often intersects itself.
    """
    share = crossed(target, pose)
    if share > _CROSSED:
        raise LandmarkError(
            f"{where}: the face intersects itself at {100 * share:.0f} % of its edges: make the "
            "mesh anew (in Blender: the modifier Remesh)"
        )


def crossed(target: Target, pose: Pose) -> float:
    """The share of the edges of a face that pass through the surface, 0 to 1.

    Args:
        target: the surface.
        pose: the pose of the model in the surface.
    """
    surface = target.surface
    inside = pose.back(surface.points)
    face = (np.abs(inside - [0.0, -2.5, 0.0]) < [7.5, 8.0, 6.0]).all(axis=1)
    edges = Surface(surface.points, surface.triangles[face[surface.triangles].all(axis=1)]).edges()
    if not len(edges):
        return 0.0
    edges = edges[:: -(-len(edges) // _LOOKED_AT)]
    begin, way = surface.points[edges[:, 0]], np.diff(surface.points[edges], axis=1)[:, 0]
    length = np.linalg.norm(way, axis=1)
    begin, way, length = begin[length > 0], way[length > 0], length[length > 0]
    ahead = way / length[:, None]
    triangle, _, far = target.closest.first_hit(begin + 0.02 * way, ahead)
    return float(((triangle >= 0) & (far < 0.96 * length)).mean())
