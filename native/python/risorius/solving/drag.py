# SPDX-License-Identifier: MIT
"""The controls that bring points of the skin where they are wanted.

J. P. Lewis and Ken Anjyo, "Direct Manipulation Blendshapes", IEEE Computer Graphics and
Applications 30 (4), 2010: the smallest change of the sliders, by least squares. Ozan Cetinaslan,
"Position Manipulation Techniques for Facial Animation", PhD thesis, Porto 2016, and later papers:
the transpose of the Jacobian in the place of its inverse.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .._native import Probe, least_change
from ..base.errors import ArgumentError
from ..base.given import MOST, checked, finite
from ..base.given import whole as whole_number
from .sparse import cheapest_change
from .surface import Doubles, Floats, Surface, limits, numbers, vector, wholes

METHODS = ("least_squares", "transpose", "sparse")
LOCAL = 0.12
"""A control that does less here, of what it does where it does most, than this share of what the
most local one does, belongs elsewhere: gaze to the eyes, though lids and brows follow it."""
ELSEWHERE = 0.001
"""The ease of a control that belongs elsewhere."""
ALIKE, AS_FAR = 0.99, 0.8
"""Two controls do the same to points if their motions have this cosine and this quotient."""
_HARD = 0.1  # of the largest ease: controls of less are looked at where others do not reach
_ON = 1e-6
# Of the whole way: what two that do the same may miss for the sake of one, and what controls that
# belong elsewhere have to bring points nearer that stay out of reach.
_WORTH = 0.02
_GAIN = 1e-5  # of the square of the whole way: what gains less is not worth another look
# Of a sparse drag: what of the way, and how many mm, may be missing for the sake of fewer controls,
# and how much nearer those that belong elsewhere have to bring the points together.
_MISSING, _MISSING_MM = 0.02, 0.6
_HELP, _HELP_MM = 0.02, 1.3
_DEAR = 100.0  # what those elsewhere cost: they come after all others
# What a control has to do, of what the strongest could, to take part, and one of those elsewhere.
_WEAK, _WEAK_ELSEWHERE = 0.05, 0.1
_STILL = 1e-4  # of a control: a look that changes less is the last
_FREED = 4.0  # a control that was found has so much more room when all of them are fitted


class Solved(NamedTuple):
    """What a drag made of the controls."""

    raw: Floats
    """float32[R]"""
    positions: Floats
    """float32[P, 3]: where the points are with it, in the file's units."""
    error: float
    """Root of the mean square of how far the points are from their targets along their axes, each
    by its weight; file units."""
    change: float
    """The length of the change of the controls."""


@dataclass
class _Drag:
    """A drag, looked through: m rows are wanted coordinates."""

    probe: Probe
    free: npt.NDArray[np.bool_]  # [R]
    targets: Doubles  # [P, 3]
    axes: Doubles  # [P, k, 3]
    roots: Doubles  # [P]: roots of weights
    low: Doubles  # [R]
    high: Doubles  # [R]
    ease: Doubles  # [R]
    unknowns: _Unknowns
    mm: float  # of the file's unit

    def held(self, controls: Sequence[int], at: Doubles) -> _Drag:
        """The same drag with some controls kept where they are."""
        low, high, free = self.low.copy(), self.high.copy(), self.free.copy()
        low[controls] = high[controls] = at[controls]
        free[controls] = False
        return replace(self, low=low, high=high, free=free)

    def positions(self, raw: Doubles) -> Doubles:
        return self.probe.positions(raw)

    def residual(self, positions: Doubles) -> Doubles:
        """float64[m]: what is missing."""
        apart = np.einsum("pki,pi->pk", self.axes, self.targets - positions)
        return np.asarray((apart * self.roots[:, None]).ravel())

    def left(self, raw: Doubles) -> float:
        """The square of what is missing at a pose."""
        missing = self.residual(self.positions(raw))
        return float(missing @ missing)

    def jacobian(self, raw: Doubles) -> Doubles:
        """float64[m, R]"""
        self.probe.linearise(raw, self.high, self.free)
        out = self.probe.jacobian()
        along = np.einsum("pki,pir->pkr", self.axes, out) * self.roots[:, None, None]
        return np.asarray(along.reshape(-1, len(raw)))

    def error(self, residual: Doubles) -> float:
        return float(np.sqrt(residual @ residual / max(1e-300, float(self.roots @ self.roots))))


