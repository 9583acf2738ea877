# SPDX-License-Identifier: MIT
"""Bytes and text of files, and the clip that a reader makes of its numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..anim.clip import Clip, Event
from .errors import AnimationFileError

Doubles = npt.NDArray[np.float64]

# No recorded take is as large; a larger file is a mistake and would only fill the memory.
MAX_BYTES = 1 << 30
# Times that lie further apart than this rate gives are times of keys, not of frames.
LEAST_RATE = 8.0
USUAL_RATE = 60.0
RATES = (12.0, 23.976, 24.0, 25.0, 29.97, 30.0, 48.0, 50.0, 59.94, 60.0, 90.0, 100.0, 120.0, 240.0)


_SOUND = (
    "a sound: Speak from Audio in Blender, or `risorius speech` on the command line, moves a face "
    "to it"
)
# First bytes, where they stand, and what such a file is. None of them is text in UTF-8 or UTF-16.
_OTHER_KINDS = (
    (b"WAVE", 8, _SOUND),
    (b"AIFF", 8, _SOUND),
    (b"fLaC", 0, _SOUND),
    (b"OggS", 0, _SOUND),
    (b"ID3", 0, _SOUND),
    (b"\xff\xfb", 0, _SOUND),
    (b"\x89PNG", 0, "a picture (PNG)"),
    (b"\xff\xd8\xff", 0, "a picture (JPEG)"),
    (b"ftyp", 4, "a film: its sound goes through Speak from Audio or `risorius speech`"),
    (b"PK\x03\x04", 0, "an archive (ZIP): unpack it first"),
    (b"\x1f\x8b", 0, "an archive (gzip): unpack it first"),
    (b"BLENDER", 0, "a scene of Blender (.blend): open it there"),
    (b"\x28\xb5\x2f\xfd", 0, "packed by Zstandard, as Blender packs its scenes (.blend)"),
    (b"DNA\0", 0, "a face (DNA): Import DNA in Blender and `risorius info` take it"),
    (b"RZC\x1a", 0, "a clip of Risorius whose name does not end in .rzc: rename it"),
)


@dataclass
class Take:
    """What a reader found: curves of the file's own names, and what is to be said of the reading.

    Attributes:
        clip: names as the file spells them, times as the file gives them.
        kind: one of `importing.KINDS`.
        mapping: the built-in mapping that fits this kind, or "" where the names decide.
        notes: sentences; what was left out, filled or assumed.
    """

    clip: Clip
    kind: str
    mapping: str = ""
    notes: list[str] = field(default_factory=list)


def read_bytes(path: Path) -> bytes:
    """Raises: AnimationFileError: missing, unreadable, empty, larger than MAX_BYTES."""
    try:
        size = path.stat().st_size
        if size > MAX_BYTES:
            raise AnimationFileError(
                str(path), f"a file of {MAX_BYTES} bytes at most was expected, found {size}"
            )
        data = path.read_bytes()
    except OSError as error:
        raise AnimationFileError(str(path), f"cannot read it: {error.strerror}") from error
    if not data.strip(b"\0 \t\r\n\xef\xbb\xbf"):
        raise AnimationFileError(str(path), "it holds nothing")
    return data


def refuse_other_kinds(data: bytes, name: str) -> None:
    """Say what a file is that is no animation, where its first bytes tell.

    Args:
        data: the file, or its first bytes.
        name: what errors call the file.

    Raises:
        AnimationFileError: a sound, a picture, a film, an archive, a scene, a face.
    """
    for start, at, kind in _OTHER_KINDS:
        if data[at : at + len(start)] == start:
            raise AnimationFileError(name, f"animation was expected, this is {kind}")


def decode(data: bytes, name: str) -> str:
    """Text of a file: UTF-8 with or without a byte order mark, UTF-16 with one.

    Args:
        data: the whole file.
        name: what errors call the file.

    Raises:
        AnimationFileError: another encoding, with the line and column of the first bad byte.
    """
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        before = data[: error.start]
        raise AnimationFileError(
            name,
            f"UTF-8 text was expected, found the byte {data[error.start]:#04x}",
            line=before.count(b"\n") + 1,
            column=error.start - before.rfind(b"\n"),
        ) from error


def frame_rate(times: Doubles) -> float:
    """Frames per second of frame times: a usual rate if one is within 1 %, else as measured; of
    keys that lie far apart USUAL_RATE."""
    if times.size < 2:
        return USUAL_RATE
    step = float(np.median(np.diff(times)))
    measured = 1.0 / step if step > 0.0 else USUAL_RATE
    if measured < LEAST_RATE:
        return USUAL_RATE
    # The nearest rate is tried first: 29.97 and 30 lie within 1 % of each other.
    near = min(RATES, key=lambda rate: abs(rate - measured))
    if abs(near - measured) > 0.01 * near:
        return measured
    if near in (29.97, 59.94, 23.976):
        return round(near) * 1000.0 / 1001.0
    return near


def make_clip(
    names: Sequence[str],
    curves: npt.ArrayLike,
    times: Doubles,
    *,
    rate: float | None = None,
    events: Sequence[Event] = (),
    metadata: Mapping[str, str] | None = None,
) -> Clip:
    """A clip that is evenly timed where its times are even.

    Even means that no frame is further than a microsecond from start + i / rate.

    Args:
        names: of the curves, each once.
        curves: float[controls, frames].
        times: float64[frames], seconds, ascending.
        rate: frames a second; None: told from the times.
        events: of the clip.
        metadata: of the clip.
    """
    chosen = rate or frame_rate(times)
    start = float(times[0]) if times.size else 0.0
    even = start + np.arange(times.size) / chosen
    own = None if np.abs(times - even).max(initial=0.0) < 1e-6 else times
    return Clip(
        names,
        np.asarray(curves, np.float32),
        chosen,
        start=start,
        times=own,
        events=events,
        metadata=metadata,
    )


def number(text: str, name: str, line: int, column: int | str) -> float:
    """The finite number in a cell of a table or a word of a line.

    Args:
        text: the cell.
        name: what errors call the file.
        line: from 1, for errors.
        column: from 1, or what heads it, for errors.

    Raises:
        AnimationFileError: no number, NaN, infinite or outside float32.
    """
    try:
        value = float(text.replace("_", "?"))  # Python's 1_000 is no number elsewhere
    except ValueError:
        found = text if len(text) <= 40 else text[:40] + "..."
        raise AnimationFileError(
            name, f"a number was expected, found {found!r}", line=line, column=column
        ) from None
    if not math.isfinite(value) or abs(value) > np.finfo(np.float32).max:
        raise AnimationFileError(
            name, f"a finite number was expected, found {text[:40]!r}", line=line, column=column
        )
    return value


def keep_ascending(times: Doubles, notes: list[str]) -> npt.NDArray[np.intp]:
    """Indices of the frames whose time comes after all times before; the others are noted.

    Args:
        times: float64[frames], seconds.
        notes: gets a sentence where frames are left out.

    Returns:
        int[kept frames].
    """
    highest = np.maximum.accumulate(times) if times.size else times
    good = np.ones(times.size, bool)
    good[1:] = times[1:] > highest[:-1]
    dropped = int(times.size - good.sum())
    if dropped:
        first = int(np.argmin(good))
        notes.append(
            f"{dropped} frame(s) left out whose time is not after the one before "
            f"(the first: frame {first}, {times[first]:.6f} s)"
        )
    return np.flatnonzero(good)
