# SPDX-License-Identifier: MIT
"""Finds the controls that move points of the skin to target positions.

The method "least_squares" finds the smallest change of the sliders by least squares, as in J. P.
Lewis and Ken Anjyo, "Direct Manipulation Blendshapes", IEEE Computer Graphics and Applications 30
(4), 2010. The method "transpose" uses the transpose of the Jacobian in place of its inverse, as in
Ozan Cetinaslan, "Position Manipulation Techniques for Facial Animation", PhD thesis, Porto 2016,
and later papers.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple, Unpack

import numpy as np
import numpy.typing as npt

from ..base.errors import ArgumentError
from ..base.given import MOST, checked, finite
from ..base.given import whole as whole_number
from .controls import (
    ControlLimits,
    ControlSharing,
    DragFields,
    LimitFields,
    check_keywords,
    structure,
)
from .few import BEHIND_MM, few_controls, nearer, prices
from .pull import ON, Drag, least_squares, make_drag
from .surface import Doubles, Floats, Surface, numbers, vector, wholes

METHODS = ("least_squares", "transpose", "sparse")
LOCAL = 0.12
"""A control belongs elsewhere if the ratio of its effect at the dragged points to its largest
effect anywhere is below LOCAL times the largest such ratio of any control. Gaze belongs to the
eyes, although lids and brows follow it."""
ELSEWHERE = 0.001
"""Ease of controls that belong elsewhere."""


class Solved(NamedTuple):
    """The pose that a drag leads to, and its error."""

    raw: Floats
    """float32[R], values of the raw controls."""
    positions: Floats
    """float32[P, 3]: positions of the points at this pose, in the file's unit."""
    error: float
    """Weighted root mean square of the remaining distances along the axes, in the file's unit."""
    change: float
    """Euclidean length of the change of the controls."""


def solve_drag(
    surface: Surface,
    raw: npt.ArrayLike,
    points: Sequence[tuple[int, int]],
    targets: npt.ArrayLike,
    *,
    axes: npt.ArrayLike | None = None,
    weights: npt.ArrayLike | None = None,
    limits: ControlLimits | None = None,
    sharing: ControlSharing | None = None,
    method: str = "least_squares",
    smallest: float = 1e-3,
    rounds: int = 4,
    **keywords: Unpack[DragFields],
) -> Solved:
    """Finds the smallest change of the controls that moves points to targets.

    Args:
        surface: surface of the face.
        raw: float[R], raw controls at the beginning of the drag.
        points: (mesh, vertex) of each dragged or pinned point; pinned points have their present
            position as target.
        targets: float[P, 3], target positions in the file's unit.
        axes: float[P, k, 3]: unit vectors along which the distance of each point counts, such as
            the two axes of a screen, which leave the depth free; None: all three axes.
        weights: float[P], importance of each point; None: 1.
        limits: the controls that may change, and their ranges; None: all, from 0 to 1.
        sharing: ease (how readily each control changes), partners and opposites of the controls;
            None: all controls have the same ease, and none has a partner or an opposite.
        method: "least_squares"; "transpose", which changes controls in proportion to their effect
            on the points and moves less elsewhere; or "sparse", which changes few controls, about
            one per direction that counts. "sparse" may miss the target by up to 0.6 mm, and uses
            controls that belong elsewhere (an ease below a tenth of the largest) only if they bring
            the points clearly nearer. If few controls do not reach the targets, more are added
            until the points are less than 1.3 mm farther from the targets than with "least_squares"
            if all controls had the same ease.
        smallest: price of a change, relative to the effect of the strongest control; a larger value
            misses the target by more.
        rounds: largest number of linearisations of one solution by least squares; "transpose" uses
            up to three times this number.
        keywords: fields of ControlLimits and ControlSharing, if these arguments are None.

    Raises:
        ValueError: an invalid argument; the message names it.
    """
    check_keywords("solve_drag", keywords, ControlLimits, ControlSharing)
    limits = structure("limits", limits, ControlLimits, keywords)
    sharing = structure("sharing", sharing, ControlSharing, keywords)
    begin = vector("raw", raw, len(surface.rig.raw_control_names))
    if method not in METHODS:
        raise ArgumentError(f"method: {' or '.join(METHODS)} was expected, found {method!r}")
    checked("smallest", finite, smallest, 1e-12, 1e12)
    checked("rounds", whole_number, rounds, 0, 1000)
    drag = make_drag(surface, begin, points, targets, axes, weights, limits, sharing)
    pairs = _pairs(sharing.opposites, len(begin))
    at = _solved(drag, begin, pairs, method, smallest, rounds)
    positions = drag.positions(at)
    error = drag.error(drag.residual(positions))
    change = float(np.linalg.norm(at - begin))
    return Solved(at.astype(np.float32), positions.astype(np.float32), error, change)


