# SPDX-License-Identifier: MIT
"""Control animation: named curves over time, for any character whose rig has controls so named;
.rzc files of them, read as a whole or in parts."""

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

_AT_ONCE = 4096  # frames
# What may be read at once however small the file: 75 minutes of 1,000 controls that stand still.
MOST_BYTES = 1 << 30

Floats = npt.NDArray[np.float32]
Times = npt.NDArray[np.float64]


class Event(NamedTuple):
    """Something that happens at a time of a clip: a word, a note, a reaction to fire."""

    time: float
    """Seconds, on the clip's own clock."""
    name: str
    duration: float = 0.0
    """Seconds; 0 for a moment."""
    value: str = ""


class Clip:
    """Curves of named controls.

    A clip knows nothing of a rig: it plays on every character that has controls of its names, at
    every LOD. It is a value: what changes a clip returns another one.

    Attributes:
        names: the controls, each once; as a DNA spells its raw controls, or anything else that a
            curve may be named after.
        curves: float32[controls, frames], contiguous and read-only. Bit for bit what was given:
            NaN, -0 and denormals included.
        rate: frames per second. Of a clip with times of its own it is what tools should offer.
        start: seconds, the time of the first frame.
        times: float64[frames] in seconds, strictly ascending, or None: frame i is then at
            start + i / rate.
        events: by ascending time.
        metadata: what is worth knowing of the clip: its source, take, actor.
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
        """Take a copy of what is given.

        Raises:
            ValueError: a name twice, another shape, a rate that is not above 0, times that do not
                ascend; the sentence says which.
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
        """Seconds from the first frame to the last; 0 of a single frame."""
        if self.frame_count < 2:
            return 0.0
        if self.times is not None:
            return float(self.times[-1] - self.times[0])
        return (self.frame_count - 1) / self.rate

    def frame_times(self) -> Times:
        """float64[frames], seconds."""
        if self.times is not None:
            return self.times
        return self.start + np.arange(self.frame_count) / self.rate

    def curve(self, name: str) -> Floats:
        """float32[frames] of a control. Raises: KeyError."""
        return self.curves[self._index[name]]

    def __contains__(self, name: str) -> bool:
        return name in self._index

    def sample(self, times: npt.ArrayLike) -> Floats:
        """The curves at any times: straight lines between frames, held before and after.

        Args:
            times: seconds, [n], on the clip's own clock.

        Returns:
            float32[n, controls]. A time that is a frame's gives its very bits.
        """
        wanted = np.atleast_1d(np.asarray(times, np.float64))
        count = self.frame_count
        if count == 0:
            return np.zeros((wanted.size, len(self.names)), np.float32)
        if self.times is not None:
            place = np.interp(wanted, self.times, np.arange(count, dtype=np.float64))
        else:
            place = np.clip((wanted - self.start) * self.rate, 0.0, count - 1.0)
            near = np.rint(place)  # the division rounds; the time of a frame has to give that frame
            place = np.where(np.abs(place - near) < 1e-9 * np.maximum(near, 1.0), near, place)
        place = np.nan_to_num(place, nan=0.0)  # a time that is no number is the first frame's
        first = np.minimum(place.astype(np.int64), count - 1)
        part = (place - first).astype(np.float32)[:, None]
        here = self.curves[:, first].T
        following = self.curves[:, np.minimum(first + 1, count - 1)].T
        return np.where(part == 0.0, here, here + (following - here) * part)

    def resampled(self, rate: float) -> Clip:
        """The clip with frames `rate` a second, from its start to its end.

        Raises:
            BudgetError: frames far apart would become more than a clip of this size can be worth.
        """
        count = self._even_count(rate, 1e-6)
        times = self.start + np.arange(count) / rate
        return self.replaced(curves=self._sampled(times), rate=rate, times=None)

    def without_gaps(self) -> Clip:
        """The clip with even frames at its own rate from its first frame on.

        Raises:
            BudgetError: as resampled.
        """
        count = self._even_count(self.rate, 0.5)
        start = float(self.frame_times()[0]) if self.frame_count else self.start
        curves = self._sampled(start + np.arange(count) / self.rate)
        return self.replaced(curves=curves, start=start, times=None)

    def _even_count(self, rate: float, rounding: float) -> int:
        """Frames from the first to the last at a rate, if that many can be held."""
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
        """Where most of the clip's time goes, e.g. "frame 1 comes 9 s after frame 0 at 2 s"."""
        if self.times is None:
            return f"the clip has {self.frame_count:,} frames at {self.rate:g} a second"
        frame = int(np.argmax(np.diff(self.times)))
        step = self.times[frame + 1] - self.times[frame]
        return f"frame {frame + 1} comes {step:g} s after frame {frame} at {self.times[frame]:g} s"

    def _sampled(self, times: Times) -> Floats:
        """float32[controls, times]; some thousand at a time, so that it takes little more."""
        out = np.empty((len(self.names), times.size), np.float32)
        for first in range(0, times.size, _AT_ONCE):
            part = slice(first, first + _AT_ONCE)
            out[:, part] = self.sample(times[part]).T
        return out

    def selected(self, names: Sequence[str]) -> Clip:
        """The clip of these controls only, in this order. Raises: KeyError."""
        rows = [self._index[name] for name in names]
        return self.replaced(names=names, curves=self.curves[rows])

    def replaced(self, **changes: object) -> Clip:
        """The clip with other values for some of its attributes (names, curves, rate, start, times,
        events, metadata)."""
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
            raise TypeError(f"a clip has no {sorted(unknown)[0]}")
        return Clip(**{**values, **changes})  # type: ignore[arg-type]

    def to_bytes(self) -> bytes:
        """The clip as the bytes of a .rzc file: no bit of it is lost."""
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
        """Write the clip to a .rzc file; a file of that name from before is replaced as a whole.

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
        """Read a .rzc file, or some of its frames or controls.

        Args:
            source: path, or the bytes of such a file.
            frames: first and end (not included), from 0; None: all.
            controls: names of curves, in the order wanted; None: all.

        Raises:
            ClipError: no .rzc file, cut, damaged, of another version; or it cannot be opened.
            KeyError: a control that is not there.
        """
        return ClipReader(source).read(frames, controls)

    def raw_controls(self, rig_names: Sequence[str]) -> tuple[Floats, list[str]]:
        """What a rig is to be evaluated with.

        Args:
            rig_names: `Rig.raw_control_names`.

        Returns:
            float32[frames, rig_names], 0 where the clip has no curve, ready for
            `Rig.evaluate_batch`; and the names of the clip that the rig does not have.
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


def _frozen(array: npt.NDArray) -> npt.NDArray:  # type: ignore[type-arg]
    array.flags.writeable = False
    return array
