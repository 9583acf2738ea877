# SPDX-License-Identifier: MIT
"""Recognises phonemes by vote: several decoders hear the voice at several speeds.

A decoder of words is constrained by its language model, a decoder of phonemes is not. A voice
played a little faster sounds like a smaller speaker, for whom the model may work better. If the
decoders disagree, the majority is right more often than any single decoder.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from .audio import RATE, Samples, resample
from .phones import CLASS_OF, VISEMES, Phoneme
from .recogniser import FRAME, Recogniser, Segment

Votes = npt.NDArray[np.float64]

_SPEEDS = (0.95, 1.0, 1.05)
_WORD_VOTE, _PHONE_VOTE = 1.2, 1.0
_MAJORITY = 0.01  # additional vote of the decoder of phonemes at speed 1, to break ties
_SHORTEST = 3  # smallest number of frames of a phoneme

_PHONES = tuple(CLASS_OF)
_COLUMN = {phone: i for i, phone in enumerate(_PHONES)}
_VISEME_OF_COLUMN = np.array([VISEMES.index(CLASS_OF[phone]) for phone in _PHONES])


def hear(recogniser: Recogniser, samples: Samples, tell: Callable[[float], None]) -> list[Phoneme]:
    """Recognises the phonemes of a piece of a voice, with the words that begin at them.

    Args:
        recogniser: the recogniser whose decoders vote.
        samples: float32[n] at audio.RATE per second.
        tell: called with the fraction of the work done, 0 to 1.
    """
    votes = np.zeros((max(1, round(len(samples) / RATE / FRAME)), len(_PHONES)))
    words: list[Segment] = []
    for i, speed in enumerate(_SPEEDS):
        tell(i / len(_SPEEDS))
        played = samples if speed == 1.0 else resample(samples, round(RATE * speed), RATE)
        extra = _MAJORITY if speed == 1.0 else 0.0
        _count(votes, recogniser.hear_phonemes(played), speed, _PHONE_VOTE + extra)
        heard = recogniser.hear_words(played) or []
        _count(votes, heard, speed, _WORD_VOTE)
        if speed == 1.0:
            words = [segment for segment in heard if segment.word]
    return _with_words(_elected(votes), words)


def _count(votes: Votes, heard: Sequence[Segment], speed: float, weight: float) -> None:
    for segment in heard:
        first, last = (round(t * speed / FRAME) for t in (segment.begin, segment.end))
        votes[first:last, _COLUMN.get(segment.name, _COLUMN["SIL"])] += weight


def _elected(votes: Votes) -> list[Phoneme]:
    """Elects the viseme of each frame, then a phoneme for each run of frames with one viseme.

    Args:
        votes: float64[frames, phonemes], votes for each phoneme in each frame of FRAME seconds.
    """
    visemes = np.zeros((len(votes), len(VISEMES)))
    for column, viseme in enumerate(_VISEME_OF_COLUMN):
        visemes[:, viseme] += votes[:, column]
    padded = np.pad(visemes, ((1, 1), (0, 0)), mode="edge")
    smooth = 0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:]
    best = smooth.argmax(axis=1)
    share = visemes[np.arange(len(votes)), best] / np.maximum(votes.sum(axis=1), 1e-9)
    runs = _runs(best)
    found = []
    for first, last in runs:
        of_viseme = votes[first:last].sum(axis=0) * (best[first] == _VISEME_OF_COLUMN)
        confidence = round(float(min(1.0, share[first:last].mean())), 3)
        name = _PHONES[int(of_viseme.argmax())]
        found.append(Phoneme(first * FRAME, last * FRAME, name, confidence))
    return found


def _runs(best: npt.NDArray[np.intp]) -> list[tuple[int, int]]:
    """(first frame, last frame + 1) of each run of frames with one viseme.

    A run of fewer than 3 frames joins the run before it.

    Args:
        best: int[frames], index of the viseme of each frame.
    """
    edges = [0, *(int(i) + 1 for i in np.flatnonzero(np.diff(best))), len(best)]
    runs: list[tuple[int, int]] = []
    for first, last in pairwise(edges):
        if runs and (last - first < _SHORTEST or best[first] == best[runs[-1][0]]):
            runs[-1] = (runs[-1][0], last)
        else:
            runs.append((first, last))
    return runs


def _with_words(found: list[Phoneme], words: Sequence[Segment]) -> list[Phoneme]:
    """Sets the `word` of the phonemes: each word at the phoneme that begins nearest to it.

    A word is dropped if an earlier word of the list is at this phoneme, or if all is silence.

    Args:
        found: phonemes; changed.
        words: the words with their times.
    """
    spoken = [i for i, phone in enumerate(found) if phone.name != "SIL"]
    if not spoken:
        return found
    begins = np.array([found[i].begin for i in spoken])
    for word in words:
        i = spoken[int(np.argmin(np.abs(begins - word.begin)))]
        if not found[i].word:
            found[i] = found[i]._replace(word=word.word)
    return found
