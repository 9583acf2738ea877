# SPDX-License-Identifier: MIT
"""The meshes of one LOD in glTF's layout, and the positions of their vertices at a pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .._native import Dna, Mesh, Rig
from ..author.geometry.simplify import fan_triangles
from ..author.geometry.skeleton import skin_entries
from ..solving.surface import Surface
from ..web.kinds import kind_of
from .errors import GameFaceError
from .joints.skeleton import Skeleton
from .joints.weights import INFLUENCES, strongest
from .naming import safe

Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

_AXES = {
    "right": (1, 0, 0), "left": (-1, 0, 0), "up": (0, 1, 0), "down": (0, -1, 0), "front": (0, 0, 1),
    "back": (0, 0, -1),
}  # fmt: skip
_METRES = {"cm": 0.01, "m": 1.0}
_FARTHEST = 1e4  # metres: a vertex farther away is an error


@dataclass(frozen=True)
class Part:
    """A mesh in glTF's layout: one vertex per pair of position and texture coordinate.

    Attributes:
        name: name of the mesh in the glTF, made safe for paths.
        mesh: name of the mesh in the DNA file.
        kind: material kind from web.kinds.
        rows: int64[V], index of each vertex's position in the arrays of `Points`.
        uv: float64[V, 2], v from the top as in glTF.
        normals: float64[V, 3] at the rest pose.
        triangles: int64[T, 3].
        joints, weights: int64[V, 4], float64[V, 4], the joints of the exported skeleton that move
            each vertex, and their weights in steps of 1 / 255.
    """

    name: str
    mesh: str
    kind: str
    rows: Ints
    uv: Doubles
    normals: Doubles
    triangles: Ints
    joints: Ints
    weights: Doubles


class Points:
    """All vertices of a LOD, evaluated together.

    Attributes:
        parts: the meshes that have triangles.
        rest: float64[P, 3], rest positions in metres; y up, the face looks along z, or along -z in
            VRM 0.x.
        axes: the result of axes_of.
    """

    def __init__(
        self, dna: Dna, rig: Rig, lod: int, skeleton: Skeleton, axes: Doubles,
        move: Doubles | None = None,
    ) -> None:  # fmt: skip
        """Prepares the vertices of a LOD.

        Args:
            dna: face with geometry.
            rig: rig compiled from `dna`.
            lod: number of the LOD.
            skeleton: joints of the exported file.
            axes: from axes_of.
            move: float64[3], metres by which the face is moved to meet its body; None: no body.
        """
        surface = Surface(dna, rig, lod)
        meshes = [m for m in surface.mesh_indices if len(dna.meshes[m].positions)]
        counts = [len(dna.meshes[m].positions) for m in meshes]
        mesh = np.repeat(np.array(meshes, np.int64), counts)
        vertex = np.concatenate([np.zeros(0, np.int64), *(np.arange(n) for n in counts)])
        points = np.stack([mesh, vertex], axis=1)
        self._probe = surface.probe(points)
        self._face = dna.name or "the face"
        self.axes, self._move = axes, np.zeros(3) if move is None else move
        self.rest = self.at(np.asarray(rig.initial_raw_controls, np.float32))
        starts = np.concatenate([[0], np.cumsum(counts)])
        made = [
            self._part(dna.mesh_names[m], dna.meshes[m], int(start), skeleton)
            for m, start in zip(meshes, starts[:-1], strict=True)
        ]
        self.parts = [part for part in made if len(part.triangles)]

    def at(self, raw: npt.NDArray[np.float32]) -> Doubles:
        """float64[P, 3]: positions at a pose, in metres.

        Args:
            raw: float32[R], values of the raw controls.

        Raises:
            GameFaceError: a position is not finite, or is more than 10 km from the origin.
        """
        found = np.asarray(self._probe.positions(raw), np.float64) @ self.axes.T + self._move
        if not (np.abs(found) < _FARTHEST).all():
            raise GameFaceError(
                f"{self._face}: vertices within 10 km of the origin were expected, one is no "
                "number or farther away"
            )
        return found

    def _part(self, name: str, mesh: Mesh, start: int, skeleton: Skeleton) -> Part:
        layouts = fan_triangles(mesh)
        places = mesh.layout_positions.astype(np.int64)
        textures = np.zeros(len(places), np.int64)
        if len(mesh.texture_coordinates):
            textures = mesh.layout_texture_coordinates.astype(np.int64)
        key = places * (int(textures.max(initial=0)) + 1) + textures
        # Vertices are sorted by their first triangle. So neighbours are close in memory, which
        # compresses better.
        _, first, turn = np.unique(key[layouts.ravel()], return_index=True, return_inverse=True)
        order = np.argsort(first, kind="stable")
        rank = np.empty(len(order), np.int64)
        rank[order] = np.arange(len(order))
        corner = layouts.ravel()[first[order]]
        triangles = rank[turn.ravel()].reshape(-1, 3)
        if np.linalg.det(self.axes) < 0:
            triangles = triangles[:, ::-1]
        row = places[corner]
        uv = np.zeros((len(row), 2))
        if len(mesh.texture_coordinates):
            uv = mesh.texture_coordinates[textures[corner]].astype(np.float64)
        joints, weights = _skin(mesh, skeleton)
        rows = start + row
        normals = unit(_own_normals(mesh)[row] @ self.axes.T)
        if not len(mesh.normals):
            normals = normals_of(self.rest[rows], triangles, rows)
        return Part(
            safe(name), name, kind_of(name), rows,
            np.stack([uv[:, 0], 1 - uv[:, 1]], axis=1), normals,
            triangles, joints[row], weights[row],
        )  # fmt: skip


def axes_of(dna: Dna, *, faces_back: bool = False) -> Doubles:
    """float64[3, 3]: maps the file's axes and unit to glTF's: metres, y up, z to the front.

    Positions in glTF are `points @ axes.T`.

    Args:
        dna: the face, with the names of its axes and its unit. Unknown axes count as right, up,
            front, and an unknown unit as cm.
        faces_back: whether the face looks along -z, as in VRM 0.x.
    """
    words = dna.coordinate_system
    known = all(word in _AXES for word in words)
    columns = [_AXES[word] for word in (words if known else ("right", "up", "front"))]
    axes = np.array(columns, np.float64).T * _METRES.get(dna.translation_unit, 0.01)
    return np.diag([-1.0, 1.0, -1.0]) @ axes if faces_back else axes


def unit(vectors: Doubles) -> Doubles:
    """Vectors scaled to length 1; a zero vector becomes (0, 0, 1)."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 1e-12, vectors / np.maximum(length, 1e-12), [0.0, 0.0, 1.0])


