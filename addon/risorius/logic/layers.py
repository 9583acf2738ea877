# SPDX-License-Identifier: GPL-3.0-or-later
"""Layers of animation without Blender: what a layer moves, and when it reads its source."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from . import regions

Float = NDArray[np.float64]
COLLECTION = "risorius_layers"
_PATH = re.compile(rf"^{COLLECTION}\[(\d+)\](.*)$")
_LIMIT = 200_000  # samples of one source: an hour at 50 fps


def masked(controls: Iterable[str], chosen: Iterable[str], words: str = "") -> list[str]:
    """The controls that a layer may move, in their order.

    Args:
        controls: names.
        chosen: regions; none means all.
        words: names or patterns, separated by spaces or commas: `jawOpen mouth*`, without their
            prefix and in any case. One that begins with `-` is taken out again. Where all begin
            with it, they are taken out of everything.
    """
    wanted = set(chosen)
    patterns = [w.lower() for w in re.split(r"[\s,;]+", words) if w.strip("-")]
    taken = [p for p in patterns if not p.startswith("-")]
    left_out = [p[1:] for p in patterns if p.startswith("-")]
    kept = []
    for control in controls:
        if wanted and regions.region_of(control) not in wanted:
            continue
        names = (control.lower(), regions.short_name(control).lower())
        if taken and not any(fnmatchcase(n, p) for n in names for p in taken):
            continue
        if not any(fnmatchcase(n, p) for n in names for p in left_out):
            kept.append(control)
    return kept


@dataclass(frozen=True)
class Span:
    """When a layer plays its source, in frames of the scene.

    Attributes:
        start: where the source's frame `first` is played.
        first, last: of the source that are played.
        scale: how much longer than the source it is; 2 is half as fast.
        repeat: how often; 0 for ever.
    """

    start: float
    first: float
    last: float
    scale: float = 1.0
    repeat: float = 1.0

    @property
    def period(self) -> float:
        """Frames of the scene that the source takes once."""
        return (self.last - self.first) * self.scale

    @property
    def end(self) -> float:
        """Where it ends; infinite where it repeats for ever."""
        return self.start + self.period * self.repeat if self.repeat > 0 else np.inf

    def source(self, frames: Float) -> Float:
        """The source's frames at frames of the scene, of the first time that it plays."""
        return self.first + (np.asarray(frames, np.float64) - self.start) / self.scale


def sample_frames(span: Span, keys: Sequence[float], bent: bool) -> Float:
    """At which of its own frames a source is sampled so that straight lines between them are it.

    Whole frames of the scene always are among them, so that they are exact at any time scale, and
    all keys. A curve that bends between its keys is sampled four times as often.

    Args:
        span: when it plays.
        keys: frames of all its keys.
        bent: whether a curve has handles or a modifier.

    Returns:
        float64[n], ascending; at least one.
    """
    first, last = span.first, span.last
    inside = [k for k in keys if first <= k <= last]
    if not last > first:
        return np.array([first])
    begin = span.start
    step = 0.25 if bent else 1.0
    count = int(min(np.ceil(span.period / step) + 2, _LIMIT))
    scene = np.floor(begin) + np.arange(count) * step
    grid = span.source(scene)
    if not bent and inside and span.scale == 1.0:
        grid = grid[:0]  # straight lines from key to key are all there is
    every = np.concatenate([[first, last], inside, grid[(grid > first) & (grid < last)]])
    return np.unique(every)


def moved_path(path: str, order: Sequence[int]) -> str | None:
    """The data path of a layer's property after layers were put into another order.

    Args:
        path: `risorius_layers[2].weight`, or any other.
        order: for each new place the old one; a layer that is not in it was removed.

    Returns:
        The new path, or None where its layer is gone. Other paths stay.
    """
    found = _PATH.match(path)
    if not found:
        return path
    old = int(found.group(1))
    return f"{COLLECTION}[{order.index(old)}]{found.group(2)}" if old in order else None
