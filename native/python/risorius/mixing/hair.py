# SPDX-License-Identifier: MIT
"""Gives a mixed face the hair of one parent, because each person has hair meshes of its own.

Brows and lashes have the same topology in all people, and are mixed like the skin.
"""

from __future__ import annotations

import copy
import re

import numpy as np

from .. import Dna, Mesh
from ..author.geometry.skeleton import Doubles, Ints
from ..base.budget import BASE_BYTES, BYTES_PER_BYTE, Budget

_OWN = re.compile(r"(hair|beard)_lod\d+_mesh")
_NEAR = 4  # number of nearest skin vertices that a vertex of hair follows
_CELLS = 1 << 22  # largest number of distances in memory at once
_BASE_STEPS = 1 << 28
_STEPS_PER_BYTE = 256


def hair_meshes(dna: Dna) -> list[int]:
    """Indices of the hair and beard meshes, found by name at the end of the list of meshes.

    Args:
        dna: a face.
    """
    out: list[int] = []
    for number in reversed(range(len(dna.mesh_names))):
        if not _OWN.fullmatch(dna.mesh_names[number]):
            break
        out.insert(0, number)
    return out


def without_hair(dna: Dna) -> Dna:
    """The face without its hair and beard meshes; the same object if it has none.

    Args:
        dna: a face; not changed.
    """
    own = hair_meshes(dna)
    if not own:
        return dna
    out = copy.copy(dna)
    out.meshes, out.mesh_names = list(dna.meshes)[: own[0]], list(dna.mesh_names)[: own[0]]
    mapping = dna.lod_mesh_mapping
    out.lod_mesh_mapping = [
        [int(m) for m in mapping[lod] if int(m) < own[0]] for lod in range(len(mapping))
    ]
    pairs = np.asarray(dna.mesh_blend_shape_channel_mapping, np.int64).reshape(-1, 2)
    out.mesh_blend_shape_channel_mapping = pairs[pairs[:, 0] < own[0]]
    return out


def give_hair(out: Dna, leading: Dna) -> None:
    """Adds one parent's hair to a mix, moved with the skin under it.

    Args:
        out: the mix without hair; changed in place.
        leading: the parent, with its hair.
    """
    own = hair_meshes(leading)
    if not own:
        return
    mapping, budget = leading.lod_mesh_mapping, budget_of(leading)
    meshes = list(out.meshes)
    for number in own:
        lods = [lod for lod in range(len(mapping)) if number in [int(m) for m in mapping[lod]]]
        skin = _skin(leading, [int(m) for m in mapping[lods[0]]] if lods else [])
        mesh = copy.copy(leading.meshes[number])
        if skin is not None and len(leading.meshes[skin].positions):
            before, after = (
                np.asarray(d.meshes[skin].positions, np.float64) for d in (leading, out)
            )
            mesh.positions = _moved(mesh, before, after - before, budget)
        meshes.append(mesh)
    out.meshes = meshes
    out.mesh_names = list(leading.mesh_names)
    out.lod_mesh_mapping = [[int(m) for m in mapping[lod]] for lod in range(len(mapping))]
    pairs = np.asarray(leading.mesh_blend_shape_channel_mapping, np.int64).reshape(-1, 2)
    mixed = np.asarray(out.mesh_blend_shape_channel_mapping, np.int64).reshape(-1, 2)
    out.mesh_blend_shape_channel_mapping = np.concatenate([mixed, pairs[pairs[:, 0] >= own[0]]])


def _skin(dna: Dna, listed: list[int]) -> int | None:
    """Index of the mesh under the hair, one of `listed`: the head, or else the largest mesh."""
    own = set(hair_meshes(dna))
    there = [m for m in listed if m not in own]
    heads = [m for m in there if "head" in dna.mesh_names[m].lower()]
    return max(heads or there, key=lambda m: len(dna.meshes[m].positions), default=None)


def _moved(mesh: Mesh, skin: Doubles, shift: Doubles, budget: Budget) -> Doubles:
    """float64[V, 3]: positions of hair, each moved like the nearest skin vertices.

    Args:
        mesh: the hair.
        skin: float64[n, 3], vertices of the skin in the parent's face.
        shift: float64[n, 3], displacements of these vertices from the parent's face to the mix.
        budget: budget of the face.
    """
    points = np.asarray(mesh.positions, np.float64)
    near = nearest(points, skin, min(_NEAR, len(skin)), budget)
    square = ((points[:, None] - skin[near]) ** 2).sum(axis=2)
    weight = 1 / (square + 1e-6)
    weight /= weight.sum(axis=1, keepdims=True)
    return points + np.einsum("nk,nkx->nx", weight, shift[near])


def budget_of(dna: Dna) -> Budget:
    """Limits on memory and work for mixing a face, by its size; as large as for compiling it.

    Args:
        dna: the face.
    """
    size = dna.size_in_bytes()
    return Budget(BASE_BYTES + BYTES_PER_BYTE * size, _BASE_STEPS + _STEPS_PER_BYTE * size)


def nearest(points: Doubles, others: Doubles, count: int, budget: Budget) -> Ints:
    """int64[n, count]: indices of the points of `others` nearest to each point, in any order.

    Args:
        points: float64[n, 3], points whose neighbours are searched for.
        others: float64[m, 3], the possible neighbours.
        count: number of neighbours, from 1 to m.
        budget: budget of the face.

    Raises:
        BudgetError: too many pairs for the face's size.
    """
    budget.work(len(points) * len(others) / 8, "vertices near others")
    lengths = (others**2).sum(axis=1)
    rows = max(1, _CELLS // max(1, len(others)))
    out = np.zeros((len(points), count), np.int64)
    for begin in range(0, len(points), rows):
        part = slice(begin, begin + rows)
        square = lengths - 2 * points[part] @ others.T
        if count == 1:
            out[part, 0] = square.argmin(axis=1)
        else:
            out[part] = np.argpartition(square, count - 1, axis=1)[:, :count]
    return out
