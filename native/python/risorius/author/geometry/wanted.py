# SPDX-License-Identifier: MIT
"""Computes the displacements of a mesh in each expression, in blocks if the mesh is large."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from ... import Dna, Mesh
from . import skeleton as sk
from .blocks import LARGE, blocks_of, split_mesh
from .simplify import Floats, attributes_of
from .skeleton import Doubles, Ints


class Face(Protocol):
    """The attributes of author.work.Work from which the displacements are computed."""

    source: Dna
    columns: list[int]
    motions: Doubles


class Block(NamedTuple):
    """A block of vertices of a mesh.

    Attributes:
        vertices: sorted indices of the vertices.
        mesh: these vertices with skin weights and blend shapes; polygons only if the block is the
            whole mesh.
        wanted: float64[C, n, 3], displacements of the vertices with each input at 1.
    """

    vertices: Ints
    mesh: Mesh
    wanted: Doubles


class Wanted:
    """The displacements of a mesh with each input at 1.

    For a mesh of at most LARGE (60,000) vertices the displacements are stored. For a larger mesh
    they are computed again at each use.

    Attributes:
        mesh: the mesh.
        farthest: float64[V], the largest displacement of each vertex.
        squares: float64[C], sum of squared displacements of each input.
        by_joints: float, largest deviation of the existing joints alone from the displacements, in
            one coordinate.
    """

    def __init__(self, work: Face, mesh: Mesh, go_on: Callable[[], None] = lambda: None) -> None:
        """Look at all displacements once.

        Args:
            work: the face of shapes.
            mesh: a mesh of the face.
            go_on: called before each block; raises an error to stop.
        """
        self.mesh, self._work = mesh, work
        positions = np.asarray(mesh.positions, np.float64)
        self._blocks = blocks_of(positions)
        self._parts = split_mesh(mesh, self._blocks)
        self._whole = displacements(work, mesh) if self.small else None
        self.farthest = np.zeros(len(positions))
        self.squares = np.zeros(len(work.columns))
        self.by_joints = 0.0
        for block in self.blocks():
            go_on()
            lengths = np.square(block.wanted).sum(axis=2)
            self.farthest[block.vertices] = np.sqrt(lengths.max(axis=0, initial=0.0))
            self.squares += lengths.sum(axis=1)
            self.by_joints = max(self.by_joints, _by_joints(work, block))

    def __len__(self) -> int:
        return len(self.farthest)

    def __getitem__(self, row: int) -> Doubles:
        """float64[V, 3]: the displacements of all vertices by one input."""
        return np.asarray(self.ways(np.array([row]))[0])

    @property
    def small(self) -> bool:
        """Whether the mesh is a single block because it has at most LARGE (60,000) vertices."""
        return len(self._blocks) == 1

    def blocks(self) -> Iterator[Block]:
        """The blocks of the mesh; each vertex is in one."""
        for vertices, part in zip(self._blocks, self._parts, strict=True):
            whole = self._whole
            wanted = displacements(self._work, part) if whole is None else whole
            yield Block(vertices, part, wanted)

    def at(self, vertices: Ints) -> Doubles:
        """float64[C, n, 3]: the displacements of some vertices, each of which is listed once."""
        if self._whole is not None:
            return self._whole[:, vertices]
        (part,) = split_mesh(self.mesh, [vertices])
        return displacements(self._work, part)

    def ways(self, rows: Ints) -> Doubles:
        """float64[n, V, 3]: the displacements of all vertices by a few inputs.

        Args:
            rows: indices of the inputs.
        """
        out = np.zeros((len(rows), len(self), 3))
        for block in self.blocks():
            out[:, block.vertices] = block.wanted[rows]
        return out

    def evenly(self) -> Ints:
        """Indices of all vertices. If there are more than LARGE (60,000) vertices, only every
        second, third or nth vertex is listed, so that at most LARGE indices are returned."""
        return np.arange(0, len(self), -(-len(self) // LARGE) if len(self) else 1)


def _by_joints(work: Face, block: Block) -> float:
    positions = np.asarray(block.mesh.positions, np.float64)
    weights = sk.dense_weights(block.mesh, len(work.source.joint_names))
    far = 0.0
    moving = ~np.isclose(work.motions, np.eye(3, 4), atol=1e-12).all(axis=(1, 2, 3))
    for row in np.flatnonzero(block.wanted.any(axis=(1, 2))).tolist():
        off = block.wanted[row]
        if moving[row]:
            off = sk.skinned(positions, weights, work.motions[row]) - positions - off
        far = max(far, float(np.abs(off).max()))
    return far


def displacements(work: Face, mesh: Mesh) -> Doubles:
    """float64[C, V, 3]: displacement of the vertices with each input at 1.

    Args:
        work: the face of shapes.
        mesh: a mesh of the face, or a block of such a mesh.
    """
    positions = np.asarray(mesh.positions, np.float64)
    weights = sk.dense_weights(mesh, len(work.source.joint_names))
    shapes = sk.column_shapes(work.source, mesh, sk.column_count(work.source))
    out = np.zeros((len(work.columns), len(positions), 3))
    rests = np.isclose(work.motions, np.eye(3, 4), atol=1e-12).all(axis=(1, 2, 3))
    for row, column in enumerate(work.columns):
        delta = shapes.get(column)
        if not rests[row]:
            shaped = positions if delta is None else positions + delta
            out[row] = sk.skinned(shaped, weights, work.motions[row]) - positions
        elif delta is not None:
            out[row] = delta
    return out


def joined_displacements(wanted: Mapping[int, Wanted], meshes: Sequence[int]) -> Doubles:
    """float64[C, V, 3]: the displacements of all vertices of some meshes, concatenated.

    Args:
        wanted: index of a mesh -> displacements of the mesh in each expression.
        meshes: indices of the meshes.
    """
    every = [wanted[m].at(np.arange(len(wanted[m]))) for m in meshes]
    return np.concatenate(every, axis=1)


def known_attributes(known: dict[int, Floats], m: int, wanted: Wanted) -> Floats:
    """The result of attributes_of() for a mesh, which the simplification preserves.

    Args:
        known: index of a mesh -> attributes that are already computed; the result is added.
        m: index of the mesh.
        wanted: the displacements of the mesh.
    """
    if m not in known:
        some = wanted.at(wanted.evenly())
        known[m] = attributes_of(wanted.mesh, some, wanted.blocks())
    return known[m]
