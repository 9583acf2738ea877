# SPDX-License-Identifier: MIT
"""Writes .rzc clips during recording."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from types import TracebackType

import numpy as np
import numpy.typing as npt

from .._native import ClipFileWriter
from .clip import Event


class ClipWriter:
    """Records a clip to PATH.part frame by frame; close() renames it to PATH.

    A clip that was not closed stays as a .part file, which `ClipReader(part, recover=True)` reads
    up to the last complete block. A `with` statement closes the clip at the end of its block, but
    not after an exception.
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
        """Open a file for recording.

        Args:
            path: path of the .rzc file after close().
            names: names of the controls, each once.
            rate: frames per second, above 0.
            start: seconds, the time of the first frame.
            has_times: True: each frame has its own time.
            metadata: facts about the clip, such as source, take and actor.
            block_frames: 1 to 4096. Small blocks lose less in a crash; large blocks take less
                space.

        Raises:
            ClipError: a repeated name, a rate that is not above 0, a file that cannot be written.
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
        """The path of the file that holds the frames until the clip is closed."""
        return os.fspath(self._file.part)

    @property
    def frame_count(self) -> int:
        return int(self._file.frame_count)

    def append(self, frames: npt.ArrayLike, times: npt.ArrayLike | None = None) -> None:
        """Add frames.

        Args:
            frames: float32[n, controls], or [controls] for one frame.
            times: float64[n], seconds, ascending and later than all earlier frames; only if
                has_times.

        Raises:
            ClipError: times that do not ascend, a closed clip, a full disk.
            ValueError: `frames` has another shape.
        """
        given = np.asarray(frames, np.float32)
        if given.ndim == 1:
            given = given[None]
        own = None if times is None else np.atleast_1d(np.asarray(times, np.float64))
        self._file.append(given, own)

    def event(self, event: Event) -> None:
        """Add an event, which is written together with the next frames."""
        self._file.event(event)

    def close(self) -> None:
        """Write the remaining frames and rename the file. Further calls have no effect.

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
