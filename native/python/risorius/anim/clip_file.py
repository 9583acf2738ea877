# SPDX-License-Identifier: MIT
"""Clips as .rzc files, read in parts or written while they are recorded."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from types import TracebackType

import numpy as np
import numpy.typing as npt

from .._native import ClipError, ClipFile, ClipFileWriter
from ..base.budget import BYTES_PER_BYTE
from .clip import Clip, Event

__all__ = ["ClipError", "ClipReader", "ClipWriter"]

# What may be read at once however small the file: 75 minutes of 1,000 controls that stand still.
MOST_BYTES = 1 << 30


class ClipReader:
    """A .rzc file of which one reads what one needs. Frames are decoded in blocks, and the block
    read last is kept compressed: to play, read some hundred frames at a time.

    Attributes:
        names: the controls.
        rate, start: as of a Clip.
        has_times: the frames have times of their own.
        frame_count: frames in the file.
        byte_count: bytes of the file that hold them; fewer than it has only after a recovery.
        block_starts: the first frame of each block, and the frame behind the last.
        events, metadata: as of a Clip.
    """

    def __init__(self, source: str | os.PathLike[str] | bytes, *, recover: bool = False) -> None:
        """Read the head and the index.

        Args:
            source: a path, or the bytes of a file.
            recover: take also a file that was cut while it was recorded, up to its last whole
                block.

        Raises:
            ClipError: no .rzc file, cut, damaged, of another version; or it cannot be opened.
        """
        if isinstance(source, bytearray | memoryview):
            source = bytes(source)
        self._file = ClipFile(source if isinstance(source, bytes) else os.fspath(source), recover)
        self._size = len(source) if isinstance(source, bytes) else os.path.getsize(source)
        self.names: tuple[str, ...] = self._file.names
        self.rate: float = self._file.rate
        self.start: float = self._file.start
        self.has_times: bool = self._file.has_times
        self.frame_count: int = self._file.frame_count
        self.byte_count: int = self._file.byte_count
        self.block_starts: list[int] = self._file.block_starts
        self.metadata: dict[str, str] = self._file.metadata
        self.events = tuple(Event(*event) for event in self._file.events)
        self._index = {name: i for i, name in enumerate(self.names)}

    def read(
        self, frames: tuple[int, int] | None = None, controls: Sequence[str] | None = None
    ) -> Clip:
        """Frames begin to end - 1 of some controls, or of all.

        Returns:
            A clip that starts when its first frame does. It has those events whose time it spans;
            the whole clip has all.

        Raises:
            ClipError: frames that are not there, a damaged block, more at once than a file of this
                size may take.
            KeyError: a control that is not there.
        """
        begin, end = frames if frames is not None else (0, self.frame_count)
        if begin < 0 or end < begin or end > self.frame_count:
            raise ClipError(
                f"frames from 0 to {self.frame_count} were expected, found {begin} to {end}"
            )
        count = len(self.names if controls is None else controls)
        needed = (end - begin) * (4 * count + 8)
        if needed > MOST_BYTES + BYTES_PER_BYTE * self._size:
            raise ClipError(
                f"{count:,} controls of {end - begin:,} frames take {needed:,} bytes, at most "
                f"{MOST_BYTES + BYTES_PER_BYTE * self._size:,} were expected of a file of "
                f"{self._size:,}: read it in parts (frames, controls)"
            )
        wanted = None if controls is None else [self._index[name] for name in controls]
        curves, times = self._file.read(begin, end, wanted)
        events = self.events
        if (begin, end) != (0, self.frame_count):
            first = float(times[0]) if times is not None and end > begin else self._at(begin)
            last = float(times[-1]) if times is not None and end > begin else self._at(end - 1)
            events = tuple(e for e in events if first <= e.time <= last)
        return Clip(
            self.names if controls is None else controls,
            curves,
            self.rate,
            start=self._at(begin),
            times=times,
            events=events,
            metadata=self.metadata,
        )

    def _at(self, frame: int) -> float:
        return self.start + frame / self.rate


class ClipWriter:
    """Records a clip: frames go to PATH.part as they come, and close() makes PATH of it. What is
    not closed stays: `ClipReader(part, recover=True)` reads it up to the last whole block. Used
    with `with`, it closes at the end, but not after an exception.

        with ClipWriter("take.rzc", names, 60.0) as take:
            take.append(frames)
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        names: Iterable[str],
        rate: float = 60.0,
        *,
        start: float = 0.0,
        has_times: bool = False,
        metadata: Mapping[str, str] | None = None,
        block_frames: int = 512,
    ) -> None:
        """Open a file for names.

        Args:
            has_times: each frame will come with its time.
            block_frames: 1 to 4096. Few lose less when recording ends badly, many take less space.

        Raises:
            ClipError: a name twice, a rate that is not above 0, a file that cannot be written.
        """
        self.names: tuple[str, ...] = tuple(names)
        self.path = os.fspath(path)
        self._file = ClipFileWriter(
            self.path,
            self.names,
            float(rate),
            float(start),
            has_times,
            list((metadata or {}).items()),
            block_frames,
        )

    @property
    def part(self) -> str:
        """Where the frames are until the clip is closed."""
        return os.fspath(self._file.part)

    @property
    def frame_count(self) -> int:
        return int(self._file.frame_count)

    def append(self, frames: npt.ArrayLike, times: npt.ArrayLike | None = None) -> None:
        """Add frames.

        Args:
            frames: float32[n, controls], or [controls] of one frame.
            times: float64[n] in seconds, after those before, if the clip has times.

        Raises:
            ClipError: times that do not ascend, a closed clip, a disk that is full.
            ValueError: another shape.
        """
        given = np.asarray(frames, np.float32)
        if given.ndim == 1:
            given = given[None]
        own = None if times is None else np.atleast_1d(np.asarray(times, np.float64))
        self._file.append(given, own)

    def event(self, event: Event) -> None:
        """Add an event; it is written with the frames that come next."""
        self._file.event(event)

    def close(self) -> None:
        """Write what is left and give the file its name. Closing twice is closing once.

        Raises:
            ClipError: the file cannot be written.
        """
        self._file.close()

    def __enter__(self) -> ClipWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if kind is None:
            self.close()
