# SPDX-License-Identifier: MIT
"""Finds lips, lids and brows, as weights of the base mesh's vertices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from risorius.author.geometry.polygon_mesh import vertex_normals
from risorius.base.easing import smooth_step

from ..polygons import Floats, Ints
from ..source import BaseMesh

MM = 0.01  # decimetres per millimetre
_TOUCHING = 0.03  # decimetres: largest distance of a lip vertex from the other lip
# decimetres: smallest difference between the displacements of two touching lip vertices if the jaw
# opens
_PARTED = 0.04
_BETWEEN = 0.03  # decimetres: width of the blend between the lips at the corners
_LID = 0.035  # decimetres: reach of a lid's skin from the roots of its lashes
_CHUNK = 256  # points whose distances are computed together


def nearest(points: Floats, others: Floats) -> tuple[Ints, Floats]:
    """Index of the nearest other point for each point, and its distance.

    Args:
        points: float64[n, 3].
        others: float64[m, 3].

    Returns:
        int64[n] and float64[n].
    """
    index = np.empty(len(points), np.int64)
    distance = np.empty(len(points))
    for begin in range(0, len(points), _CHUNK):
        rows = slice(begin, begin + _CHUNK)
        square = ((points[rows, None] - others[None]) ** 2).sum(axis=2)
        index[rows] = square.argmin(axis=1)
        distance[rows] = np.sqrt(square.min(axis=1))
    return index, distance


def bell(distance: Floats) -> Floats:
    """float64[n]: a bell curve with value 1 at distance 0.

    Args:
        distance: float64[n], in standard deviations.
    """
    return np.asarray(np.exp(-(distance**2) / 2))


@dataclass(frozen=True)
class Places:
    """Regions and measures of a face for the controls of further.toml.

    Arrays have a row per vertex of the base mesh; lengths are in decimetres.

    Attributes:
        positions: float64[V, 3] of the man, whose left is +x and who looks along +z.
        normals: float64[V, 3], unit normals.
        groups: name of a group of the base mesh -> vertex indices.
        skin: float64[V], 1 for vertices of the body's skin, else 0.
        lips: "U" or "D" -> float64[V], 1 for all vertices above or below the line between the lips,
            with a soft edge; the sum is 1.
        along: float64[V], 0 in the middle of the lips, 1 and -1 at their corners.
        lip_distance: float64[V], distance from the line along which the lips touch.
        lids: "U" or "D" -> float64[V], weight of the upper or lower lids of both eyes, with lashes.
        brows: float64[V], weight of both brows.
        eyes: "L" or "R" -> float64[3], middle of this eye.
    """

    positions: Floats
    normals: Floats
    groups: dict[str, Ints]
    skin: Floats
    lips: dict[str, Floats]
    along: Floats
    lip_distance: Floats
    lids: dict[str, Floats]
    brows: Floats
    eyes: dict[str, Floats]

    def eye_of(self) -> Floats:
        """float64[V, 3]: the middle of the eye on each vertex's side of the face."""
        left = self.positions[:, :1] > 0
        return np.where(left, self.eyes["L"], self.eyes["R"])


def find_places(
    base: BaseMesh,
    positions: Floats,
    groups: dict[str, Ints],
    jaw_open: Floats,
    brow_shapes: Floats,
) -> Places:
    """Finds the regions of a face.

    Args:
        base: the base mesh with the polygons.
        positions: float64[V, 3], in decimetres.
        groups: name of a group of the base mesh -> vertex indices.
        jaw_open: float64[V, 3], displacement of the opening jaw, which distinguishes the lips.
        brow_shapes: float64[V, 3], sum of the absolute displacements of brows up and down.
    """
    count = len(positions)
    faces = [[c[0] for c in face] for rows in base.faces.values() for face in rows]
    skin = np.zeros(count)
    skin[groups["body"]] = 1
    eyes = {s: positions[groups[f"helper-{s.lower()}-eye"]].mean(axis=0) for s in "LR"}
    line = positions[_lip_line(positions, faces, groups["body"], jaw_open)]
    corner = np.abs(line[:, 0]).max()
    _, lip_distance = nearest(positions, line)
    # Smooths the line (degree 4 in x), because the lips touch in an area some millimetres high.
    height = np.polyfit(line[:, 0] ** 2, line[:, 1], 2)
    aside = np.minimum(np.abs(positions[:, 0]), corner)
    upper = smooth_step((positions[:, 1] - np.polyval(height, aside**2)) / _BETWEEN + 0.5)
    travel = np.linalg.norm(brow_shapes, axis=1) * skin
    return Places(
        positions,
        vertex_normals(positions, faces),
        groups,
        skin,
        {"U": upper, "D": 1 - upper},
        positions[:, 0] / corner,
        lip_distance,
        {k: _lid(positions, groups, n) for k, n in (("D", 1), ("U", 2))},
        smooth_step(travel / (0.6 * travel.max())),
        eyes,
    )


def _lip_line(positions: Floats, faces: list[list[int]], body: Ints, jaw_open: Floats) -> Ints:
    """int64[n]: vertices of each lip at which it touches the other lip.

    Within _TOUCHING of such a vertex is a vertex of the other lip. The opening jaw parts both
    vertices, and no face has both.

    Args:
        positions: float64[V, 3], in decimetres.
        faces: vertex indices of each face.
        body: indices of the skin's vertices.
        jaw_open: float64[V, 3], displacement of the opening jaw.
    """
    front = body[(np.abs(positions[body, 0]) < 0.4) & (positions[body, 2] > 1.2)]
    joined: dict[int, set[int]] = {}
    for face in faces:
        for vertex in face:
            joined.setdefault(vertex, set()).update(face)
    out = set()
    for vertex in front:
        near = front[np.linalg.norm(positions[front] - positions[vertex], axis=1) < _TOUCHING]
        apart = np.linalg.norm(jaw_open[near] - jaw_open[vertex], axis=1) > _PARTED
        if set(near[apart].tolist()) - joined[int(vertex)]:
            out.add(int(vertex))
    return np.array(sorted(out))


def _lid(positions: Floats, groups: dict[str, Ints], number: int) -> Floats:
    """float64[V]: weight of both upper or both lower lids; lashes get the weight of the skin below.

    Args:
        positions: float64[V, 3], in decimetres.
        groups: name of a group of the base mesh -> vertex indices.
        number: number of the lids' lash group: 1 for lower lids, 2 for upper lids.
    """
    out = np.zeros(len(positions))
    body = groups["body"]
    for letter in "lr":
        lashes = groups[f"helper-{letter}-eyelashes-{number}"]
        skin_at, height = nearest(positions[lashes], positions[body])
        roots = positions[lashes[height < np.quantile(height, 0.35)]]
        index, distance = nearest(positions[body], roots)
        weight = 1 - smooth_step(distance / _LID)
        # At the corners of the eye both lids are equally near, so only skin above the roots of the
        # upper lashes or below the roots of the lower lashes counts.
        beyond = (positions[body, 1] - roots[index, 1]) * (1 if number == 2 else -1)
        weight *= smooth_step((beyond + 0.004) / 0.006)
        width = np.abs(roots[:, 0] - roots[:, 0].mean()).max()
        aside = (positions[body, 0] - roots[:, 0].mean()) / width
        weight *= np.sqrt(np.clip(1 - aside**2, 0, 1))
        out[body] = np.maximum(out[body], weight)
        out[lashes] = weight[skin_at]
    return out