def _drag(
    surface: Surface,
    raw: Doubles,
    points: Sequence[tuple[int, int]],
    targets: npt.ArrayLike,
    axes: npt.ArrayLike | None,
    weights: npt.ArrayLike | None,
    free: npt.ArrayLike | None,
    lowest: npt.ArrayLike | None,
    highest: npt.ArrayLike | None,
    partners: npt.ArrayLike | None = None,
    ease: npt.ArrayLike | None = None,
) -> _Drag:
    dragged = wholes("points", points)
    count = len(dragged) if dragged.ndim else 0
    if not count:
        raise ArgumentError("points: one at least was expected, found 0")
    if dragged.shape != (count, 2):
        raise ArgumentError("points: a mesh and a vertex of each were expected")
    wanted = numbers("targets", targets)
    if wanted.shape != (count, 3):
        raise ArgumentError(f"targets: finite numbers of shape [{count}, 3] were expected")
    along = np.tile(np.eye(3), (count, 1, 1)) if axes is None else numbers("axes", axes)
    if along.ndim != 3 or along.shape[::2] != (count, 3):
        raise ArgumentError(f"axes: finite numbers of shape [{count}, k, 3] were expected")
    weight = vector("weights", 1.0 if weights is None else weights, count)
    if (weight < 0).any():
        raise ArgumentError(f"weights: numbers from 0 were expected, found {weight.min():g}")
    low, high = limits(len(raw), lowest, highest)
    low, high = np.minimum(low, raw), np.maximum(high, raw)
    loose = vector("free", True if free is None else free, len(raw)).astype(bool)
    low[~loose] = high[~loose] = raw[~loose]
    surface.check_size(count)
    probe = surface.probe(dragged)
    easy = vector("ease", 1.0 if ease is None else ease, len(raw))
    unknowns = _unknowns(len(raw), partners, easy)
    # A pair is as ready as its readier half: the other half alone would hold both back.
    pair = easy.copy()
    pair[unknowns.first] = pair[unknowns.second] = unknowns.ease
    return _Drag(
        probe, loose, wanted, along, np.sqrt(weight), low, high, pair, unknowns, surface.mm
    )


@dataclass
class _Unknowns:
    """What is solved for: each a change of a control, or of a control and its partner alike."""

    first: npt.NDArray[np.int64]  # [U] controls
    second: npt.NDArray[np.int64]  # [U] their partners, themselves where they have none
    ease: Doubles  # [U]: of two partners that of the readier one
    scale: Doubles  # [U]: what a unit of an unknown changes each of its controls by

    def alike(self) -> _Unknowns:
        """The same, each as ready as the others."""
        return replace(self, ease=np.ones_like(self.ease), scale=self.scale / self.ease)

    def columns(self, jacobian: Doubles) -> Doubles:
        """float64[m, U] of float64[m, R]"""
        both = jacobian[:, self.second] * (self.first != self.second)
        return np.asarray((jacobian[:, self.first] + both) * self.scale)

    def change(self, values: Doubles, count: int) -> Doubles:
        """float64[R], R being `count`, of float64[U]."""
        out = np.zeros(count)
        out[self.first] = out[self.second] = values * self.scale
        return out

    def values(self, change: Doubles) -> Doubles:
        """float64[U] of a change, float64[R], that is alike in partners."""
        return np.asarray(change[self.first] / self.scale)

    def limits(self, low: Doubles, high: Doubles) -> tuple[Doubles, Doubles]:
        """float64[U] each, of how far each control may change down and up."""
        lowest = np.maximum(low[self.first], low[self.second]) / self.scale
        return lowest, np.minimum(high[self.first], high[self.second]) / self.scale


