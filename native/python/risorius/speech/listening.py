# SPDX-License-Identifier: MIT
"""Finds the phonemes of a voice: cuts it at pauses, and aligns or recognises the pieces."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..base.errors import ArgumentError, RisoriusError
from . import text, voting
from .audio import RATE, Samples, read_audio, resample
from .phones import Phoneme
from .recogniser import Recogniser, Segment, agreement, to_phonemes

Progress = Callable[[float], None]
Cancel = Callable[[], bool]

STEP = 0.01
"""Seconds between two values of a loudness curve."""

_PIECE = 12.0  # seconds: smallest length of a piece, if pauses allow it
# Seconds: longest piece that pieces() makes, to limit the decoder's memory. The pieces in which a
# transcript is aligned may be longer.
_LONGEST_PIECE = 30.0
_PAUSE = 0.15  # seconds: shortest silence in which the voice may be cut
_SHORTEST_SILENCE = 0.08  # seconds: shorter silences are not removed from phonemes
_SHORTEST_PHONEME = 0.03  # seconds: shortest length of a phoneme
# A transcript is doubtful if its mean confidence is below this number. In tests wrong transcripts
# reached at most 0.35, right ones 0.41 to 0.77.
_DOUBTFUL = 0.37
_UNSAID = 0.2  # fraction of the speech that may be missing in the transcript
# Smallest fraction of a transcript's words that the aligner must find in the voice. If the
# transcript is wrong, the aligner still finds up to half of its words.
_LEAST_FOUND = 0.6
_SILENT = -80.0  # decibels relative to full scale; quieter sound is not speech
_GAP = 0.05  # seconds between words beyond which they are not adjacent
_NO_SPEECH = "no speech was heard"
_STOPS = frozenset({"P", "B", "T", "D", "K", "G", "CH", "JH"})  # begin with a silent closure


class CancelledError(RisoriusError):
    """The work was cancelled because cancel() returned true."""

    code = "cancelled"


class Heard(NamedTuple):
    """The phonemes and samples of a voice."""

    phonemes: list[Phoneme]
    """Phonemes in order, without gaps from 0 to the end of the sound; pauses are SIL."""
    samples: Samples
    """float32[n] at audio.RATE samples per second."""
    aligned: bool
    """True: the phonemes come from the transcript, or were given to `follow`; gaps and pieces that
    cannot be aligned are recognised nevertheless. False: all are recognised, or nobody speaks."""
    notes: list[str]
    """Sentences about deviations, such as words of the transcript that were not heard."""


def listen(
    path: str | os.PathLike[str],
    transcript: str | None = None,
    *,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> Heard:
    """Finds the phonemes of a sound file.

    Args:
        path: path of a WAV file, or of any file that an ffmpeg on PATH can read.
        transcript: the spoken words in English, if known.
        progress: called repeatedly with the fraction of the work done, 0 to 1.
        cancel: called repeatedly; if it returns true, the work ends.

    Raises:
        AudioError: an unusable file. ValueError: a transcript without English words. MissingError:
            PocketSphinx is not installed. CancelledError: cancel() returned true.
    """
    words = None if transcript is None else text.words(transcript)
    if words is not None and not words:
        raise ArgumentError("the transcript has no English word: letters a to z were expected")
    recogniser = Recogniser()
    samples, rate = read_audio(path)
    samples = resample(samples, rate)
    tell = _reporter(progress, cancel)
    tell(0.02)
    levels = loudness(samples)
    if not speaking(levels).any():
        tell(1.0)
        return Heard(filled([], len(samples) / RATE), samples, False, [_NO_SPEECH])
    notes: list[str] = []
    found = None
    if words is not None:
        found = _aligned(recogniser, samples, words, tell, notes)
        if found is None:
            notes.append(
                "the transcript does not fit the voice: the voice was recognised without it"
            )
    aligned = found is not None
    if found is None:
        found = _recognised(recogniser, samples, tell)
    if aligned:
        notes += _doubts(found, levels)
    elif confidence(found) == 0.0:
        notes.append(_NO_SPEECH)
    found = with_silences(found, levels)
    tell(1.0)
    return Heard(filled(found, len(samples) / RATE), samples, aligned, notes)


def follow(path: str | os.PathLike[str], found: Sequence[Phoneme]) -> Heard:
    """Combines a sound file with known phonemes; PocketSphinx is not needed.

    Args:
        path: path of a WAV file, or of any file that an ffmpeg on PATH can read.
        found: phonemes in order; gaps become silence.

    Raises:
        AudioError: an unusable file. ArgumentError: a phoneme other than silence begins after the
            end of the sound.
    """
    samples = resample(*read_audio(path))
    duration = len(samples) / RATE
    late = next((p for p in found if p.begin >= duration and p.name != "SIL"), None)
    if late is not None:
        raise ArgumentError(
            f"the phoneme {late.name} at {late.begin:g} s begins after the end of the voice at "
            f"{duration:g} s: are the phonemes of another recording?"
        )
    cut = [p._replace(end=min(p.end, duration)) for p in found]
    return Heard(filled(cut, duration), samples, True, [])


def _reporter(progress: Progress | None, cancel: Cancel | None) -> Progress:
    def tell(part: float) -> None:
        if cancel is not None and cancel():
            raise CancelledError("listening was cancelled")
        if progress is not None:
            progress(part)

    return tell


def _aligned(
    recogniser: Recogniser, samples: Samples, words: Sequence[str], tell: Progress, notes: list[str]
) -> list[Phoneme] | None:
    """The transcript's phonemes with times, or None if too few of its words are heard.

    The voice is cut into pieces, and the phonemes of each piece are aligned. Phonemes are
    recognised without the transcript in pieces whose alignment fails. If the words of the
    transcript do not match the voice exactly, they are also recognised in the gaps between the
    words that are heard.

    Args:
        recogniser: decoders.
        samples: float32[n], the whole voice at RATE samples per second.
        words: words of the transcript.
        tell: called with the fraction of the work done, 0 to 1.
        notes: gets a sentence if some words are not heard.
    """
    duration = len(samples) / RATE
    segments = recogniser.align_words(samples, words)
    if segments is not None:
        parts = list(_word_pieces(segments, duration))
    else:
        segments = recogniser.align_loosely(samples, words)
        if len(segments) < _LEAST_FOUND * len(words):
            return None
        parts = _loose_pieces(segments, duration)
        if len(segments) < len(words):
            notes.append(f"{len(words) - len(segments)} of {len(words)} words were not heard")
    found: list[Phoneme] = []
    for begin, end, said in parts:
        tell(0.2 + 0.8 * begin / duration)
        found += _piece(recogniser, samples, begin, end, said)
    return found


def _piece(
    recogniser: Recogniser, samples: Samples, begin: float, end: float, said: Sequence[str]
) -> list[Phoneme]:
    """The phonemes from `begin` to `end` seconds of the voice, in times of the whole sound.

    The words `said` are aligned; if this fails or there are none, phonemes are recognised.

    Args:
        recogniser: decoders.
        samples: float32[n], the whole voice at RATE samples per second.
        begin, end: first and last second of the piece.
        said: words of the piece.
    """
    piece = samples[int(begin * RATE) : int(end * RATE)]
    phones = recogniser.align_phonemes(piece, said) if said else None
    if phones is not None:
        return to_phonemes(phones, agreement(phones, recogniser.hear_phonemes(piece)), begin)
    return _shifted(voting.hear(recogniser, piece, lambda part: None), begin, end)


def _shifted(found: Sequence[Phoneme], begin: float, end: float) -> list[Phoneme]:
    """Converts times in a piece from `begin` to `end` seconds to times in the whole sound, at most
    `end`.

    Args:
        found: phonemes with times in the piece.
        begin, end: first and last second of the piece.
    """
    return [p._replace(begin=p.begin + begin, end=min(p.end + begin, end)) for p in found]


def _loose_pieces(
    segments: Sequence[Segment], duration: float
) -> list[tuple[float, float, list[str]]]:
    """(begin, end, words) of each piece, in seconds. A piece is a run of adjacent words, or a gap
    without words.

    Args:
        segments: the words that were heard, with times.
        duration: duration of the voice in seconds.
    """
    parts: list[tuple[float, float, list[str]]] = []
    for segment in segments:
        last = parts[-1][1] if parts else 0.0
        if parts and segment.begin - last < _GAP and parts[-1][2]:
            parts[-1] = (parts[-1][0], segment.end, [*parts[-1][2], segment.word])
            continue
        if segment.begin - last >= _GAP:
            parts.append((last, segment.begin, []))
        parts.append((segment.begin, segment.end, [segment.word]))
    if duration - parts[-1][1] >= _GAP:
        parts.append((parts[-1][1], duration, []))
    return parts


def confidence(found: Sequence[Phoneme]) -> float:
    """Mean confidence of all phonemes but silence, weighted by duration; 0 without phonemes."""
    spoken = [p for p in found if p.name != "SIL"]
    whole = sum(p.end - p.begin for p in spoken)
    return sum(p.confidence * (p.end - p.begin) for p in spoken) / whole if whole else 0.0


def _doubts(found: Sequence[Phoneme], levels: npt.NDArray[np.float64]) -> list[str]:
    """Sentences for the user if the transcript seems not to belong to this voice.

    Args:
        found: aligned phonemes.
        levels: float64[n], loudness in decibels every STEP seconds.
    """
    notes = []
    if confidence(found) < _DOUBTFUL:
        notes.append("the transcript fits the voice badly: does it belong to another recording?")
    loud = speaking(levels)
    times = (np.flatnonzero(loud) + 0.5) * STEP
    covered = np.zeros(len(times), bool)
    for phone in found:
        if phone.name != "SIL":
            first, last = np.searchsorted(times, (phone.begin, phone.end))
            covered[first:last] = True
    if len(covered) and covered.mean() < 1.0 - _UNSAID:
        notes.append(f"{1.0 - covered.mean():.0%} of the speech is not in the transcript")
    return notes


def _word_pieces(
    segments: Sequence[Segment], duration: float
) -> Iterator[tuple[float, float, list[str]]]:
    """(begin, end, words) of each piece, in seconds; pieces are cut in the middle of pauses.

    The pieces cover the whole duration, or end in the middle of the last pause if no word follows
    this pause.

    Args:
        segments: all words with times, and silences between them.
        duration: duration of the voice in seconds.
    """
    begin = 0.0
    said: list[str] = []
    for segment in segments:
        pause = not segment.word and segment.end - segment.begin >= _PAUSE
        middle = 0.5 * (segment.begin + segment.end)
        if pause and said and middle - begin >= _PIECE:
            yield begin, middle, said
            begin, said = middle, []
        elif segment.word:
            said.append(segment.word)
    if said:
        yield begin, duration, said


def _recognised(recogniser: Recogniser, samples: Samples, tell: Progress) -> list[Phoneme]:
    found: list[Phoneme] = []
    duration = len(samples) / RATE
    for begin, end in pieces(loudness(samples)):
        piece = samples[int(begin * RATE) : int(end * RATE)]

        def of_all(part: float, begin: float = begin, end: float = end) -> None:
            tell(0.02 + 0.98 * (begin + part * (end - begin)) / duration)

        for phone in voting.hear(recogniser, piece, of_all):
            found.append(phone._replace(begin=phone.begin + begin, end=min(phone.end + begin, end)))
    return found


def loudness(samples: Samples) -> npt.NDArray[np.float64]:
    """float64[n]: loudness in decibels relative to full scale every STEP seconds, over windows of
    25 ms; -100 or more."""
    hop = int(STEP * RATE)
    count = max(1, -(-len(samples) // hop))
    half = int(0.0125 * RATE)
    power = np.concatenate([[0.0], np.cumsum(np.square(samples, dtype=np.float64))])
    middle = np.arange(count) * hop + hop // 2
    first = np.clip(middle - half, 0, len(samples))
    last = np.clip(middle + half, 0, len(samples))
    mean = (power[last] - power[first]) / np.maximum(last - first, 1)
    return 10.0 * np.log10(np.maximum(mean, 1e-10))


def speaking(levels: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """bool[n]: whether each loudness is high enough for speech."""
    floor, peak = float(np.quantile(levels, 0.05)), float(np.quantile(levels, 0.98))
    return levels > max(_SILENT, peak - 38.0, min(floor + 8.0, peak - 12.0))


def pieces(levels: npt.NDArray[np.float64]) -> list[tuple[float, float]]:
    """(begin, end) in seconds of pieces that are decoded separately; they cover the whole sound."""
    quiet = ~speaking(levels)
    shortest, longest = int(_PIECE / STEP), int(_LONGEST_PIECE / STEP)
    cuts = [0]
    edges = np.flatnonzero(np.diff(np.concatenate([[0], quiet.astype(np.int8), [0]])))
    pauses = [(int(a), int(b)) for a, b in edges.reshape(-1, 2) if b - a >= _PAUSE / STEP]
    for first, last in [*pauses, (len(levels), len(levels))]:
        middle = (first + last) // 2
        # If there is no pause for too long, cut at the quietest moment.
        while middle - cuts[-1] > longest:
            window = levels[cuts[-1] + shortest : cuts[-1] + longest]
            cuts.append(cuts[-1] + shortest + int(np.argmin(window)))
        if middle - cuts[-1] >= shortest and len(levels) - middle >= shortest // 4:
            cuts.append(middle)
    ends = [*cuts[1:], len(levels)]
    return [(a * STEP, b * STEP) for a, b in zip(cuts, ends, strict=True)]


def with_silences(found: Sequence[Phoneme], levels: npt.NDArray[np.float64]) -> list[Phoneme]:
    """The phonemes, shortened by silences that the decoder included in them.

    The silent closure of a stop consonant (such as p) within a word is kept. A phoneme keeps at
    least 30 ms.

    Args:
        found: phonemes in order.
        levels: float64[n], loudness in decibels every STEP seconds.
    """
    quiet = np.concatenate([[False], ~speaking(levels), [False]])
    edges = np.flatnonzero(np.diff(quiet.astype(np.int8))).reshape(-1, 2) * STEP
    phones = list(found)
    for begin, end in edges:
        if end - begin < _SHORTEST_SILENCE:
            continue
        inside = [i for i, p in enumerate(phones) if p.end > begin and p.begin < end]
        if not inside or _is_closure(phones, inside[-1], float(begin)):
            continue
        place = float(begin)
        for i in inside:
            phone = phones[i]
            if phone.name == "SIL":
                continue
            if phone.end > end and phone.begin > begin - _SHORTEST_PHONEME:
                phones[i] = phone._replace(begin=min(float(end), phone.end - _SHORTEST_PHONEME))
            else:
                first = min(phone.begin, place)
                place = max(place, first + _SHORTEST_PHONEME)
                phones[i] = phone._replace(begin=first, end=min(place, phone.end))
    return [phone for phone in phones if phone.end > phone.begin]


def _is_closure(phones: Sequence[Phoneme], last: int, begin: float) -> bool:
    """Whether a silence that starts at `begin` is the closure of a stop consonant inside a word.

    Args:
        phones: phonemes in order.
        last: index of the last phoneme that overlaps the silence.
        begin: start of the silence in seconds.
    """
    phone = phones[last]
    return phone.name in _STOPS and not phone.word and phone.begin > begin - 0.05


def filled(found: Sequence[Phoneme], duration: float) -> list[Phoneme]:
    """The phonemes without gaps from 0 to `duration`: gaps become silence, silences are joined.

    Args:
        found: phonemes in order.
        duration: duration of the sound in seconds.
    """
    whole: list[Phoneme] = []
    place = 0.0
    for phone in [*found, Phoneme(duration, duration, "SIL")]:
        if phone.begin > place + 1e-6:
            whole.append(Phoneme(place, phone.begin, "SIL"))
        if phone.end > phone.begin:
            whole.append(phone)
        place = max(place, phone.end)
    joined: list[Phoneme] = []
    for phone in whole:
        if joined and phone.name == "SIL" and joined[-1].name == "SIL":
            joined[-1] = joined[-1]._replace(end=phone.end)
        else:
            joined.append(phone)
    return joined
