# SPDX-License-Identifier: MIT
"""Adds blend shapes that correct the errors caused by removed joints."""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np

from .. import BlendShapeTarget, Dna, Mesh, Rig
from ..author.geometry import skeleton as sk
from ..author.geometry.skeleton import Doubles, Ints
from .measure import Told, Vertices
from .poses import Pose, motion_rows

_LEAST_VALUE = 1e-3  # a control below this value cannot drive a blend shape


def add_shapes(
    before: Dna, after: Dna, poses: Sequence[tuple[Pose, Pose]], tolerance: float, told: Told
) -> Dna:
    """Adds blend shapes to the lighter face for vertices with a larger error than the tolerance.

    Expressions come first, then correctives by the number of their controls, where four or more
    count as one step; each step corrects the error that is left. Only LODs that have blend shapes
    get new ones.

    Args:
        before: the source face, with the same LODs and meshes.
        after: the lighter face; not changed.
        poses: each pose of before with the same pose of after.
        tolerance: allowed error in the file's unit.
        told: called with the fraction of the work done, 0 to 1.
    """
    stages: dict[int, list[tuple[Pose, Pose]]] = {}
    raw = len(after.raw_control_names)
    for pair in poses:
        own = pair[1]
        stages.setdefault(0 if own.input < raw else min(own.controls, 4), []).append(pair)
    old = Rig(before)
    done = 0
    for stage in sorted(stages):
        after = _add_stage(before, after, old, stages[stage], tolerance)
        done += len(stages[stage])
        told(done / len(poses))
    return after


def _add_stage(
    before: Dna, after: Dna, old: Rig, poses: Sequence[tuple[Pose, Pose]], tolerance: float
) -> Dna:
    """Adds blend shapes for some poses, all computed from the same lighter face.

    Args:
        before: the source face.
        after: the lighter face; not changed.
        old: compiled from `before`.
        poses: each pose of `before` with the same pose of `after`.
        tolerance: allowed error in the file's unit.
    """
    new = Rig(after)
    found: dict[tuple[int, int], tuple[Ints, Doubles]] = {}  # (mesh, input) -> (vertices, deltas)
    for lod in range(after.lod_count):
        if not _has_shapes(after, lod):
            continue
        goal, own = Vertices(before, old, lod), Vertices(after, new, lod)
        weights = [sk.dense_weights(after.meshes[m], len(after.joint_names)) for m in own.meshes]
        at = 0
        for rows in motion_rows(after, new, lod, [pose for _, pose in poses], np.zeros(3)):
            for motions in rows + np.eye(3, 4):
                theirs, mine = poses[at]
                at += 1
                way = goal.at(theirs.raw) - own.at(mine.raw)
                if np.linalg.norm(way, axis=1).max(initial=0.0) <= tolerance:
                    continue
                controls = new.evaluate(mine.raw, lod=lod).controls
                value = float(controls[mine.input])
                if value < _LEAST_VALUE:
                    continue
                parts = np.split(way, np.cumsum(own.counts)[:-1])
                for m, part, weight in zip(own.meshes, parts, weights, strict=True):
                    moved = np.flatnonzero(np.linalg.norm(part, axis=1) > tolerance)
                    if len(moved) and (m, mine.input) not in found:
                        turn = (weight[moved] @ motions.reshape(-1, 12)).reshape(-1, 3, 4)[..., :3]
                        shape = np.linalg.solve(turn, part[moved][..., None])[..., 0] / value
                        found[m, mine.input] = moved, shape
    return _with_shapes(after, found)


def _has_shapes(dna: Dna, lod: int) -> bool:
    lods = dna.blend_shape_channels.lods
    return lod < len(lods) and int(lods[lod]) > 0


def _with_shapes(dna: Dna, found: dict[tuple[int, int], tuple[Ints, Doubles]]) -> Dna:
    """The face with these deltas added to its blend shapes; missing channels are created.

    Args:
        dna: the face; not changed.
        found: (mesh, control that drives the shape) -> (indices of vertices, float64[n, 3] deltas).
    """
    out = copy.copy(dna)
    channels = dna.blend_shape_channels
    drives = {
        int(source): int(channel)
        for source, channel in zip(channels.input_indices, channels.output_indices, strict=True)
    }
    missing = sorted({source for _, source in found if source not in drives})
    drives |= _add_channels(out, missing)
    meshes = list(out.meshes)
    for m in sorted({m for m, _ in found}):
        mine = {drives[s]: deltas for (mesh, s), deltas in found.items() if mesh == m}
        meshes[m] = _more(meshes[m], mine)
    out.meshes = meshes
    pairs = {(int(m), int(c)) for m, c in dna.mesh_blend_shape_channel_mapping}
    pairs |= {(m, drives[source]) for m, source in found}
    out.mesh_blend_shape_channel_mapping = np.array(sorted(pairs)).reshape(-1, 2)
    return out


def _add_channels(dna: Dna, inputs: Sequence[int]) -> dict[int, int]:
    """Adds a channel for each input, and returns input -> index of its channel.

    The new channels become the first rows of the face's channel table, because a LOD uses the first
    rows of this table: so all LODs that have channels also have the new ones.

    Args:
        dna: the face; changed in place.
        inputs: indices in the control vector of the controls that drive the new channels.
    """
    if not inputs:
        return {}
    first, raw = len(dna.blend_shape_channel_names), dna.raw_control_names
    names = [
        raw[s].rpartition(".")[2] if s < len(raw) else f"corrective_{s - len(raw)}" for s in inputs
    ]
    new = list(range(first, first + len(inputs)))
    dna.blend_shape_channel_names = [*dna.blend_shape_channel_names, *names]
    channels = copy.copy(dna.blend_shape_channels)
    channels.lods = [int(n) + len(new) * (int(n) > 0) for n in channels.lods]
    channels.input_indices = [*inputs, *map(int, channels.input_indices)]
    channels.output_indices = [*new, *map(int, channels.output_indices)]
    dna.blend_shape_channels = channels
    mapping = dna.lod_blend_shape_mapping
    dna.lod_blend_shape_mapping = [
        [*map(int, mapping[lod]), *(new if len(mapping[lod]) else [])]
        for lod in range(len(mapping))
    ]
    return dict(zip(inputs, new, strict=True))


def _more(mesh: Mesh, shapes: dict[int, tuple[Ints, Doubles]]) -> Mesh:
    """The mesh with deltas added to the targets of some channels.

    Args:
        mesh: the mesh; not changed.
        shapes: channel -> (indices of vertices, float64[n, 3] deltas).
    """
    out, targets = copy.copy(mesh), list(mesh.blend_shape_targets)
    at = {int(target.blend_shape_channel_index): n for n, target in enumerate(targets)}
    for channel, (vertices, deltas) in sorted(shapes.items()):
        rows, values = vertices, deltas
        if channel in at:
            old = targets[at[channel]]
            whole = np.concatenate([np.asarray(old.vertex_indices, np.int64), vertices])
            rows, of = np.unique(whole, return_inverse=True)
            values = np.zeros((len(rows), 3))
            np.add.at(values, of.ravel(), np.concatenate([old.deltas, deltas]))
        made = BlendShapeTarget(
            deltas=values, vertex_indices=rows, blend_shape_channel_index=channel
        )
        if channel in at:
            targets[at[channel]] = made
        else:
            targets.append(made)
    out.blend_shape_targets = targets
    return out
