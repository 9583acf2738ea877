# SPDX-License-Identifier: MIT
"""Movements of a speaking face besides the mouth: blinks, brows, nods."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..base.easing import smooth_step
from .articulation import Curves, Times
from .phones import Phoneme
from .prosody import Accent

_PREFIX = "CTRL_expressions."
# median of the seconds between blinks, and standard deviation of their logarithm
_USUAL_GAP, _GAP_SPREAD = 3.2, 0.45
_SHORTEST_GAP = 0.9  # seconds between two blinks
_PULL = 1.2  # seconds: a blink is moved to a pause that is nearer than this
# seconds in which lids close, stay closed, and open
_LID_DOWN, _LID_CLOSED, _LID_UP = 0.08, 0.035, 0.17
_BROW = {"browRaiseInL": 0.32, "browRaiseInR": 0.32, "browRaiseOuterL": 0.4,
         "browRaiseOuterR": 0.4}  # fmt: skip
_NOD = 0.05  # radians by which the head pitches down at the strongest accent


def bump(times: Times, begin: float, rise: float, hold: float, fall: float) -> Curves:
    """float64[frames]: a curve that rises smoothly from 0 to 1, holds, and falls back to 0.

    Args:
        times: float64[frames], seconds.
        begin: start of the rise in seconds.
        rise, hold, fall: durations in seconds.
    """
    up = smooth_step((times - begin) / rise)
    return np.minimum(up, smooth_step((begin + rise + hold + fall - times) / fall))


def blink_times(phonemes: Sequence[Phoneme], duration: float, seed: int) -> list[float]:
    """Seconds at which the lids begin to close: at a natural rate, moved to nearby pauses.

    Args:
        phonemes: phonemes of the voice; pauses are SIL.
        duration: duration of the voice in seconds.
        seed: seed of the random times; equal seeds give equal times.

    Returns:
        Seconds, ascending.
    """
    random = np.random.default_rng(seed)
    pauses = np.array([p.begin for p in phonemes if p.name == "SIL" and p.end - p.begin > 0.12])
    found: list[float] = []
    place = float(random.uniform(0.3, 2.0))
    while place < duration - 0.1:
        time = place
        if pauses.size:
            nearest = float(pauses[np.argmin(np.abs(pauses - place))])
            if abs(nearest - place) < _PULL:
                time = nearest + float(random.uniform(0.0, 0.06))
        if not found or time - found[-1] >= _SHORTEST_GAP:
            found.append(time)
        place += float(np.clip(random.lognormal(np.log(_USUAL_GAP), _GAP_SPREAD), 1.2, 9.0))
    return found


def blinks(times: Times, begins: Sequence[float]) -> dict[str, Curves]:
    """Control -> float64[frames]: curves of the lids.

    Args:
        times: float64[frames], seconds.
        begins: seconds at which the lids begin to close.
    """
    lids = np.zeros(len(times))
    for begin in begins:
        lids = np.maximum(lids, bump(times, begin, _LID_DOWN, _LID_CLOSED, _LID_UP))
    return {f"{_PREFIX}eyeBlink{side}": lids for side in "LR"}


def accent_curves(times: Times, found: Sequence[Accent], intensity: float) -> dict[str, Curves]:
    """Curves of brows and nods that follow stressed syllables.

    Args:
        times: float64[frames], seconds.
        found: the stressed syllables.
        intensity: factor on all movements; 1 is usual, 0 moves nothing.

    Returns:
        Raw control of a brow -> float64[frames] in [0, 1]; "head.pitch" -> float64[frames],
        radians, negative for down.
    """
    brows, nod = np.zeros(len(times)), np.zeros(len(times))
    for accent in found:
        rise = bump(times, max(accent.time - 0.2, 0.0), 0.2, 0.08, 0.45)
        fall = bump(times, max(accent.time - 0.15, 0.0), 0.2, 0.02, 0.4)
        brows = np.maximum(brows, accent.strength * rise)
        nod = np.maximum(nod, accent.strength * fall)
    curves = {_PREFIX + name: np.clip(intensity * w * brows, 0, 1) for name, w in _BROW.items()}
    return {**curves, "head.pitch": -_NOD * intensity * nod}
