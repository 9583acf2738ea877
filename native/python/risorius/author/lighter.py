# SPDX-License-Identifier: MIT
"""Removes the shortest deltas, so that a rig has at most as many as its source face."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .. import BlendShapeTarget, Dna, Mesh
from .geometry.skeleton import Doubles
from .work import MM, listed_meshes


@dataclass
class Lightened:
    """A face with a limited number of deltas, and the removed deltas."""

    dna: Dna
    before: int  # number of deltas of the input at LOD 0
    after: int  # number of deltas of the face at LOD 0
    shortest_mm: float = 0.0  # length of the longest removed delta at LOD 0; 0: none removed
    # (name of a mesh, channel) -> length of the longest removed delta in mm
    dropped: dict[tuple[str, int], float] = field(default_factory=dict)


def count_deltas(meshes: Sequence[Mesh]) -> int:
    """The number of nonzero deltas in the blend shape targets of some meshes."""
    return sum(int((lengths > 0).sum()) for mesh in meshes for lengths in _lengths(mesh))


def deltas_of(dna: Dna, lod: int = 0) -> int:
    """The number of deltas in the meshes of a LOD.

    Args:
        dna: the face.
        lod: index of the LOD.
    """
    return count_deltas([dna.meshes[m] for m in listed_meshes(dna, lod)])


def within_deltas(dna: Dna, source: Dna) -> Lightened:
    """Give each LOD at most as many deltas as the source has at that LOD.

    The shortest deltas of all meshes and targets of a LOD, including correctives, are removed
    first. A delta is added before skinning, and a weighted mean of rotations makes no vector
    longer. So the error of a vertex grows by at most the length of the removed delta.

    Args:
        dna: a face of joints; it is not changed.
        source: the face of shapes from which it was made.
    """
    out = Lightened(dna, deltas_of(source), deltas_of(dna))
    meshes, mm = list(dna.meshes), MM.get(dna.translation_unit, 10.0)
    done: set[int] = set()
    for lod in range(max(1, source.lod_count)):
        own = [m for m in listed_meshes(dna, lod) if m not in done]
        budget = deltas_of(source, lod) - count_deltas(
            [meshes[m] for m in listed_meshes(dna, lod) if m in done]
        )
        done.update(own)
        limit = _limit([meshes[m] for m in own], max(0, budget))
        if limit is None:
            continue
        if lod == 0:
            out.shortest_mm = limit * mm
        for m in own:
            meshes[m], dropped = _without(meshes[m], limit)
            for channel, longest in dropped.items():
                out.dropped[dna.mesh_names[m], channel] = longest * mm
    if out.dropped:
        out.dna = copy.copy(dna)
        out.dna.meshes = meshes
        out.dna.mesh_blend_shape_channel_mapping = np.array(
            [
                (m, t.blend_shape_channel_index)
                for m, mesh in enumerate(meshes)
                for t in mesh.blend_shape_targets
            ]
        ).reshape(-1, 2)
        out.after = deltas_of(out.dna)
    return out


def _lengths(mesh: Mesh) -> list[Doubles]:
    return [
        np.linalg.norm(np.asarray(t.deltas, np.float64).reshape(-1, 3), axis=1)
        for t in mesh.blend_shape_targets
    ]


def _limit(meshes: Sequence[Mesh], budget: int) -> float | None:
    """The length of the longest delta to remove; None if there are at most `budget` deltas."""
    if count_deltas(meshes) <= budget:
        return None
    lengths = np.concatenate([part for mesh in meshes for part in _lengths(mesh)])
    at = len(lengths) - 1 - budget
    return float(np.partition(lengths, at)[at])


def _without(mesh: Mesh, limit: float) -> tuple[Mesh, dict[int, float]]:
    """The mesh without deltas that are not longer than `limit`, and channel -> length of its
    longest removed delta; lengths are in the file's unit."""
    out, targets, dropped = copy.copy(mesh), [], {}
    for target, lengths in zip(mesh.blend_shape_targets, _lengths(mesh), strict=True):
        kept = lengths > limit
        channel = int(target.blend_shape_channel_index)
        if not kept.all():
            dropped[channel] = float(lengths[~kept].max())
        if not kept.any():
            continue
        targets.append(
            BlendShapeTarget(
                deltas=np.asarray(target.deltas)[kept],
                vertex_indices=np.asarray(target.vertex_indices)[kept],
                blend_shape_channel_index=channel,
            )
        )
    out.blend_shape_targets = targets
    return out, dropped
