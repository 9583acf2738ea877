# SPDX-License-Identifier: MIT
"""Differences of a mesh's blend shape targets. Targets are matched by channel, and their deltas
are matched by vertex."""

from __future__ import annotations

import numpy as np

import risorius

from ...base.words import counted
from ..pairing.common import Place, more_and_less
from ..pairing.pairs import integers, pair


def compare_targets(place: Place, a: risorius.Mesh, b: risorius.Mesh) -> None:
    """Report differences of blend shape targets, matched by channel, and of deltas, by vertex.

    Args:
        place: where the differences are reported.
        a, b: the same mesh of each face.
    """
    faces = place.faces
    targets_a, targets_b = a.blend_shape_targets, b.blend_shape_targets
    channels_a = faces.channels.in_a([t.blend_shape_channel_index for t in targets_a])
    channels_b = faces.channels.in_b([t.blend_shape_channel_index for t in targets_b])
    pairs = pair(channels_a, channels_b)
    text = more_and_less(place, pairs, faces.channels, channels_a, channels_b)
    if text:
        place.at("blend_shape_channel_index", "targets").say(text)
    for i, j in zip(pairs.a.tolist(), pairs.b.tolist(), strict=True):
        _target(place, faces.channels.label(int(channels_a[i])), targets_a[i], targets_b[j])


def _target(
    place: Place, channel: str, a: risorius.BlendShapeTarget, b: risorius.BlendShapeTarget
) -> None:
    pairs = pair(integers(a.vertex_indices), integers(b.vertex_indices))
    x, y = a.deltas, b.deltas
    if not pairs.identical:
        x, y = x[pairs.a], y[pairs.b]
    changed = place.faces.changed(x, y).any(axis=1)
    parts = []
    if changed.any():
        amount = place.faces.distance(x[changed], y[changed])
        parts.append((np.count_nonzero(changed), f" changed {amount}"))
    parts += [(len(pairs.only_b), " added"), (len(pairs.only_a), " removed")]
    parts = [part for part in parts if part[0]]
    of = place.at("deltas" if changed.any() else "vertex_indices")
    if parts:
        first = f"{counted(parts[0][0], 'delta')} of channel {channel}{parts[0][1]}"
        of.say(", ".join([first, *(f"{number:,}{verb}" for number, verb in parts[1:])]))
    if pairs.reordered:
        of.say(f"the deltas of channel {channel} stand in another order")
