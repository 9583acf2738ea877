# SPDX-License-Identifier: MIT
"""Makes a Mesh of a DNA file from polygons with positions and texture coordinates."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ... import Mesh

Floats = npt.NDArray[Any]  # NumPy's stubs lose the type in arithmetic


def polygon_mesh(
    positions: Floats,
    normals: Floats,
    faces: Sequence[Sequence[int]],
    uvs: Floats,
    uv_faces: Sequence[Sequence[int]],
) -> Mesh:
    """A mesh without weights and shapes. Each pair of vertex and texture coordinate is a layout.

    Args:
        positions: float64[V, 3], vertex positions.
        normals: float64[V, 3], vertex normals.
        faces: vertex indices of each polygon.
        uvs: float64[T, 2], texture coordinates.
        uv_faces: indices into `uvs` of each polygon's corners.
    """
    sizes = np.fromiter(map(len, faces), np.int64, len(faces))
    vertices, places = (
        np.fromiter(itertools.chain.from_iterable(of), np.int64, int(sizes.sum()))
        for of in (faces, uv_faces)
    )
    count = max(int(places.max(initial=0)) + 1, 1)
    key, index = np.unique(vertices * count + places, return_inverse=True)
    layouts = np.stack(np.divmod(key, count), axis=1)
    return Mesh(
        positions=positions,
        texture_coordinates=uvs,
        normals=normals,
        layout_positions=layouts[:, 0],
        layout_texture_coordinates=layouts[:, 1],
        layout_normals=layouts[:, 0],
        face_offsets=np.concatenate([[0], np.cumsum(sizes)]),
        face_layouts=index.ravel(),
    )


def vertex_normals(positions: Floats, faces: Sequence[Sequence[int]]) -> Floats:
    """Unit normals [V, 3]: area-weighted means of the adjacent faces; +z if the faces have no area.

    Args:
        positions: float64[V, 3], vertex positions.
        faces: vertex indices of each polygon, counter-clockwise seen from outside.
    """
    normals = np.zeros_like(positions)
    for size in {len(face) for face in faces}:
        table = np.array([face for face in faces if len(face) == size])
        corners = positions[table]
        area = np.zeros((len(table), 3))
        for k in range(1, size - 1):
            area += np.cross(corners[:, k] - corners[:, 0], corners[:, k + 1] - corners[:, 0])
        for k in range(size):
            for axis in range(3):
                normals[:, axis] += np.bincount(table[:, k], area[:, axis], len(normals))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 0, normals / np.maximum(length, 1e-12), [0.0, 0.0, 1.0])
