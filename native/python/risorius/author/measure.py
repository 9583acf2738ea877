# SPDX-License-Identifier: MIT
"""Measures the distance of a face of joints from the face of shapes, vertex by vertex."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np

from .. import Dna, Mesh
from .geometry import skeleton as sk
from .geometry.skeleton import Doubles
from .work import MM


def posed_meshes(dna: Dna, column: int, meshes: Sequence[int], *, shapes: bool) -> list[Doubles]:
    """The vertices float64[V, 3] of some meshes with one input at 1.

    Args:
        dna: the face.
        column: index of the input.
        meshes: indices of the meshes.
        shapes: whether blend shapes are applied.
    """
    count = sk.column_count(dna)
    motion = sk.column_motions(dna, count)[column]
    out = []
    for m in meshes:
        mesh = dna.meshes[m]
        positions = np.asarray(mesh.positions, np.float64)
        if shapes:
            positions = positions + sk.column_shapes(dna, mesh, count).get(column, 0.0)
        out.append(sk.skinned(positions, sk.dense_weights(mesh, len(dna.joint_names)), motion))
    return out


def expression_errors(
    source: Dna, made: Dna, column: int, names: Sequence[str]
) -> tuple[list[Mesh], list[Doubles]]:
    """The source's meshes posed in an expression, and the errors of the joints alone.

    Args:
        source: the face of shapes.
        made: the face of joints.
        column: index of the expression's input.
        names: names of meshes that both faces have, with the same vertices.

    Returns:
        The posed meshes, and the errors float64[V] of each in mm.
    """
    before = [source.mesh_names.index(name) for name in names]
    after = [made.mesh_names.index(name) for name in names]
    goals = posed_meshes(source, column, before, shapes=True)
    reached = posed_meshes(made, column, after, shapes=False)
    meshes = []
    for m, goal in zip(before, goals, strict=True):
        mesh = copy.copy(source.meshes[m])
        mesh.positions = goal
        meshes.append(mesh)
    mm = MM.get(source.translation_unit, 10.0)
    pairs = zip(goals, reached, strict=True)
    return meshes, [np.linalg.norm(goal - found, axis=1) * mm for goal, found in pairs]
