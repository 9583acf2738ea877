# SPDX-License-Identifier: MIT
"""Makes a Mesh of a DNA file from polygons with positions and texture coordinates."""

from __future__ import annotations

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
    corners = [
        pair
        for face, uv_face in zip(faces, uv_faces, strict=True)
        for pair in zip(face, uv_face, strict=True)
    ]
    layouts, index = np.unique(np.array(corners), axis=0, return_inverse=True)
    return Mesh(
        positions=positions,
        texture_coordinates=uvs,
        normals=normals,
        layout_positions=layouts[:, 0],
        layout_texture_coordinates=layouts[:, 1],
        layout_normals=layouts[:, 0],
        face_offsets=np.concatenate([[0], np.cumsum([len(face) for face in faces])]),
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
            np.add.at(normals, table[:, k], area)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.where(length > 0, normals / np.maximum(length, 1e-12), [0.0, 0.0, 1.0])
