# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits GUI controls to wanted raw controls.

Several settings of the GUI controls may give the same raw controls. The fit minimises squared
differences within the controls' ranges: it sets one GUI control after another to its best value.
Raw controls are piecewise linear functions of a GUI control, and a formula gives the best value in
each linear piece. So no step makes the fit worse.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .board_table import BoardTable, Doubles

_SWEEPS = 40  # most sweeps; controls that share outputs halve their error in each
_ENOUGH = 1e-7  # a sweep that moves no control by more ends the fit
# Limit of differences and of sums of squared differences. A raw control counts as reached if it
# differs from its goal by no more than _RIGHT. A pose is refitted if its sum of squared differences
# exceeds _RIGHT, and a refit counts only if it lowers this sum by more than _RIGHT.
_RIGHT = 1e-9
_REST = 1e-10  # cost per unit of distance from rest: decides between equally good values


@dataclass(frozen=True)
class Loss:
    """The accuracy of a conversion of raw controls to GUI controls and back.

    Attributes:
        largest: largest difference of a converted raw control from its wanted value, in any pose.
        worst: names of raw controls with their largest difference, the largest first; differences
            that are too small to see are left out.
    """

    largest: float = 0.0
    worst: tuple[tuple[str, float], ...] = ()


def fit(table: BoardTable, raw: ArrayLike, start: ArrayLike) -> Doubles:
    """Fit GUI controls, within their ranges, to raw controls by least squares.

    Args:
        table: GUI controls of the face.
        raw: float[N, R], wanted raw controls of N poses.
        start: float[N, G], GUI controls at which the search starts.

    Returns:
        float64[N, G], fitted GUI controls.
    """
    wanted = np.asarray(raw, np.float64)
    gui = np.clip(np.asarray(start, np.float64), table.lowest, table.highest)
    _descend(table, wanted, gui)
    rows = np.flatnonzero(_cost(table, wanted, gui) > _RIGHT) if table.sharing else ()
    if len(rows):
        part = gui[rows]
        for pair in table.sharing:
            _make_room(table, wanted[rows], part, pair)
        _descend(table, wanted[rows], part)
        gui[rows] = part
    return gui


def _descend(table: BoardTable, wanted: Doubles, gui: Doubles) -> None:
    """Set each GUI control in turn to its best value, until none moves or after 40 sweeps.

    Args:
        table: GUI controls of the face.
        wanted: float64[N, R], wanted raw controls of N poses.
        gui: float64[N, G], GUI controls, which are changed in place.
    """
    totals = table.sums(gui)
    movable = [g for g in range(len(table.names)) if table.outputs_of(g)]
    for _sweep in range(_SWEEPS):
        moved = 0.0
        for index in movable:
            outputs = table.outputs_of(index)
            given = np.clip(totals[:, outputs], 0.0, 1.0)
            if np.abs(given - wanted[:, outputs]).max(initial=0.0) <= _RIGHT:
                continue  # during a drag, most raw controls are reached already
            own = table.part(index, gui[:, index])
            others = totals[:, outputs] - own
            best = _best(table, index, wanted[:, outputs], others)
            moved = max(moved, float(np.abs(best - gui[:, index]).max(initial=0.0)))
            gui[:, index] = best
            totals[:, outputs] = others + table.part(index, best)
        if moved < _ENOUGH:
            break


def _make_room(table: BoardTable, wanted: Doubles, gui: Doubles, pair: tuple[int, int]) -> None:
    """Refit two GUI controls that drive the same raw control, if that improves a pose.

    One of them can drive the raw control so far that the other has no effect. So both are set to 0
    and fitted in both orders.

    Args:
        table: GUI controls of the face.
        wanted: float64[N, R], wanted raw controls of N poses.
        gui: float64[N, G], GUI controls, which are changed in the poses that improve.
        pair: indices of the two GUI controls.
    """
    left = _cost(table, wanted, gui)
    for order in (pair, pair[::-1]):
        tried = gui.copy()
        tried[:, order] = 0.0
        for index in order:
            outputs = table.outputs_of(index)
            others = table.sums(tried)[:, outputs] - table.part(index, tried[:, index])
            tried[:, index] = _best(table, index, wanted[:, outputs], others)
        cost = _cost(table, wanted, tried)
        better = cost < left - _RIGHT
        gui[better], left[better] = tried[better], cost[better]


def _cost(table: BoardTable, wanted: Doubles, gui: Doubles) -> Doubles:
    """float64[N]: the sum of squared differences of the raw controls that the table drives."""
    off = (table.raw(gui) - wanted)[:, table.reached]
    return np.asarray((off**2).sum(axis=1), np.float64)


def _best(table: BoardTable, index: int, wanted: Doubles, others: Doubles) -> Doubles:
    """float64[N]: the best value of one GUI control if all other GUI controls stay unchanged.

    Args:
        table: GUI controls of the face.
        index: index of the GUI control.
        wanted: float64[N, n], wanted values of the n raw controls that this GUI control drives.
        others: float64[N, n], contributions of all other GUI controls to these raw controls.
    """
    breaks = table.breaks_of(index)
    tried = [np.full(len(wanted), end) for end in breaks]
    for low, high in pairwise(breaks):
        inner = low + (high - low) * np.array([0.25, 0.75])
        at = table.part(index, inner)
        slope = (at[1] - at[0]) / (inner[1] - inner[0])
        weight = float(slope @ slope)
        if weight > 0.0:
            cut = at[0] - slope * inner[0]
            tried.append(np.clip((wanted - others - cut) @ slope / weight, low, high))
    costs = np.stack(
        [
            ((np.clip(others + table.part(index, v), 0.0, 1.0) - wanted) ** 2).sum(axis=1)
            + _REST * np.abs(v)
            for v in tried
        ]
    )
    return np.stack(tried)[costs.argmin(axis=0), np.arange(len(wanted))]


def loss(
    labels: list[str], wanted: ArrayLike, given: ArrayLike, which: NDArray[np.bool_], seen: float
) -> Loss:
    """Measure how far converted raw controls are from the wanted ones.

    Args:
        labels: names of the raw controls.
        wanted, given: float[N, R], raw controls of N poses before and after the conversion.
        which: bool[R], the controls that were converted.
        seen: smallest visible difference; smaller ones are not listed.
    """
    off = np.abs(np.asarray(wanted, np.float64) - np.asarray(given, np.float64))
    most = np.where(which, off.max(axis=0, initial=0.0), 0.0)
    order = np.argsort(-most, kind="stable")
    worst = tuple((labels[i], float(most[i])) for i in order if most[i] > seen)
    return Loss(float(most.max(initial=0.0)), worst)
