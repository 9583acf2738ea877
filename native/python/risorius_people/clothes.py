# SPDX-License-Identifier: MIT
"""Makes a shirt that covers neck and shoulders: cut from the base mesh's tights, with a collar.

The tights fit every body of the data. New vertices are affine combinations of vertices of the
tights. Lengths are in decimetres. Constants such as heights refer to the base mesh.
"""

from __future__ import annotations

import numpy as np

from .part import Part
from .polygons import Floats, Operator, Polygons, clip_below, compact_uvs, edges_of, subdivide
from .source import BaseMesh

GROUP = "helper-tights"
# COLLAR: height y of the collar's seam at x = z = 0. COLLAR_SLOPE: drop of the seam per decimetre
# of z (to the front). COLLAR_ROUND: rise of the seam per square decimetre of x^2 (to the side).
COLLAR = 5.66
COLLAR_SLOPE = 0.2
COLLAR_ROUND = 0.3
HEM = 4.62  # height of the lower edge
SHOULDER = 2.02  # largest |x|, where the sleeve is cut
ROOM = 0.02  # vertices move away from the trunk's middle by this fraction of their distance to it
# Rows of the collar from its seam over its upper edge to the inside: (millimetres away from the
# neck, millimetres up). The collar leans towards the neck like ribbing, because an upright collar
# looks like a pipe.
_COLLAR = (
    (1.6, -2.5), (2.4, 0.5), (1.3, 5.0), (-1.4, 9.6), (-3.2, 10.6), (-4.0, 9.2), (-2.4, 3.0),
)  # fmt: skip
# Weights of the moving average along the collar's ring.
_EVEN = tuple(k / 64 for k in (1, 6, 15, 20, 15, 6, 1))
MM = 0.01


def collar_heights(positions: Floats) -> Floats:
    """float64[v]: height above the collar's seam, in decimetres.

    Args:
        positions: float64[v, 3] on the base mesh.
    """
    x, y, z = positions.T
    # Shoulders may be as high as the collar, so the seam rises away from the neck.
    sides = COLLAR_ROUND * x**2 + 0.5 * np.clip(np.abs(x) - 0.7, 0, None)
    return np.asarray(y + COLLAR_SLOPE * z - sides - COLLAR)


def rings(polygons: Polygons) -> list[list[int]]:
    """The border loops of a mesh, each as vertices in the direction of its faces' edges.

    Args:
        polygons: a mesh whose faces all have the same winding.
    """
    edges = edges_of(polygons.faces)
    after: dict[int, int] = {}
    for face in polygons.faces:
        for a, b in zip(face, [*face[1:], face[0]], strict=True):
            if len(edges[min(a, b), max(a, b)]) == 1:
                after[a] = b
    out = []
    while after:
        ring = [next(iter(after))]
        while (following := after.pop(ring[-1], None)) is not None and following != ring[0]:
            ring.append(following)
        out.append(ring)
    return out


def shirt(base: BaseMesh, lod: int) -> Part:
    """Makes the shirt of one LOD.

    Args:
        base: the base mesh.
        lod: number of the LOD, 0 or 1.
    """
    corners = base.faces[GROUP]
    polygons = Polygons(
        [[c[0] for c in face] for face in corners],
        [[c[1] for c in face] for face in corners],
        base.uvs,
        len(base.positions),
    )
    x, y = base.positions.T[:2]
    collar = collar_heights(base.positions)
    operators: list[Operator] = []
    for field, level in ((y, HEM), (-collar, 0.0), (-np.abs(x), -SHOULDER)):
        heights = Part("", polygons, operators).carry(field[:, None])[:, 0]
        polygons, operator = clip_below(polygons, heights, level)
        operators.append(operator)
    part = Part(f"shirt_lod{lod}_mesh", compact_uvs(polygons), operators, rests=True)
    positions = part.carry(base.positions)
    faces, combine = with_edges(part.polygons, positions)
    part.polygons = Polygons(faces, faces, np.zeros((combine.shape[0], 2)), combine.shape[0])
    part.operators.append(combine)
    if lod == 0:
        part.polygons, operator = subdivide(part.polygons)
        part.operators.append(operator)
    part.polygons.uvs = unrolled(part.carry(base.positions))
    part.polygons.uv_faces = part.polygons.faces
    return part


def unrolled(positions: Floats) -> Floats:
    """float64[v, 2]: texture coordinates around the body and up; the texture repeats each
    decimetre.

    Args:
        positions: float64[v, 3], in decimetres.
    """
    return np.column_stack([positions[:, 0] + 0.5 * positions[:, 2], positions[:, 1]])


def spread(vertices: list[int], most: int) -> list[int]:
    """Every k-th vertex, with the largest k for which at least `most` vertices remain.

    The few vertices represent the ring in the mean on which all vertices of the ring depend; with
    all vertices of the ring, the matrix of the Operator would have many more entries.

    Args:
        vertices: vertices in their order on the ring.
        most: smallest number of vertices to return; fewer than twice as many are returned. A ring
            with fewer vertices is returned unchanged.
    """
    return vertices[:: max(1, len(vertices) // most)]


def with_edges(polygons: Polygons, positions: Floats) -> tuple[list[list[int]], Operator]:
    """Widens the shirt, and adds collar and turned-in hems.

    Returns the faces, and the operator that computes all vertices of the shirt from the vertices of
    the cut tights.

    Args:
        polygons: the cut tights.
        positions: float64[v, 3], their vertices in decimetres.
    """
    count = polygons.vertex_count
    faces = [list(face) for face in polygons.faces]
    rows: list[tuple[int, int, float]] = []
    trunk = np.flatnonzero(np.abs(positions[:, 0]) < 1.0).tolist()
    near = 1 / len(trunk)
    # Each vertex moves away from the mean of the trunk's vertices, because this motion is linear in
    # the positions. A motion away from the trunk's middle at the height of the vertex would need a
    # division, which is not linear, and would look much the same.
    for i in range(count):
        rows.append((i, i, 1 + ROOM))
        rows += [(i, j, -ROOM * near) for j in trunk]
    total = count
    for ring in rings(polygons):
        few = spread(ring, 16)
        middle = positions[few].mean(axis=0)
        collar = middle[1] > 5.5 and abs(middle[0]) < 0.3
        profile = _COLLAR if collar else ((0.0, 0.0), (-3.0, 0.0), (-9.0, 0.0))
        radius = float(np.linalg.norm(positions[ring] - middle, axis=1).mean())
        rise = float(np.linalg.norm(middle - positions[trunk].mean(axis=0)))
        share = 1 / len(few)
        # The cut crosses large faces; without the moving average the edge would show their corners.
        even = _EVEN if collar else (1.0,)
        before, size = ring, len(ring)
        for away, up in profile:
            grow, lift = away * MM / radius, up * MM / rise
            new = list(range(total, total + size))
            for k, n in enumerate(new):
                for i, part in enumerate(even):
                    rows.append((n, ring[(k + i - len(even) // 2) % size], (1 + grow) * part))
                rows += [(n, w, (lift - grow) * share) for w in few]
                rows += [(n, w, -lift * near) for w in trunk] if lift else []
            for k in range(size):
                m = (k + 1) % size
                faces.append([before[m], before[k], new[k], new[m]])
            before, total = new, total + size
    table = np.array(rows)
    return faces, Operator(
        table[:, 0].astype(int), table[:, 1].astype(int), table[:, 2], (total, count)
    )
