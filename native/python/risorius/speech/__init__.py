# SPDX-License-Identifier: MIT
"""Animates a face from the recording of a voice.

sound file --listen--> phonemes with times --viseme_weights--> visemes --controls--> Clip

    clip = risorius.speech.speak("voice.wav", "Hello, how are you?")
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from ..anim.clip import Clip, Event
from ..base.errors import ArgumentError
from ..expressions import Expression
from . import articulation, gestures, prosody, sheets
from .audio import RATE, AudioError
from .listening import Cancel, CancelledError, Heard, Progress, listen
from .phones import Phoneme

__all__ = ["AudioError", "CancelledError", "Heard", "Phoneme", "animate", "listen", "mouth",
           "phonemes", "sheets", "speak"]  # fmt: skip

_TAIL = 0.3  # seconds after the sound until the end of the clip, in which the mouth closes


def phonemes(
    path: str | os.PathLike[str],
    transcript: str | None = None,
    *,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> list[Phoneme]:
    """The phonemes of a sound file with their times, in order and without gaps; pauses are SIL.

    Args:
        path: path of a WAV file, or of any file that an ffmpeg on PATH can read.
        transcript: the spoken words in English, if known.
        progress: called repeatedly with the fraction of the work done, 0 to 1.
        cancel: called repeatedly; if it returns true, CancelledError is raised.

    Raises:
        AudioError: an unusable file. ValueError: a transcript without English words.
        MissingError: PocketSphinx is not installed. CancelledError: cancel() returned true.
    """
    return listen(path, transcript, progress=progress, cancel=cancel).phonemes


def speak(
    path: str | os.PathLike[str],
    transcript: str | None = None,
    *,
    rate: float = 60.0,
    seed: int = 0,
    intensity: float = 1.0,
    blinks: bool = True,
    accents: bool = True,
    correctable: bool = False,
    library: Mapping[str, Expression] | None = None,
    progress: Progress | None = None,
    cancel: Cancel | None = None,
) -> Clip:
    """Makes a clip of a face that speaks the words of a sound file.

    Args:
        path: path of a WAV file, or of any file that an ffmpeg on PATH can read.
        transcript: the spoken words in English, if known; the mouth then moves more correctly.
        rate: frames per second of the clip.
        seed: seed of the blinks' times; equal files and arguments give equal clips.
        intensity: factor on mouth shapes, brows and nods, 0 to 4; lips still close completely.
        blinks: whether to add blinks.
        accents: whether brows and head follow stressed syllables.
        correctable: whether to add metadata with which `mouth` can recompute the curves after a
            user has corrected the phonemes.
        library: the face's own expressions by name, whose visemes replace the built-in ones.
        progress: called repeatedly with the fraction of the work done, 0 to 1.
        cancel: called repeatedly; if it returns true, CancelledError is raised.

    Returns:
        A clip of raw controls and, with accents, of head.pitch (radians), from the beginning of
        the sound to 0.3 s after its end. Values of its events "word" and "phoneme" are the word or
        phoneme. Metadata: source, speech ("aligned" or "recognised"), transcript if given, notes
        about deviations if there are any; if correctable also seconds (duration of the sound) and
        openness (integers, in thousandths).

    Raises:
        AudioError: an unusable file. ValueError: a transcript without English words, a rate or an
            intensity out of range. MissingError: PocketSphinx is not installed. CancelledError:
            cancel() returned true.
    """
    _check(rate, intensity)
    heard = listen(path, transcript, progress=progress, cancel=cancel)
    clip = animate(
        heard, rate=rate, seed=seed, intensity=intensity, blinks=blinks, accents=accents,
        correctable=correctable, library=library,
    )  # fmt: skip
    metadata = {**clip.metadata, "source": os.path.basename(os.fspath(path))}
    if transcript is not None:
        metadata["transcript"] = transcript
    return clip.replaced(metadata=metadata)


def animate(
    heard: Heard,
    *,
    rate: float = 60.0,
    seed: int = 0,
    intensity: float = 1.0,
    blinks: bool = True,
    accents: bool = True,
    correctable: bool = False,
    library: Mapping[str, Expression] | None = None,
) -> Clip:
    """Makes the clip of a voice from its phonemes and samples.

    Args:
        heard: phonemes and samples from `listen`.
        rate: frames per second of the clip.
        seed: seed of the blinks' times.
        intensity: factor on mouth shapes, brows and nods, 0 to 4.
        blinks: whether to add blinks.
        accents: whether brows and head follow stressed syllables.
        correctable: whether to add metadata with which `mouth` can recompute the curves.
        library: expressions by name, whose visemes replace the built-in ones.

    Raises:
        ValueError: an invalid rate or intensity.
    """
    _check(rate, intensity)
    duration = len(heard.samples) / RATE
    times = np.arange(int(np.ceil((duration + _TAIL) * rate)) + 1) / rate
    opened = prosody.openness(heard.samples)
    curves = mouth(heard.phonemes, opened, times, intensity, library)
    if blinks:
        begins = gestures.blink_times(heard.phonemes, duration, seed)
        curves.update(gestures.blinks(times, begins))
    if accents:
        found = prosody.accents(heard.phonemes, heard.samples)
        curves.update(gestures.accent_curves(times, found, intensity))
    metadata = {"speech": "aligned" if heard.aligned else "recognised"}
    if heard.notes:
        metadata["notes"] = "; ".join(heard.notes)
    if correctable:
        metadata["seconds"] = repr(duration)
        metadata["openness"] = " ".join(str(round(1000.0 * value)) for value in opened)
    return Clip(
        curves, list(curves.values()), rate, events=_events(heard.phonemes), metadata=metadata
    )


def mouth(
    phonemes: Sequence[Phoneme],
    opened: npt.ArrayLike,
    times: npt.NDArray[np.float64],
    intensity: float = 1.0,
    library: Mapping[str, Expression] | None = None,
) -> dict[str, npt.NDArray[np.float64]]:
    """The curves of lips, jaw and tongue.

    Args:
        phonemes: in order, without gaps; before and after them the mouth has the shape of silence.
        opened: float[n], factor on the jaw of vowels every OPENNESS_STEP seconds: the result of
            prosody.openness, or the integers "openness" in a correctable clip's metadata / 1000.
        times: float64[frames], seconds, ascending in equal steps.
        intensity: factor on mouth shapes, 0 to 4.
        library: expressions by name, whose visemes replace the built-in ones.

    Returns:
        Raw control -> float64[frames] in [0, 1].
    """
    begin, end = (phonemes[0].begin, phonemes[-1].end) if phonemes else (0.0, 0.0)
    # Silence is added before and after, for the frames outside the sound.
    rest = [Phoneme(begin - 1.0, begin, "SIL"), *phonemes, Phoneme(end, end + 1.0, "SIL")]
    weights = articulation.viseme_weights(rest, times)
    open_far = prosody.openness_at(np.asarray(opened, np.float64), times)
    return articulation.controls(weights, open_far, intensity, library)


def _check(rate: float, intensity: float) -> None:
    if not 1.0 <= rate <= 1000.0:
        raise ArgumentError(f"rate: 1 to 1000 frames per second were expected, found {rate:g}")
    if not 0.0 <= intensity <= 4.0:
        raise ArgumentError(f"intensity: 0 to 4 was expected, found {intensity:g}")


def _events(found: list[Phoneme]) -> list[Event]:
    events = [Event(p.begin, "phoneme", p.end - p.begin, p.name) for p in found]
    for begin, end, word in sheets.words_of(found):
        events.append(Event(begin, "word", end - begin, word))
    return events