def _unknowns(count: int, partners: npt.ArrayLike | None, ease: Doubles) -> _Unknowns:
    if not (ease > 0).all():
        raise ArgumentError(f"ease: numbers above 0 were expected, found {ease.min():g}")
    each = np.arange(count)
    partner = each if partners is None else wholes("partners", partners)
    if partner.shape != (count,):
        raise ArgumentError(f"partners: whole numbers of shape [{count}] were expected")
    if ((partner < 0) | (partner >= count)).any() or (partner[partner] != each).any():
        raise ArgumentError("partners: each control's partner was expected to have it as its own")
    first = np.unique(np.minimum(each, partner))
    second = partner[first].astype(np.int64)
    easier = np.maximum(ease[first], ease[second])
    scale = np.where(first == second, 1.0, np.sqrt(0.5)) * easier
    return _Unknowns(first, second, easier, scale)


def solve_drag(
    surface: Surface,
    raw: npt.ArrayLike,
    points: Sequence[tuple[int, int]],
    targets: npt.ArrayLike,
    *,
    axes: npt.ArrayLike | None = None,
    weights: npt.ArrayLike | None = None,
    free: npt.ArrayLike | None = None,
    lowest: npt.ArrayLike | None = None,
    highest: npt.ArrayLike | None = None,
    ease: npt.ArrayLike | None = None,
    partners: npt.ArrayLike | None = None,
    opposites: Sequence[tuple[int, int]] = (),
    method: str = "least_squares",
    smallest: float = 1e-3,
    rounds: int = 4,
) -> Solved:
    """The smallest change of the controls that brings points where they are wanted.

    Args:
        surface: the face.
        raw: float[R], the pose that the drag began with.
        points: (mesh, vertex) of each dragged or pinned point.
        targets: float[P, 3] in the file's units; of a pin where it is.
        axes: float[P, k, 3]: unit vectors along which each point counts, e.g. two of a screen,
            which leave the depth free; None is all three.
        weights: float[P], how much each point counts; None is 1.
        free: bool[R], which controls may change; None is all.
        lowest, highest: float[R] or one number: the limits; None is 0 and 1. A control that is
            beyond them may stay where it is.
        ease: float[R] above 0, how readily each control changes: one of 0.1 costs ten times as
            much, and is left alone where others bring the points there; of two partners the readier
            one counts; None is 1.
        partners: int[R], each control's partner, itself where it has none: the two change alike, as
            left and right of a symmetric drag; None is no partners.
        opposites: pairs of controls of which one at most shall be on, as mouthLeft and mouthRight.
            A face whose halves differ finds a use for both at once, and nobody wants that. Two that
            are partners as well stay as they are.
        method: "least_squares"; "transpose", which takes the controls that move the points
            themselves by as much as they do so: surprises less far from the drag; or "sparse", few
            controls, about one for each direction that counts, which may leave some of the
            way missing, 0.6 mm at most, and ask those that belong elsewhere (an ease below a tenth)
            only where they bring the points noticeably nearer.
        smallest: how much a small change is worth, beside the reach of the strongest control; more
            gives up some of the target.
        rounds: how often at most the face is looked at anew on the way.

    Raises:
        ValueError: an argument that makes no sense; the sentence names it.
    """
    at = vector("raw", raw, len(surface.rig.raw_control_names))
    if method not in METHODS:
        raise ArgumentError(f"method: {' or '.join(METHODS)} was expected, found {method!r}")
    checked("smallest", finite, smallest, 1e-12, 1e12)
    checked("rounds", whole_number, rounds, 0, 1000)
    given = begin = at
    drag = _drag(
        surface, begin, points, targets, axes, weights, free, lowest, highest, partners, ease
    )

    hard = [*map(int, np.flatnonzero(drag.ease < _HARD * drag.ease.max()))]

    def solve(drag: _Drag, start: Doubles) -> Doubles:
        if method == "transpose":
            return _transposed(drag, begin, rounds)
        if method == "sparse":
            return _sparsely(drag, begin, smallest, rounds)
        if not hard:
            return _least_squares(drag, begin, start, smallest, rounds)
        # The easy ones alone often do, and are few to look at.
        easy = _least_squares(drag.held(hard, begin), begin, start, smallest, rounds)
        if drag.left(easy) <= _GAIN * drag.left(begin):
            return easy
        every = _least_squares(drag, begin, easy, smallest, rounds)
        # Where the points stay out of reach a little nearer is not worth what it takes along.
        near, nearer, way = (np.sqrt(drag.left(x)) for x in (easy, every, begin))
        return easy if near - nearer < _WORTH * way < nearer else every

    pairs = _pairs(opposites, len(begin))
    at = whole = _kept_apart(drag, begin, pairs, solve)
    # A sparse drag takes the cheaper of two that do the same by itself.
    doubles, readier = _doubles(drag.held(hard, begin), begin) if method != "sparse" else ([], [])
    if doubles:
        at = _kept_apart(drag.held(doubles, begin), begin, pairs, solve)
        if (at[readier] >= drag.high[readier] - _ON).any():  # they have no more to give
            begin = at
            at = _kept_apart(drag, begin, pairs, solve)
        worse = np.sqrt(drag.left(at)) - np.sqrt(drag.left(whole))
        at = whole if worse > _WORTH * np.sqrt(drag.left(given)) else at
    positions = drag.positions(at)
    error = drag.error(drag.residual(positions))
    change = float(np.linalg.norm(at - given))
    return Solved(at.astype(np.float32), positions.astype(np.float32), error, change)


