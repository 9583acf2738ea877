# SPDX-License-Identifier: MIT
"""Aligns a known text to a voice, or recognises speech, as timed phonemes.

The decoders are PocketSphinx's, with the English model of its wheel. A frame lasts 10 ms.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..base.errors import RisoriusError
from . import letters
from .audio import RATE, Samples
from .phones import Phoneme, viseme_of

FRAME = 0.01
"""Duration of a decoder's frame in seconds."""

_NEEDS = (
    "speech is recognised by PocketSphinx, which is not installed: pip install risorius[speech]"
)
# Seconds of near silence added around each piece, because a decoder must hear speech begin.
_PAD = 0.3
_LAG = 0.0128  # seconds from the beginning of a frame to the middle of its 25.6 ms window
# Likelihoods in the grammar of an inexact transcript: the voice says the next word, the voice skips
# this word, or other speech precedes it.
_SAID, _SKIPPED, _OTHER = 0.98, 0.002, 0.01
_PHONE_OPTIONS: dict[str, Any] = {"beam": 1e-20, "pbeam": 1e-20, "lw": 1.0}
# Words are decoded in a single quick pass with narrow beams, because the vote of three quick
# decodings is better than one thorough decoding.
_WORD_OPTIONS: dict[str, Any] = {"fwdflat": False, "maxhmmpf": 3000, "beam": 1e-40, "wbeam": 1e-20}
# Options that are tried in turn, because on the best path through the word lattice the alignment of
# phonemes sometimes does not reach the end of the sound.
_ALIGNERS: dict[str, dict[str, Any]] = {
    "narrow": {},
    "one way": {"bestpath": False},
    "wide": {"bestpath": False, "beam": 1e-100, "wbeam": 1e-100, "pbeam": 1e-100},
}


class MissingError(RisoriusError):
    """PocketSphinx is not installed; the message tells how to install it."""

    code = "missing_package"


class Segment(NamedTuple):
    """A word, phoneme or silence from a decoder; seconds from the beginning of the piece."""

    begin: float
    end: float
    name: str
    word: str
    """The word; for a phoneme, the word that begins with it; otherwise ""."""


class Recogniser:
    """PocketSphinx's decoders, made at first use, because their language model loads slowly."""

    def __init__(self) -> None:
        """Imports PocketSphinx. Raises: MissingError: it is not installed."""
        try:
            self._sphinx: Any = importlib.import_module("pocketsphinx")
        except ImportError as error:
            raise MissingError(_NEEDS) from error
        self._decoders: dict[str, Any] = {}

    def _decoder(self, kind: str) -> Any:
        if kind not in self._decoders:
            if kind == "words":
                options = _WORD_OPTIONS
            elif kind == "phones":
                model = self._sphinx.get_model_path("en-us/en-us-phone.lm.bin")
                options = {"lm": None, "allphone": model, **_PHONE_OPTIONS}
            else:
                options = {"lm": None, **_ALIGNERS[kind]}
            self._decoders[kind] = self._sphinx.Decoder(loglevel="FATAL", samprate=RATE, **options)
        return self._decoders[kind]

    def align_words(self, samples: Samples, words: Sequence[str]) -> list[Segment] | None:
        """The words with times, and silences between them; None if the voice does not say them.

        Args:
            samples: samples of a piece of a voice at RATE per second.
            words: words in spoken order.
        """
        for kind in _ALIGNERS:
            found = self._word_pass(kind, samples, words)
            if found is not None:
                return found
        return None

    def align_phonemes(self, samples: Samples, words: Sequence[str]) -> list[Segment] | None:
        """The phonemes of words with times; None if the voice does not say the words.

        Args:
            samples: samples of a piece of a voice at RATE per second.
            words: words in spoken order.
        """
        for kind in _ALIGNERS:
            if self._word_pass(kind, samples, words) is not None:
                found = _phone_pass(self._decoder(kind), samples)
                if found is not None:
                    return found
        return None

    def align_loosely(self, samples: Samples, words: Sequence[str]) -> list[Segment]:
        """The words that the voice says, with times; other words and other speech are left out.

        It serves inexact transcripts: the voice may skip each word of the transcript, and other
        speech may precede each word.

        Args:
            samples: samples of a piece of a voice at RATE per second.
            words: words in the order of the transcript.
        """
        decoder = self._decoder("one way")
        self._learn(decoder, words)
        steps: list[tuple[int, int, float] | tuple[int, int, float, str]] = []
        for i, word in enumerate(words):
            steps += [(i, i + 1, _SAID, word), (i, i + 1, _SKIPPED), (i, i, _OTHER, "[SPEECH]")]
        decoder.add_fsg("loose", decoder.create_fsg("loose", 0, len(words), steps))
        decoder.activate_search("loose")
        _decode(decoder, _pcm(samples))
        return [segment for segment in _segments(decoder, len(samples)) if segment.word]

    def _learn(self, decoder: Any, words: Sequence[str]) -> None:
        for word in set(words):
            if not decoder.lookup_word(word):
                decoder.add_word(word, " ".join(letters.pronounce(word)), True)

    def _word_pass(self, kind: str, samples: Samples, words: Sequence[str]) -> list[Segment] | None:
        decoder = self._decoder(kind)
        self._learn(decoder, words)
        decoder.set_align_text(" ".join(words))
        _decode(decoder, _pcm(samples))
        found = _segments(decoder, len(samples))
        return found if [s.word for s in found if s.word] == list(words) else None

    def hear_words(self, samples: Samples) -> list[Segment] | None:
        """The phonemes of the most likely English words; None if no words are recognised, or their
        phonemes cannot be timed.

        Args:
            samples: samples of a piece of a voice at RATE per second.
        """
        decoder = self._decoder("words")
        decoder.activate_search()
        _decode(decoder, _pcm(samples))
        hypothesis = decoder.hyp()
        if hypothesis is None or not hypothesis.hypstr.strip():
            return None
        words = [word.partition("(")[0] for word in hypothesis.hypstr.split()]
        return _phone_pass(decoder, samples) or self.align_phonemes(samples, words)

    def hear_phonemes(self, samples: Samples) -> list[Segment]:
        """The most likely phonemes, regardless of words."""
        decoder = self._decoder("phones")
        _decode(decoder, _pcm(samples))
        return [s._replace(name=_phone(s.name), word="") for s in _segments(decoder, len(samples))]


