# SPDX-License-Identifier: MIT
"""Names of new joints: FACIAL_<side>_<region><number>, counted from the top of the face down."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..controls.regions import TITLES, region_of
from .skeleton import Doubles

_WORDS = {"brow": "Brow", "eye": "Eye", "nose": "Nose", "cheek": "Cheek", "mouth": "Mouth"}
_WORDS |= {"jaw": "JawSkin", "tongue": "Tongue", "teeth": "Teeth", "neck": "Neck"}


def joint_names(
    positions: Doubles, amounts: Doubles, controls: Sequence[str], *, left: int, taken: set[str]
) -> list[str]:
    """A name of its own for each joint.

    Args:
        positions: float64[J, 3], x across the face, 0 in its middle.
        amounts: float64[E, J], how far an expression moves what hangs on the joint.
        controls: names of the expressions, E; their regions name the joints'.
        left: 1 where the character's left is +x, -1 where it is -x.
        taken: names that are there already; is added to.
    """
    regions = list(TITLES)
    share = np.zeros((len(regions), len(positions)))
    for row, control in zip(amounts, controls, strict=True):
        share[regions.index(region_of(control))] += row
    size = np.ptp(positions[:, 0]) or 1.0
    out = [""] * len(positions)
    counts: dict[str, int] = {}
    for joint in np.lexsort((positions[:, 0] * left, -positions[:, 1].round(3))):
        region = regions[int(share[:, joint].argmax())]
        x = positions[joint, 0] * left
        side = "C" if abs(x) < 1e-3 * size else "L" if x > 0 else "R"
        stem = f"FACIAL_{side}_{_WORDS.get(region, region.title())}"
        while not out[joint] or out[joint] in taken:
            counts[stem] = counts.get(stem, 0) + 1
            out[joint] = f"{stem}{counts[stem]}"
        taken.add(out[joint])
    return out
