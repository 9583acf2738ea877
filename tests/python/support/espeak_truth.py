# SPDX-License-Identifier: MIT
"""Synthesises speech with espeak-ng, whose library reports the times of phonemes."""

from __future__ import annotations

import ctypes
import ctypes.util
import wave
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

# Viseme class -> espeak's names of the sounds of its American voice. The classes follow phonetics,
# not the output of a recogniser. A diphthong has the class of its nucleus.
CLASSES = {
    "sil": "_ _: _:: _! _| ?",
    "PP": "p b m m-",
    "FF": "f v",
    "TH": "T D",
    "DD": "t d t# t2 d#",
    "kk": "k g N h x",
    "CH": "tS dZ S Z",
    "SS": "s z",
    "nn": "n l n- @L l#",
    "RR": "r r- 3 3:",
    "aa": "a aa a# 0 0# A: A@ V V# @ @2 @5 aI aI@ aI3 aU aU@",
    "E": "E E2 E# e@ eI",
    "I": "I I2 I# i i: i@ i@3 j ;",
    "O": "O O2 O: O@ o@ oU OI",
    "U": "U U@ u: w",
}
CLASS_OF = {name: viseme for viseme, names in CLASSES.items() for name in names.split()}

# Sounds that begin with a closure of the lips or of the tongue. espeak reports the time at which
# the closure opens; in espeak's times, the silence before it belongs to the previous sound.
STOPS = {"p", "b", "t", "d", "k", "g", "tS", "dZ", "t2"}


@dataclass
class Spoken:
    """Speech with its sounds: sound i lasts from times[i] to times[i + 1], in seconds."""

    rate: int
    samples: np.ndarray  # int16
    names: list[str]
    times: list[float]

    def classes(self, at: np.ndarray) -> np.ndarray:
        """The viseme class at each time in seconds, as an array of strings.

        "sil" before the first and after the last sound.
        """
        visemes = np.array([CLASS_OF[name] for name in self.names])
        place = np.searchsorted(self.times, at, side="right") - 1
        found = visemes[np.clip(place, 0, len(visemes) - 1)]
        return np.where((place < 0) | (at >= self.times[-1]), "sil", found)

    def save(self, path: Path) -> None:
        with wave.open(str(path), "wb") as file:
            file.setnchannels(1)
            file.setsampwidth(2)
            file.setframerate(self.rate)
            file.writeframes(self.samples.astype("<i2").tobytes())


class _Id(ctypes.Union):
    _fields_ = [("number", ctypes.c_int), ("name", ctypes.c_char_p), ("string", ctypes.c_char * 8)]


class _Event(ctypes.Structure):
    _fields_ = [
        ("type", ctypes.c_int),
        ("unique_identifier", ctypes.c_uint),
        ("text_position", ctypes.c_int),
        ("length", ctypes.c_int),
        ("audio_position", ctypes.c_int),
        ("sample", ctypes.c_int),
        ("user_data", ctypes.c_void_p),
        ("id", _Id),
    ]


_Callback = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(_Event)
)
_SYNCHRONOUS, _PHONEME_EVENTS, _END, _PHONEME, _UTF8 = 2, 1, 0, 7, 1
_SPEED, _PITCH = 1, 3


@cache
def _library() -> tuple[ctypes.CDLL, int] | None:
    name = ctypes.util.find_library("espeak-ng")
    if name is None:
        return None
    library = ctypes.CDLL(name)
    return library, library.espeak_Initialize(_SYNCHRONOUS, 0, None, _PHONEME_EVENTS)


def is_installed() -> bool:
    return _library() is not None


def say(text: str, voice: str = "en-us", speed: int = 175, pitch: int = 50) -> Spoken:
    """Synthesise a text.

    Args:
        voice: name of a voice, optionally with a variant (en-us+f2).
        speed: words per minute.
        pitch: 0 to 100.
    """
    found = _library()
    assert found is not None
    library, rate = found
    blocks, events = [], []

    def listen(block, count, event):
        if count > 0:
            blocks.append(np.ctypeslib.as_array(block, (count,)).copy())
        i = 0
        while event[i].type != _END:
            if event[i].type == _PHONEME:
                name = bytes(event[i].id.string).split(b"\0")[0].decode()
                events.append((event[i].sample / rate, name))
            i += 1
        return 0

    callback = _Callback(listen)
    library.espeak_SetSynthCallback(callback)
    assert library.espeak_SetVoiceByName(voice.encode()) == 0, voice
    library.espeak_SetParameter(_SPEED, speed, 0)
    library.espeak_SetParameter(_PITCH, pitch, 0)
    data = text.encode()
    library.espeak_Synth(data, len(data) + 1, 0, 1, 0, _UTF8, None, None)
    library.espeak_Synchronize()
    samples = np.concatenate(blocks)
    names = [name for _, name in events]
    times = [time for time, _ in events] + [len(samples) / rate]
    return Spoken(rate, samples, names, _with_closures(samples, rate, names, times))


def _with_closures(samples, rate, names, times):
    """`times` with earlier begins of stops, in seconds.

    A stop begins with the silence before it, unless the sound before it is a pause.
    """
    moved = list(times)
    for i in range(1, len(names)):
        if names[i] in STOPS and CLASS_OF[names[i - 1]] != "sil":
            part = samples[int(times[i - 1] * rate) : int(times[i] * rate)]
            loud = np.nonzero(np.abs(part.astype(int)) > 20)[0]
            moved[i] = times[i - 1] + (loud[-1] + 1 if loud.size else 0) / rate
    return moved
