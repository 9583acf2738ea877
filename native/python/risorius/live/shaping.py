# SPDX-License-Identifier: MIT
"""Converts a sender's values to raw controls: calibration, mapping, ranges, gain, smoothing."""

from __future__ import annotations

import math
import os
from typing import NamedTuple

import numpy as np

from ..base.filters import OneEuro
from ..controls import arkit, vocabulary
from ..controls.shares import share_of
from ..controls.vocabulary import Meaning
from ..importing import Mapping, load_mapping
from ..importing.mapping import row_of
from ..ranges import Ranges, Remap
from .frame import Floats, Frame

HEAD = ("head.yaw", "head.pitch", "head.roll")
_EYES = ("eyeL.yaw", "eyeL.pitch", "eyeR.yaw", "eyeR.pitch")
_IGNORED = {"eyeL.roll", "eyeR.roll"}
_LOOK_AT_ONE = math.radians(30.0)  # radians of an eye's rotation at which a look control is 1
# Cutoff frequency of the filter at speed 0 in Hz, if `smoothing` is just above 0; at `smoothing` 1
# the cutoff is 5 % of this number.
_STILL = 12.0
_LONGEST_GAP = 0.5  # seconds without a frame after which the filter restarts
Row = dict[str, float]
_SENDERS = "vrm"  # vocabulary whose one-letter names are accepted
_ANGLES = {*HEAD, *_EYES, *_IGNORED}


class Controls(NamedTuple):
    """The controls of one frame."""

    names: tuple[str, ...]
    """Raw control names as in a DNA file, and head.yaw, head.pitch, head.roll."""
    values: Floats
    """float32[names]: controls from 0 to `Shaper.maximum`, head angles in radians."""


class Plan:
    """A matrix from a sender's names to controls, compiled once for a tuple of names.

    Attributes:
        controls: names of the resulting controls.
        matrix: float32[controls, names].
        shares: (index of a control such as mouthClose, index of the control such as jawOpen whose
            effect it partly undoes).
        adjusted: (index of a control, its adjustment in the mapping).
        unmapped: names without a control, except those that the mapping ignores.
        is_angle: bool[names], whether a name is an angle.
        head: bool[controls], True for the three angles of the head.
        is_share: bool[controls], whether a control partly undoes another one, like mouthClose.
    """

    def __init__(self, names: tuple[str, ...], mapping: Mapping) -> None:
        rows = _rows(names, mapping)
        found: dict[str, int] = {}
        for row in rows:
            for control in row or ():
                found.setdefault(control, len(found))
        self.controls = tuple(found)
        self.matrix = np.zeros((len(found), len(names)), np.float32)
        for column, row in enumerate(rows):
            for control, weight in (row or {}).items():
                self.matrix[found[control], column] = weight
        self.shares = tuple(
            (found[control], found[whole])
            for control, whole in mapping.shares.items()
            if control in found and whole in found
        )
        changes = ((i, mapping.adjustment(control)) for control, i in found.items())
        self.adjusted = tuple((i, change) for i, change in changes if change is not None)
        self.unmapped = tuple(n for n, row in zip(names, rows, strict=True) if row is None)
        self.is_angle = np.array([name in _ANGLES for name in names], bool)
        self.head = np.array([name in HEAD for name in self.controls], bool)
        self.is_share = np.zeros(len(found), bool)
        self.is_share[[place for place, _ in self.shares]] = True


def _rows(names: tuple[str, ...], mapping: Mapping) -> list[Row | None]:
    """{control: weight} of each name; empty for an ignored name, None for an unknown one.

    Args:
        names: names in a frame.
        mapping: the mapping; names that it lacks may be raw controls, angles, or names of any
            vocabulary.
    """
    find = mapping.finder()
    rows = [found[1] if (found := find(name)) else None for name in names]
    units = sum(bool(row) for row in rows)
    looks = any(name.startswith("eyeLook") for name in names)
    order = (_SENDERS, *vocabulary.leading(names))
    for i, name in enumerate(names):
        if rows[i] is not None:
            continue
        if name in HEAD or name.startswith("CTRL_"):
            rows[i] = {name: 1.0}
        elif name in _ANGLES:
            rows[i] = _look(name, mapping) if name in _EYES and not looks else {}
        elif (said := vocabulary.find(name, order)) is not None:
            repeats = said.vocabulary == _SENDERS and units >= arkit.FULL_SET
            rows[i] = {} if repeats else _row(said, mapping)
    return rows


def _row(said: Meaning, mapping: Mapping) -> Row:
    """{control: weight} for a name of a known vocabulary, such as VRM.

    Args:
        said: the meaning of the name, in ARKit units or in controls.
        mapping: converts ARKit units to controls.
    """
    return _through(dict(said.units), mapping) if said.units else row_of(said)


def _through(row: Row, mapping: Mapping) -> Row:
    """Replaces each ARKit unit of a row by the controls that it moves in the mapping."""
    result: Row = {}
    for unit, weight in row.items():
        for control, share in mapping.rows.get(unit, {}).items():
            result[control] = result.get(control, 0.0) + weight * share
    return result


def _look(name: str, mapping: Mapping) -> Row:
    """{control: weight} for an eye's angle in radians.

    Positive angles move one look unit, such as eyeLookUpLeft, negative ones the opposite unit.

    Args:
        name: name of the angle, such as "eyeL.yaw".
        mapping: converts ARKit units to controls.
    """
    side = "Left" if name[3] == "L" else "Right"
    if name.endswith("pitch"):
        ahead, back = f"eyeLookUp{side}", f"eyeLookDown{side}"
    else:  # positive is the own left: out for the left eye, in for the right eye
        ahead, back = ("eyeLookOut", "eyeLookIn") if side == "Left" else ("eyeLookIn", "eyeLookOut")
        ahead, back = ahead + side, back + side
    weight = 1.0 / _LOOK_AT_ONE
    return _through({ahead: weight}, mapping) | _through({back: -weight}, mapping)


