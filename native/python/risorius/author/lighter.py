# SPDX-License-Identifier: MIT
"""A rig is never heavier than its input: the deltas of blend shapes that do least are left out."""

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
    """A face within the budget of another, and what that took."""

    dna: Dna
    before: int  # deltas of the input at LOD 0
    after: int
    shortest_mm: float = 0.0  # no delta that was left out at LOD 0 is longer; 0: all were kept
    # mm, the longest delta that was left out, by mesh and channel
    dropped: dict[tuple[str, int], float] = field(default_factory=dict)


def count_deltas(meshes: Sequence[Mesh]) -> int:
    """How many vertices of targets these meshes move: a delta of 0 is none."""
    return sum(int((lengths > 0).sum()) for mesh in meshes for lengths in _lengths(mesh))


def deltas_of(dna: Dna, lod: int = 0) -> int:
    """The deltas of a level's meshes.

    Args:
        dna: the face.
        lod: the level.
    """
    return count_deltas([dna.meshes[m] for m in listed_meshes(dna, lod)])


def within_deltas(dna: Dna, source: Dna) -> Lightened:
    """The face with at most as many deltas as its source, at each level that both have.

    The shortest deltas go first, over all meshes and targets of a level, correctives too. A delta
    is added before the joints move the vertex, and a mean of turns makes nothing longer: without
    it the vertex is off by its length at most.

    Args:
        dna: a face of joints; it stays as it is.
        source: the face of shapes that it was made from.
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
    """The length of the longest delta that has to go; None: none has to."""
    if count_deltas(meshes) <= budget:
        return None
    lengths = np.concatenate([part for mesh in meshes for part in _lengths(mesh)])
    return float(np.sort(lengths)[::-1][budget])


def _without(mesh: Mesh, limit: float) -> tuple[Mesh, dict[int, float]]:
    """A mesh without deltas of this length or less; the longest that went, by channel."""
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
