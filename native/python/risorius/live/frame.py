# SPDX-License-Identifier: MIT
"""The common format of live sources: a frame of named values of one subject."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..base.errors import RisoriusError

Floats = npt.NDArray[np.float32]


class LiveError(RisoriusError):
    """Live capture cannot start, or a packet cannot be used; the message is one sentence."""

    code = "live"


class Packet(NamedTuple):
    """The decoded values of a face, with the sender's time."""

    subject: str
    device: str
    """Device of the sender, which distinguishes senders with equal subject names; may be empty."""
    time: float | None
    """Seconds on the sender's clock; None if it sends no time."""
    names: tuple[str, ...]
    values: Floats
    """float32[names]; blend shapes from 0 to 1, angles in radians."""


class Frame(NamedTuple):
    """A packet that was accepted as the next frame of its subject."""

    subject: str
    time: float
    """Seconds on the subject's clock, never decreasing: the sender's time if it sends one, else the
    time of arrival."""
    arrival: float
    """Time of arrival in seconds of perf_counter, which is finer than monotonic on Windows."""
    sequence: int
    """Number of this frame among the subject's frames, from 1."""
    names: tuple[str, ...]
    values: Floats
    """float32[names], values of these names; read-only."""


def unit_name(name: str) -> str:
    """The name of an ARKit unit in Apple's spelling, from any usual spelling.

    `EyeBlinkLeft` and `eyeBlink_L` give `eyeBlinkLeft`. Other names get a lower-case first letter,
    and Left or Right for a final _L or _R.
    """
    if name.endswith(("_L", "_R")):
        name = name[:-2] + ("Left" if name.endswith("_L") else "Right")
    return name[:1].lower() + name[1:]


def turn_angles(forward: Floats, right: Floats, up: Floats) -> tuple[float, float, float]:
    """Yaw, pitch and roll of a head from its axes, given in the axes of an upright head.

    Args:
        forward, right, up: float[3], unit vectors of the rotated head, with components along right,
            up, forward of the upright head.

    Returns:
        Radians: yaw positive to the head's own left, pitch positive up, roll positive towards its
            own left shoulder; applied as yaw, then pitch, then roll, each about the already rotated
            axes.
    """
    yaw = -np.arctan2(forward[0], forward[2])
    pitch = np.arcsin(np.clip(forward[1], -1.0, 1.0))
    roll = np.arctan2(right[1], up[1])
    return float(yaw), float(pitch), float(roll)
