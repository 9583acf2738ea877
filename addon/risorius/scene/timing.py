# SPDX-License-Identifier: GPL-3.0-or-later
"""How long each stage of a frame takes, for the overlay and for benchmarks."""

from collections import deque
from time import perf_counter

STAGES = ("controls", "rig", "bones", "shapes")
_KEPT = 30  # frames that the overlay shows the median of


class Frame:
    """Milliseconds of one frame: of our stages, and of what Blender does around them."""

    def __init__(self):
        self.begin = perf_counter()
        self.stages = dict.fromkeys(STAGES, 0.0)
        self.animation = self.ours = self.deform = self.drawing = 0.0
        self.characters = 0


frames = deque([Frame()], maxlen=_KEPT)


def begin():
    """A frame change, or an edit of a control, begins."""
    frames.append(Frame())


def animated():
    """Blender has evaluated curves, strips and drivers."""
    frames[-1].animation = (perf_counter() - frames[-1].begin) * 1000


def add(times):
    """One character was brought up. Args: times  perf_counter at the stages' ends, five."""
    for name, start, end in zip(STAGES, times[:-1], times[1:], strict=True):
        frames[-1].stages[name] += (end - start) * 1000
    frames[-1].characters += 1
