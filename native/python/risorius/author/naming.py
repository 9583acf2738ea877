# SPDX-License-Identifier: MIT
"""Names of new joints: FACIAL_<side>_<region><number>, counted from the top of the face down."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..controls.regions import TITLES, region_of
from .geometry.skeleton import Doubles, Ints

_WORDS = {"brow": "Brow", "eye": "Eye", "nose": "Nose", "cheek": "Cheek", "mouth": "Mouth"}
_WORDS |= {"jaw": "JawSkin", "tongue": "Tongue", "teeth": "Teeth", "neck": "Neck"}


def joint_names(
    positions: Doubles,
    effects: Doubles,
    mirrored: Ints,
    controls: Sequence[str],
    *,
    left: int,
    taken: set[str],
) -> list[str]:
    """A name of its own for each joint; those of a pair differ in their side alone.

    Args:
        positions: float64[J, 3], the middle of what each moves; x across the face, 0 in its middle.
        effects: float64[E, J], how far an expression moves what hangs on the joint.
        mirrored: int64[J], the joint of the other side, itself in the middle.
        controls: names of the expressions, E; the region of what moves a joint most names it.
        left: 1 where the character's left is +x, -1 where it is -x.
        taken: names that are there already; is added to.
    """
    regions = list(TITLES)
    share = np.zeros((len(regions), len(positions)))
    for row, control in zip(effects, controls, strict=True):
        region = regions.index(region_of(control))
        share[region] = np.maximum(share[region], row)
    share = np.maximum(share, share[:, mirrored])
    moving = np.flatnonzero(share.any(axis=0))
    for joint in np.flatnonzero(~share.any(axis=0)):  # one that moves nothing is as its neighbour
        if len(moving):
            apart = ((positions[moving] - positions[joint]) ** 2).sum(axis=1)
            share[:, joint] = share[:, moving[apart.argmin()]]
    size = np.ptp(positions[:, 0]) or 1.0
    out = [""] * len(positions)
    counts: dict[tuple[bool, str], int] = {}
    for joint in np.lexsort((positions[:, 0] * left, -positions[:, 1].round(3))).tolist():
        if out[joint]:
            continue
        pair = sorted({joint, int(mirrored[joint])}, key=lambda j: (-positions[j, 0] * left, j))
        sides = "LR" if len(pair) == 2 else _side(positions[joint, 0] * left / size)
        word = regions[int(share[:, joint].argmax())]
        word = _WORDS.get(word, word.title())
        names: list[str] = []
        while not names or not taken.isdisjoint(names):
            key = (len(pair) == 2, word)
            counts[key] = counts.get(key, 0) + 1
            names = [f"FACIAL_{side}_{word}{counts[key]}" for side in sides]
        for j, name in zip(pair, names, strict=True):
            out[j] = name
        taken.update(names)
    return out


def _side(x: float) -> str:
    """Of a joint that has no other one. Args: x  to its left, of the face's width."""
    if abs(x) < 1e-3:
        return "C"
    return "L" if x > 0 else "R"
