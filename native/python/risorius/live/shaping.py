# SPDX-License-Identifier: MIT
"""From what a sender says to raw controls: calibration, gain, mapping, smoothing."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import NamedTuple

import numpy as np

from .. import arkit
from .frame import Floats, Frame

HEAD = ("head.yaw", "head.pitch", "head.roll")
_EYES = ("eyeL.yaw", "eyeL.pitch", "eyeR.yaw", "eyeR.pitch")
_IGNORED = {"eyeL.roll", "eyeR.roll"}
_LOOK_AT_ONE = math.radians(30.0)  # an eye's turn that a look control at 1 stands for
_FULL_SET = 10  # ARKit units from which on the expressions of VRM are taken to repeat them
_ANGLES = {*HEAD, *_EYES, *_IGNORED}


class Controls(NamedTuple):
    """A frame for a rig."""

    names: tuple[str, ...]
    """Raw controls as a DNA spells them, and head.yaw, head.pitch, head.roll."""
    values: Floats
    """float32[names]: controls 0 to 1, the head in radians."""


@cache
def expressions() -> dict[str, dict[str, float]]:
    """VRM expression, in lower case -> {ARKit unit: weight}; of VRM 0 and 1."""
    text = resources.files(__package__).joinpath("vrm.toml").read_text(encoding="utf-8")
    table = tomllib.loads(text)
    found = {name: dict(row) for name, row in table["expressions"].items()}
    return found | {name: found[same] for name, same in table["same"].items()}


class Plan:
    """The way from names that a sender uses to controls, compiled once for a set of names.

    Attributes:
        controls: the controls that the names reach.
        matrix: float32[controls, names].
        unmapped: names that reach none.
        is_angle: bool[names].
        head: bool[controls], the three angles of the head.
    """

    def __init__(self, names: tuple[str, ...], table: Mapping[str, Mapping[str, float]]) -> None:
        rows = _rows(names, table)
        found: dict[str, int] = {}
        for row in rows:
            for control in row:
                found.setdefault(control, len(found))
        self.controls = tuple(found)
        self.matrix = np.zeros((len(found), len(names)), np.float32)
        for column, row in enumerate(rows):
            for control, weight in row.items():
                self.matrix[found[control], column] = weight
        empty = {n for n, row in zip(names, rows, strict=True) if not row}
        self.unmapped = tuple(sorted(empty - _ANGLES - {"neutral"}))
        self.is_angle = np.array([name in _ANGLES for name in names], bool)
        self.head = np.array([name in HEAD for name in self.controls], bool)


def _rows(
    names: tuple[str, ...], table: Mapping[str, Mapping[str, float]]
) -> list[Mapping[str, float]]:
    units = sum(name in table for name in names)
    looks = any(name.startswith("eyeLook") for name in names)
    rows: list[Mapping[str, float]] = []
    for name in names:
        if name in HEAD or name.startswith("CTRL_"):
            rows.append({name: 1.0})
        elif name in table:
            rows.append(table[name])
        elif name.lower() in expressions() and units < _FULL_SET:
            rows.append(_through(expressions()[name.lower()], table))
        elif name in _EYES and not looks:
            rows.append(_look(name, table))
        else:
            rows.append({})
    return rows


def _through(
    row: Mapping[str, float], table: Mapping[str, Mapping[str, float]]
) -> dict[str, float]:
    """A row in units as a row in controls."""
    result: dict[str, float] = {}
    for unit, weight in row.items():
        for control, share in table.get(unit, {}).items():
            result[control] = result.get(control, 0.0) + weight * share
    return result


def _look(name: str, table: Mapping[str, Mapping[str, float]]) -> dict[str, float]:
    """An eye's angle as look controls: one side with its sign, the other against it."""
    side = "Left" if name[3] == "L" else "Right"
    if name.endswith("pitch"):
        ahead, back = f"eyeLookUp{side}", f"eyeLookDown{side}"
    else:  # to the own left: out for the left eye, in for the right
        ahead, back = ("eyeLookOut", "eyeLookIn") if side == "Left" else ("eyeLookIn", "eyeLookOut")
        ahead, back = ahead + side, back + side
    weight = 1.0 / _LOOK_AT_ONE
    return _through({ahead: weight}, table) | _through({back: -weight}, table)