def normals_of(points: Doubles, triangles: Ints, rows: Ints) -> Doubles:
    """float64[V, 3]: vertex normals, smooth across seams of texture coordinates.

    Args:
        points: float64[V, 3].
        triangles: int64[T, 3].
        rows: int64[V], equal for vertices that share a position.
    """
    corners = points[triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    _, place = np.unique(rows, return_inverse=True)
    count = int(place.max(initial=-1)) + 1
    sums = np.zeros((count, 3))
    for corner in place[triangles].T:
        for axis in range(3):
            sums[:, axis] += np.bincount(corner, faces[:, axis], count)
    return unit(np.asarray(sums[place], np.float64))


def _own_normals(mesh: Mesh) -> Doubles:
    """float64[positions, 3]: the sum of the corner normals at each position; 0 without normals."""
    sums = np.zeros((len(mesh.positions), 3))
    if len(mesh.normals):
        np.add.at(sums, mesh.layout_positions, mesh.normals[mesh.layout_normals].astype(np.float64))
    return sums


def _skin(mesh: Mesh, skeleton: Skeleton) -> tuple[Ints, Doubles]:
    """int64[positions, 4], float64[positions, 4]: the four joints of the exported skeleton with the
    largest weights at each position, and these weights."""
    count = len(mesh.positions)
    width = max(INFLUENCES, len(skeleton.names))
    dense = np.zeros((count, width))
    vertex, joint, weight = skin_entries(mesh)
    np.add.at(dense, (vertex, skeleton.of_joint[joint]), weight)
    dense[dense.sum(axis=1) <= 0, skeleton.head] = 1.0
    return strongest(dense)
