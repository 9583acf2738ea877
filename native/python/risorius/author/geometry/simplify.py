# SPDX-License-Identifier: MIT
"""Meshes with fewer vertices, for coarser levels of detail: corners of the fine one, none moved."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ... import Mesh, _native
from .skeleton import Doubles, Ints

_UV = 0.5  # of the texture's width counts as much as of the mesh' size
_MOTION = 2.0  # of the mesh' size, moved otherwise than the neighbours, counts as much as one of it
_COMPONENTS = 6  # of the motion that are looked at
_TRIES = 4
_STUCK = 1.5  # times the vertices that were asked for: seams are given up
# Pieces of a mesh (eyes, teeth, lashes) stay whole: each keeps so many vertices. Pieces that are
# smaller than a share of the mesh all go at once when less would be left of them.
_LEAST_OF_PIECE, _SMALL_PIECE, _GONE = 8, 0.06, 3.0
_CARD, _MANY = 16, 60  # vertices of a card of hair at most, and how many make hair
_THINNED = 0.6  # the power of its share: a head goes bald sooner than it goes flat

Floats = npt.NDArray[np.float32]
Indices = npt.NDArray[np.uint32]


def fan_triangles(mesh: Mesh) -> Ints:
    """int64[n, 3]: the polygons as fans of triangles, in layouts."""
    offsets = np.asarray(mesh.face_offsets, np.int64)
    layouts = np.asarray(mesh.face_layouts, np.int64)
    fans = np.maximum(np.diff(offsets) - 2, 0)
    first = np.repeat(offsets[:-1], fans)
    step = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
    return layouts[np.stack([first, first + step + 1, first + step + 2], axis=1)]


def attributes_of(mesh: Mesh, displacements: Doubles) -> Floats:
    """float32[layouts, n]: texture coordinates, and the main components of the motion.

    Args:
        mesh: stays as it is.
        displacements: float64[E, V, 3], what expressions add to its vertices.
    """
    size = _size(mesh)
    places = np.asarray(mesh.layout_positions, np.int64)
    uvs = np.asarray(mesh.texture_coordinates, np.float64)
    own = uvs[np.asarray(mesh.layout_texture_coordinates, np.int64)]
    moving = np.abs(displacements).max(axis=(1, 2), initial=0.0) > 0
    displacements = displacements[moving]
    if not len(displacements):
        return (_UV * own).astype(np.float32)
    moved = displacements.transpose(1, 0, 2).reshape(len(mesh.positions), -1) / size
    spread, axes = np.linalg.eigh(moved.T @ moved)
    main = axes[:, np.argsort(-spread, kind="stable")[:_COMPONENTS]]
    # An axis has no direction of its own: the larger half of it points up, on every machine.
    main = main * np.where(main[np.abs(main).argmax(axis=0), range(main.shape[1])] < 0, -1, 1)
    return np.column_stack([_UV * own, _MOTION * (moved @ main)[places]]).astype(np.float32)


def _size(mesh: Mesh) -> float:
    return float(np.ptp(np.asarray(mesh.positions, np.float64), axis=0).max()) or 1.0


def pieces_of(mesh: Mesh) -> Ints:
    """int64[V]: the number of the piece that a vertex belongs to; seams of the texture cut
    nothing.

    Args:
        mesh: stays as it is.
    """
    count = len(mesh.positions)
    _, own = np.unique(np.asarray(mesh.positions), axis=0, return_inverse=True)
    corners = own.ravel()[np.asarray(mesh.layout_positions, np.int64)[fan_triangles(mesh)]]
    label = connected(count, corners.ravel(), np.full(len(corners), 3))
    return np.asarray(np.unique(label[own.ravel()], return_inverse=True)[1].ravel(), np.int64)


def connected(count: int, corners: Ints, sizes: Ints) -> Ints:
    """int64[count]: the least vertex of the piece that each vertex belongs to.

    Args:
        count: of the vertices.
        corners: int64, the vertices of all polygons, one polygon after the other.
        sizes: int64[polygons], how many of them each has.
    """
    label = np.arange(count)
    begins = np.cumsum(sizes) - sizes
    while len(sizes):
        least = np.minimum.reduceat(label[corners], begins)
        new = label.copy()
        np.minimum.at(new, corners, np.repeat(least, sizes))
        new = new[new]
        if np.array_equal(new, label):
            break
        label = new
    return label


def fewer_triangles(mesh: Mesh, attributes: Floats, vertices: int) -> Ints:
    """int64[n, 3]: triangles of a mesh' layouts with about so many vertices, some of those it has.

    What the texture and the expressions do is kept beside the form. Borders and seams stay where
    they are; where there are so many seams that nothing can be taken away, each vertex keeps one
    place of the texture. Pieces are kept whole: each has some vertices left, or small ones all go.

    Args:
        mesh: stays as it is.
        attributes: float32[layouts, n] of it, see attributes_of.
        vertices: at most, where it can be.
    """
    triangles = fan_triangles(mesh).astype(np.uint32)
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
    """Vertices of each piece, of which `held` are those that it has; 0: it is left out."""
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
    # Of hair fewer cards stay, whole and evenly, which thins it.
    among = min(len(cards), round(share**_THINNED * len(cards)))
    out[cards] = 0
    stay = cards[np.arange(among) * len(cards) // max(1, among)]
    out[stay] = counts[stay]
    return [int(n) for n in out]


def _fewer_whole(mesh: Mesh, attributes: Floats, triangles: Indices, vertices: int) -> Ints:
    """int64[n, 3]: one piece with fewer triangles."""
    used, own = np.unique(triangles, return_inverse=True)
    triangles = own.reshape(-1, 3).astype(np.uint32)
    places = np.asarray(mesh.layout_positions, np.int64)[used]
    points = np.asarray(mesh.positions, np.float64)[places]
    # An attribute counts beside the size of what is simplified, which is the piece alone.
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
    """Triangles with at most so many vertices, where it can be."""
    # A closed surface has twice as many triangles as vertices; what is open has fewer.
    count, found = 2 * vertices, triangles
    for _ in range(_TRIES):
        found, _ = _native.simplify(points, attributes, triangles, count)
        now = len(np.unique(places[found]))
        if now <= vertices or not len(found):
            break
        count = int(0.97 * count * vertices / now)
    return found


def simplified(mesh: Mesh, triangles: Ints) -> tuple[Mesh, Ints]:
    """The mesh with these triangles of its layouts alone, without skin and shapes.

    Args:
        mesh: stays as it is.
        triangles: int64[n, 3], of fewer_triangles, for it or for one of the same topology.

    Returns:
        The new mesh of triangles, and which vertices of the fine one its own are.
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
