# SPDX-License-Identifier: MIT
"""The result of every live source: a frame of named values of one subject."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..base.errors import RisoriusError

Floats = npt.NDArray[np.float32]


class LiveError(RisoriusError):
    """Live capture cannot start, or a packet cannot be used; the text is one sentence."""

    code = "live"


class Packet(NamedTuple):
    """A decoded packet: a whole face, at the sender's time."""

    subject: str
    device: str
    """Distinguishes two senders with the same subject name; may be empty."""
    time: float | None
    """Seconds on the sender's clock; None if it sends no time."""
    names: tuple[str, ...]
    values: Floats
    """float32[names]; units of a face from 0 to 1, angles in radians."""


class Frame(NamedTuple):
    """An accepted packet."""

    subject: str
    time: float
    """Seconds on the subject's clock, never decreasing: the sender's time, else the time of
    arrival."""
    arrival: float
    """Seconds of this machine's perf_counter, which is finer than monotonic on Windows."""
    sequence: int
    """Number of the subject's frame, from 1."""
    names: tuple[str, ...]
    values: Floats
    """float32[names], read-only."""


def unit_name(name: str) -> str:
    """The name of an ARKit unit in Apple's spelling, from any usual spelling.

    `EyeBlinkLeft` and `eyeBlink_L` give `eyeBlinkLeft`; any other name changes only in its first
    letter.
    """
    if name.endswith(("_L", "_R")):
        name = name[:-2] + ("Left" if name.endswith("_L") else "Right")
    return name[:1].lower() + name[1:]


def turn_angles(forward: Floats, right: Floats, up: Floats) -> tuple[float, float, float]:
    """Yaw, pitch and roll of a head from its axes, expressed in the axes of a straight head.

    Args:
        forward, right, up: float[3] unit vectors of the turned head, with the components right, up,
        forward of the straight head.

    Returns:
        Radians: yaw positive to the own left, pitch positive up, roll positive towards the own left
            shoulder; applied as yaw, then pitch, then roll, each about the axes after the turns
            before.
    """
    yaw = -np.arctan2(forward[0], forward[2])
    pitch = np.arcsin(np.clip(forward[1], -1.0, 1.0))
    roll = np.arctan2(right[1], up[1])
    return float(yaw), float(pitch), float(roll)
