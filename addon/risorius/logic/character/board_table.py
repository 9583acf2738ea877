# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of GUI controls: which raw controls each drives, and its range.

A DNA file with GUI controls contains the table. For other files it is made from the names of raw
controls. Each raw control has a GUI control; two opposites, such as Up and Down, share one. GUI
controls for Up, Down, Left and Right of one name share a handle.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import slider_words

Doubles = NDArray[np.float64]
Whole = NDArray[np.intp]

_BESIDE = ("Left", "Right")
_ABOVE = ("Up", "Down")
_OPPOSITES = (
    _BESIDE, _ABOVE, ("Out", "In"), ("Wide", "Narrow"), ("Fwd", "Back"), ("Thick", "Thin"),
    ("Push", "Pull"), ("Blow", "Suck"), ("Sharpen", "Rounder"), ("Dilate", "Compress"),
    ("Exhale", "Inhale"),
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """A row of a DNA file's conditionals, which convert GUI controls to raw controls.

    Adds slope * value + cut to a raw control if low <= value <= high.

    Attributes:
        gui, raw: indices of the GUI control and of the raw control.
        low, high: range of the GUI control's value.
        slope, cut: coefficients of the line.
    """

    gui: int
    raw: int
    low: float
    high: float
    slope: float
    cut: float


@dataclass(frozen=True)
class BoardTable:
    """The GUI controls of a face.

    Attributes:
        names: names of the GUI controls, such as CTRL_L_eye_blink.ty.
        rows: in the file's order; of several rows with the same GUI control and raw control, the
            first whose range contains the value of the GUI control is used.
        raw_count: R, number of raw controls of the face.
        is_own: True: the table was made from names of raw controls, so `cut` is 0 in all rows.
    """

    names: tuple[str, ...]
    rows: tuple[Row, ...]
    raw_count: int
    is_own: bool = False
    _pieces: dict[int, list[tuple[int, list[Row]]]] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        for gui in range(len(self.names)):
            found: dict[int, list[Row]] = {}
            for row in self.rows:
                if row.gui == gui:
                    found.setdefault(row.raw, []).append(row)
            self._pieces[gui] = list(found.items())

    @cached_property
    def lowest(self) -> Doubles:
        """float64[G]: lowest value of each GUI control, at most 0."""
        out = np.zeros(len(self.names))
        for row in self.rows:
            out[row.gui] = min(out[row.gui], row.low)
        return out

    @cached_property
    def highest(self) -> Doubles:
        """float64[G]: highest value of each GUI control, at least 0."""
        out = np.zeros(len(self.names))
        for row in self.rows:
            out[row.gui] = max(out[row.gui], row.high)
        return out

    @cached_property
    def reached(self) -> NDArray[np.bool_]:
        """bool[R]: True for raw controls that a GUI control drives; others have only sliders."""
        out = np.zeros(self.raw_count, bool)
        out[[row.raw for row in self.rows]] = True
        return out

    @cached_property
    def sharing(self) -> tuple[tuple[int, int], ...]:
        """Pairs of GUI controls whose sets of raw controls overlap but are not equal."""
        led = [set(self.outputs_of(gui)) for gui in range(len(self.names))]
        pairs = combinations(range(len(led)), 2)
        return tuple((a, b) for a, b in pairs if led[a] & led[b] and led[a] != led[b])

    def outputs_of(self, gui: int) -> list[int]:
        """The indices of the raw controls that a GUI control drives.

        Args:
            gui: index of the GUI control.
        """
        return [raw for raw, _rows in self._pieces[gui]]

    def breaks_of(self, gui: int) -> list[float]:
        """Values of a GUI control at which the range of one of its rows begins or ends, and 0.

        Args:
            gui: index of the control.
        """
        ends = {0.0, float(self.lowest[gui]), float(self.highest[gui])}
        for _raw, rows in self._pieces[gui]:
            ends.update(end for row in rows for end in (row.low, row.high))
        return sorted(ends)

    def part(self, gui: int, values: ArrayLike) -> Doubles:
        """The contribution of one GUI control to its raw controls, before clamping to 0..1.

        Args:
            gui: index of the GUI control.
            values: float[N], values of the GUI control.

        Returns:
            float64[N, n], a column for each of the n raw controls in `outputs_of(gui)`.
        """
        v = np.asarray(values, np.float64)
        out = np.zeros((len(v), len(self._pieces[gui])))
        for column, (_raw, rows) in enumerate(self._pieces[gui]):
            free = np.ones(len(v), bool)
            for row in rows:
                holds = free & (row.low <= v) & (v <= row.high)
                out[holds, column] = row.slope * v[holds] + row.cut
                free &= ~holds
        return out

    def raw(self, gui: ArrayLike) -> Doubles:
        """Convert GUI controls to raw controls.

        Args:
            gui: float[N, G], GUI controls of N poses.

        Returns:
            float64[N, R] in 0..1; 0 for raw controls that no GUI control drives.
        """
        return np.clip(self.sums(np.asarray(gui, np.float64)), 0.0, 1.0)

    @cached_property
    def _straight(self) -> tuple[Whole, Whole, Doubles, Doubles, Doubles]:
        """Fields of all rows as five arrays: gui, raw, low, high and slope."""
        rows = self.rows
        numbers = np.array([(row.low, row.high, row.slope) for row in rows], np.float64)
        low, high, slopes = numbers.reshape(-1, 3).T
        inputs = np.array([row.gui for row in rows], np.intp)
        return inputs, np.array([row.raw for row in rows], np.intp), low, high, slopes

    def own_raw(self, gui: NDArray[np.float32]) -> NDArray[np.float32]:
        """Convert the GUI controls of one pose to raw controls; only for a table with `is_own`.

        Args:
            gui: float32[G], GUI controls.

        Returns:
            float32[R] in 0..1.
        """
        inputs, outputs, low, high, slopes = self._straight
        given = np.clip(gui[inputs], low, high) * slopes
        raw = np.bincount(outputs, given, self.raw_count)
        return np.clip(raw, 0.0, 1.0).astype(np.float32)

    def sums(self, gui: Doubles) -> Doubles:
        """Convert GUI controls to raw controls without clamping to 0..1.

        Args:
            gui: float64[N, G], GUI controls of N poses.

        Returns:
            float64[N, R].
        """
        out = np.zeros((len(gui), self.raw_count))
        for index in range(len(self.names)):
            if self._pieces[index]:
                out[:, self.outputs_of(index)] += self.part(index, gui[:, index])
        return out


def of_file(names: Sequence[str], columns: ArrayLike, raw: int) -> BoardTable:
    """Make the table of a file's GUI controls.

    Args:
        names: names of the GUI controls.
        columns: float[6, rows] of the file's conditionals: inputs, outputs, from, to, slopes, cuts.
        raw: number of raw controls.

    Returns:
        BoardTable; rows with numbers that are not finite, an empty range or a bad index are left
        out.
    """
    rows = []
    for numbers in np.asarray(columns, np.float64).T:
        gui, out, low, high, slope, cut = numbers.tolist()
        if np.isfinite(numbers).all() and low <= high and gui < len(names) and out < raw:
            rows.append(Row(int(gui), int(out), low, high, slope, cut))
    return BoardTable(tuple(names), tuple(rows), raw)


def of_raw_controls(labels: Sequence[str], lowest: Sequence[float]) -> BoardTable:
    """Make a table for a file without GUI controls.

    Args:
        labels: names of the raw controls.
        lowest: lowest value of each raw control. A raw control with a lowest value below 0 is a
            component of a rotation and is left out.

    Returns:
        BoardTable of GUI controls with names such as `CTRL_jawOpen.ty`, `CTRL_eyeLookL.tx`.
    """
    short = {label: slider_words.short_name(label) for label in labels}
    index = {short[label]: i for i, label in enumerate(labels) if lowest[i] >= 0.0}
    names: list[str] = []
    rows: list[Row] = []
    done: set[str] = set()
    for name, raw in index.items():
        if name in done:
            continue
        up, down, gui = _pair(name, index)
        done |= {name, up, down}
        names.append(gui if gui not in names else f"CTRL_{name}.ty")
        here = len(names) - 1
        rows.append(Row(here, index.get(up, raw), 0.0, 1.0, 1.0, 0.0))
        if down:
            rows.append(Row(here, index[down], -1.0, 0.0, -1.0, 0.0))
    return BoardTable(tuple(names), tuple(rows), len(labels), is_own=True)


def _pair(name: str, index: dict[str, int]) -> tuple[str, str, str]:
    """Choose the GUI control of a raw control, and the opposite that shares the GUI control.

    Args:
        name: name of a raw control without prefix.
        index: name of each raw control of the face, without prefix -> its index.

    Returns:
        The raw control that the GUI control drives above 0, the raw control that it drives below 0
        ("" for none), and the GUI control.
    """
    for pair in _OPPOSITES:
        for one, other in (pair, pair[::-1]):
            for found in re.finditer(rf"{one}(?=[A-Z_]|$)", name):
                before, after = name[: found.start()], name[found.end() :]
                if before + other + after not in index or not (before or after):
                    continue
                two = pair in (_ABOVE, _BESIDE)
                stem = before + ("" if two else pair[0] + pair[1]) + after
                axis = "tx" if pair == _BESIDE else "ty"
                up, down = before + pair[0] + after, before + pair[1] + after
                return up, down, f"CTRL_{stem}.{axis}"
    return name, "", f"CTRL_{name}.ty"
