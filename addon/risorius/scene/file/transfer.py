# SPDX-License-Identifier: GPL-3.0-or-later
"""Transfers the user's mesh attributes, such as UV maps, to a mesh of another topology."""

from __future__ import annotations

from typing import Any, Protocol

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree
from numpy.typing import NDArray

from ...logic.character import user_edits
from ..base.blender_types import Attribute, Values

# Attributes that the import or Blender creates. Attributes with other names belong to the user.
_OURS = {"position", "UVMap", "custom_normal", "material_index"}
_SHADING = {"sharp_edge", "sharp_face"}
OUR_PREFIX = "risorius_"  # prefix of attributes that the add-on's materials read
_FIELDS = {
    "FLOAT": ("value", 1, np.float32),
    "INT": ("value", 1, np.int32),
    "BOOLEAN": ("value", 1, bool),
    "FLOAT2": ("vector", 2, np.float32),
    "FLOAT_VECTOR": ("vector", 3, np.float32),
    "FLOAT_COLOR": ("color", 4, np.float32),
    "BYTE_COLOR": ("color", 4, np.float32),
}


class Carry(Protocol):
    """Converts values of old vertices to values of new vertices."""

    def vertices(self, values: Values) -> Values:
        """Values [V, ...] of old vertices converted to values [W, ...] of new vertices."""
        ...

    def nearest_vertices(self, indices: list[int]) -> list[int]:
        """The new vertex nearest to each old vertex."""
        ...


class SameVertices:
    """Transfer between meshes with equal vertex order: vertex i stays vertex i."""

    def vertices(self, values: Values) -> Values:
        """The values, unchanged."""
        return values

    def nearest_vertices(self, indices: list[int]) -> list[int]:
        """The indices, unchanged."""
        return indices


class Nearest:
    """Transfer from the nearest point of the old surface to each new vertex.

    Args:
        old: float64[V, 3], old neutral vertices.
        triangles: int[T, 3], vertex indices of the old mesh's triangles.
        new: float64[W, 3], new neutral vertices.
    """

    def __init__(
        self, old: NDArray[np.float64], triangles: NDArray[np.int32], new: NDArray[np.float64]
    ) -> None:
        self._old, self._new = old, new
        where, weights = nearest_triangles(old, triangles, new)
        self._corners, self._weights = triangles[where], weights

    def vertices(self, values: Values) -> Values:
        """Values [V, ...] of old vertices interpolated at the new vertices, float64[W, ...]."""
        values = np.asarray(values, np.float64)
        shape = (len(self._weights), 3) + (1,) * (values.ndim - 1)
        return np.sum(values[self._corners] * self._weights.reshape(shape), axis=1)

    def nearest_vertices(self, indices: list[int]) -> list[int]:
        """The new vertex nearest to each old vertex; negative indices stay."""
        return [
            int(np.argmin(np.sum((self._new - self._old[i]) ** 2, axis=1))) if i >= 0 else i
            for i in indices
        ]


