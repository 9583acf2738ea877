# SPDX-License-Identifier: MIT
"""The controls that bring points of the skin where they are wanted.

J. P. Lewis and Ken Anjyo, "Direct Manipulation Blendshapes", IEEE Computer Graphics and
Applications 30 (4), 2010: the smallest change of the sliders, by least squares. Ozan Cetinaslan,
"Position Manipulation Techniques for Facial Animation", PhD thesis, Porto 2016, and later papers:
the transpose of the Jacobian in the place of its inverse.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .._native import Probe, least_change
from ..base.errors import ArgumentError
from .surface import Doubles, Floats, Surface, limits, vector

METHODS = ("least_squares", "transpose")


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

    def positions(self, raw: Doubles) -> Doubles:
        return self.probe.positions(raw)

    def residual(self, positions: Doubles) -> Doubles:
        """float64[m]: what is missing."""
        apart = np.einsum("pki,pi->pk", self.axes, self.targets - positions)
        return np.asarray((apart * self.roots[:, None]).ravel())

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
) -> _Drag:
    count = len(points)
    if not count:
        raise ArgumentError("points: one at least was expected, found 0")
    wanted = np.asarray(targets, np.float64)
    if wanted.shape != (count, 3) or not np.isfinite(wanted).all():
        raise ArgumentError(f"targets: finite numbers of shape [{count}, 3] were expected")
    along = np.tile(np.eye(3), (count, 1, 1)) if axes is None else np.asarray(axes, np.float64)
    if along.ndim != 3 or along.shape[::2] != (count, 3) or not np.isfinite(along).all():
        raise ArgumentError(f"axes: finite numbers of shape [{count}, k, 3] were expected")
    weight = vector("weights", 1.0 if weights is None else weights, count)
    if (weight < 0).any():
        raise ArgumentError(f"weights: numbers from 0 were expected, found {weight.min():g}")
    low, high = limits(len(raw), lowest, highest)
    low, high = np.minimum(low, raw), np.maximum(high, raw)
    loose = vector("free", True if free is None else free, len(raw)).astype(bool)
    low[~loose] = high[~loose] = raw[~loose]
    probe = surface.probe(np.asarray(points, np.int64).reshape(count, 2))
    return _Drag(probe, loose, wanted, along, np.sqrt(weight), low, high)


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
        method: "least_squares", or "transpose", which takes the controls that move the points
            themselves by as much as they do so: surprises less far from the drag.
        smallest: how much a small change is worth, beside the reach of the strongest control; more
            gives up some of the target.
        rounds: how often at most the face is looked at anew on the way.

    Raises:
        ValueError: an argument that makes no sense; the sentence names it.
    """
    at = vector("raw", raw, len(surface.rig.raw_control_names))
    if method not in METHODS:
        raise ArgumentError(f"method: {' or '.join(METHODS)} was expected, found {method!r}")
    begin = at
    drag = _drag(surface, begin, points, targets, axes, weights, free, lowest, highest)
    if method == "transpose":
        at = _transposed(drag, at, rounds)
    else:
        at = _least_squares(drag, at, smallest, rounds)
    positions = drag.positions(at)
    error = drag.error(drag.residual(positions))
    change = float(np.linalg.norm(at - begin))
    return Solved(at.astype(np.float32), positions.astype(np.float32), error, change)


def _least_squares(drag: _Drag, begin: Doubles, smallest: float, rounds: int) -> Doubles:
    """Gauss-Newton, whose whole change from the begin is kept small, with halved steps."""
    at, missing = begin, drag.residual(drag.positions(begin))
    price = -1.0
    for _ in range(max(1, rounds)):
        jacobian = drag.jacobian(at)
        if price < 0:  # the same all along, so that what one round gains no other gives away
            strongest = float((jacobian**2).sum(axis=0).max(initial=0))
            price = max(smallest**2 * strongest, 1e-20)
        low, high = drag.low - begin, drag.high - begin
        goal = missing + jacobian @ (at - begin)
        step = begin + least_change(jacobian, goal, low, high, price) - at
        worth = missing @ missing + price * ((at - begin) @ (at - begin))
        gained = 0.0
        for share in (1.0, 0.5, 0.25):
            tried = at + share * step
            left = drag.residual(drag.positions(tried))
            gained = float(worth - left @ left - price * ((tried - begin) @ (tried - begin)))
            if gained > 0:
                at, missing = tried, left
                break
        if gained <= 1e-6 * worth:
            break
    return at


def _transposed(drag: _Drag, at: Doubles, rounds: int) -> Doubles:
    """Down the slope, each time as far as is best by the derivatives; in the limits."""
    for _ in range(max(1, 3 * rounds)):
        jacobian, missing = drag.jacobian(at), drag.residual(drag.positions(at))
        toward = jacobian.T @ missing
        toward[((at <= drag.low) & (toward < 0)) | ((at >= drag.high) & (toward > 0))] = 0
        reach = jacobian @ toward
        if not reach @ reach > 0:
            break
        size = float(reach @ missing / (reach @ reach))
        at = np.clip(at + size * toward, drag.low, drag.high)
    return at


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
    along = None if axes is None else np.asarray(axes, np.float64)[None]
    goal = np.asarray(target, np.float64)[None]
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
