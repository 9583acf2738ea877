# SPDX-License-Identifier: MIT
"""Reads bytes and text of files, and makes clips from a reader's numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..anim.clip import Clip, Event
from ..base import signatures
from ..base.reading import ReadingError, read_file
from .clock.units import COUNT_ROWS
from .errors import AnimationFileError

Doubles = npt.NDArray[np.float64]

# Larger than any recorded take; a larger file is a mistake that would fill the memory.
MAX_BYTES = 1 << 30
# Lowest rate of captured frames in frames per second. Times that are further apart are times of
# keyframes.
LEAST_RATE = 8.0
USUAL_RATE = 60.0
# largest fraction of frames that may be dropped because their time does not ascend
MOST_LOST = 1.0 / 3.0
RATES = (12.0, 23.976, 24.0, 25.0, 29.97, 30.0, 48.0, 50.0, 59.94, 60.0, 90.0, 100.0, 120.0, 240.0)


@dataclass
class Take:
    """Curves with the file's own names, and notes for the user.

    Attributes:
        clip: names and times as in the file.
        kind: one of `importing.KINDS`.
        mapping: name of the built-in mapping for this kind of file, or "" to choose by curve names.
        notes: sentences about dropped, filled or assumed data.
    """

    clip: Clip
    kind: str
    mapping: str = ""
    notes: list[str] = field(default_factory=list)


def read_bytes(path: Path, *, found: bool = False) -> bytes:
    """Reads the bytes of a file.

    Args:
        path: path of the file.
        found: whether the path comes from another file; such a path may not be a pipe.

    Raises:
        AnimationFileError: missing, unreadable, empty, larger than MAX_BYTES, a device.
    """
    try:
        data = read_file(path, MAX_BYTES, found=found)
    except ReadingError as error:
        raise AnimationFileError(str(path), error.what) from error
    except OSError as error:
        raise AnimationFileError(str(path), f"cannot read it: {error.strerror}") from error
    if not data.strip(b"\0 \t\r\n\xef\xbb\xbf"):
        raise AnimationFileError(str(path), "it holds nothing")
    return data


def refuse_other_kinds(data: bytes, name: str) -> None:
    """Raises an error if the first bytes of a file identify a kind other than animation.

    Args:
        data: the file, or its first bytes.
        name: the file's name in errors.

    Raises:
        AnimationFileError: the file is a sound, a picture, an archive, a document, a scene or a
            face; the error names the kind.
    """
    kind = signatures.other_kind(data)
    if kind is not None:
        raise AnimationFileError(name, f"animation was expected, this is {kind}")


def decode(data: bytes, name: str) -> str:
    """Decodes UTF-8 with or without a byte order mark, or UTF-16 with one.

    Args:
        data: the whole file.
        name: the file's name in errors.

    Raises:
        AnimationFileError: another encoding; the message names line and column of the first bad
            byte.
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
    """Frames per second of frame times: a usual rate if one is within 1 %, else the measured one.

    USUAL_RATE (60) for fewer than two frames, and for keyframes that are far apart.

    Args:
        times: float64[frames], seconds, ascending.
    """
    if times.size < 2:
        return USUAL_RATE
    step = float(np.median(np.diff(times)))
    measured = 1.0 / step if step > 0.0 else USUAL_RATE
    if measured < LEAST_RATE:
        return USUAL_RATE
    # The nearest rate is tried first, because 29.97 and 30 are within 1 % of each other.
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
    """Makes a clip; it has a rate instead of times if its times are even.

    Times are even if no frame is further than a microsecond from start + i / rate.

    Args:
        names: names of the curves, each once.
        curves: float[controls, frames].
        times: float64[frames], seconds, ascending.
        rate: frames per second; None: inferred from the times.
        events: events of the clip.
        metadata: metadata of the clip.
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
    """Parses a finite number from a cell of a table or a word of a line.

    Args:
        text: the cell.
        name: the file's name in errors.
        line: from 1, for errors.
        column: from 1, or its header, for errors.

    Raises:
        AnimationFileError: not a number, NaN, infinite or outside float32.
    """
    try:
        # "_" is replaced, because 1_000 is a number only in Python
        value = float(text.replace("_", "?"))
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


def keep_ascending(times: Doubles, notes: list[str], name: str) -> npt.NDArray[np.intp]:
    """Indices of the frames whose time is later than all earlier times.

    Args:
        times: float64[frames], seconds.
        notes: receives a sentence if frames are dropped.
        name: the file's name in errors.

    Returns:
        int[kept frames].

    Raises:
        AnimationFileError: more than MOST_LOST of the frames would be lost.
    """
    highest = np.maximum.accumulate(times) if times.size else times
    good = np.ones(times.size, bool)
    good[1:] = times[1:] > highest[:-1]
    dropped = int(times.size - good.sum())
    if dropped:
        first = int(np.argmin(good))
        where = f"(the first: frame {first}, {times[first]:.6f} s)"
        if dropped > MOST_LOST * times.size:
            raise AnimationFileError(
                name,
                f"times that ascend were expected, found {dropped} of {times.size} frames whose "
                f"time is not after the one before {where}: {COUNT_ROWS}",
            )
        notes.append(
            f"{dropped} frame(s) left out whose time is not after the one before {where}; "
            f"{COUNT_ROWS}"
        )
    return np.flatnonzero(good)
