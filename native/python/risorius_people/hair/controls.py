# SPDX-License-Identifier: MIT
"""Makes blend shapes of lashes: for the lashes' own controls, and for their rotation with the lid.

A lid slides around the eye, but the joints of its skin rotate less. These shapes add the missing
rotation, so that lashes of a closed eye point down.
"""

from __future__ import annotations

import re

import numpy as np
from risorius import BlendShapeTarget, Dna, Mesh
from risorius.author.geometry import skeleton as sk
from risorius.base.easing import smooth_step

from ..polygons import Floats

# Control without its side -> (the half of the lid whose lashes it moves: -1 at the nose, 1 at the
# temple; shift (x, y, z) of a lash's tip, y up and z to the front, in lengths of the lash).
_WAYS = {
    "eyelashesUpIN": (-1, (0.0, 1.0, -0.3)),
    "eyelashesUpOUT": (1, (0.0, 1.0, -0.3)),
    "eyelashesDownIN": (-1, (0.0, -1.0, -0.3)),
    "eyelashesDownOUT": (1, (0.0, -1.0, -0.3)),
}
_LEAST_TURN = 4.0  # degrees: smaller missing rotations are ignored
_LEAST_SHIFT = 1e-3  # centimetres: smaller displacements are ignored
_REACH = 0.8  # factor on the shift of a hair's tip


def add_lash_controls(dna: Dna, mesh: Mesh, rows: int, lod: int) -> None:
    """Adds the shapes of the lashes' own controls, if the LOD has their channels.

    Args:
        dna: face with the channels.
        mesh: cards of the lashes, bound to the skin; changed.
        rows: number of rows of a card.
        lod: number of the mesh's LOD.
    """
    positions = np.asarray(mesh.positions, np.float64)
    middles = _middles(positions, rows)
    steps = np.linalg.norm(np.diff(middles, axis=1), axis=2).cumsum(axis=1)
    long = np.concatenate([np.zeros((len(middles), 1)), steps], axis=1)
    root = middles[:, 0]
    more: dict[int, Floats] = {}
    for name, channel in _channels(dna, lod).items():
        if name[:-1] not in _WAYS:
            continue
        half, way = _WAYS[name[:-1]]
        side = 1 if name[-1] == "L" else -1
        x = np.abs(root[root[:, 0] * side > 0][:, 0])
        aside = (np.abs(root[:, 0]) - (x.min() + x.max()) / 2) / (np.ptp(x) / 2)
        share = smooth_step(0.5 + 0.5 * half * aside) * (root[:, 0] * side > 0)
        share = share * (middles[:, -1, 1] > root[:, 1])  # only upper lashes, which curl up
        more[channel] = (_REACH * share[:, None] * long)[..., None] * np.array(way)
    _add(mesh, {c: np.repeat(d.reshape(-1, 3), 2, axis=0) for c, d in more.items()})


def add_lid_turns(dna: Dna, mesh: Mesh, rows: int, lod: int) -> None:
    """Adds shapes that rotate lashes about their roots by the angle by which the lid slides.

    Args:
        dna: face with joints of both eyes.
        mesh: cards of the lashes, bound to the skin; changed.
        rows: number of rows of a card.
        lod: number of the mesh's LOD.
    """
    channels = _channels(dna, lod)
    positions = np.asarray(mesh.positions, np.float64)
    weights = sk.dense_weights(mesh, len(dna.joint_names))
    count = len(dna.raw_control_names)
    motions = sk.column_motions(dna, sk.column_count(dna))[:count]
    shapes = sk.column_shapes(dna, mesh, count)
    before = _middles(positions, rows)
    names = list(dna.joint_names)
    rest = sk.world_matrices(dna, np.zeros((len(names), 9)))[:, :3, 3]
    left, right = (rest[names.index(f"FACIAL_{s}_Eye")] for s in "LR")
    eye = np.where(before[:, 0, :1] > 0, left, right)
    offsets = positions.reshape(len(before), rows, 2, 3) - before[:, :1, None]
    more: dict[int, Floats] = {}
    for column, label in enumerate(dna.raw_control_names):
        name = label.rpartition(".")[2]
        if name not in channels or re.match("head|neck", name):
            continue
        moved = sk.skinned(positions + shapes.get(column, 0.0), weights, motions[column])
        after = _middles(moved, rows)
        went = _angle(after[:, 0] - eye) - _angle(before[:, 0] - eye)
        turned = _angle(after[:, -1] - after[:, 0]) - _angle(before[:, -1] - before[:, 0])
        left_over = np.degrees(_wrapped(went - turned))
        if np.abs(left_over).max() < _LEAST_TURN:
            continue
        angle = np.radians(left_over)[:, None, None]
        c, s, y, z = np.cos(angle), np.sin(angle), offsets[..., 1], offsets[..., 2]
        delta = np.stack([0 * y, c * y + s * z - y, c * z - s * y - z], axis=-1)
        more[channels[name]] = delta.reshape(-1, 3)
    _add(mesh, more)


def _middles(positions: Floats, rows: int) -> Floats:
    """float64[n, rows, 3]: the middle line of each card."""
    return np.asarray(positions.reshape(-1, rows, 2, 3).mean(axis=2))


def _angle(ways: Floats) -> Floats:
    """float64[n]: angle in radians between the front (+z) and each direction, seen from the side;
    positive up."""
    return np.asarray(np.arctan2(ways[:, 1], ways[:, 2]))


def _wrapped(angles: Floats) -> Floats:
    return np.asarray((angles + np.pi) % (2 * np.pi) - np.pi)


def _channels(dna: Dna, lod: int) -> dict[str, int]:
    """Name -> index, for each blend shape channel of a LOD."""
    listed = {int(c) for c in dna.lod_blend_shape_mapping[lod]}
    names = enumerate(dna.blend_shape_channel_names)
    return {name: channel for channel, name in names if channel in listed}


def _add(mesh: Mesh, more: dict[int, Floats]) -> None:
    """Adds displacements, channel -> float64[V, 3], to the shapes of a mesh."""
    whole = {channel: delta.copy() for channel, delta in more.items()}
    kept = []
    for target in mesh.blend_shape_targets:
        channel = int(target.blend_shape_channel_index)
        if channel in whole:
            rows = np.asarray(target.vertex_indices, np.int64)
            whole[channel][rows] += np.asarray(target.deltas)
        else:
            kept.append(target)
    for channel, delta in whole.items():
        moved = np.flatnonzero(np.abs(delta).max(axis=1) > _LEAST_SHIFT)
        if len(moved):
            kept.append(
                BlendShapeTarget(
                    deltas=delta[moved], vertex_indices=moved, blend_shape_channel_index=channel
                )
            )
    kept.sort(key=lambda target: int(target.blend_shape_channel_index))
    mesh.blend_shape_targets = kept
