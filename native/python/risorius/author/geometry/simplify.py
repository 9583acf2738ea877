# SPDX-License-Identifier: MIT
"""Simplifies meshes for coarser levels of detail. Kept vertices are not moved."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence

import numpy as np
import numpy.typing as npt

from ... import Mesh, _native
from .blocks import LARGE
from .skeleton import Doubles, Ints

_UV = 0.5  # weight of texture coordinates relative to positions in units of the mesh' size
_MOTION = 2.0  # weight of displacements by expressions relative to positions
_COMPONENTS = 6  # number of principal components of the displacements
_TRIES = 4
_STUCK = 1.5  # factor of the vertex budget above which seams of the texture are welded
# A connected piece of a mesh, such as an eye, a tooth or a lash, keeps at least _LEAST_OF_PIECE
# vertices. A piece is small if its longest side is below _SMALL_PIECE times the size of the mesh.
# All small pieces are removed if they would keep fewer than _GONE vertices on average.
_LEAST_OF_PIECE, _SMALL_PIECE, _GONE = 8, 0.06, 3.0
_CARD, _MANY = 16, 60  # largest number of vertices of a hair card; smallest number of cards of hair
# The fraction of kept hair cards is the fraction of kept vertices to this power. The power is below
# 1, so that more cards stay, because missing cards are more visible than a coarser skin.
_THINNED = 0.6

Floats = npt.NDArray[np.float32]
Indices = npt.NDArray[np.uint32]


def fan_triangles(mesh: Mesh) -> Ints:
    """int64[n, 3]: the polygons as fans of triangles; the numbers are layout indices."""
    offsets = np.asarray(mesh.face_offsets, np.int64)
    layouts = np.asarray(mesh.face_layouts, np.int64)
    fans = np.maximum(np.diff(offsets) - 2, 0)
    first = np.repeat(offsets[:-1], fans)
    step = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
    return layouts[np.stack([first, first + step + 1, first + step + 2], axis=1)]


def attributes_of(
    mesh: Mesh, some: Doubles, blocks: Iterable[tuple[Ints, Mesh, Doubles]] | None = None
) -> Floats:
    """float32[layouts, n]: texture coordinates and principal components of the displacements.

    Args:
        mesh: the mesh.
        some: float64[E, n, 3], displacements of all or many vertices by the expressions, which
            determine the components.
        blocks: indices of the vertices, part of the mesh and displacements float64[E, n, 3] of
            each block; each vertex is in one. None: `some` has all vertices.
    """
    size = _size(mesh)
    places = np.asarray(mesh.layout_positions, np.int64)
    uvs = np.asarray(mesh.texture_coordinates, np.float64)
    own = uvs[np.asarray(mesh.layout_texture_coordinates, np.int64)]
    moving = np.flatnonzero(some.any(axis=(1, 2)))
    if not len(moving):
        return (_UV * own).astype(np.float32)
    moved = _by_vertex(some, moving) / size
    spread, axes = np.linalg.eigh(moved.T @ moved)
    main = axes[:, np.argsort(-spread, kind="stable")[:_COMPONENTS]]
    # The sign of an eigenvector is arbitrary. Its largest entry is made positive on every machine.
    main = main * np.where(main[np.abs(main).argmax(axis=0), range(main.shape[1])] < 0, -1, 1)
    along = np.zeros((len(mesh.positions), main.shape[1]))
    for vertices, _, displacements in blocks or [(np.arange(len(along)), mesh, some)]:
        along[vertices] = _by_vertex(displacements, moving) / size @ main
    return np.column_stack([_UV * own, _MOTION * along[places]]).astype(np.float32)


def _by_vertex(displacements: Doubles, expressions: Ints) -> Doubles:
    """float64[V, 3 n]: the displacements [E, V, 3] by n of the expressions."""
    own = displacements[expressions]
    return own.transpose(1, 0, 2).reshape(own.shape[1], -1)


def _size(mesh: Mesh) -> float:
    return float(np.ptp(np.asarray(mesh.positions, np.float64), axis=0).max()) or 1.0


def pieces_of(mesh: Mesh) -> Ints:
    """int64[V]: number of the connected piece of each vertex; texture seams do not separate, and
    vertices at the same position are connected.

    Args:
        mesh: the mesh.
    """
    count = len(mesh.positions)
    _, own = np.unique(np.asarray(mesh.positions), axis=0, return_inverse=True)
    corners = own.ravel()[np.asarray(mesh.layout_positions, np.int64)[fan_triangles(mesh)]]
    label = connected(count, corners.ravel(), np.full(len(corners), 3))
    return np.asarray(np.unique(label[own.ravel()], return_inverse=True)[1].ravel(), np.int64)


def connected(count: int, corners: Ints, sizes: Ints) -> Ints:
    """int64[count]: the smallest vertex index of each vertex' connected piece.

    Args:
        count: number of vertices.
        corners: int64, vertex indices of all polygons, concatenated.
        sizes: int64[polygons], number of corners of each polygon.
    """
    label = np.arange(count)
    begins = np.cumsum(sizes) - sizes
    while len(sizes):
        own = label[corners]
        least = np.repeat(np.minimum.reduceat(own, begins), sizes)
        larger = own > least
        if not larger.any():
            break
        np.minimum.at(label, own[larger], least[larger])
        above = label[label]
        while not np.array_equal(above, label):
            label, above = above, above[above]
    return label


def fewer_triangles(
    mesh: Mesh, attributes: Floats, vertices: int, begin: Ints | None = None
) -> Ints:
    """int64[n, 3]: triangles of a simplified mesh, as layout indices of the given mesh.

    The simplification preserves the shape of the surface, its texture coordinates and its
    displacements by expressions. Borders and seams stay in place. If seams prevent the reduction,
    they are welded, and each vertex keeps one texture coordinate. Each connected piece keeps some
    vertices, or all small pieces are removed. Of the cards of hair, some are kept whole, and the
    others are removed.

    Args:
        mesh: the mesh; it is not changed.
        attributes: float32[layouts, n], the result of attributes_of(), which is preserved.
        vertices: wanted largest number of vertices; seams and borders may require more.
        begin: int64[n, 3], triangles of a finer level as layout indices, which are simplified
            further; None: all triangles of the mesh.
    """
    triangles = (fan_triangles(mesh) if begin is None else begin).astype(np.uint32)
    places = np.asarray(mesh.layout_positions, np.int64)
    if not len(triangles):
        return np.asarray(triangles, np.int64)
    pieces = pieces_of(mesh)[places[triangles[:, 0]]]
    order = np.argsort(pieces, kind="stable")
    parts = np.split(triangles[order], np.flatnonzero(np.diff(pieces[order])) + 1)
    held = [np.unique(places[part]) for part in parts]
    out = [
        np.asarray(part, np.int64)
        if budget >= len(own)
        else _fewer_whole(mesh, attributes, part, budget)
        for part, own, budget in zip(parts, held, _budgets(mesh, held, vertices), strict=True)
        if budget
    ]
    return np.concatenate([np.zeros((0, 3), np.int64), *out])


def _budgets(mesh: Mesh, held: Sequence[Ints], vertices: int) -> list[int]:
    """The number of vertices that each piece keeps; 0 removes the piece.

    Args:
        mesh: the mesh.
        held: vertex indices of each piece.
        vertices: wanted number of vertices of all pieces.
    """
    if len(held) == 1:
        return [vertices]
    positions, size = np.asarray(mesh.positions, np.float64), _size(mesh)
    counts = np.array([len(own) for own in held])
    share = vertices / max(1, int(counts.sum()))
    cards = np.flatnonzero(counts <= _CARD)
    if len(cards) < _MANY:
        cards = cards[:0]
    extents = np.array([np.ptp(positions[own], axis=0).max() for own in held])
    small = extents < _SMALL_PIECE * size
    small[cards] = False
    out = np.maximum(np.minimum(counts, _LEAST_OF_PIECE), np.round(share * counts))
    if share * counts[small].sum() < _GONE * small.sum():
        out[small] = 0
    # Of the cards of hair, every nth is kept whole, and the others are removed.
    among = min(len(cards), round(share**_THINNED * len(cards)))
    out[cards] = 0
    stay = cards[np.arange(among) * len(cards) // max(1, among)]
    out[stay] = counts[stay]
    return [int(n) for n in out]


def _fewer_whole(mesh: Mesh, attributes: Floats, triangles: Indices, vertices: int) -> Ints:
    """int64[n, 3]: triangles of one piece, simplified as a whole. Texture seams are welded if they
    prevent the reduction to `vertices`."""
    used, own = np.unique(triangles, return_inverse=True)
    triangles = own.reshape(-1, 3).astype(np.uint32)
    places = np.asarray(mesh.layout_positions, np.int64)[used]
    points = np.asarray(mesh.positions, np.float64)[places]
    # Attributes are relative to the mesh' size, but the simplifier compares them with the piece's
    # size. So they are divided by the piece's size relative to the mesh.
    share = float(np.ptp(points, axis=0).max()) / _size(mesh)
    attributes = attributes[used] / np.float32(max(share, 1e-6))
    points = points.astype(np.float32)
    found = _fewer(points, attributes, triangles, places, vertices)
    if len(np.unique(places[found])) > _STUCK * vertices:
        _, first, of = np.unique(places, return_index=True, return_inverse=True)
        welded = of.ravel()[triangles].astype(np.uint32)
        found = _fewer(points[first], attributes[first, 2:], welded, places[first], vertices)
        found = np.asarray(first, np.uint32)[found]
    return np.asarray(used[found], np.int64)


def _fewer(
    points: Floats, attributes: Floats, triangles: Indices, places: Ints, vertices: int
) -> Indices:
    """Simplified triangles. Borders and seams may keep them above `vertices` vertices."""
    # A closed surface has twice as many triangles as vertices; an open surface has fewer.
    count, found = 2 * vertices, triangles
    for _ in range(_TRIES):
        # To save time, each try on a large mesh simplifies the result of the try before it.
        begin = found if len(triangles) > 4 * LARGE else triangles
        found, _ = _native.simplify(points, attributes, begin, count)
        now = len(np.unique(places[found]))
        if now <= vertices or not len(found):
            break
        count = int(0.97 * count * vertices / now)
    return found


def simplified(mesh: Mesh, triangles: Ints) -> tuple[Mesh, Ints]:
    """A mesh that consists of given triangles of a fine mesh, without shapes. The caller must
    replace the skin weights, because the new mesh still has the weights of the fine mesh.

    Args:
        mesh: the fine mesh.
        triangles: int64[n, 3], layouts from fewer_triangles() of a mesh with the same topology.

    Returns:
        The new mesh, and the index in the fine mesh of each vertex.
    """
    layouts, corners = np.unique(triangles, return_inverse=True)

    def kept(of: object) -> tuple[Ints, Ints]:
        return np.unique(np.asarray(of, np.int64)[layouts], return_inverse=True)

    vertices, to_vertex = kept(mesh.layout_positions)
    uvs, to_uv = kept(mesh.layout_texture_coordinates)
    normals, to_normal = kept(mesh.layout_normals)
    out = copy.copy(mesh)
    out.positions = np.asarray(mesh.positions)[vertices]
    out.texture_coordinates = np.asarray(mesh.texture_coordinates)[uvs]
    out.normals = np.asarray(mesh.normals)[normals]
    out.layout_positions, out.layout_texture_coordinates = to_vertex, to_uv
    out.layout_normals = to_normal
    out.face_offsets = 3 * np.arange(len(triangles) + 1)
    out.face_layouts = corners.ravel()
    out.blend_shape_targets = []
    return out, vertices
