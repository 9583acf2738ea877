# SPDX-License-Identifier: MIT
"""Measures pitch, loudness and stressed syllables of a voice."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .audio import RATE, Samples, resample
from .listening import STEP, loudness, speaking
from .phones import VOWEL_VISEMES, Phoneme, viseme_of

Curve = npt.NDArray[np.float64]

OPENNESS_STEP = 0.04
"""Seconds between two values of `openness`, a quarter of the duration of its smoothing."""

_PITCH_RATE = 8000  # samples per second: enough to find the pitch
_LOWEST, _HIGHEST = 60.0, 400.0  # Hz: range of the pitch
_VOICED = 0.45  # fraction of the power that repeats after a period, above which a sound is voiced


class Accent(NamedTuple):
    """A stressed syllable of a voice."""

    time: float
    """Middle of its vowel in seconds."""
    strength: float
    """Strength of the stress, 0 to 1."""


def pitch(samples: Samples) -> Curve:
    """Pitch in semitones above 100 Hz every STEP seconds; NaN for unvoiced sound.

    The period is the lag with the largest autocorrelation in windows of 40 ms. The autocorrelation
    is divided by the autocorrelation of the window function (Boersma 1993).
    """
    low = resample(samples, RATE, _PITCH_RATE)
    width, hop = int(0.04 * _PITCH_RATE), int(STEP * _PITCH_RATE)
    count = max(1, -(-len(samples) // int(STEP * RATE)))
    padded = np.concatenate([np.zeros(width // 2), low, np.zeros(width + hop)])
    windows = np.lib.stride_tricks.sliding_window_view(padded, width)[::hop][:count]
    shape = np.hanning(width)
    size = 4 * width
    own = np.fft.irfft(np.square(np.abs(np.fft.rfft(shape, size))))
    shortest, longest = int(_PITCH_RATE / _HIGHEST), int(_PITCH_RATE / _LOWEST)
    lags = np.arange(shortest, longest + 1)
    found = np.full(count, np.nan)
    for first in range(0, len(windows), 4096):
        block = windows[first : first + 4096]
        block = (block - block.mean(axis=1, keepdims=True)) * shape
        power = np.fft.irfft(np.square(np.abs(np.fft.rfft(block, size))))
        score = power[:, lags] / np.maximum(power[:, :1], 1e-9) * (own[0] / own[lags])
        # The small penalty selects the first of equal peaks. The first peak is at the period of the
        # voice; later peaks are at multiples of the period.
        best = np.argmax(score - 0.002 * lags, axis=1)
        voiced = (score[np.arange(len(block)), best] > _VOICED) & (power[:, 0] > 1e-6)
        heights = 12.0 * np.log2(_PITCH_RATE / lags[best] / 100.0)
        found[first : first + len(block)] = np.where(voiced, heights, np.nan)
    return found


def openness(samples: Samples) -> Curve:
    """Factor on the jaw of vowels, from loudness: about 0.6 to 1.25 every OPENNESS_STEP seconds.

    Args:
        samples: samples of the voice at RATE per second.

    Returns:
        float64[n] in multiples of 0.001, so that text stores them exactly; the first value is at
        half a STEP after the beginning.
    """
    levels = loudness(samples)
    loud = levels[speaking(levels)]
    usual = float(np.median(loud)) if loud.size else 0.0
    relative = np.clip((levels - usual) / 12.0, -1.0, 0.6)
    kernel = np.hanning(17)  # 160 ms wide: follows syllables, not glottal pulses
    kernel /= kernel.sum()
    smooth = np.convolve(np.pad(relative, 8, mode="edge"), kernel, mode="valid")
    return np.round((1.0 + 0.4 * smooth[:: round(OPENNESS_STEP / STEP)]) * 1000.0) / 1000.0


def openness_at(opened: Curve, times: Curve) -> Curve:
    """float64[frames]: the values of `openness`, interpolated at other times.

    Args:
        opened: from `openness`.
        times: float64[frames], seconds.
    """
    return np.interp(times, np.arange(len(opened)) * OPENNESS_STEP + 0.5 * STEP, opened)


def accents(phonemes: Sequence[Phoneme], samples: Samples, apart: float = 0.7) -> list[Accent]:
    """Finds vowels that are louder, higher or longer than the other vowels of the voice.

    A voice of fewer than three vowels has no accents.

    Args:
        phonemes: phonemes of the voice, in order.
        samples: samples of the voice at RATE per second.
        apart: smallest number of seconds between two accents.
    """
    levels, heights = loudness(samples), pitch(samples)
    vowels = [p for p in phonemes if viseme_of(p.name) in VOWEL_VISEMES | {"RR"}]
    vowels = [p for p in vowels if p.name not in ("R", "W", "Y")]
    if len(vowels) < 3:
        return []
    rows = np.array([_measure(p, levels, heights) for p in vowels])
    # Vowels without a measurable pitch get the median pitch of the others.
    usual = np.nanmedian(rows[:, 1]) if np.isfinite(rows[:, 1]).any() else 0.0
    rows[:, 1] = np.where(np.isfinite(rows[:, 1]), rows[:, 1], usual)
    spread = np.maximum(rows.std(axis=0), (1.0, 0.5, 0.02))
    score = ((rows - np.median(rows, axis=0)) / spread) @ np.array([0.4, 0.4, 0.2])
    found: list[Accent] = []
    for i in np.argsort(-score):
        time = 0.5 * (vowels[i].begin + vowels[i].end)
        if score[i] < 0.45:
            break
        if all(abs(time - other.time) >= apart for other in found):
            found.append(Accent(time, float(np.clip(0.35 + 0.4 * score[i], 0.0, 1.0))))
    return sorted(found)


def _measure(phone: Phoneme, levels: Curve, heights: Curve) -> tuple[float, float, float]:
    """(loudness in dB, pitch in semitones or NaN, duration in seconds up to 0.3) of a vowel.

    Args:
        phone: the vowel.
        levels: float64[n], loudness in decibels every STEP seconds.
        heights: float64[n], pitch in semitones every STEP seconds, or NaN.
    """
    first = min(int(phone.begin / STEP), len(levels) - 1)
    last = max(first + 1, int(phone.end / STEP))
    voiced = heights[first:last][np.isfinite(heights[first:last])]
    height = float(np.median(voiced)) if voiced.size else float("nan")
    return float(levels[first:last].max()), height, min(phone.end - phone.begin, 0.3)