def _doubles(drag: _Drag, begin: Doubles) -> tuple[list[int], list[int]]:
    """Controls at rest that do to the points what a readier one does; that one of each.

    Least squares would toss a coin for which of them moves: a brow comes down by browDown or by
    eyeFaceScrunch, whose brow is the same to a hundredth.
    """
    ease = drag.ease
    if (ease == ease[0]).all():
        return [], []
    drag.probe.linearise(begin, drag.high, drag.free)
    columns = drag.probe.jacobian().reshape(-1, len(begin)).astype(np.float64)
    far = np.linalg.norm(columns, axis=0)
    strong = np.flatnonzero(drag.free & (far > 0) & (far >= AS_FAR**2 * far.max(initial=0.0)))
    unit = columns[:, strong] / far[strong]
    quotient = far[strong][:, None] / far[strong]
    alike = (unit.T @ unit >= ALIKE) & (quotient >= AS_FAR) & (quotient <= 1 / AS_FAR)
    alike &= (ease[strong][:, None] < ease[strong]) & (begin[strong] <= drag.low[strong])[:, None]
    lesser, readier = np.nonzero(alike)
    return [*map(int, strong[lesser])], [*map(int, strong[readier])]


def _pairs(opposites: Sequence[tuple[int, int]], count: int) -> npt.NDArray[np.int64]:
    """int64[N, 2]"""
    found = wholes("opposites", opposites)
    pairs = found if found.size else np.empty((0, 2), np.int64)
    if pairs.shape[1:] != (2,) or not ((pairs >= 0) & (pairs < count)).all():
        raise ArgumentError(f"opposites: pairs of whole numbers below {count} were expected")
    return pairs