def _pcm(samples: Samples) -> bytes:
    """16-bit samples with silence before and after, at the loudness that the model expects.

    Quiet noise, the same in each call, is added, because the logarithm of exact silence is
    undefined.
    """
    pad = np.zeros(int(_PAD * RATE), np.float32)
    loud = float(np.quantile(np.abs(samples), 0.99)) if len(samples) else 0.0
    wide = np.concatenate([pad, samples * min(0.3 / max(loud, 1e-4), 100.0), pad]) * 32767.0
    wide += np.random.default_rng(1).normal(0.0, 3.0, len(wide))
    return np.clip(wide, -32768.0, 32767.0).astype("<i2").tobytes()


def _decode(decoder: Any, pcm: bytes) -> None:
    decoder.start_utt()
    decoder.process_raw(pcm, full_utt=True)
    decoder.end_utt()


def _phone_pass(decoder: Any, samples: Samples) -> list[Segment] | None:
    """Decodes again to time the phonemes within the words of the first pass; None if it fails."""
    try:
        decoder.set_alignment()
        _decode(decoder, _pcm(samples))
        alignment = decoder.get_alignment()
        if alignment is None:
            return None
        return [
            _segment(phone.start, phone.start + phone.duration, _phone(phone.name),
                     word.name if i == 0 else "", len(samples))
            for word in alignment
            for i, phone in enumerate(word)
        ]  # fmt: skip
    except RuntimeError:
        return None


def _segments(decoder: Any, count: int) -> list[Segment]:
    # hyp() must precede seg(), because hyp() frees memory that segments of seg() still use.
    if decoder.hyp() is None:
        return []
    found = decoder.seg() or ()
    return [_segment(s.start_frame, s.end_frame + 1, s.word, s.word, count) for s in found]


def _segment(first: int, last: int, name: str, word: str, count: int) -> Segment:
    """A Segment from frame numbers of the padded sound, with times in the sound without padding.

    Args:
        first, last: first frame, and last frame + 1.
        name: name of the segment.
        word: word that begins with this segment, as the decoder spells it.
        count: number of samples without padding.
    """
    begin, end = (min(max(n * FRAME - _PAD + _LAG, 0.0), count / RATE) for n in (first, last))
    spoken = "" if word[:1] in "<[+" or word == "SIL" else word.partition("(")[0]
    return Segment(begin, end, name, spoken)


def _phone(name: str) -> str:
    """The phoneme's name; noises such as +SPN+ become SIL."""
    return "SIL" if name.startswith("+") or name.startswith("<") else name


def agreement(segments: Sequence[Segment], other: Sequence[Segment]) -> list[float]:
    """The fraction of each segment's duration in which another decoder hears the same viseme.

    Args:
        segments: phonemes from one decoder.
        other: phonemes from the other decoder, with times from the same beginning.

    Returns:
        Numbers from 0 to 1.
    """
    shares = []
    for one in segments:
        same = sum(
            max(0.0, min(one.end, two.end) - max(one.begin, two.begin))
            for two in other
            if viseme_of(one.name) == viseme_of(two.name)
        )
        shares.append(min(1.0, same / max(one.end - one.begin, 1e-6)))
    return shares


def to_phonemes(
    segments: Sequence[Segment], shares: Sequence[float], offset: float
) -> list[Phoneme]:
    """Converts a piece's phonemes to times of the whole sound; phonemes of no length are dropped.

    Args:
        segments: phonemes of the piece.
        shares: confidence of each phoneme, 0 to 1.
        offset: beginning of the piece in seconds.
    """
    return [
        Phoneme(s.begin + offset, s.end + offset, s.name, round(share, 3), s.word)
        for s, share in zip(segments, shares, strict=True)
        if s.end - s.begin > 1e-6
    ]
