# SPDX-License-Identifier: MIT
"""Makes the meshes of the eyes: balls, corneas, tear lines along the lower lids, caruncles."""

from __future__ import annotations

import numpy as np

from ..part import Part
from ..polygons import Floats, Ints, Operator, Polygons, compact_uvs, subdivide
from ..source import BaseMesh
from .rings import COLUMNS, LOWER, ROOT, TEMPLE, find_rings

# Name of a mesh of the eyes -> groups of the base mesh from which it is made.
_BALLS = {
    "eyeLeft": ["eyeball-l"],
    "eyeRight": ["eyeball-r"],
    "cornea": ["cornea-l", "cornea-r"],
}
# Cross sections of the caruncle, each as a tuple: number of grid columns from the eye's inner
# corner; position across the lid's rim (0 at the lashes' roots, 2 to 3 where the rim meets the
# eye); height above the line between upper and lower rim, in lid thicknesses.
_MOUND = (
    (0, 0.35, -0.02),
    (0, 1.0, 0.10),
    (1, 1.5, 0.20),
    (2, 1.9, 0.24),
    (3, 2.1, 0.16),
    (4, 2.25, 0.04),
    (4, 2.7, -0.15),
)
_APART = 0.12  # weight of the neighbouring column in the caruncle's vertices at the eye's corner
Row = dict[int, float]  # vertex of the base mesh -> weight; the weights of a row sum to 1


def eye_parts(base: BaseMesh, groups: dict[str, Ints], lod: int) -> list[Part]:
    """Makes all meshes of the eyes at one LOD.

    Args:
        base: the base mesh with its eyeballs.
        groups: name of a group of the base mesh -> vertex indices.
        lod: number of the LOD: 0, or 1 for coarse meshes.
    """
    out = []
    for name, own in _BALLS.items():
        ending = "-coarse" if lod else ""
        corners = [face for group in own for face in base.faces[group + ending]]
        out.append(_picked(f"{name}_lod{lod}_mesh", base, corners))
    rings = find_rings(base, groups)
    for name, strip in (("eyeEdge", _tears), ("cartilage", _caruncle)):
        rows: list[Row] = []
        faces: list[list[int]] = []
        uvs: list[Floats] = []
        for side in "lr":
            points, quads, places = strip(rings[side])
            faces += [[len(rows) + v for v in quad] for quad in quads]
            rows += points
            uvs.append(places)
        polygons = Polygons(faces, faces, np.concatenate(uvs), len(rows))
        part = Part(f"{name}_lod{lod}_mesh", polygons, [_operator(rows, len(base.positions))])
        for _ in range(1 - lod):
            part.polygons, operator = subdivide(part.polygons)
            part.operators.append(operator)
        out.append(part)
    return out


def _picked(name: str, base: BaseMesh, corners: list[list[tuple[int, int]]]) -> Part:
    vertices = sorted({c[0] for face in corners for c in face})
    number = {v: i for i, v in enumerate(vertices)}
    polygons = Polygons(
        [[number[c[0]] for c in face] for face in corners],
        [[c[1] for c in face] for face in corners],
        base.uvs,
        len(vertices),
    )
    rows: list[Row] = [{v: 1.0} for v in vertices]
    return Part(name, compact_uvs(polygons), [_operator(rows, len(base.positions))])


def _operator(rows: list[Row], columns: int) -> Operator:
    entries = [(r, column, share) for r, row in enumerate(rows) for column, share in row.items()]
    table = np.array(entries)
    return Operator(
        table[:, 0].astype(int), table[:, 1].astype(int), table[:, 2], (len(rows), columns)
    )


def _mixed(*parts: tuple[float, Row]) -> Row:
    out: Row = {}
    for share, row in parts:
        for vertex, weight in row.items():
            out[vertex] = out.get(vertex, 0.0) + share * weight
    return out


def _on_skin(rings: Ints, row: int, column: int) -> Row:
    """Weights of the base mesh's vertices for a lid vertex after the subdivision of LOD 0.

    Args:
        rings: int64[13, COLUMNS], vertices of the rings of skin around the eye, from the cheek and
            brow inward.
        row: row of the grid, neither the first nor the last.
        column: column of the grid.
    """
    out: Row = {}
    for down in (-1, 0, 1):
        for aside in (-1, 0, 1):
            share = (9 / 16, 3 / 32, 1 / 64)[abs(down) + abs(aside)]
            vertex = int(rings[row + down, (column + aside) % COLUMNS])
            out[vertex] = out.get(vertex, 0.0) + share
    return out


