# SPDX-License-Identifier: MIT
"""Controls of lashes alone: up and down about their roots, the half at the nose or the other."""

from __future__ import annotations

import numpy as np

from ... import BlendShapeTarget, Dna, Mesh
from ...base.easing import smooth_step

# Control -> which half (-1 at the nose), and what a hair's tip does, as shares of its length.
_WAYS = {
    "eyelashesUpIN": (-1, (0.0, 1.0, -0.3)),
    "eyelashesUpOUT": (1, (0.0, 1.0, -0.3)),
    "eyelashesDownIN": (-1, (0.0, -1.0, -0.3)),
    "eyelashesDownOUT": (1, (0.0, -1.0, -0.3)),
}
_REACH = 0.8  # of its length: how far a tip goes


def add_lash_controls(dna: Dna, mesh: Mesh, rows: int, lod: int) -> None:
    """Shapes of the lashes' own controls, where the level has their channels.

    Args:
        dna: has the channels.
        mesh: the lashes' cards, bound; gets the shapes.
        rows: of a card.
        lod: the level of the mesh.
    """
    listed = {int(c) for c in dna.lod_blend_shape_mapping[lod]}
    positions = np.asarray(mesh.positions, np.float64)
    middles = positions.reshape(-1, 2, 3).mean(axis=1).reshape(-1, rows, 3)
    steps = np.linalg.norm(np.diff(middles, axis=1), axis=2).cumsum(axis=1)
    long = np.concatenate([np.zeros((len(middles), 1)), steps], axis=1)
    root = middles[:, 0]
    eyes = {s: root[root[:, 0] * s > 0] for s in (1, -1)}
    targets = list(mesh.blend_shape_targets)
    for channel, name in enumerate(dna.blend_shape_channel_names):
        if name[:-1] not in _WAYS or channel not in listed:
            continue
        half, way = _WAYS[name[:-1]]
        side = 1 if name[-1] == "L" else -1
        own = eyes[side]
        x = np.abs(own[:, 0])
        aside = (np.abs(root[:, 0]) - (x.min() + x.max()) / 2) / (np.ptp(x) / 2)
        share = smooth_step(0.5 + 0.5 * half * aside) * (root[:, 0] * side > 0)
        share = share * _upper(middles)
        delta = (_REACH * share[:, None] * long)[..., None] * np.array(way)
        flat = np.repeat(delta.reshape(-1, 3), 2, axis=0)
        moved = np.flatnonzero(np.abs(flat).max(axis=1) > 1e-4)
        targets.append(
            BlendShapeTarget(
                deltas=flat[moved], vertex_indices=moved, blend_shape_channel_index=channel
            )
        )
    targets.sort(key=lambda t: int(t.blend_shape_channel_index))
    mesh.blend_shape_targets = targets


def _upper(middles: object) -> object:
    """float64[n]: 1 for hairs whose tips curl up."""
    points = np.asarray(middles)
    return (points[:, -1, 1] > points[:, 0, 1]).astype(np.float64)
