# SPDX-License-Identifier: MIT
"""A tongue that is put out lies on the lower lip, wherever other controls take this lip.

Lengths are decimetres.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from risorius.base.easing import smooth_step

from ..polygons import Floats, Ints

OUT = "tongueOut"
# What lifts the middle of the lower lip farther than an open jaw takes the tongue off it.
LIFTING = ("mouthCornerPull", "mouthPressD", "jawChinRaiseD")
_JAW = 0.08  # by how much an open jaw takes the tongue off the lip, in which the data's lies
_BEHIND = 0.22  # how far behind the lip the tongue begins to rise
_EVEN = 0.05  # across: over such a width the lip's lift is evened out


def over_lip(
    units: Mapping[str, Floats], positions: Floats, tongue: Ints, rim: Ints
) -> dict[tuple[str, str], Floats]:
    """What lifts the tongue with the lower lip, by the two raw controls that it fires with.

    Args:
        units: float64[V, 3], what each raw control does, by its name.
        positions: float64[V, 3] of a person.
        tongue: its vertices.
        rim: vertices of the lower lip at the upper one.
    """
    at = positions[tongue] + units[OUT][tongue]
    lip = positions[rim]
    # At the lip and before it the whole lift, none at the root.
    share = smooth_step((at[:, 2] - lip[:, 2].max()) / _BEHIND + 1.0)
    near = np.exp(-(((at[:, :1] - lip[None, :, 0]) / _EVEN) ** 2)) + 1e-12
    near /= near.sum(axis=1, keepdims=True)
    out = {}
    for name in (n + side for n in LIFTING for side in "LR"):
        lift = np.maximum(near @ units[name][rim, 1], 0.0)
        out[(name, OUT)] = _up(positions, tongue, share * lift)
    out[("jawOpen", OUT)] = _up(positions, tongue, share * _JAW)
    return out


def _up(positions: Floats, vertices: Ints, lift: Floats) -> Floats:
    """float64[V, 3]: some vertices go up. Args: positions  float64[V, 3]; lift  of each."""
    out = np.zeros_like(positions)
    out[vertices, 1] = lift
    return out
