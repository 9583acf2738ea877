# SPDX-License-Identifier: MIT
"""Defines clips (curves of named controls), and reads .rzc clip files completely or in parts.

A clip plays on every character whose rig has these controls.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .._native import ClipError, ClipFile, encode_clip, write_clip
from ..base import signatures
from ..base.budget import BYTES_PER_BYTE, Budget, BudgetError
from ..base.errors import ArgumentError

_AT_ONCE = 4096  # frames that are resampled at a time
# Memory that the clip from one read may take, in bytes, in addition to BYTES_PER_BYTE times the
# file's size. This amount suffices for 75 minutes of 1,000 controls at 60 frames per second.
MOST_BYTES = 1 << 30

Floats = npt.NDArray[np.float32]
Times = npt.NDArray[np.float64]


class Event(NamedTuple):
    """A named event at a time of a clip, such as a spoken word, a note or a reaction to start."""

    time: float
    """Seconds, on the clip's own clock."""
    name: str
    duration: float = 0.0
    """Seconds; 0 for a moment."""
    value: str = ""


class Clip:
    """Curves of named controls.

    A clip does not refer to a rig: it plays on every character that has controls with its names, at
    every LOD. A clip is immutable: operations return a new clip.

    Attributes:
        names: the controls, each once, usually in the spelling of a DNA's raw controls.
        curves: float32[controls, frames], contiguous and read-only. All bits are kept, including
            NaN, -0 and denormals.
        rate: frames per second. For a clip with individual times, the rate that tools should
            propose.
        start: seconds, the time of the first frame; equal to times[0] if there are times.
        times: float64[frames] in seconds, strictly ascending, or None: then frame i is at start + i
            / rate.
        events: events in the order of their times.
        metadata: facts about the clip, such as source, take and actor.
    """

    def __init__(
        self,
        names: Iterable[str],
        curves: npt.ArrayLike,
        rate: float = 60.0,
        *,
        start: float = 0.0,
        times: npt.ArrayLike | None = None,
        events: Iterable[Event] = (),
        metadata: Mapping[str, str] | None = None,
    ) -> None:
        """Copy the arguments, which the class describes.

        Raises:
            ValueError: a repeated name, a wrong shape, a rate that is not above 0, a start that is
                not finite, or times that are not finite or do not ascend.
        """
        self.names: tuple[str, ...] = tuple(names)
        self.curves: Floats = _frozen(np.array(curves, np.float32, order="C"))
        self.rate = float(rate)
        self.start = float(start)
        self.times: Times | None = None
        if times is not None:
            self.times = _frozen(np.array(times, np.float64))
        self.events: tuple[Event, ...] = tuple(sorted(events, key=lambda event: event.time))
        self.metadata: dict[str, str] = dict(metadata or {})
        self._index = {name: i for i, name in enumerate(self.names)}
        self._check()
        if self.times is not None and self.times.size:
            self.start = float(self.times[0])

    def _check(self) -> None:
        if self.curves.ndim != 2 or self.curves.shape[0] != len(self.names):
            raise ArgumentError(
                f"curves of {len(self.names)} controls were expected as [controls, frames], found "
                f"the shape {list(self.curves.shape)}"
            )
        if len(self._index) != len(self.names):
            twice = next(n for i, n in enumerate(self.names) if self._index[n] != i)
            raise ArgumentError(f"{twice}: a control may have one curve only, found two")
        if not (np.isfinite(self.rate) and self.rate > 0.0):
            raise ArgumentError(f"a rate above 0 frames per second was expected, found {self.rate}")
        if not np.isfinite(self.start):
            raise ArgumentError(f"a start in seconds was expected, found {self.start}")
        if self.times is not None:
            self._check_times(self.times)

    def _check_times(self, times: Times) -> None:
        if times.shape != (self.frame_count,):
            raise ArgumentError(
                f"{self.frame_count} times were expected, found the shape {list(times.shape)}"
            )
        if not np.isfinite(times).all():
            raise ArgumentError(
                f"frame {int(np.argmin(np.isfinite(times)))}: its time is no number"
            )
        if (np.diff(times) <= 0.0).any():
            frame = int(np.argmax(np.diff(times) <= 0.0)) + 1
            raise ArgumentError(
                f"frame {frame}: a time after {times[frame - 1]} s was expected, "
                f"found {times[frame]} s"
            )

    def __repr__(self) -> str:
        return (
            f"Clip({len(self.names)} controls, {self.frame_count} frames, {self.rate:g} fps, "
            f"{self.duration:.3f} s)"
        )

    @property
    def frame_count(self) -> int:
        return int(self.curves.shape[1])

    @property
    def duration(self) -> float:
        """Seconds from the first frame to the last; 0 for a single frame."""
        if self.frame_count < 2:
            return 0.0
        if self.times is not None:
            return float(self.times[-1] - self.times[0])
        return (self.frame_count - 1) / self.rate

    def frame_times(self) -> Times:
        """Times of all frames in seconds, float64[frames]."""
        if self.times is not None:
            return self.times
        return self.start + np.arange(self.frame_count) / self.rate

    def curve(self, name: str) -> Floats:
        """The curve of a control, float32[frames]. Raises: KeyError: the clip lacks the control."""
        return self.curves[self._index[name]]

    def __contains__(self, name: str) -> bool:
        return name in self._index

    def sample(self, times: npt.ArrayLike) -> Floats:
        """The curves at any times, interpolated linearly between frames and constant outside.

        Args:
            times: seconds, [n], on the clip's own clock.

        Returns:
            float32[n, controls]. At the time of a frame the values equal that frame bit for bit.
        """
        wanted = np.atleast_1d(np.asarray(times, np.float64))
        count = self.frame_count
        if count == 0:
            return np.zeros((wanted.size, len(self.names)), np.float32)
        if self.times is not None:
            place = np.interp(wanted, self.times, np.arange(count, dtype=np.float64))
        else:
            place = np.clip((wanted - self.start) * self.rate, 0.0, count - 1.0)
            # The times of frames are rounded. A position within 1e-9 of a frame becomes that frame,
            # so that the time of a frame gives its exact values.
            near = np.rint(place)
            place = np.where(np.abs(place - near) < 1e-9 * np.maximum(near, 1.0), near, place)
        place = np.nan_to_num(place, nan=0.0)  # NaN counts as the time of the first frame
        first = np.minimum(place.astype(np.int64), count - 1)
        part = (place - first).astype(np.float32)[:, None]
        here = self.curves[:, first].T
        following = self.curves[:, np.minimum(first + 1, count - 1)].T
        return np.where(part == 0.0, here, here + (following - here) * part)

    def resampled(self, rate: float) -> Clip:
        """The clip with evenly spaced frames at `rate` per second, from its first to its last time.

        Raises:
            BudgetError: long gaps between frames would give more frames than the memory budget for
                a clip of this size allows.
        """
        count = self._even_count(rate, 1e-6)
        times = self.start + np.arange(count) / rate
        return self.replaced(curves=self._sampled(times), rate=rate, times=None)

    def without_gaps(self) -> Clip:
        """The clip with evenly spaced frames at its `rate`, from the time of its first frame to the
        time nearest to its last frame.

        Raises:
            BudgetError: long gaps between frames would give more frames than the memory budget for
                a clip of this size allows.
        """
        count = self._even_count(self.rate, 0.5)
        start = float(self.frame_times()[0]) if self.frame_count else self.start
        curves = self._sampled(start + np.arange(count) / self.rate)
        return self.replaced(curves=curves, start=start, times=None)

    def _even_count(self, rate: float, rounding: float) -> int:
        """The number of frames at `rate` from the first to the last time, rounded down after adding
        `rounding`. Raises BudgetError if they need too much memory."""
        frames = self.duration * rate
        budget = Budget.of(self.curves.nbytes + 8 * self.frame_count)
        each = 4 * len(self.names) + 8  # float32 of each control, and a time
        if (frames + 1.0) * each > budget.bytes:
            raise BudgetError(
                f"{self._longest_step()}: {frames:,.0f} frames at {rate:g} a second were asked "
                f"for, {budget.bytes // each:,} are the most of a clip of this size: mend the "
                "time, or cut the clip before"
            )
        return int(np.floor(frames + rounding)) + 1 if self.frame_count else 0

    def _longest_step(self) -> str:
        """The longest gap of the clip, e.g. "frame 1 comes 9 s after frame 0 at 2 s"; the number of
        frames if the frames have no individual times."""
        if self.times is None:
            return f"the clip has {self.frame_count:,} frames at {self.rate:g} a second"
        frame = int(np.argmax(np.diff(self.times)))
        step = self.times[frame + 1] - self.times[frame]
        return f"frame {frame + 1} comes {step:g} s after frame {frame} at {self.times[frame]:g} s"

    def _sampled(self, times: Times) -> Floats:
        """The curves at many times, float32[controls, times]; sampled in blocks to save memory."""
        out = np.empty((len(self.names), times.size), np.float32)
        for first in range(0, times.size, _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            out[:, part] = self.sample(times[part]).T
        return out

    def selected(self, names: Sequence[str]) -> Clip:
        """The clip with only the named controls, in this order. Raises KeyError for an unknown
        name."""
        rows = [self._index[name] for name in names]
        return self.replaced(names=names, curves=self.curves[rows])

    def replaced(self, **changes: object) -> Clip:
        """The clip with other values for some of its attributes.

        Args:
            changes: new values of names, curves, rate, start, times, events or metadata.
        """
        values: dict[str, object] = {
            "names": self.names,
            "curves": self.curves,
            "rate": self.rate,
            "start": self.start,
            "times": self.times,
            "events": self.events,
            "metadata": self.metadata,
        }
        unknown = set(changes) - set(values)
        if unknown:
            raise TypeError(f"a clip has no field {sorted(unknown)[0]}")
        return Clip(**{**values, **changes})  # type: ignore[arg-type]

    def to_bytes(self) -> bytes:
        """The contents of a .rzc file with this clip, without loss."""
        return encode_clip(
            self.names,
            self.curves,
            self.rate,
            self.start,
            self.times,
            self.events,
            list(self.metadata.items()),
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the clip to a .rzc file, replacing an existing file.

        Raises:
            ClipError: the file cannot be written.
        """
        write_clip(path, self.to_bytes())

    @staticmethod
    def load(
        source: str | os.PathLike[str] | bytes,
        *,
        frames: tuple[int, int] | None = None,
        controls: Sequence[str] | None = None,
    ) -> Clip:
        """Read a .rzc file, or only some of its frames or controls.

        Args:
            source: a path, or the bytes of a .rzc file.
            frames: first frame and end (exclusive), counted from 0; None for all.
            controls: names of the curves to read, in the wanted order; None for all.

        Raises:
            ClipError: not a .rzc file, truncated, damaged or of another version, it cannot be
                opened, it lacks some of the frames, or they are more than one read of a file of
                this size may return.
            KeyError: the file lacks a control.
        """
        return ClipReader(source).read(frames, controls)

    def raw_controls(self, rig_names: Sequence[str]) -> tuple[Floats, list[str]]:
        """The curves as input of `Rig.evaluate_batch`.

        Args:
            rig_names: `Rig.raw_control_names`.

        Returns:
            float32[frames, rig_names], 0 for controls without a curve, and the names of curves that
            the rig lacks.
        """
        index = {name: i for i, name in enumerate(rig_names)}
        raw = np.zeros((self.frame_count, len(rig_names)), np.float32)
        unknown = []
        for name, curve in zip(self.names, self.curves, strict=True):
            if name in index:
                raw[:, index[name]] = curve
            else:
                unknown.append(name)
        return raw, unknown


class ClipReader:
    """Reads a .rzc file in parts.

    The file stores frames in compressed blocks. The most recently read block stays in memory in
    its compressed form. For playback, read a few hundred frames at a time.

    Attributes:
        names: names of the controls.
        rate, start: frames per second, and time of the first frame in seconds.
        has_times: whether each frame has its own time.
        frame_count: number of frames in the file.
        byte_count: bytes of the file that belong to the clip; fewer than the file's size only after
            a recovery.
        block_starts: index of the first frame of each block, and at the end the frame count.
        events: events of the whole clip, in the order in which the file stores them.
        metadata: facts about the clip, such as source, take and actor.
    """

    def __init__(self, source: str | os.PathLike[str] | bytes, *, recover: bool = False) -> None:
        """Read the file's header and index.

        Args:
            source: a path, or the bytes of a file.
            recover: True: also accept a file that was truncated during recording, up to its last
                complete block.

        Raises:
            ClipError: not a .rzc file, truncated, damaged or of another version, or it cannot be
                opened.
        """
        if isinstance(source, bytearray | memoryview):
            source = bytes(source)
        given = source if isinstance(source, bytes) else os.fspath(source)
        try:
            self._file = ClipFile(given, recover)
        except ClipError as error:
            if error.code != "not_clip":
                raise
            raise signatures.named(error, source) from None
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
        """Read the named controls (None: all) in `frames` (begin, exclusive end; None: all).

        Returns:
            A clip that starts at the time of its first frame. The clip has the events within its
            time span; a read of all frames has all events.

        Raises:
            ClipError: frames that do not exist, a damaged block, or more frames than one read of a
                file of this size may return.
            KeyError: the file lacks a control.
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
                f"{self._size:,} bytes: read it in parts (frames, controls)"
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


def _frozen(array: npt.NDArray) -> npt.NDArray:  # type: ignore[type-arg]
    array.flags.writeable = False
    return array
