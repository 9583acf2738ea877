# SPDX-License-Identifier: MIT
"""What every source of live capture yields: a frame of named values of one subject."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..base.errors import RisoriusError

Floats = npt.NDArray[np.float32]


class LiveError(RisoriusError):
    """Live capture cannot start, or a packet cannot be used; one sentence."""

    code = "live"


class Packet(NamedTuple):
    """What a decoder read: a whole face, at the sender's own time."""

    subject: str
    device: str
    """What tells two senders apart that call their subject alike; may be empty."""
    time: float | None
    """Seconds on the sender's clock; None where it sends none."""
    names: tuple[str, ...]
    values: Floats
    """float32[names]; units of a face 0 to 1, angles in radians."""


class Frame(NamedTuple):
    """A packet that was accepted."""

    subject: str
    time: float
    """Seconds on the subject's own clock, never going back: the sender's time, else arrival."""
    arrival: float
    """Seconds of this machine's perf_counter: finer on Windows than monotonic."""
    sequence: int
    """Counts the subject's frames from 1."""
    names: tuple[str, ...]
    values: Floats
    """float32[names], read-only."""


def unit_name(name: str) -> str:
    """A unit of ARKit as Apple spells it, from any of the ways in which tools spell it.

    `EyeBlinkLeft` and `eyeBlink_L` give `eyeBlinkLeft`; what is no such name changes in its first
    letter only.
    """
    if name.endswith(("_L", "_R")):
        name = name[:-2] + ("Left" if name.endswith("_L") else "Right")
    return name[:1].lower() + name[1:]


def turn_angles(forward: Floats, right: Floats, up: Floats) -> tuple[float, float, float]:
    """Yaw, pitch and roll of a head whose axes are given in the axes of a straight head.

    Args:
        forward, right, up: float[3] unit vectors of the turned head: its own right, up, forward,
            each as (right, up, forward).

    Returns:
        Radians: yaw positive to the own left, pitch positive up, roll positive towards the own
        left shoulder; turned by yaw first, then by pitch, then by roll, each about the axes that
        the turns before have turned.
    """
    yaw = -np.arctan2(forward[0], forward[2])
    pitch = np.arcsin(np.clip(forward[1], -1.0, 1.0))
    roll = np.arctan2(right[1], up[1])
    return float(yaw), float(pitch), float(roll)
