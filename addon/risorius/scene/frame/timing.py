# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the time of each stage of a frame, for the overlay and for benchmarks."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import pairwise
from statistics import median
from time import perf_counter

from ...logic.base.sentences import Sentence, told
from ..base import session

STAGES = ("controls", "rig", "bones", "shapes")
_KEPT = 30  # number of frames whose median the overlay shows


class Frame:
    """Times of one frame in ms: the stages of Risorius, and Blender's animation, deformation and
    drawing."""

    def __init__(self) -> None:
        self.begin = self.ended = perf_counter()
        self.stages = dict.fromkeys(STAGES, 0.0)
        self.animation = self.deform = self.drawing = 0.0
        self.characters = 0

    @property
    def ours(self) -> float:
        """The sum of the add-on's stages in ms."""
        return sum(self.stages.values())


frames = session.keep("timing.frames", lambda: deque([Frame()], maxlen=_KEPT), ("unregister",))
_drawing = session.value("timing.drawing", 0.0, ("unregister",))


def begin() -> None:
    """Begin to measure a frame change, or the update after an edit."""
    frames.append(Frame())


def animated() -> None:
    """Record the time in which Blender evaluated F-curves, NLA strips and drivers of controls."""
    frames[-1].animation = _since(frames[-1].begin)


def evaluated() -> None:
    """Record the time that Blender took to deform the meshes after the faces were evaluated.

    If no face was evaluated before the frame, the whole time counts as Blender's animation.
    """
    if frames[-1].characters:
        frames[-1].deform = _since(frames[-1].ended)
    else:
        animated()


def looked(begin: float) -> None:
    """Add the time for reading the controls of a character whose controls are unchanged.

    Args:
        begin: perf_counter before the reading.
    """
    frames[-1].stages["controls"] += _since(begin)


def add(times: Sequence[float]) -> None:
    """Add the time of each stage in which a character was evaluated.

    Args:
        times: five values of perf_counter: before the first stage, and after each of the STAGES.
    """
    for name, start, end in zip(STAGES, times[:-1], times[1:], strict=True):
        frames[-1].stages[name] += (end - start) * 1000
    frames[-1].characters += 1
    frames[-1].ended = times[-1]


def skinned(begin: float) -> None:
    """Add the time for writing the final vertex positions of faces.

    Args:
        begin: perf_counter before the writing.
    """
    frames[-1].stages["shapes"] += _since(begin)
    frames[-1].ended = perf_counter()


def drawing_begins() -> None:
    """Record that Blender has evaluated the written values and begins to draw a view."""
    _drawing.now = perf_counter()
    if not frames[-1].deform:
        frames[-1].deform = _since(frames[-1].ended)


def drawing_ends() -> None:
    """Record the time of Blender's drawing calls for a view, which have ended."""
    frames[-1].drawing = _since(_drawing.now)


def _since(moment: float) -> float:
    return (perf_counter() - moment) * 1000


def lines() -> list[Sentence]:
    """Lines of the overlay: median times of the last frames in ms."""
    seen = [f for f in frames if f.characters]
    if not seen:
        return [told("Risorius: no frame yet")]

    middle = {stage: median(f.stages[stage] for f in seen) for stage in STAGES}
    count = seen[-1].characters
    apart = median([b.begin - a.begin for a, b in pairwise(seen)] or [0.0])
    head = told("Risorius, faces: {count}", count=count)
    if apart > 0:
        head = told("Risorius, faces: {count}   {rate:.0f} fps", count=count, rate=1 / apart)
    ahead, behind, drawn = (
        median(getattr(f, name) for f in seen) for name in ("animation", "deform", "drawing")
    )
    return [
        head,
        told("Blender: curves, strips, drivers  {ms:.2f} ms", ms=ahead),
        told("controls  {ms:.2f} ms", ms=middle["controls"]),
        told("rig  {ms:.2f} ms", ms=middle["rig"]),
        told("bones  {ms:.2f} ms", ms=middle["bones"]),
        told("shapes  {ms:.2f} ms", ms=middle["shapes"]),
        told("Blender: bones, skin, shapes  {ms:.2f} ms", ms=behind),
        told("Blender: drawing  {ms:.2f} ms", ms=drawn),
    ]
