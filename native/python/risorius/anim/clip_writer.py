# SPDX-License-Identifier: MIT
"""Clips as .rzc files, written while they are recorded."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from types import TracebackType

import numpy as np
import numpy.typing as npt

from .._native import ClipFileWriter
from .clip import Event


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
