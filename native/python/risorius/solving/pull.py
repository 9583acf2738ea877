# SPDX-License-Identifier: MIT
"""A drag as equations: target coordinates, the effect of controls on them, and their least
squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .._native import Probe, least_change
from ..base.errors import ArgumentError
from .controls import ControlLimits, ControlSharing
from .surface import Doubles, Surface, numbers, vector, wholes

ON = 1e-6  # a smaller change of a control counts as none
_GAIN = 1e-5  # of the squared distance: a smaller gain ends the iteration


@dataclass
class Drag:
    """A checked drag; its m rows are target coordinates."""

    probe: Probe
    free: npt.NDArray[np.bool_]  # [R]
    targets: Doubles  # [P, 3]
    axes: Doubles  # [P, k, 3]
    roots: Doubles  # [P]: square roots of the weights
    low: Doubles  # [R]
    high: Doubles  # [R]
    ease: Doubles  # [R]
    unknowns: Unknowns
    mm: float  # millimetres in the file's unit

    def held(self, controls: Sequence[int], at: Doubles) -> Drag:
        """The same drag with some controls fixed. Args: controls; at  their values, [R]."""
        low, high, free = self.low.copy(), self.high.copy(), self.free.copy()
        low[controls] = high[controls] = at[controls]
        free[controls] = False
        return replace(self, low=low, high=high, free=free)

    def positions(self, raw: Doubles) -> Doubles:
        """float64[P, 3]: where the points are. Args: raw  a pose, float64[R]."""
        return self.probe.positions(raw)

    def residual(self, positions: Doubles) -> Doubles:
        """float64[m]: the weighted distances. Args: positions  of the points, float64[P, 3]."""
        apart = np.einsum("pki,pi->pk", self.axes, self.targets - positions)
        return np.asarray((apart * self.roots[:, None]).ravel())

    def left(self, raw: Doubles) -> float:
        """The squared distance. Args: raw  a pose, float64[R]."""
        missing = self.residual(self.positions(raw))
        return float(missing @ missing)

    def far(self, raw: Doubles) -> float:
        """Root mean square distance in mm. Args: raw  a pose, float64[R]."""
        return self.error(self.residual(self.positions(raw))) * self.mm

    def jacobian(self, raw: Doubles) -> Doubles:
        """The derivatives, float64[m, R]. Args: raw  a pose, float64[R]."""
        self.probe.linearise(raw, self.high, self.free)
        out = self.probe.jacobian()
        along = np.einsum("pki,pir->pkr", self.axes, out) * self.roots[:, None, None]
        return np.asarray(along.reshape(-1, len(raw)))

    def error(self, residual: Doubles) -> float:
        """Root mean square in file units. Args: residual  float64[m]."""
        return float(np.sqrt(residual @ residual / max(1e-300, float(self.roots @ self.roots))))


def make_drag(
    surface: Surface,
    raw: Doubles,
    points: Sequence[tuple[int, int]],
    targets: npt.ArrayLike,
    axes: npt.ArrayLike | None,
    weights: npt.ArrayLike | None,
    limits: ControlLimits,
    sharing: ControlSharing,
) -> Drag:
    """Check the arguments and make a drag.

    Args:
        surface, raw, points, targets, axes, weights, limits, sharing: as in solve_drag.

    Raises:
        ArgumentError: an invalid argument.
    """
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
    low, high, free = limits.around(raw)
    surface.check_size(count)
    probe = surface.probe(dragged)
    easy = vector("ease", 1.0 if sharing.ease is None else sharing.ease, len(raw))
    unknowns = _unknowns(len(raw), sharing.partners, easy)
    # A pair has the larger ease of its two halves, because the other half alone would hold it back.
    pair = easy.copy()
    pair[unknowns.first] = pair[unknowns.second] = unknowns.ease
    return Drag(probe, free, wanted, along, np.sqrt(weight), low, high, pair, unknowns, surface.mm)


@dataclass
class Unknowns:
    """The unknowns: each is the change of one control, or of a control and its partner together."""

    first: npt.NDArray[np.int64]  # [U] controls
    second: npt.NDArray[np.int64]  # [U] their partners, or the controls themselves
    ease: Doubles  # [U]: of two partners the larger ease
    scale: Doubles  # [U]: change of each control per unit of the unknown

    def alike(self) -> Unknowns:
        """The same unknowns with equal ease."""
        return replace(self, ease=np.ones_like(self.ease), scale=self.scale / self.ease)

    def columns(self, jacobian: Doubles) -> Doubles:
        """The derivatives by unknowns, float64[m, U]. Args: jacobian  float64[m, R]."""
        both = jacobian[:, self.second] * (self.first != self.second)
        return np.asarray((jacobian[:, self.first] + both) * self.scale)

    def change(self, values: Doubles, count: int) -> Doubles:
        """A change of the controls, float64[R]. Args: values  float64[U]; count  R."""
        out = np.zeros(count)
        out[self.first] = out[self.second] = values * self.scale
        return out

    def values(self, change: Doubles) -> Doubles:
        """The unknowns, float64[U]. Args: change  float64[R], alike in partners."""
        return np.asarray(change[self.first] / self.scale)

    def limits(self, low: Doubles, high: Doubles) -> tuple[Doubles, Doubles]:
        """Limits of the unknowns, float64[U] each. Args: low, high  of a change, float64[R]."""
        lowest = np.maximum(low[self.first], low[self.second]) / self.scale
        return lowest, np.minimum(high[self.first], high[self.second]) / self.scale


def _unknowns(count: int, partners: npt.ArrayLike | None, ease: Doubles) -> Unknowns:
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
    return Unknowns(first, second, easier, scale)


def least_squares(
    drag: Drag, begin: Doubles, start: Doubles, smallest: float, rounds: int
) -> Doubles:
    """Gauss-Newton with halved steps; keeps the whole change from the begin small.

    Args:
        drag: the drag.
        begin: float64[R], the pose from which changes are counted.
        start: float64[R], the initial pose.
        smallest, rounds: as in solve_drag.
    """
    at = np.clip(start, drag.low, drag.high)
    missing = drag.residual(drag.positions(at))
    price, first = -1.0, float(missing @ missing)
    low, high = drag.unknowns.limits(drag.low - begin, drag.high - begin)
    for _ in range(max(1, rounds)):
        jacobian = drag.unknowns.columns(drag.jacobian(at))
        if price < 0:  # constant, so that no round gives up the gain of another
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


def seen_from(drag: Drag, begin: Doubles, at: Doubles) -> tuple[Doubles, Doubles]:
    """The derivatives at a pose, float64[m, U], and the residual in terms of changes from the
    begin.

    Args:
        drag: the drag.
        begin: float64[R], the pose at its begin.
        at: float64[R], the pose.
    """
    jacobian = drag.unknowns.columns(drag.jacobian(at))
    here = drag.unknowns.values(at - begin)
    return jacobian, drag.residual(drag.positions(at)) + jacobian @ here
