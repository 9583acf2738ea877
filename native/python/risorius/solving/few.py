# SPDX-License-Identifier: MIT
"""Implements the method "sparse" of solve_drag: few controls, and more only if necessary."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from .._native import least_change
from .pull import ON, Drag, least_squares, seen_from
from .sparse import cheapest_change, cheapest_to
from .surface import Doubles

_HARD = 0.1  # fraction of the largest ease below which a control belongs elsewhere
# _MISSING: distance by which a sparse drag may miss the target to use fewer controls. _HELP: gain
# in distance that justifies the use of controls of other parts of the face. Both are the smaller of
# a fraction of the distance to the target and a limit in mm.
_MISSING, _MISSING_MM = 0.02, 0.6
_HELP, _HELP_MM = 0.02, 1.3
_DEAR = 100.0  # price of controls that belong elsewhere, so that all others are selected first
# Smallest effect of a selectable control relative to the strongest one; the second number is for
# controls of other parts of the face.
_WEAK, _WEAK_ELSEWHERE = 0.05, 0.1
# mm: if a sparse drag misses the targets by more than this, the solution with all controls is
# computed too. If that one is nearer by more than this, controls are added to the sparse drag.
BEHIND_MM = 1.3
# number of attempts to add controls, chosen by derivatives; if all of them fail, the sparse pose
# is moved towards the solution with all controls
_MORE = 3
_NOTHING_MM = 0.02  # mm: an attempt that brings the points nearer by less is the last one
_WEAKEST = 0.01  # fraction of the strongest control's effect below which a control is not added
_STILL = 1e-4  # a smaller change of all controls ends the iteration
_GONE = 0.01  # price of a control that has already changed
_HALVES = 5  # number of bisections between two poses
_FEW = 2  # superfluous controls are searched for only if more controls than this were selected
_FREED = 4.0  # limits of a selected control during the fit, as a multiple of its selected change


def few_controls(drag: Drag, begin: Doubles, smallest: float, rounds: int) -> Doubles:
    """Selects the controls of the cheapest change that comes near enough to the targets, and fits
    them.

    The price of a control is divided by its ease and multiplied by the root of its effect on the
    points, so that of several controls in one direction a strong one is preferred to weak ones at
    their limits. Controls are selected once, by the derivatives at the beginning, so that the
    selection depends continuously on the targets; only controls that prove superfluous are then
    dropped.

    Args:
        drag: equations of the drag.
        begin: float64[R], the pose at the beginning.
        smallest: price of a change, relative to the effect of the strongest control.
        rounds: largest number of linearisations.
    """
    price, elsewhere = prices(drag)
    units = drag.unknowns.alike()
    drag = replace(drag, unknowns=units)
    jacobian, missing = seen_from(drag, begin, begin)
    way, unit = float(np.linalg.norm(missing)), float(np.linalg.norm(drag.roots)) / drag.mm
    low, high = units.limits(drag.low - begin, drag.high - begin)
    far = np.linalg.norm(jacobian, axis=0)
    reach = far * np.maximum(high, -low)
    least = np.where(elsewhere, _WEAK_ELSEWHERE, _WEAK) * reach.max(initial=0.0)
    some = np.flatnonzero(reach > least)
    price *= np.sqrt(far)
    x = np.zeros(len(far))
    x[some] = cheapest_change(
        jacobian[:, some], missing, low[some], high[some], price[some], elsewhere[some],
        min(_MISSING * way, _MISSING_MM * unit), min(_HELP * way, _HELP_MM * unit),
    )  # fmt: skip
    at = _fitted(drag, begin, x, smallest, rounds)
    enough = min(_MISSING * way, _MISSING_MM * unit)
    order = np.lexsort((np.abs(x) * far, ~elsewhere))
    is_there = drag.far(at) <= BEHIND_MM and np.count_nonzero(x) > _FEW
    for one in order[x[order] != 0] if is_there else ():
        fewer = np.where(np.arange(len(x)) == one, 0.0, x)
        there = _fitted(drag, begin, fewer, smallest, rounds)
        if drag.left(there) <= max(enough**2, drag.left(at)):
            at, x = there, fewer
    return at


def _fitted(drag: Drag, begin: Doubles, x: Doubles, smallest: float, rounds: int) -> Doubles:
    """The best pose near `begin` + the change `x`, among poses that change the same controls as x.

    `x` is float64[U], values of the unknowns. The function uses full Gauss-Newton steps, whose
    result is continuous in the targets. If the result is far from the targets, halved steps are
    tried, too, and the nearer result is used.

    Args:
        drag: equations of the drag.
        begin: float64[R], the pose at the beginning.
        x: float64[U], values of the unknowns; unknowns with the value 0 stay 0.
        smallest: price of a change, relative to the effect of the strongest control.
        rounds: largest number of linearisations.
    """
    units, change = drag.unknowns, drag.unknowns.change(x, len(begin))
    drag = drag.held([*map(int, np.flatnonzero(change == 0))], begin)
    least, most = units.limits(drag.low - begin, drag.high - begin)
    low, high = np.clip(_FREED * x, least, 0.0), np.clip(_FREED * x, 0.0, most)
    at, ridge = begin + change, -1.0
    for _ in range(max(1, rounds - 1)):
        jacobian, missing = seen_from(drag, begin, at)
        if ridge < 0:
            strongest = float((jacobian**2).sum(axis=0).max(initial=0.0))
            ridge = max(smallest**2 * strongest, 1e-20)
        was, x = x, least_change(jacobian, missing, low, high, ridge)
        at = begin + units.change(x, len(begin))
        if float(np.abs(x - was).max(initial=0.0)) < _STILL:
            break
    if drag.far(at) <= BEHIND_MM:
        return at
    drag = replace(
        drag,
        low=np.maximum(drag.low, begin + np.minimum(_FREED * change, 0.0)),
        high=np.minimum(drag.high, begin + np.maximum(_FREED * change, 0.0)),
    )
    return min(at, least_squares(drag, begin, begin + change, smallest, rounds), key=drag.far)


def prices(drag: Drag) -> tuple[Doubles, npt.NDArray[np.bool_]]:
    """float64[U], bool[U]: the price of each unknown, and whether the unknown belongs to another
    part of the face than the points.

    The price is the largest ease divided by the ease of the unknown, but _DEAR (100) for an unknown
    of another part.

    Args:
        drag: equations of the drag.
    """
    eases = drag.unknowns.ease
    elsewhere = eases < _HARD * eases.max()
    return np.where(elsewhere, _DEAR, eases.max() / eases), elsewhere


def nearer(
    drag: Drag,
    price: Doubles,
    begin: Doubles,
    few: Doubles,
    every: Doubles,
    pairs: npt.NDArray[np.int64],
) -> Doubles:
    """float64[R]: a pose with more controls than `few`: the points are at most BEHIND_MM (1.3 mm)
    farther from the targets than with all controls.

    If `few` is near enough, it is returned unchanged.

    Args:
        drag: equations of the drag, with unknowns of equal ease.
        price: float64[U], price of each unknown.
        begin: float64[R], the pose at the beginning.
        few: float64[R], the pose with few controls.
        every: float64[R], the pose with all controls.
        pairs: int64[N, 2], pairs of opposites.
    """
    aim = drag.far(every) + BEHIND_MM
    if drag.far(few) <= aim:
        return few
    drag, at = _agreeing(drag, begin, few, every, pairs)
    for _ in range(_MORE):
        there = _with_more(drag, price, begin, at, aim)
        if drag.far(there) > drag.far(at) - _NOTHING_MM:
            break
        at = there
        if drag.far(at) <= aim:
            return at
    return _towards(drag, at, _without_weak(drag, begin, every, aim), aim)


def _agreeing(
    drag: Drag, begin: Doubles, few: Doubles, every: Doubles, pairs: npt.NDArray[np.int64]
) -> tuple[Drag, Doubles]:
    """For each control that is positive in the pose `every` and larger than in `begin`, fixes its
    opposite.

    Returns: the drag with these controls fixed, and the pose `few` in which each fixed control has
        the smaller of its values in `few` and `every`.

    Args:
        drag: equations of the drag.
        begin: float64[R], the pose at the beginning.
        few: float64[R], the pose with few controls.
        every: float64[R], the pose with all controls.
        pairs: int64[N, 2], indices of opposite controls.
    """
    on = every[pairs] > np.maximum(begin[pairs], 0.0) + ON
    off = [
        int(pair[1 - side])
        for pair, both in zip(pairs, on, strict=True)
        for side in (0, 1)
        if both[side]
    ]
    at = few.copy()
    at[off] = np.minimum(few, every)[off]
    return drag.held(off, at), at


def _with_more(drag: Drag, price: Doubles, begin: Doubles, at: Doubles, aim: float) -> Doubles:
    """A pose with additional controls: by linear equations, the full change brings the points to at
    most `aim` mm from the targets, or as near as possible.

    Of the full, half and quarter change the one that brings the points nearest is returned.
    Controls that have already changed have a price near 0.

    Args:
        drag: equations of the drag.
        price: float64[U], price of each unknown that has not changed yet.
        begin: float64[R], the pose at the beginning.
        at: float64[R], the pose to which controls are added.
        aim: wanted distance from the targets in mm.
    """
    units, count = drag.unknowns, len(begin)
    jacobian, missing = units.columns(drag.jacobian(at)), drag.residual(drag.positions(at))
    low, high = units.limits(drag.low - at, drag.high - at)
    far = np.linalg.norm(jacobian, axis=0)
    reach = far * np.maximum(high, -low)
    some = np.flatnonzero(reach > _WEAKEST * reach.max(initial=0.0))
    moved = np.abs(units.values(at - begin)) > ON
    price = np.where(moved, _GONE, price) * np.sqrt(far)
    x = np.zeros(len(far))
    x[some] = cheapest_to(
        jacobian[:, some], missing, low[some], high[some], price[some],
        aim * float(np.linalg.norm(drag.roots)) / drag.mm,
    )  # fmt: skip
    step = units.change(x, count)
    poses = [at + share * step for share in (1.0, 0.5, 0.25)]
    return min(poses, key=drag.far)


def _without_weak(drag: Drag, begin: Doubles, every: Doubles, aim: float) -> Doubles:
    """The pose `every` with its weakest controls returned to `begin`.

    The number of these controls is the largest with which the points are at most
    `aim` - BEHIND_MM / 2 mm from the targets.

    Args:
        drag: equations of the drag.
        begin: float64[R], the pose at the beginning.
        every: float64[R], the pose with all controls.
        aim: wanted distance from the targets in mm.
    """
    units = drag.unknowns
    change = units.values(every - begin)
    order = np.argsort(np.abs(change) * np.linalg.norm(units.columns(drag.jacobian(every)), axis=0))

    def without(number: int) -> Doubles:
        kept = change.copy()
        kept[order[:number]] = 0.0
        return begin + units.change(kept, len(begin))

    none, all_of = 0, len(order)
    while all_of - none > 1:
        half = (none + all_of) // 2
        enough = drag.far(without(half)) <= aim - BEHIND_MM / 2
        none, all_of = (half, all_of) if enough else (none, half)
    return without(none)


def _towards(drag: Drag, at: Doubles, other: Doubles, aim: float) -> Doubles:
    """The first pose from `at` towards `other` that is at most `aim` mm from the targets, by
    bisection.

    Args:
        drag: equations of the drag.
        at: float64[R], the pose where the way begins.
        other: float64[R], the pose where the way ends; it is returned if no pose before it is near
            enough.
        aim: wanted distance from the targets in mm.
    """
    if drag.far(at) <= aim:
        return at
    none, whole = 0.0, 1.0
    for _ in range(_HALVES):
        half = (none + whole) / 2
        none, whole = (none, half) if drag.far(at + half * (other - at)) <= aim else (half, whole)
    return at + whole * (other - at)