def _new_filter() -> OneEuro:
    return OneEuro(_STILL, beta=4.0, longest_gap=_LONGEST_GAP)


class Shaper:
    """Converts frames to controls. Use one Shaper per subject and thread.

    Args:
        mapping: a risorius.importing.Mapping, the name of a built-in one, or the path of a file.

    Attributes:
        mapping: the Mapping; names that it lacks may be raw controls, head angles, or names of any
            vocabulary.
        gain: factor on all controls, except the head's angles and controls that partly undo another
            control, such as mouthClose; because of this exception shut lips stay shut.
        head_gain: factor on the head's angles; a negative factor reverses them.
        gains: name in the frame -> factor, in addition to `gain`.
        smoothing: strength of the one-euro filter, 0 (none) to 1; it calms a still face and passes
            quick movements.
        maximum: upper limit of control values, except the head's angles.
        neutral: name in the frame -> value in the neutral face, which is subtracted; `capture` sets
            it. Empty: nothing is subtracted.
        ranges: the person's ranges, applied to controls before the gain; None: no remapping. If
            `neutral` is set, only the extremes of the ranges are used.
    """

    def __init__(
        self,
        mapping: str | os.PathLike[str] | Mapping = "arkit",
        *,
        smoothing: float = 0.0,
        gain: float = 1.0,
        head_gain: float = 1.0,
        maximum: float = 1.0,
    ) -> None:
        """Loads the mapping. Raises: risorius.importing.MappingError: it cannot be loaded."""
        self.mapping = load_mapping(mapping)
        self.smoothing = smoothing
        self.gain, self.head_gain, self.maximum = gain, head_gain, maximum
        self.gains: dict[str, float] = {}
        self.neutral: dict[str, float] = {}
        self._ranges: Ranges | None = None
        self._remap: Remap | None = None
        self._plan: Plan | None = None
        self._names: tuple[str, ...] = ()
        self._filter = _new_filter()

    @property
    def ranges(self) -> Ranges | None:
        return self._ranges

    @ranges.setter
    def ranges(self, ranges: Ranges | None) -> None:
        self._ranges, self._remap = ranges, None

    def plan(self, names: tuple[str, ...]) -> Plan:
        """The plan for these names, kept because the next frame usually has the same names."""
        if self._plan is None or names != self._names:
            self._plan, self._names = Plan(names, self.mapping), names
            self._filter, self._remap = _new_filter(), None
        if self._remap is None:
            used = self._ranges.used() if self._ranges is not None else {}
            if self.neutral:
                used = {name: range_.calibrated() for name, range_ in used.items()}
            self._remap = Remap(self._plan.controls, used)
        return self._plan

    def capture(self, frame: Frame | None) -> None:
        """Uses a frame as the neutral face, whose values are subtracted; None: no subtraction."""
        self.neutral, self._remap = {}, None
        if frame is not None:
            self.neutral = dict(zip(frame.names, map(float, frame.values), strict=True))

    @property
    def unmapped(self) -> tuple[str, ...]:
        """Names of the last frame that have no control."""
        return self._plan.unmapped if self._plan else ()

    def without_smoothing(self) -> Shaper:
        """A Shaper with the same settings but without smoothing, for a recording."""
        other = Shaper(self.mapping, gain=self.gain, head_gain=self.head_gain, maximum=self.maximum)
        other.gains, other.neutral = dict(self.gains), dict(self.neutral)
        other.ranges = self.ranges
        return other

    def apply(self, frame: Frame) -> Controls:
        """The controls of a frame. Call it in ascending order of the frames' times."""
        plan = self.plan(frame.names)
        values = plain = self._calibrated(frame, plan.is_angle)
        if self.gains:
            values = values * np.array([self.gains.get(n, 1.0) for n in frame.names], np.float32)
        result = plan.matrix @ values
        # mouthClose undoes a share of jawOpen. The share is computed with the value of jawOpen
        # before `gains`, because a gain of the jaw must not part the lips.
        for place, whole in plan.shares:
            result[place] = share_of(result[place], plan.matrix[whole] @ plain)
        for place, change in plan.adjusted:
            result[place] = change.apply(result[place])
        if self._remap is not None and self._remap.changes:
            result = self._remap(result)
        factors = np.where(plan.head, np.float32(self.head_gain), np.float32(self.gain))
        result *= np.where(plan.is_share, np.float32(1.0), factors)
        if self.smoothing > 0.0:
            self._filter.cutoff = _STILL * 0.05 ** min(self.smoothing, 1.0)
            result = self._filter(frame.time, result).astype(np.float32)
        np.clip(result, 0.0, self.maximum, out=result, where=~plan.head)
        return Controls(plan.controls, result)

    def _calibrated(self, frame: Frame, is_angle: np.ndarray) -> Floats:  # type: ignore[type-arg]
        """float32[names]: values minus the neutral ones; blend shapes are not below 0, and are
        rescaled so that they still reach 1.

        Args:
            frame: the received values.
            is_angle: bool[names], True for angles, which are not rescaled.
        """
        if not self.neutral:
            return frame.values
        rest = np.array([self.neutral.get(n, 0.0) for n in frame.names], np.float32)
        room = np.maximum(1.0 - rest, 0.05)
        units = np.maximum(frame.values - rest, 0.0) / room
        return np.where(is_angle, frame.values - rest, units).astype(np.float32)
