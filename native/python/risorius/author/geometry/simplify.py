# SPDX-License-Identifier: MIT
"""Meshes with fewer vertices, for coarser levels of detail: corners of the fine one, none moved."""

from __future__ import annotations

import copy

import numpy as np
import numpy.typing as npt

from ... import Mesh, _native
from .skeleton import Doubles, Ints

_UV = 0.5  # of the texture's width counts as much as of the mesh' size
_MOTION = 2.0  # of the mesh' size, moved otherwise than the neighbours, counts as much as one of it
_COMPONENTS = 6  # of the motion that are looked at
_TRIES = 4
_STUCK = 1.5  # times the vertices that were asked for: seams are given up

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


def fewer_triangles(mesh: Mesh, attributes: Floats, vertices: int) -> Ints:
    """int64[n, 3]: triangles of a mesh' layouts with about so many vertices, some of those it has.

    What the texture and the expressions do is kept beside the form. Borders and seams stay where
    they are; where there are so many seams that nothing can be taken away, each vertex keeps one
    place of the texture. A mesh of many pieces may keep more vertices than were asked for.

    Args:
        mesh: stays as it is.
        attributes: float32[layouts, n] of it, see attributes_of.
        vertices: at most, where it can be.
    """
    positions = np.asarray(mesh.positions, np.float64)
    places = np.asarray(mesh.layout_positions, np.int64)
    points = positions[places].astype(np.float32)
    triangles = fan_triangles(mesh).astype(np.uint32)
    found = _fewer(points, attributes, triangles, places, vertices)
    if len(np.unique(places[found])) > _STUCK * vertices:
        _, first, of = np.unique(places, return_index=True, return_inverse=True)
        welded = of.ravel()[triangles].astype(np.uint32)
        found = _fewer(points[first], attributes[first, 2:], welded, places[first], vertices)
        found = np.asarray(first, np.uint32)[found]
    return np.asarray(found, np.int64)


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