class Shaper:
    """Turns frames into controls. Not for several threads, nor for several subjects, at once.

    Attributes:
        gain: factor on all units; head_gain: on the head's angles, negative to turn them round.
        gains: factor for single units, by their name as the frame has it, beside `gain`.
        smoothing: 0 for none, to 1: a one-euro filter, which holds a still face still and lets a
            quick move pass.
        maximum: controls are clamped to it.
        neutral: the values that count as a face at rest, by name; see `capture`.
    """

    def __init__(
        self,
        table: Mapping[str, Mapping[str, float]] | None = None,
        *,
        smoothing: float = 0.0,
        gain: float = 1.0,
        head_gain: float = 1.0,
        maximum: float = 1.0,
    ) -> None:
        self._table = arkit.mapping() if table is None else table
        self.smoothing = smoothing
        self.gain, self.head_gain, self.maximum = gain, head_gain, maximum
        self.gains: dict[str, float] = {}
        self.neutral: dict[str, float] = {}
        self._plan: Plan | None = None
        self._names: tuple[str, ...] = ()
        self._filter = OneEuro()

    def plan(self, names: tuple[str, ...]) -> Plan:
        """The way of these names; kept for the next frame, which mostly has the same."""
        if self._plan is None or names != self._names:
            self._plan, self._names = Plan(names, self._table), names
            self._filter = OneEuro()
        return self._plan

    def capture(self, frame: Frame | None) -> None:
        """Take a frame as the face at rest; None forgets it."""
        self.neutral = {}
        if frame is not None:
            self.neutral = dict(zip(frame.names, map(float, frame.values), strict=True))

    def without_smoothing(self) -> Shaper:
        """One of the same settings for a recording."""
        other = Shaper(self._table, gain=self.gain, head_gain=self.head_gain, maximum=self.maximum)
        other.gains, other.neutral = dict(self.gains), dict(self.neutral)
        return other

    def apply(self, frame: Frame) -> Controls:
        """The controls of a frame. Frames are to come in the order of their times."""
        plan = self.plan(frame.names)
        values = self._calibrated(frame, plan.is_angle)
        if self.gains:
            values = values * np.array([self.gains.get(n, 1.0) for n in frame.names], np.float32)
        result = plan.matrix @ values
        result *= np.where(plan.head, np.float32(self.head_gain), np.float32(self.gain))
        if self.smoothing > 0.0:
            result = self._filter.step(result, frame.time, self.smoothing)
        np.clip(result, 0.0, self.maximum, out=result, where=~plan.head)
        return Controls(plan.controls, result)

    def _calibrated(self, frame: Frame, is_angle: np.ndarray) -> Floats:  # type: ignore[type-arg]
        """Values with the face at rest taken away; what is left of a unit still reaches 1."""
        if not self.neutral:
            return frame.values
        rest = np.array([self.neutral.get(n, 0.0) for n in frame.names], np.float32)
        room = np.maximum(1.0 - rest, 0.05)
        units = np.maximum(frame.values - rest, 0.0) / room
        return np.where(is_angle, frame.values - rest, units).astype(np.float32)


class OneEuro:
    """The one-euro filter (Casiez, Roussel, Vogel 2012) for many values at once."""

    def __init__(self) -> None:
        self._time = 0.0
        self._value: Floats | None = None
        self._speed: Floats | None = None

    def step(self, values: Floats, time: float, amount: float) -> Floats:
        """The filtered values.

        Args:
            values: float32[n].
            time: seconds; a step back, or of more than half a second, begins anew.
            amount: above 0, to 1: a still value is cut at 12 Hz down to 0.6 Hz.
        """
        step = time - self._time
        if self._value is None or self._speed is None or not 0.0 <= step < 0.5:
            self._time, self._value, self._speed = time, values.copy(), np.zeros_like(values)
            return values.copy()
        if step == 0.0:
            return self._value.copy()
        lowest = 12.0 * 0.05 ** min(amount, 1.0)
        speed = (values - self._value) / np.float32(step)
        self._speed = self._speed + _share(1.0, step) * (speed - self._speed)
        cutoff = lowest + 4.0 * np.abs(self._speed)
        self._value = self._value + _share(cutoff, step) * (values - self._value)
        self._time = time
        return self._value.copy()


def _share(cutoff: float | Floats, step: float) -> Floats:
    """How much of a change passes in a step, of a low pass at `cutoff` Hz."""
    return np.asarray(1.0 - 1.0 / (1.0 + 2.0 * math.pi * cutoff * step), np.float32)
