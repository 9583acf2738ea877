# SPDX-License-Identifier: MIT
"""Hair of mixed faces: each person has meshes of its own, so a mix wears that of one parent.

Brows and lashes are alike on all people and are mixed as skin is; hair and beards are not.
"""

from __future__ import annotations

import copy
import re

import numpy as np

from .. import Dna, Mesh
from ..author.geometry.skeleton import Doubles

_OWN = re.compile(r"(hair|beard)_lod\d+_mesh")
_NEAR = 4  # vertices of the skin that a vertex of hair goes with
_CHUNK = 256


def hair_meshes(dna: Dna) -> list[int]:
    """Numbers of the meshes that are one person's own: what ends the list and is named so.

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
    """The face without the meshes that are its own; itself where it has none.

    Args:
        dna: a face; it stays as it is.
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
    """Let a mix wear one parent's hair, moved as the skin under it has been.

    Args:
        out: the mix without hair; is changed.
        leading: the parent, with its hair.
    """
    own = hair_meshes(leading)
    if not own:
        return
    mapping = leading.lod_mesh_mapping
    meshes = list(out.meshes)
    for number in own:
        lods = [lod for lod in range(len(mapping)) if number in [int(m) for m in mapping[lod]]]
        skin = _skin(leading, [int(m) for m in mapping[lods[0]]] if lods else [])
        mesh = copy.copy(leading.meshes[number])
        if skin is not None:
            before, after = (
                np.asarray(d.meshes[skin].positions, np.float64) for d in (leading, out)
            )
            mesh.positions = _moved(mesh, before, after - before)
        meshes.append(mesh)
    out.meshes = meshes
    out.mesh_names = list(leading.mesh_names)
    out.lod_mesh_mapping = [[int(m) for m in mapping[lod]] for lod in range(len(mapping))]
    pairs = np.asarray(leading.mesh_blend_shape_channel_mapping, np.int64).reshape(-1, 2)
    mixed = np.asarray(out.mesh_blend_shape_channel_mapping, np.int64).reshape(-1, 2)
    out.mesh_blend_shape_channel_mapping = np.concatenate([mixed, pairs[pairs[:, 0] >= own[0]]])


def _skin(dna: Dna, listed: list[int]) -> int | None:
    """The mesh of a level that hair stands on: the head, else the largest."""
    own = set(hair_meshes(dna))
    there = [m for m in listed if m not in own]
    heads = [m for m in there if "head" in dna.mesh_names[m].lower()]
    return max(heads or there, key=lambda m: len(dna.meshes[m].positions), default=None)


def _moved(mesh: Mesh, skin: Doubles, shift: Doubles) -> Doubles:
    """float64[V, 3]: positions of hair, each moved as the skin nearest to it."""
    points = np.asarray(mesh.positions, np.float64)
    out = points.copy()
    for begin in range(0, len(points), _CHUNK):
        rows = slice(begin, begin + _CHUNK)
        square = ((points[rows, None] - skin[None]) ** 2).sum(axis=2)
        near = np.argpartition(square, _NEAR, axis=1)[:, :_NEAR]
        weight = 1 / (np.take_along_axis(square, near, axis=1) + 1e-6)
        weight /= weight.sum(axis=1, keepdims=True)
        out[rows] += np.einsum("nk,nkx->nx", weight, shift[near])
    return out
