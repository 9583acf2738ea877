# SPDX-License-Identifier: MIT
"""Random poses in ARKit units that resemble faces: which units are on together, and how far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

Doubles = npt.NDArray[np.float64]

_STEEP = 1.3  # exponent of the random weights: low weights are more frequent
_ONE_SIDED = 0.25  # share of the poses with one side weaker than the other
# Rows of units that exclude each other: unit without its side -> fraction of the poses in
# which it is active.
_PAIRS = (
    {"eyeBlink": 0.75},
    {"eyeLookDown": 0.55, "eyeLookUp": 0.2},
    {"eyeSquint": 0.45},
    {"eyeWide": 0.15},
    {"cheekSquint": 0.35},
    {"noseSneer": 0.35},
    {"browDown": 0.4, "browOuterUp": 0.3},
    *(
        {f"mouth{name}": 0.22}
        for name in (
            "Smile", "Frown", "Dimple", "Stretch", "Press", "LowerDown", "UpperUp",
        )
    ),
)  # fmt: skip
_SINGLE = {
    "jawOpen": 0.8, "browInnerUp": 0.35, "mouthPucker": 0.3, "mouthFunnel": 0.25,
    "mouthShrugUpper": 0.3, "mouthShrugLower": 0.4, "mouthRollLower": 0.2, "mouthRollUpper": 0.2,
    "cheekPuff": 0.1, "mouthLeft": 0.1, "mouthRight": 0.1, "jawLeft": 0.08, "jawRight": 0.08,
    "jawForward": 0.1, "tongueOut": 0.06,
}  # fmt: skip
_STILL = 0.3  # share of the poses whose jawOpen is reduced to 0.12 of its weight
_SHUT = 0.6  # share of the poses in which mouthClose takes back part of jawOpen
_ASIDE = (("eyeLookOutLeft", "eyeLookInRight"), ("eyeLookInLeft", "eyeLookOutRight"))
_EACH_ASIDE = 0.25


def typical(names: Sequence[str], count: int, seed: int = 1) -> Doubles:
    """Random poses: float64[count, names], weights from 0 to 1.

    Args:
        names: ARKit units; units for which this file has no rule stay 0.
        count: number of poses.
        seed: seed of the random numbers; equal seeds give equal poses.
    """
    chance = np.random.default_rng(seed)
    on: dict[str, Doubles] = {}
    for row in _PAIRS:
        level = chance.random(count) ** _STEEP
        drawn, low = chance.random(count), 0.0
        for pair, often in row.items():
            here: Doubles = np.where((drawn >= low) & (drawn < low + often), level, 0.0)
            low += often
            for side in ("Left", "Right"):
                on[pair + side] = here * (1 + chance.normal(0, 0.08, count))
    weaker = np.where(chance.random(count) < _ONE_SIDED, chance.random(count), 1.0)
    is_left = chance.random(count) < 0.5
    for name, level in on.items():
        on[name] = level * np.where(is_left == name.endswith("Left"), weaker, 1.0)
    for name, often in _SINGLE.items():
        on[name] = chance.random(count) ** _STEEP * (chance.random(count) < often)
    on["jawOpen"] = on["jawOpen"] * np.where(chance.random(count) < _STILL, 0.12, 1.0)
    share = np.clip(1.5 * chance.random(count), 0.0, 1.0)
    on["mouthClose"] = on["jawOpen"] * share * (chance.random(count) < _SHUT)
    drawn, level = chance.random(count), chance.random(count) ** _STEEP
    for i, units in enumerate(_ASIDE):
        for name in units:
            on[name] = level * ((drawn >= i * _EACH_ASIDE) & (drawn < (i + 1) * _EACH_ASIDE))
    off = np.zeros(count)
    return np.clip(np.stack([on.get(name, off) for name in names], axis=1), 0.0, 1.0)


def of_frames(names: Sequence[str], frames: Sequence[Mapping[str, float]]) -> Doubles:
    """float64[frames, names]: weights of ARKit units in captured frames, clipped to 0 to 1.

    Args:
        names: names of the units.
        frames: unit -> weight of each frame; missing units are 0.
    """
    rows = [[frame.get(name, 0.0) for name in names] for frame in frames]
    return np.clip(np.array(rows, np.float64).reshape(-1, len(names)), 0.0, 1.0)
