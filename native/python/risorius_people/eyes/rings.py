# SPDX-License-Identifier: MIT
"""Finds the lids of the base mesh as a grid: rings of skin around each eye."""

from __future__ import annotations

import numpy as np

from ..polygons import Floats, Ints, edges_of
from ..source import BaseMesh

OUTER, INNER = 8, 4  # number of rings outside and inside the ring of the lashes' roots
ROOT = OUTER  # row of the lashes' roots; row ROOT + 3 is the inner rim, inside the ball
COLUMNS = 28
# columns of the lids and of the outer corner; column 0 is the corner at the nose
UPPER, TEMPLE, LOWER = slice(1, 14), 14, slice(15, 28)
Faces = list[list[int]]
Edges = dict[tuple[int, int], list[int]]


def find_rings(base: BaseMesh, groups: dict[str, Ints]) -> dict[str, Ints]:
    """ "l" or "r" -> int64[OUTER + 1 + INNER, COLUMNS], vertices of the rings of this eye.

    Column 0 is the inner corner; then follow the upper lid, the outer corner and the lower lid.

    Args:
        base: the base mesh; its faces are quads in regular rings around each eye.
        groups: name of a group of the base mesh -> vertex indices.
    """
    faces = [[c[0] for c in face] for face in base.faces["body"]]
    edges = edges_of(faces)
    beside: dict[int, list[int]] = {}
    for a, b in edges:
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)
    roots = {side: _lash_root(base, groups, side) for side in "lr"}
    first = {side: _lash_ring(faces, edges, beside, root) for side, root in roots.items()}
    return {side: _rings(base, groups, faces, edges, side, first[side]) for side in "lr"}


def _rings(
    base: BaseMesh,
    groups: dict[str, Ints],
    faces: Faces,
    edges: Edges,
    side: str,
    first: list[int],
) -> Ints:
    ahead = [_beside(first, faces, edges, way) for way in (0, 1)]
    # Of both neighbouring rings, the inner one is nearer to the middle of the eye.
    middle = base.positions[groups[f"helper-{side}-eye"]].mean(axis=0)
    ahead.sort(key=lambda ring: np.linalg.norm(base.positions[ring] - middle, axis=1).mean())
    inside, outside = [first, ahead[0]], [first, ahead[1]]
    for rings, count in ((inside, INNER), (outside, OUTER)):
        while len(rings) <= count:
            beside = [_beside(rings[-1], faces, edges, way) for way in (0, 1)]
            rings.append(next(r for r in beside if r != rings[-2]))
    grid = np.array([*outside[:0:-1], *inside])
    x, y = np.abs(base.positions[grid[ROOT], 0]), base.positions[grid[ROOT], 1]
    grid = np.roll(grid, -int(x.argmin()), axis=1)
    y = base.positions[grid[ROOT], 1]
    if y[UPPER].mean() < y[LOWER].mean():
        grid = np.roll(grid[:, ::-1], 1, axis=1)
    return grid


def _lash_root(base: BaseMesh, groups: dict[str, Ints], side: str) -> int:
    """Index of the skin vertex nearest to the lashes in the middle of this eye's upper lid."""
    body = groups["body"]
    lashes = base.positions[groups[f"helper-{side}-eyelashes-2"]]
    middle = lashes[np.abs(lashes[:, 0] - lashes[:, 0].mean()).argsort()[:12]]
    gaps = np.linalg.norm(base.positions[body][:, None] - middle[None], axis=2).min(axis=1)
    return int(body[gaps.argmin()])


def _lash_ring(faces: Faces, edges: Edges, beside: dict[int, list[int]], root: int) -> list[int]:
    """The closed loop of edges through a skin vertex, as vertices in order.

    Args:
        faces: vertex indices of each face; all faces are quads.
        edges: edge -> numbers of its faces.
        beside: vertex -> its neighbours along edges.
        root: index of the vertex.
    """
    for start in beside[root]:
        ring = [root, start]
        while len(ring) <= COLUMNS and len(beside[ring[-1]]) == 4:
            before, at = ring[-2:]
            near = {v for f in edges[(min(before, at), max(before, at))] for v in faces[f]}
            (ahead,) = [v for v in beside[at] if v not in near]
            if ahead == root:
                if len(ring) == COLUMNS:
                    return ring
                break
            ring.append(ahead)
    raise ValueError(f"{COLUMNS} edges around the eye were expected at vertex {root}")


def _beside(ring: list[int], faces: Faces, edges: Edges, way: int) -> list[int]:
    """The ring next to a ring, with corresponding vertices in the same order.

    Args:
        ring: vertices of a closed loop of edges.
        faces: vertex indices of each face; all faces are quads.
        edges: edge -> numbers of its faces.
        way: 0 or 1, index of one of the two faces at the ring's first edge, as `edges` lists them;
            the returned ring is on the side of this face.
    """
    out = []
    face = edges[(min(ring[:2]), max(ring[:2]))][way]
    for a, b in zip(ring, [*ring[1:], ring[0]], strict=True):
        quad = faces[face]
        at = quad.index(a)
        (other,) = [v for v in (quad[(at + 1) % 4], quad[at - 1]) if v != b]
        (last,) = [v for v in quad if v not in (a, b, other)]
        out.append(other)
        face = next(f for f in edges[(min(b, last), max(b, last))] if f != face)
    return out


def smoothed(grid: Floats) -> Floats:
    """float64[rings, columns, k]: the rings' vertices after one Catmull-Clark step.

    The first and the last ring stay unchanged.

    Args:
        grid: float64[rings, columns, k], values before the step.
    """
    beside = np.roll(grid, 1, axis=1) + np.roll(grid, -1, axis=1)
    out = grid.copy()
    middle = 9 / 16 * grid[1:-1] + 3 / 32 * (beside[1:-1] + grid[:-2] + grid[2:])
    out[1:-1] = middle + (beside[:-2] + beside[2:]) / 64
    return out
