# SPDX-License-Identifier: MIT
"""Divides large meshes into blocks of vertices, so that work on them needs little memory."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ... import BlendShapeTarget, Mesh
from .skeleton import Doubles, Ints

LARGE = 60_000  # vertices: larger meshes are worked on in blocks
_BLOCK = 24_000  # largest number of vertices of a block of a large mesh
_CELLS = 16  # cells of the grid along each axis by which vertices are sorted


def blocks_of(positions: Doubles) -> list[Ints]:
    """Sorted vertex indices of each block: one block for at most LARGE (60,000) vertices, else
    several.

    The vertices of a block are near each other.

    Args:
        positions: float64[V, 3].
    """
    count = len(positions)
    if count <= LARGE:
        return [np.arange(count)]
    low, extent = positions.min(axis=0), max(float(np.ptp(positions, axis=0).max()), 1e-30)
    cell = np.minimum((positions - low) / extent * _CELLS, _CELLS - 1).astype(np.int64)
    # In `key` the bits of a vertex's cell in x, y and z alternate (a Z-order curve). So vertices
    # that are near each other have keys that are near each other.
    key = np.zeros(count, np.int64)
    for bit in range(_CELLS.bit_length() - 1):
        for axis in range(3):
            key |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    order = np.argsort(key, kind="stable")
    return [np.sort(part) for part in np.array_split(order, -(-count // _BLOCK))]


def split_mesh(mesh: Mesh, blocks: Sequence[Ints]) -> list[Mesh]:
    """A mesh of each block with positions, skin weights and blend shapes, but without polygons; the
    mesh itself if there is one block with all vertices.

    Args:
        mesh: the mesh.
        blocks: vertex indices of each block; no vertex is in two blocks.
    """
    positions = np.asarray(mesh.positions)
    if len(blocks) == 1 and len(blocks[0]) == len(positions):
        return [mesh]
    block = np.full(len(positions), -1)
    place = np.zeros(len(positions), np.int64)
    for number, vertices in enumerate(blocks):
        block[vertices], place[vertices] = number, np.arange(len(vertices))
    targets: list[list[BlendShapeTarget]] = [[] for _ in blocks]
    for target in mesh.blend_shape_targets:
        vertices = np.asarray(target.vertex_indices, np.int64)
        deltas = np.asarray(target.deltas)
        own = block[vertices]
        for number in np.unique(own[own >= 0]).tolist():
            rows = np.flatnonzero(own == number)
            targets[number].append(
                BlendShapeTarget(
                    deltas=deltas[rows],
                    vertex_indices=place[vertices[rows]],
                    blend_shape_channel_index=int(target.blend_shape_channel_index),
                )
            )
    return [_part(mesh, own, rows) for own, rows in zip(blocks, targets, strict=True)]


def _part(mesh: Mesh, vertices: Ints, targets: list[BlendShapeTarget]) -> Mesh:
    out = Mesh(positions=np.asarray(mesh.positions)[vertices])
    offsets = np.asarray(mesh.skin_offsets, np.int64)
    if len(offsets) == len(mesh.positions) + 1:
        counts = np.diff(offsets)[vertices]
        ends = np.concatenate([[0], np.cumsum(counts)])
        rows = np.arange(ends[-1]) + np.repeat(offsets[vertices] - ends[:-1], counts)
        out.skin_offsets = ends
        out.skin_weights = np.asarray(mesh.skin_weights)[rows]
        out.skin_joint_indices = np.asarray(mesh.skin_joint_indices)[rows]
    out.maximum_influence_per_vertex = mesh.maximum_influence_per_vertex
    out.blend_shape_targets = targets
    return out


def joined_targets(
    parts: Sequence[tuple[Ints, Sequence[BlendShapeTarget]]],
) -> list[BlendShapeTarget]:
    """The blend shapes of a whole mesh, by channel.

    Args:
        parts: vertex indices and blend shapes of each block.
    """
    by_channel: dict[int, list[tuple[Ints, npt.NDArray[np.float32]]]] = {}
    for vertices, targets in parts:
        for target in targets:
            rows = by_channel.setdefault(int(target.blend_shape_channel_index), [])
            rows.append((vertices[np.asarray(target.vertex_indices, np.int64)], target.deltas))
    out = []
    for channel, rows in by_channel.items():
        vertices = np.concatenate([row[0] for row in rows])
        deltas = np.concatenate([np.asarray(row[1]) for row in rows])
        order = np.argsort(vertices, kind="stable")
        out.append(
            BlendShapeTarget(
                deltas=deltas[order],
                vertex_indices=vertices[order],
                blend_shape_channel_index=channel,
            )
        )
    return out


@dataclass
class SparseWeights:
    """Skin weights of many vertices, a few joints each.

    Attributes:
        joints: int32[V, K]; a joint may occur twice in a row, then its weights add up.
        weights: float32[V, K].
        count: number of joints of the face.
    """

    joints: npt.NDArray[np.int32]
    weights: npt.NDArray[np.float32]
    count: int

    def __len__(self) -> int:
        return len(self.joints)

    def __getitem__(self, vertices: Ints) -> Doubles:
        """float64[n, joints]: the weights of the given vertices on all joints, as a dense
        matrix."""
        out = np.zeros((len(vertices), self.count))
        rows = np.arange(len(vertices))
        for k in range(self.joints.shape[1]):
            out[rows, self.joints[vertices, k]] += self.weights[vertices, k]
        return out

    def some(self, vertices: Ints) -> SparseWeights:
        """The weights of the given vertices, still sparse."""
        return SparseWeights(self.joints[vertices], self.weights[vertices], self.count)