def nearest_triangles(
    points: NDArray[np.float64], triangles: NDArray[np.int32], queries: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The nearest triangle of each query point.

    Args:
        points: float64[V, 3], vertices of a mesh.
        triangles: int32[T, 3], indices of points.
        queries: float64[n, 3], points in the same space.

    Returns:
        int64[n] indices of triangles, and float64[n, 3] barycentric weights of the nearest points
        on them.
    """
    tree: Any = BVHTree.FromPolygons(points.tolist(), triangles.tolist())
    found = [tree.find_nearest(query) for query in queries.tolist()]
    where = np.array([hit[2] or 0 for hit in found], np.int64)
    spots = np.array([hit[0] if hit[0] is not None else (0, 0, 0) for hit in found], np.float64)
    return where, user_edits.barycentric(spots.reshape(-1, 3), points[triangles[where]])


def triangles_of(
    mesh: bpy.types.Mesh,
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Triangles of a mesh: vertices int32[T, 3], corners int32[T, 3], polygon int32[T]."""
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    result = []
    for name, width in (("vertices", 3), ("loops", 3), ("polygon_index", 1)):
        flat = np.empty(count * width, np.int32)
        mesh.loop_triangles.foreach_get(name, flat)
        result.append(flat.reshape(-1, width) if width > 1 else flat)
    return tuple(result)


def own_attributes(mesh: bpy.types.Mesh) -> tuple[list[tuple[str, str, str, Values]], list[str]]:
    """The user's attributes of a mesh: (name, type, domain, values) of each attribute that can be
    transferred, and the names of the other attributes of the user."""
    kept, other = [], []
    attributes: list[Attribute] = list(mesh.attributes)
    for layer in attributes:
        internal = layer.is_internal or layer.name.startswith((".", OUR_PREFIX))
        if internal or layer.name in _OURS | _SHADING:
            continue
        if layer.data_type in _FIELDS and layer.domain in {"POINT", "CORNER", "FACE"}:
            field, width, kind = _FIELDS[layer.data_type]
            flat = np.empty(len(layer.data) * width, kind)
            layer.data.foreach_get(field, flat)
            kept.append((layer.name, layer.data_type, layer.domain, flat.reshape(-1, width)))
        else:
            other.append(layer.name)
    return kept, other


class OldSurface:
    """The data of a mesh that are transferred to its new polygons.

    Args:
        mesh: the unchanged Mesh.
        points: float32[V, 3], neutral vertices of the mesh.
    """

    def __init__(self, mesh: bpy.types.Mesh, points: NDArray[np.float32]) -> None:
        self.points = points.astype(np.float64)
        self.triangles, self.corners, self.faces = triangles_of(mesh)
        self.layers, self.lost = own_attributes(mesh)
        self.materials = np.zeros(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("material_index", self.materials)
        uvs = mesh.uv_layers
        self.active = uvs.active.name if uvs.active else ""
        self.rendered = next((u.name for u in uvs if u.active_render), "")
        self.colour = mesh.color_attributes.active_color_name

    @property
    def usable(self) -> bool:
        """Whether the mesh has triangles, so that a nearest point exists."""
        return len(self.triangles) > 0

    def give(self, mesh: bpy.types.Mesh, points: NDArray[np.float32], carry: Carry) -> None:
        """Transfer the user's attributes and the polygons' material indices to the new polygons.

        Nothing is transferred if the old or the new mesh has no polygons.

        Args:
            mesh: the Mesh with its new polygons.
            points: float32[W, 3], new neutral vertices.
            carry: converts values of vertices, SameVertices or Nearest.
        """
        if not self.usable or not len(mesh.polygons):
            return
        places = points.astype(np.float64)
        corner = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", corner)
        sizes = np.empty(len(mesh.polygons), np.int32)
        mesh.polygons.foreach_get("loop_total", sizes)
        face = np.repeat(np.arange(len(sizes)), sizes)
        middle = np.zeros((len(sizes), 3))
        np.add.at(middle, face, places[corner])
        middle /= sizes[:, None]
        if self.materials.any():
            where, _ = nearest_triangles(self.points, self.triangles, middle)
            mesh.polygons.foreach_set("material_index", self.materials[self.faces[where]])
        spots = None
        for name, kind, domain, values in self.layers:
            if domain == "POINT":
                given = carry.vertices(values)
            elif domain == "FACE":
                where, _ = nearest_triangles(self.points, self.triangles, middle)
                given = values[self.faces[where]]
            else:
                if spots is None:  # slightly inside the polygon, so that seams stay sharp
                    inside = places[corner] * 0.98 + middle[face] * 0.02
                    spots = nearest_triangles(self.points, self.triangles, inside)
                given = np.sum(values[self.corners[spots[0]]] * spots[1][..., None], axis=1)
            _write_layer(mesh, name, kind, domain, given)
        self._activate(mesh)

    def _activate(self, mesh: bpy.types.Mesh) -> None:
        if self.active in mesh.uv_layers:
            mesh.uv_layers.active = mesh.uv_layers[self.active]
        if self.rendered in mesh.uv_layers:
            mesh.uv_layers[self.rendered].active_render = True
        if self.colour and self.colour in mesh.color_attributes:
            mesh.color_attributes.active_color_name = self.colour


def _write_layer(mesh: bpy.types.Mesh, name: str, kind: str, domain: str, values: Values) -> None:
    field, _width, dtype = _FIELDS[kind]
    attributes: Any = mesh.attributes
    layer = attributes.get(name) or attributes.new(name, kind, domain)
    if dtype is bool:
        values = np.asarray(values, np.float64) > 0.5
    elif dtype is np.int32:
        values = np.rint(values)
    layer.data.foreach_set(field, np.ascontiguousarray(values, dtype).ravel())
