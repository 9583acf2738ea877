# SPDX-License-Identifier: MIT
"""Makes correctives that keep an extended tongue on the lower lip when controls move the lip.

Lengths are in decimetres.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from risorius.base.easing import smooth_step

from ..polygons import Floats, Ints

OUT = "tongueOut"
# Controls that lift the middle of the lower lip into an extended tongue.
LIFTING = ("mouthCornerPull", "mouthPressD", "jawChinRaiseD")
_JAW = 0.08  # lift of the tongue with an open jaw, because the data's tongue would lie in the lip
_BEHIND = 0.22  # decimetres behind the lip from which the tongue rises
_EVEN = 0.05  # width across the mouth over which the lip's lift is averaged


def over_lip(
    units: Mapping[str, Floats], positions: Floats, tongue: Ints, rim: Ints
) -> dict[tuple[str, str], Floats]:
    """Two raw controls -> float64[V, 3]: displacements that lift the tongue with the lower lip.

    One of the two controls is tongueOut. The other control lifts the lip, or is jawOpen, with which
    the tongue rises by a constant.

    Args:
        units: raw control -> float64[V, 3], its displacement.
        positions: float64[V, 3] of a person.
        tongue: indices of the tongue's vertices.
        rim: indices of vertices of the lower lip's rim, where the upper lip touches it.
    """
    at = positions[tongue] + units[OUT][tongue]
    lip = positions[rim]
    # The tongue rises fully at the lip and in front of it, and not at all at _BEHIND or more behind
    # the lip.
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
    """float64[V, 3]: displacement of `vertices` along y, each by its `lift`; others stay."""
    out = np.zeros_like(positions)
    out[vertices, 1] = lift
    return out
