# SPDX-License-Identifier: MIT
"""Co-articulation: converts timed phonemes to viseme weights, and these to controls.

Shapes of tongue and vowels blend by dominance (Cohen and Massaro 1993): each phoneme pulls the
mouth towards its shape with a strength that decreases before and after it, and the visible shape is
the mean weighted by strength. Lips that must close or touch are applied as gates on top, because a
mean never closes completely.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from .. import expressions
from ..base.easing import smooth_step
from ..base.filters import gaussian
from ..expressions import Expression
from .phones import GLIDES, VISEMES, VOWEL_VISEMES, Phoneme, viseme_of

Curves = npt.NDArray[np.float64]
Times = npt.NDArray[np.float64]

GATED = ("PP", "FF")
"""Visemes in which lips close or touch; they are applied on top of the other visemes."""

# Viseme -> (strength of its pull on the lips, seconds in which the pull falls to 1/e before the
# sound, and after it). Sounds of the tongue pull weakly, so that their neighbours shape the lips.
# O and U pull longest before the sound, because lips are rounded early. PP and FF pull least,
# because gate() closes the lips for them.
_DOMINANCE = {
    "sil": (0.8, 0.06, 0.08), "PP": (0.15, 0.05, 0.05), "FF": (0.15, 0.05, 0.05),
    "TH": (0.6, 0.06, 0.05), "DD": (0.45, 0.05, 0.05), "kk": (0.35, 0.05, 0.05),
    "CH": (1.0, 0.08, 0.06), "SS": (0.8, 0.06, 0.05), "nn": (0.45, 0.05, 0.05),
    "RR": (0.8, 0.08, 0.06), "aa": (1.0, 0.07, 0.07), "E": (1.0, 0.07, 0.07),
    "I": (1.0, 0.07, 0.07), "O": (1.2, 0.10, 0.07), "U": (1.3, 0.11, 0.07),
}  # fmt: skip
_REACH = 0.8  # seconds from a phoneme beyond which its pull is ignored
_GLIDE_PART = 0.55  # fraction of a diphthong's duration that its first vowel takes

_CLOSING, _OPENING = 0.08, 0.075  # seconds in which lips close and open
_QUICKEST = 0.035  # seconds: shortest closing or opening between two closures
_SHORTEST_CLOSURE = 0.045  # seconds: a shorter closure would not be visible, so it is lengthened
_SMOOTHING = 0.018  # seconds, standard deviation of the Gaussian filter
_FREE = 0.8  # up to this value a control equals the sum of the shapes


def viseme_weights(phonemes: Sequence[Phoneme], times: Times) -> Curves:
    """Computes the weight of each viseme at each time.

    Args:
        phonemes: phonemes in order, without gaps; pauses are SIL.
        times: float64[frames], seconds, ascending in equal steps.

    Returns:
        float64[frames, 15] in the order of VISEMES. PP has the weight of its `gate`, FF the weight
        of its gate times the part that PP leaves; the other visemes share the rest, so that each
        row sums to 1.
    """
    pull = np.zeros((len(times), len(VISEMES)))
    for begin, end, viseme in _targets(phonemes):
        strength, lead, lag = _DOMINANCE[viseme]
        first, last = np.searchsorted(times, (begin - _REACH, end + _REACH))
        t = times[first:last]
        # The pull is full in the middle half of the sound and decreases from there.
        middle, half = 0.5 * (begin + end), 0.25 * (end - begin)
        away = np.where(t < middle, (middle - half - t) / lead, (t - middle - half) / lag)
        pull[first:last, VISEMES.index(viseme)] += strength * np.exp(-np.clip(away, 0.0, None))
    weights = _smoothed(pull / np.maximum(pull.sum(axis=1, keepdims=True), 1e-12), times)
    gates = [gate(phonemes, name, times) for name in GATED]
    gates[1] *= 1.0 - gates[0]  # closed lips cannot touch the teeth
    for name in GATED:
        weights[:, VISEMES.index("sil")] += weights[:, VISEMES.index(name)]
        weights[:, VISEMES.index(name)] = 0.0
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-12)
    weights *= (1.0 - gates[0] - gates[1])[:, None]
    for name, closed in zip(GATED, gates, strict=True):
        weights[:, VISEMES.index(name)] = closed
    return weights


def _targets(phonemes: Sequence[Phoneme]) -> list[tuple[float, float, str]]:
    """(begin, end, viseme) of each shape, times in seconds; a diphthong gives two shapes."""
    found = []
    for phone in phonemes:
        if phone.name in GLIDES:
            turn = phone.begin + _GLIDE_PART * (phone.end - phone.begin)
            first, second = GLIDES[phone.name]
            found += [(phone.begin, turn, first), (turn, phone.end, second)]
        else:
            found.append((phone.begin, phone.end, viseme_of(phone.name)))
    return found


def gate(phonemes: Sequence[Phoneme], viseme: str, times: Times) -> Curves:
    """float64[frames] in [0, 1]: 1 while a sound with this viseme determines the lips.

    It is 1 for two frames or more at any frame rate, so that no closure falls between frames.

    Args:
        phonemes: phonemes in order, without gaps.
        viseme: one of GATED.
        times: float64[frames], seconds, ascending in equal steps.
    """
    closed = np.zeros(len(times))
    step = float(times[1] - times[0]) if len(times) > 1 else 1.0
    shortest = max(_SHORTEST_CLOSURE, 2.0 * step)
    spans = []
    for phone in phonemes:
        if viseme_of(phone.name) == viseme:
            missing = max(0.0, shortest - (phone.end - phone.begin))
            spans.append((phone.begin - 0.7 * missing, phone.end + 0.3 * missing))
    for i, (begin, end) in enumerate(spans):
        # Between two closures, as in "my map", the lips move faster, so that they open.
        before = begin - spans[i - 1][1] if i else 1.0
        after = spans[i + 1][0] - end if i + 1 < len(spans) else 1.0
        closing = float(np.clip(0.5 * before, _QUICKEST, _CLOSING))
        opening = float(np.clip(0.5 * after, _QUICKEST, _OPENING))
        first, last = np.searchsorted(times, (begin - closing, end + opening + step))
        t = times[first:last]
        rising = smooth_step((t - begin + closing) / closing)
        falling = smooth_step((end + opening - t) / opening)
        closed[first:last] = np.maximum(closed[first:last], np.minimum(rising, falling))
    return closed


def _smoothed(curves: Curves, times: Times) -> Curves:
    """Smooths with a Gaussian over time, without delay; the first and last values are extended.

    Args:
        curves: float64[frames, n].
        times: float64[frames], seconds, ascending in equal steps.
    """
    step = float(times[1] - times[0]) if len(times) > 1 else 1.0
    reach = int(np.ceil(3.0 * _SMOOTHING / step))
    held = np.pad(curves, ((reach, reach), (0, 0)), mode="edge")
    smooth = gaussian(held.T, step * np.arange(len(held)), _SMOOTHING, reach)
    return np.ascontiguousarray(smooth[:, reach : reach + len(curves)].T)


def controls(
    weights: Curves,
    openness: Curves,
    intensity: float,
    library: Mapping[str, Expression] | None = None,
) -> dict[str, Curves]:
    """Converts viseme weights to curves of raw controls.

    Args:
        weights: float64[frames, 15] from viseme_weights.
        openness: float64[frames], factor on the jaw of vowels; 1 at the voice's usual loudness.
        intensity: factor on all shapes except PP and FF.
        library: a face's own visemes by name, which replace the built-in ones; in a vowel of the
            library, openness scales all controls, not only the jaw.

    Returns:
        Raw control -> float64[frames] in [0, 1].
    """
    curves: dict[str, Curves] = {}
    for column, viseme in enumerate(VISEMES):
        scale = 1.0 if viseme in GATED else intensity
        own = (library or {}).get(viseme)
        for name, weight in (own or expressions.get(viseme)).weights.items():
            part = weights[:, column] * weight * scale
            if viseme in VOWEL_VISEMES and (own or name.endswith(".jawOpen")):
                part = part * openness
            curves[name] = curves.get(name, np.zeros(len(weights))) + part
    return {name: _rounded_off(curve) for name, curve in curves.items()}


def _rounded_off(curve: Curves) -> Curves:
    """Limits a curve to [0, 1] without a kink: values above _FREE (0.8) approach 1."""
    rest = 1.0 - _FREE
    over = _FREE + rest * np.tanh((curve - _FREE) / rest)
    return np.where(curve > _FREE, over, curve).clip(0.0, 1.0)
