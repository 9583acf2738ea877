# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the controls that a layer of animation may move, and the frames at which it plays."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np
from numpy.typing import NDArray

from ..base.face_regions import FaceRegions
from ..character import slider_words

Float = NDArray[np.float64]
COLLECTION = "risorius_layers"
_PATH = re.compile(rf"^{COLLECTION}\[(\d+)\]")
_LIMIT = 100_000  # largest number of samples of a source in addition to its keys
_NEAR = 1e-7  # times that differ by fewer frames are merged


def masked(
    controls: Iterable[str], regions: FaceRegions, chosen: Iterable[str], words: str = ""
) -> list[str]:
    """The controls that a layer may move, in the order of `controls`.

    Args:
        controls: full names of controls.
        regions: regions of the face.
        chosen: regions that the layer moves; empty for all regions.
        words: names or patterns such as `jawOpen mouth*`, separated by spaces or commas, in upper
            or lower case, with or without the controls' prefix. A word with `-` in front excludes
            controls. If all words begin with `-`, all controls except the excluded ones are kept.
    """
    wanted = set(chosen)
    patterns = [w.lower() for w in re.split(r"[\s,;]+", words) if w.strip("-")]
    taken = [p for p in patterns if not p.startswith("-")]
    left_out = [p[1:] for p in patterns if p.startswith("-")]
    kept = []
    for control in controls:
        if wanted and regions.of_control(control) not in wanted:
            continue
        names = (control.lower(), slider_words.short_name(control).lower())
        if taken and not any(fnmatchcase(n, p) for n in names for p in taken):
            continue
        if not any(fnmatchcase(n, p) for n in names for p in left_out):
            kept.append(control)
    return kept


@dataclass(frozen=True)
class Span:
    """The time of a layer: frames of its source and of the scene.

    Attributes:
        start: frame of the scene that shows the source's frame `first`, or `last` if reversed.
        first, last: first and last played frame of the source.
        scale: factor of the duration; 2 plays at half speed.
        repeat: number of times that the source plays, such as 1.5.
        reverse: True: plays from `last` to `first`.
        warp: frames of the scene and the frames of the source that play at them, float64[n] each;
            replaces `start`, `scale`, `repeat` and `reverse`. None: no warp.
    """

    start: float
    first: float
    last: float
    scale: float = 1.0
    repeat: float = 1.0
    reverse: bool = False
    warp: tuple[Float, Float] | None = None

    @property
    def period(self) -> float:
        """The duration of playing the source once, in frames of the scene."""
        return (self.last - self.first) * self.scale

    def scene_range(self) -> tuple[float, float]:
        """The first and the last frame of the scene at which the layer plays."""
        if self.warp is not None:
            return float(self.warp[0][0]), float(self.warp[0][-1])
        return self.start, self.start + self.period * self.repeat

    def source(self, frames: Float) -> Float:
        """The source's frames that the layer shows at given frames of the scene.

        Without a warp, the source repeats without end, also at scene frames before and after the
        layer. With a warp, scene frames before its first point show the source's frame of that
        point, and scene frames after its last point show the source's frame of the last point.
        """
        if self.warp is not None:
            return np.interp(frames, *self.warp)
        if not self.period > 0.0:
            return np.full(len(frames), self.first)
        gone = np.mod(frames - self.start, self.period) / self.scale
        return self.last - gone if self.reverse else self.first + gone


def sample_frames(span: Span, keys: Float, bent: bool) -> Float:
    """The frames to sample, so that straight lines between samples replace the source's curves.

    On whole frames of the scene, the lines equal the source. If a curve is not straight between
    keyframes, four samples per frame of the scene keep the error between whole frames small.

    Args:
        span: time of the layer.
        keys: frames of all keys of the source, float64[n].
        bent: whether a curve of the source has curved handles, steps or modifiers.

    Returns:
        float64[n], ascending; at least one.
    """
    first, last = span.first, span.last
    if not last > first:
        return np.array([first])
    grid = np.asarray(keys, np.float64)
    grid = grid[(grid > first) & (grid < last)]
    if bent:
        begin, end = span.scene_range()
        count = int(min(max(end - np.floor(begin), 0.0) * 4, _LIMIT)) + 1
        shown = span.source(np.floor(begin) + np.arange(count) * 0.25)
        grid = np.concatenate([grid, shown[(shown > first) & (shown < last)]])
    every = np.unique(np.concatenate([[first], grid, [last]]))
    # Merge times that differ by rounding only, because times must ascend.
    return every[np.concatenate([[True], np.diff(every) > _NEAR])]


def place_of(path: str) -> int | None:
    """The index of the layer in a data path such as `risorius_layers[2].weight`, or None."""
    found = _PATH.match(path)
    return int(found.group(1)) if found else None
