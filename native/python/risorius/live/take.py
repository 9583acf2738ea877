# SPDX-License-Identifier: MIT
"""A recording of the unchanged frames of one subject."""

from __future__ import annotations

import numpy as np

from ..anim.clip import Clip
from .frame import Frame
from .shaping import Plan, Shaper


class Take:
    """The recorded frames of one subject, in order of time; gaps are kept.

    Attributes:
        subject: the recorded subject; "" until the first frame determines it.
        limit: largest number of frames.
        full: number of frames that arrived after the limit was reached, and were dropped.
    """

    def __init__(self, subject: str = "", limit: int = 108_000) -> None:
        self.subject = subject
        self.full = 0
        self.limit = limit
        self._frames: list[Frame] = []

    def __len__(self) -> int:
        return len(self._frames)

    def add(self, frame: Frame) -> None:
        """Appends a frame of the subject; frames of other subjects are ignored.

        A frame that is not later than the last one replaces it, at the time of the last one.

        Args:
            frame: the next frame in order of arrival.
        """
        self.subject = self.subject or frame.subject
        if frame.subject != self.subject:
            return
        if self._frames and frame.time <= self._frames[-1].time:
            self._frames[-1] = frame._replace(time=self._frames[-1].time)
        elif len(self._frames) < self.limit:
            self._frames.append(frame)
        else:
            self.full += 1

    def clip(self, shaper: Shaper | None = None) -> Clip:
        """The take as a clip of raw controls that starts at 0 s.

        Args:
            shaper: converts values to controls; its smoothing is ignored, because it can be added
                later but not removed.

        Returns:
            A Clip with a time per frame. A curve is 0 in frames that do not give its control.
        """
        shaper = (shaper or Shaper()).without_smoothing()
        rows = [shaper.apply(frame) for frame in self._frames]
        names: dict[str, int] = {}
        for row in rows:
            for name in row.names:
                names.setdefault(name, len(names))
        curves = np.zeros((len(names), len(rows)), np.float32)
        for column, row in enumerate(rows):
            curves[[names[name] for name in row.names], column] = row.values
        times = np.array([frame.time for frame in self._frames], np.float64)
        times -= times[0] if len(times) else 0.0
        metadata = {"subject": self.subject}
        if shaper.ranges is not None and shaper.ranges.used():
            metadata = shaper.ranges.noted(metadata)
        return Clip(names, curves, _rate(times), times=times, metadata=metadata)

    def unmapped(self, shaper: Shaper) -> list[str]:
        """Names in the take's frames for which a shaper has no control."""
        kinds = dict.fromkeys(frame.names for frame in self._frames)
        plans = (Plan(names, shaper.mapping) for names in kinds)
        return sorted({name for plan in plans for name in plan.unmapped})


def _rate(times: np.ndarray) -> float:  # type: ignore[type-arg]
    """Frames per second from the median step; 60 for a take of fewer than two frames."""
    steps = np.diff(times)
    return round(1.0 / float(np.median(steps)), 3) if steps.size else 60.0