def _solved(
    drag: Drag,
    begin: Doubles,
    pairs: npt.NDArray[np.int64],
    method: str,
    smallest: float,
    rounds: int,
) -> Doubles:
    """float64[R]: the pose found by a method, in which at most one control of each opposite pair
    increases.

    Args:
        drag: equations of the drag.
        begin: float64[R], the pose at the beginning.
        pairs: int64[N, 2], indices of opposite controls.
        method: one of METHODS.
        smallest: price of a change, relative to the effect of the strongest control.
        rounds: largest number of linearisations.
    """

    def exactly(drag: Drag, start: Doubles) -> Doubles:
        return least_squares(drag, begin, start, smallest, rounds)

    def transposed(drag: Drag, _: Doubles) -> Doubles:
        return _transposed(drag, begin, rounds)

    def few(drag: Drag, _: Doubles) -> Doubles:
        return few_controls(drag, begin, smallest, rounds)

    solve = {"least_squares": exactly, "transpose": transposed, "sparse": few}[method]
    at = _kept_apart(drag, begin, pairs, solve)
    if method == "sparse" and drag.far(at) > BEHIND_MM:
        alike = replace(drag, unknowns=drag.unknowns.alike())
        every = _kept_apart(alike, begin, pairs, exactly)
        at = nearer(alike, prices(drag)[0], begin, at, every, pairs)
    return at


def _pairs(opposites: Sequence[tuple[int, int]], count: int) -> npt.NDArray[np.int64]:
    """int64[N, 2]: the pairs of opposite controls (their indices), after a check."""
    found = wholes("opposites", opposites)
    pairs = found if found.size else np.empty((0, 2), np.int64)
    if pairs.shape[1:] != (2,) or not ((pairs >= 0) & (pairs < count)).all():
        raise ArgumentError(f"opposites: pairs of whole numbers below {count} were expected")
    return pairs


def _kept_apart(
    drag: Drag,
    begin: Doubles,
    opposites: npt.NDArray[np.int64],
    solve: Callable[[Drag, Doubles], Doubles],
) -> Doubles:
    """float64[R]: the pose from `solve`; if both controls of an opposite pair would increase, the
    weaker one keeps its value.

    An opposite that was on at the beginning returns to 0 before the other one starts. Opposites
    that are also partners keep their values.

    Args:
        drag: equations of the drag.
        begin: float64[R], the pose at the beginning.
        opposites: int64[N, 2], indices of opposite controls.
        solve: finds a pose from the equations and a start pose.
    """
    partner = np.arange(len(begin))
    partner[drag.unknowns.first] = drag.unknowns.second
    partner[drag.unknowns.second] = drag.unknowns.first
    tied = opposites[partner[opposites[:, 0]] == opposites[:, 1]]
    drag = drag.held([*tied.ravel()], begin)
    at = solve(drag, begin)
    lesser, more = _both_on(opposites, at, begin)
    if not len(lesser):
        return at
    at = solve(drag.held([*lesser], begin), at)
    spent = [i for i in range(len(lesser)) if begin[more[i]] > at[more[i]] <= ON]
    if spent:
        gone = np.minimum(begin, at)
        drag = drag.held([*(more[i] for i in spent)], gone)
        at = solve(drag.held([c for i, c in enumerate(lesser) if i not in spent], begin), gone)
    return at


