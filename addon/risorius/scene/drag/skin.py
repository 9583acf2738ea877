# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads vertices of a face's visible meshes in world space, and finds mirrored vertices.

A point is a vertex of a face: (index of the mesh in the DNA file, index of the vertex).
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ..base import last_written, parts
from ..base.blender_types import ArmatureObject, Context, Depsgraph, MeshObject
from ..character import runtime
from ..lod import lods

Float = NDArray[np.float64]
Point = tuple[int, int]  # index of a mesh in the DNA file, index of its vertex

_BESIDE = 0.02  # largest distance of a vertex from the mirrored position / size of the face


@dataclass
class Skin:
    """A face's meshes in the scene.

    A Skin refers to Blender objects, so it must not outlive the operator that creates it.

    Attributes:
        surface: the face in file space (axes and unit of the DNA file), at the visible level of
            detail.
        items: mesh index -> mesh object.
        size: largest extent of the level's first neutral mesh, in Blender units; below it is called
            the size of the face.
        depsgraph: dependency graph of the view.
        live: Runtime of the character.
        pressed: float64[3], world position of the dragged vertex at the mouse press, or None.
    """

    surface: native.Surface
    items: dict[int, MeshObject]
    size: float
    depsgraph: Depsgraph
    live: runtime.Runtime
    pressed: Float | None = None

    @classmethod
    def of(cls, context: Context, rig: ArmatureObject, live: runtime.Runtime) -> Skin:
        """The Skin of a character, at the level of detail that the viewport shows.

        Args:
            context: has the visible scene.
            rig: the character.
            live: Runtime of the character.
        """
        last = last_written.inputs.get(rig.session_uid)
        level = lods.expected(rig, False, last[1] if isinstance(last, tuple) else None)
        level = min(max(level, 0), max(live.rig.lod_count - 1, 0))
        surface = live.surface(level)
        items = {i[parts.MESH]: i for i in parts.meshes_of(rig)}
        first = surface.mesh_indices[0] if surface.mesh_indices else 0
        places = np.asarray(live.dna.meshes[first].positions)
        size = float(np.ptp(places, axis=0).max(initial=0.0)) * live.space.scale
        return cls(surface, items, size or 1.0, context.evaluated_depsgraph_get(), live)

    def show(self, context: Context) -> None:
        """Evaluate the face with changed sliders.

        Args:
            context: its view layer is evaluated.
        """
        context.view_layer.update()  # its handler writes the bones, which need a second update
        context.view_layer.update()
        self.depsgraph = context.evaluated_depsgraph_get()

    def seen(self, mesh: int) -> Float | None:
        """float64[V, 3]: evaluated vertices of a mesh in world space.

        None if the mesh is hidden or in edit mode, or if its vertex count differs from the DNA file
        before or after the modifiers.

        Args:
            mesh: index of the mesh in the DNA file.
        """
        data, place = self._evaluated(mesh)
        if data is None:
            return None
        flat = np.empty(3 * len(data.vertices), np.float32)
        data.vertices.foreach_get("co", flat)
        return flat.reshape(-1, 3).astype(np.float64) @ place[:3, :3].T + place[:3, 3]

    def seen_at(self, point: Point) -> Float | None:
        """float64[3]: one evaluated vertex in world space; None in the same cases as `seen`.

        Args:
            point: index of the mesh in the DNA file, and vertex.
        """
        data, place = self._evaluated(point[0])
        if data is None:
            return None
        return place[:3, :3] @ np.array(data.vertices[point[1]].co, np.float64) + place[:3, 3]

    def corners(self, mesh: int, polygon: int) -> list[tuple[int, Float]] | None:
        """(vertex, position in world space) of a polygon's vertices.

        None if `seen` gives None or there is no such polygon.

        Args:
            mesh: index of the mesh in the DNA file.
            polygon: index of the polygon in the evaluated mesh.
        """
        data, place = self._evaluated(mesh)
        if data is None or not 0 <= polygon < len(data.polygons):
            return None
        found = [
            (v, np.array(data.vertices[v].co, np.float64)) for v in data.polygons[polygon].vertices
        ]
        return [(v, place[:3, :3] @ co + place[:3, 3]) for v, co in found]

    def _evaluated(self, mesh: int) -> tuple[bpy.types.Mesh | None, Float]:
        item = self.items.get(mesh)
        seen = item.evaluated_get(self.depsgraph) if item is not None else None
        if item is None or seen is None or not seen.is_evaluated or item.mode == "EDIT":
            return None, np.eye(4)
        data = seen.data
        assert isinstance(data, bpy.types.Mesh)
        same = len(data.vertices) == len(item.data.vertices) == self.surface.vertex_counts[mesh]
        return (data if same else None), np.array(seen.matrix_world)

    def mirrored(self, point: Point) -> Point | None:
        """The vertex nearest to the mirror image of a vertex in the neutral face.

        None if this vertex is _BESIDE times the size of the face or more from the mirror image.

        Args:
            point: mesh and vertex; a vertex on the middle line is its own mirror.
        """
        at = self._rest(point[0])[point[1]] * (-1.0, 1.0, 1.0)
        best: tuple[float, Point] | None = None
        for mesh in [point[0], *(m for m in self.surface.mesh_indices if m != point[0])]:
            places = self._rest(mesh)
            if not len(places):
                continue
            far = np.linalg.norm(places - at, axis=1)
            nearest = int(np.argmin(far))
            if best is None or far[nearest] < best[0] - 1e-3 * self.size:
                best = (float(far[nearest]), (mesh, nearest))
        return best[1] if best is not None and best[0] < _BESIDE * self.size else None

    def _rest(self, mesh: int) -> Float:
        return self.live.space.points(np.asarray(self.live.dna.meshes[mesh].positions))