def _kept_apart(
    drag: _Drag,
    begin: Doubles,
    opposites: npt.NDArray[np.int64],
    solve: Callable[[_Drag, Doubles], Doubles],
) -> Doubles:
    """What `solve` finds with one of two opposites alone: the one that it uses more.

    One that was on goes back before the other comes.
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
    spent = [i for i in range(len(lesser)) if begin[more[i]] > at[more[i]] <= _ON]
    if spent:
        gone = np.minimum(begin, at)
        drag = drag.held([*(more[i] for i in spent)], gone)
        at = solve(drag.held([c for i, c in enumerate(lesser) if i not in spent], begin), gone)
    return at


def _both_on(
    opposites: npt.NDArray[np.int64], at: Doubles, begin: Doubles
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """Of the pairs that are both on, further than they were: the lesser ones, and the others.

    The lesser one is that which was less on before, or, of two at rest, is so now.
    """
    before = np.maximum(begin[opposites].min(axis=1), 0.0)
    pairs = opposites[at[opposites].min(axis=1) > before + _ON]
    was, now = begin[pairs], at[pairs]
    first = (was[:, 0] < was[:, 1]) | ((was[:, 0] == was[:, 1]) & (now[:, 0] < now[:, 1]))
    return np.where(first, pairs[:, 0], pairs[:, 1]), np.where(first, pairs[:, 1], pairs[:, 0])


def _least_squares(
    drag: _Drag, begin: Doubles, start: Doubles, smallest: float, rounds: int
) -> Doubles:
    """Gauss-Newton, whose whole change from the begin is kept small, with halved steps."""
    at = np.clip(start, drag.low, drag.high)
    missing = drag.residual(drag.positions(at))
    price, first = -1.0, float(missing @ missing)
    low, high = drag.unknowns.limits(drag.low - begin, drag.high - begin)
    for _ in range(max(1, rounds)):
        jacobian = drag.unknowns.columns(drag.jacobian(at))
        if price < 0:  # the same all along, so that what one round gains no other gives away
            strongest = float((jacobian**2).sum(axis=0).max(initial=0))
            price = max(smallest**2 * strongest, 1e-20)
        here = drag.unknowns.values(at - begin)
        step = least_change(jacobian, missing + jacobian @ here, low, high, price) - here
        worth = missing @ missing + price * (here @ here)
        gained = 0.0
        for share in (1.0, 0.5, 0.25):
            there = here + share * step
            tried = begin + drag.unknowns.change(there, len(begin))
            left = drag.residual(drag.positions(tried))
            gained = float(worth - left @ left - price * (there @ there))
            if gained > 0:
                at, missing = tried, left
                break
        if gained <= _GAIN * max(float(worth), first):
            break
    return at


def _sparsely(drag: _Drag, begin: Doubles, smallest: float, rounds: int) -> Doubles:
    """The cheapest change that comes near enough, then of the controls that it moves the best.

    A control costs the root of how far it brings the points, by its ease: of several that go one
    way a strong one is preferred to weak ones that go to their limits. The controls are found as
    the face is at the begin, once: so they depend continuously on the targets.
    """
    units, eases = drag.unknowns.alike(), drag.unknowns.ease
    drag = replace(drag, unknowns=units)
    jacobian, missing = _seen_from(drag, begin, begin)
    way, unit = float(np.linalg.norm(missing)), float(np.linalg.norm(drag.roots)) / drag.mm
    low, high = units.limits(drag.low - begin, drag.high - begin)
    elsewhere = eases < _HARD * eases.max()
    far = np.linalg.norm(jacobian, axis=0)
    reach = far * np.maximum(high, -low)
    least = np.where(elsewhere, _WEAK_ELSEWHERE, _WEAK) * reach.max(initial=0.0)
    some = np.flatnonzero(reach > least)
    price = np.where(elsewhere, _DEAR, eases.max() / eases) * np.sqrt(far)
    x = np.zeros(len(far))
    x[some] = cheapest_change(
        jacobian[:, some], missing, low[some], high[some], price[some], elsewhere[some],
        min(_MISSING * way, _MISSING_MM * unit), min(_HELP * way, _HELP_MM * unit),
    )  # fmt: skip
    change = units.change(x, len(begin))
    drag, at = drag.held([*map(int, np.flatnonzero(change == 0))], begin), begin + change
    low, high = np.clip(_FREED * x, low, 0.0), np.clip(_FREED * x, 0.0, high)
    ridge = max((smallest * float(far.max(initial=0.0))) ** 2, 1e-20)
    for _ in range(max(1, rounds - 1)):
        jacobian, missing = _seen_from(drag, begin, at)
        was, x = x, least_change(jacobian, missing, low, high, ridge)
        at = begin + units.change(x, len(begin))
        if float(np.abs(x - was).max()) < _STILL:
            break
    return at


def _seen_from(drag: _Drag, begin: Doubles, at: Doubles) -> tuple[Doubles, Doubles]:
    """The derivatives at a pose, float64[m, U], and what changes from the begin have to give."""
    jacobian = drag.unknowns.columns(drag.jacobian(at))
    here = drag.unknowns.values(at - begin)
    return jacobian, drag.residual(drag.positions(at)) + jacobian @ here


def _transposed(drag: _Drag, at: Doubles, rounds: int) -> Doubles:
    """Down the slope, each time as far as is best by the derivatives; in the limits."""
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
    """How readily controls shall change where points are dragged, for solve_drag: float64[R].

    ELSEWHERE for those that do less than LOCAL there, of what they do where they do most, than the
    one that does most of its own there: a brow that is dragged then turns no eye, though eyes that
    turn move it. The others cost what they move all over the face beside what they do there: a
    brow lowers before a face is screwed up, which lowers it as much. The readiest of them has 1.

    Args:
        surface: the face.
        reach: float[P, 3, R], what each control does to the points: of surface.jacobian.
    """
    here = np.linalg.norm(numbers("reach", reach), axis=1).max(axis=0, initial=0.0)
    share = here / np.maximum(np.maximum(surface.strongest(), here), 1e-30)
    local = share >= LOCAL * share.max(initial=0.0)
    alone = here / np.maximum(surface.spread(), 1e-30)
    # solve_drag squares what a change costs, so the root of that quotient makes it one of lengths.
    readiness = np.sqrt(alone / np.maximum(alone[local].max(initial=0.0), 1e-30))
    return np.where(local, np.maximum(readiness, ELSEWHERE), ELSEWHERE)


def best_controls(
    surface: Surface,
    raw: npt.ArrayLike,
    point: tuple[int, int],
    target: npt.ArrayLike,
    *,
    axes: npt.ArrayLike | None = None,
    free: npt.ArrayLike | None = None,
    lowest: npt.ArrayLike | None = None,
    highest: npt.ArrayLike | None = None,
    count: int = 8,
) -> list[tuple[int, float, float]]:
    """The controls that alone bring a point nearest to a target, best first.

    Args:
        surface: the face.
        raw: float[R], the pose that the drag began with.
        point: (mesh, vertex).
        target: float[3] in the file's units.
        axes: float[k, 3]: unit vectors along which the point counts; None is all three.
        free: bool[R], which controls may change; None is all.
        lowest, highest: float[R] or one number: the limits; None is 0 and 1.
        count: how many at most.

    Returns:
        (control, the value that it would take, how far the point then is from its target along the
        axes in the file's units); none that makes it no better.

    Raises:
        ValueError: an argument that makes no sense; the sentence names it.
    """
    at = vector("raw", raw, len(surface.rig.raw_control_names))
    checked("count", whole_number, count, 0, MOST)
    along = None if axes is None else numbers("axes", axes)[None]
    goal = numbers("target", target)[None]
    drag = _drag(surface, at, [point], goal, along, None, free, lowest, highest)
    jacobian, missing = drag.jacobian(at), drag.residual(drag.positions(at))
    square = (jacobian**2).sum(axis=0)
    toward = np.clip(at + jacobian.T @ missing / np.maximum(square, 1e-30), drag.low, drag.high)
    left = np.linalg.norm(missing[:, None] - jacobian * (toward - at), axis=0)
    order = np.argsort(left, kind="stable")[: 2 * count]
    found = [_alone(drag, at, int(control)) for control in order if toward[control] != at[control]]
    before = float(np.linalg.norm(missing)) * (1 - 1e-6)
    return sorted((f for f in found if f[2] < before), key=lambda f: f[2])[:count]


def _alone(drag: _Drag, begin: Doubles, control: int) -> tuple[int, float, float]:
    """The best value of one control, and what is then missing: by secants, as the face bends."""
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