def _rim(rings: Ints, at: float, column: int) -> Row:
    """Weights of the base mesh's vertices for a point on a lid's rim.

    Args:
        rings: int64[13, COLUMNS], vertices of the rings of skin around the eye, from the cheek and
            brow inward.
        at: position across the rim: 0 at the lashes' roots, 2 to 3 where the rim meets the eye.
        column: column of the grid.
    """
    row = min(int(at), 2)
    low, high = (_on_skin(rings, ROOT + row + k, column) for k in (0, 1))
    return _mixed((1 - (at - row), low), (at - row, high))


def _tears(rings: Ints) -> tuple[list[Row], list[list[int]], Floats]:
    """Makes the tear line between lower lid and eye: a hollow strip from the rim to the ball.

    Args:
        rings: int64[13, COLUMNS], vertices of the rings of skin around the eye, from the cheek and
            brow inward.

    Returns:
        Vertices as weights of the base mesh's vertices, faces, and texture coordinates
        float64[vertices, 2].
    """
    rows: list[Row] = []
    columns = list(range(LOWER.stop - 1, TEMPLE - 1, -1))  # from the nose to the temple
    for column in columns:
        facing = (COLUMNS - column) % COLUMNS
        meets = _rim(rings, 2.2, column)
        above = _rim(rings, 2.2, facing)
        skin, deep = _rim(rings, 0.0, column), _rim(rings, 3.0, column)

        def raised(row: Row, share: float, skin: Row = skin, deep: Row = deep) -> Row:
            return _mixed((1, row), (share, skin), (-share, deep))

        ball = raised(_mixed((0.945, meets), (0.055, above)), 0.03)
        lid = raised(_rim(rings, 1.62, column), 0.02)
        under = raised(_rim(rings, 1.45, column), -0.02)
        inner = raised(_mixed((0.92, meets), (0.08, above)), -0.03)
        middle = raised(_mixed((0.38, ball), (0.36, lid), (0.26, meets)), 0.03)
        rows += [under, lid, middle, ball, inner]
    return _strip(rows, 5)


def _caruncle(rings: Ints) -> tuple[list[Row], list[list[int]], Floats]:
    """Makes the caruncle, the pink flesh in the inner corner: a mound between the rims.

    Args:
        rings: int64[13, COLUMNS], vertices of the rings of skin around the eye, from the cheek and
            brow inward.

    Returns:
        Vertices as weights of the base mesh's vertices, faces, and texture coordinates
        float64[vertices, 2].
    """
    rows: list[Row] = []
    for aside, at, high in _MOUND:
        upper, lower = (_rim(rings, at, column) for column in (aside, (COLUMNS - aside) % COLUMNS))
        if aside == 0:  # mixes in the neighbours, so that no two vertices coincide
            upper = _mixed((1 - _APART, upper), (_APART, _rim(rings, at, 1)))
            lower = _mixed((1 - _APART, lower), (_APART, _rim(rings, at, COLUMNS - 1)))
        skin = _mixed((0.5, _rim(rings, 0.0, aside)), (0.5, _rim(rings, 0.0, -aside % COLUMNS)))
        deep = _mixed((0.5, _rim(rings, 3.0, aside)), (0.5, _rim(rings, 3.0, -aside % COLUMNS)))
        for share, up in ((0.0, -0.05), (0.25, 0.8), (0.5, 1.0), (0.75, 0.8), (1.0, -0.05)):
            between = _mixed((1 - share, lower), (share, upper))
            rows.append(_mixed((1, between), (up * high, skin), (-up * high, deep)))
    return _strip(rows, 5)


def _strip(rows: list[Row], across: int) -> tuple[list[Row], list[list[int]], Floats]:
    """Adds quads between rows of `across` vertices each, counter-clockwise from the front, and
    texture coordinates from 0 to 1.

    Returns:
        The rows unchanged, faces, and texture coordinates float64[vertices, 2].
    """
    length = len(rows) // across
    faces = []
    for k in range(length - 1):
        for j in range(across - 1):
            a, b = k * across + j, (k + 1) * across + j
            faces.append([a, b, b + 1, a + 1])
    along, up = np.meshgrid(np.linspace(0, 1, length), np.linspace(0, 1, across), indexing="ij")
    return rows, faces, np.stack([along.ravel(), up.ravel()], axis=1)