def _both_on(
    opposites: npt.NDArray[np.int64], at: Doubles, begin: Doubles
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """(weaker, stronger) controls of each opposite pair whose smaller value increased from `begin`.

    The weaker control has the smaller value in `begin`, or in `at` if both are equal in `begin`.

    Args:
        opposites: int64[N, 2], indices of opposite controls.
        at: float64[R], a solved pose.
        begin: float64[R], the pose at the beginning.
    """
    before = np.maximum(begin[opposites].min(axis=1), 0.0)
    pairs = opposites[at[opposites].min(axis=1) > before + ON]
    was, now = begin[pairs], at[pairs]
    first = (was[:, 0] < was[:, 1]) | ((was[:, 0] == was[:, 1]) & (now[:, 0] < now[:, 1]))
    return np.where(first, pairs[:, 0], pairs[:, 1]), np.where(first, pairs[:, 1], pairs[:, 0])


def _transposed(drag: Drag, at: Doubles, rounds: int) -> Doubles:
    """Gradient descent within the limits; each step's length minimises the linearised error.

    Args:
        drag: equations of the drag.
        at: float64[R], the pose where the descent starts.
        rounds: a third of the largest number of steps.
    """
    for _ in range(max(1, 3 * rounds)):
        jacobian, missing = drag.jacobian(at), drag.residual(drag.positions(at))
        toward = drag.unknowns.columns(jacobian).T @ missing
        toward = drag.unknowns.change(toward, len(at))
        toward[((at <= drag.low) & (toward < 0)) | ((at >= drag.high) & (toward > 0))] = 0
        reach = jacobian @ toward
        if not reach @ reach > 0:
            break
        size = float(reach @ missing / (reach @ reach))
        at = np.clip(at + size * toward, drag.low, drag.high)
    return at


def local_ease(surface: Surface, reach: npt.ArrayLike) -> Doubles:
    """float64[R]: the ease of each control at dragged points, for solve_drag.

    Controls of other parts of the face, whose effect at the points is small compared with their
    effect elsewhere, get the ease ELSEWHERE (0.001), so that a dragged brow does not turn the eyes,
    although turning the eyes moves the brow. The ease of the other controls is the root of the
    ratio of their effect at the points to their mean effect on the whole face, divided by the
    largest such root, so that the largest ease is 1. The brow therefore lowers before the whole
    face contracts, which would lower it too.

    Args:
        surface: surface of the face.
        reach: float[P, 3, R], displacement of the points per unit of each control, from
            surface.jacobian.
    """
    here = np.linalg.norm(numbers("reach", reach), axis=1).max(axis=0, initial=0.0)
    share = here / np.maximum(np.maximum(surface.strongest(), here), 1e-30)
    local = share >= LOCAL * share.max(initial=0.0)
    alone = here / np.maximum(surface.spread(), 1e-30)
    # solve_drag squares the cost of a change, so the change grows with the square of the ease.
    # The root makes the change proportional to the ratio `alone`.
    readiness = np.sqrt(alone / np.maximum(alone[local].max(initial=0.0), 1e-30))
    return np.where(local, np.maximum(readiness, ELSEWHERE), ELSEWHERE)


def best_controls(
    surface: Surface,
    raw: npt.ArrayLike,
    point: tuple[int, int],
    target: npt.ArrayLike,
    *,
    axes: npt.ArrayLike | None = None,
    limits: ControlLimits | None = None,
    count: int = 8,
    **keywords: Unpack[LimitFields],
) -> list[tuple[int, float, float]]:
    """The controls that alone bring a point nearest to a target, best first.

    Args:
        surface: surface of the face.
        raw: float[R], raw controls at the beginning of the drag.
        point: (mesh, vertex) of the point.
        target: float[3], target position in the file's unit.
        axes: float[k, 3]: unit vectors along which the distance counts; None: all three axes.
        limits: the controls that may change, and their ranges; None: all, from 0 to 1.
        count: largest number of results.
        keywords: fields of ControlLimits, if `limits` is None.

    Returns:
        (control, its value, remaining distance of the point along the axes in the file's unit) of
        each; controls that bring no improvement are left out.

    Raises:
        ValueError: an invalid argument; the message names it.
    """
    check_keywords("best_controls", keywords, ControlLimits)
    limits = structure("limits", limits, ControlLimits, keywords)
    at = vector("raw", raw, len(surface.rig.raw_control_names))
    checked("count", whole_number, count, 0, MOST)
    along = None if axes is None else numbers("axes", axes)[None]
    goal = numbers("target", target)[None]
    drag = make_drag(surface, at, [point], goal, along, None, limits, ControlSharing())
    jacobian, missing = drag.jacobian(at), drag.residual(drag.positions(at))
    square = (jacobian**2).sum(axis=0)
    toward = np.clip(at + jacobian.T @ missing / np.maximum(square, 1e-30), drag.low, drag.high)
    left = np.linalg.norm(missing[:, None] - jacobian * (toward - at), axis=0)
    order = np.argsort(left, kind="stable")[: 2 * count]
    found = [_alone(drag, at, int(control)) for control in order if toward[control] != at[control]]
    before = float(np.linalg.norm(missing)) * (1 - 1e-6)
    return sorted((f for f in found if f[2] < before), key=lambda f: f[2])[:count]


def _alone(drag: Drag, begin: Doubles, control: int) -> tuple[int, float, float]:
    """The control, its best value, and the remaining distance; solved by secants, because the face
    is not linear.

    Args:
        drag: equations of the drag.
        begin: float64[R], the pose of all other controls.
        control: index of the control.
    """
    low, high = float(drag.low[control]), float(drag.high[control])
    places = np.linspace(low, high, 5)
    at = begin.copy()

    def missing(value: float) -> Doubles:
        at[control] = value
        return drag.residual(drag.positions(at))

    first = min(places, key=lambda value: float(np.linalg.norm(missing(float(value)))))
    value = float(first)
    for _ in range(3):
        here, step = missing(value), 1 / 256 if value + 1 / 256 <= high else -1 / 256
        slope = (missing(value + step) - here) / step
        if not slope @ slope > 0:
            break
        value = float(np.clip(value - slope @ here / (slope @ slope), low, high))
    value = min(value, float(first), key=lambda v: float(np.linalg.norm(missing(v))))
    return control, value, float(np.linalg.norm(missing(value)))
