# SPDX-License-Identifier: MIT
"""Names new joints FACIAL_<side>_<region><number>; numbers count from the top of the face down."""

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
    """A unique name for each joint. The names of a mirrored pair differ in the side only.

    Args:
        positions: float64[J, 3], the middle of the vertices of each joint; x = 0 is the middle of
            the face.
        effects: float64[E, J], how far each expression moves the vertices of each joint.
        mirrored: int64[J], the joint of the other side; a joint in the middle names itself.
        controls: names of the E expressions. The region of the expression that moves a joint most
            gives the joint's name.
        left: 1 if the character's left is +x, -1 if it is -x.
        taken: existing names; the new names are added.
    """
    regions = list(TITLES)
    share = np.zeros((len(regions), len(positions)))
    for row, control in zip(effects, controls, strict=True):
        region = regions.index(region_of(control))
        share[region] = np.maximum(share[region], row)
    share = np.maximum(share, share[:, mirrored])
    moving = np.flatnonzero(share.any(axis=0))
    for joint in np.flatnonzero(~share.any(axis=0)):  # a joint without effect: as the nearest one
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
    """The side of a joint that has no mirrored joint: L, R, or C for the middle.

    Args:
        x: position of the joint, positive to the character's left, as a fraction of the face's
            width.
    """
    if abs(x) < 1e-3:
        return "C"
    return "L" if x > 0 else "R"
