# SPDX-License-Identifier: MIT
"""Makes and solves the equations of a drag: residuals, derivatives by controls, least squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .._native import Probe, least_change
from ..base.errors import ArgumentError
from .controls import ControlLimits, ControlSharing
from .surface import Doubles, Surface, numbers, vector, wholes

ON = 1e-6  # smaller changes of a control count as none
_GAIN = 1e-5  # fraction of the squared distance: a smaller gain ends the iteration


@dataclass
class Drag:
    """The checked equations of a drag: P points with k directions each give m = P k equations."""

    probe: Probe
    free: npt.NDArray[np.bool_]  # [R]: controls that may change
    targets: Doubles  # [P, 3]: target positions
    axes: Doubles  # [P, k, 3]: directions that count
    roots: Doubles  # [P]: square roots of the weights
    low: Doubles  # [R]: smallest values
    high: Doubles  # [R]: largest values
    ease: Doubles  # [R]: how readily each control changes
    unknowns: Unknowns
    mm: float  # millimetres per unit of the file

    def held(self, controls: Sequence[int], at: Doubles) -> Drag:
        """The same drag with some controls fixed. Args: controls: their indices; at: float64[R], a
        pose with their values."""
        low, high, free = self.low.copy(), self.high.copy(), self.free.copy()
        low[controls] = high[controls] = at[controls]
        free[controls] = False
        return replace(self, low=low, high=high, free=free)

    def positions(self, raw: Doubles) -> Doubles:
        """float64[P, 3]: positions of the points. Args: raw: float64[R], a pose."""
        return self.probe.positions(raw)

    def residual(self, positions: Doubles) -> Doubles:
        """float64[m]: targets minus positions along the directions, times the roots of the
        weights. Args: positions: float64[P, 3], of the points."""
        apart = np.einsum("pki,pi->pk", self.axes, self.targets - positions)
        return np.asarray((apart * self.roots[:, None]).ravel())

    def left(self, raw: Doubles) -> float:
        """The sum of the squared residuals. Args: raw: float64[R], a pose."""
        missing = self.residual(self.positions(raw))
        return float(missing @ missing)

    def far(self, raw: Doubles) -> float:
        """Weighted root mean square distance to the targets, mm. Args: raw: float64[R], a pose."""
        return self.error(self.residual(self.positions(raw))) * self.mm

    def jacobian(self, raw: Doubles) -> Doubles:
        """float64[m, R]: derivatives of the weighted positions along the directions, by each
        control. Args: raw: float64[R], a pose."""
        self.probe.linearise(raw, self.high, self.free)
        out = self.probe.jacobian()
        along = np.einsum("pki,pir->pkr", self.axes, out) * self.roots[:, None, None]
        return np.asarray(along.reshape(-1, len(raw)))

    def error(self, residual: Doubles) -> float:
        """Weighted root mean square of residuals, in the file's unit. Args: residual:
        float64[m]."""
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
    """Checks the arguments, and makes the equations of a drag.

    Args:
        surface: surface of the face.
        raw: float64[R], raw controls at the beginning of the drag.
        points: (mesh, vertex) of each of the P points.
        targets: float[P, 3], target positions in the file's unit.
        axes: float[P, k, 3], unit vectors along which distances count; None: all three axes.
        weights: float[P] of 0 or more, importance of each point; None: 1.
        limits: the controls that may change, and their ranges.
        sharing: how the drag is distributed over the controls.

    Raises:
        ArgumentError: an invalid argument.
    """
    dragged = wholes("points", points)
    count = len(dragged) if dragged.ndim else 0
    if not count:
        raise ArgumentError("points: one at least was expected, found 0")
    if dragged.shape != (count, 2):
        raise ArgumentError("points: a mesh index and a vertex index of each point were expected")
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
    # Both partners have the larger ease of the two, because otherwise the slower one would hold
    # back the other.
    pair = easy.copy()
    pair[unknowns.first] = pair[unknowns.second] = unknowns.ease
    return Drag(probe, free, wanted, along, np.sqrt(weight), low, high, pair, unknowns, surface.mm)


@dataclass
class Unknowns:
    """The unknowns of a drag: changes of single controls, or of two partners together."""

    first: npt.NDArray[np.int64]  # [U]: indices of controls
    second: npt.NDArray[np.int64]  # [U]: indices of their partners, or of the controls themselves
    ease: Doubles  # [U]: the larger ease of two partners
    scale: Doubles  # [U]: change of each control per unit of the unknown

    def alike(self) -> Unknowns:
        """The same unknowns, all with the ease 1, so that all controls change equally readily."""
        return replace(self, ease=np.ones_like(self.ease), scale=self.scale / self.ease)

    def columns(self, jacobian: Doubles) -> Doubles:
        """float64[m, U]: derivatives by the unknowns. Args: jacobian: float64[m, R], derivatives by
        the controls."""
        both = jacobian[:, self.second] * (self.first != self.second)
        return np.asarray((jacobian[:, self.first] + both) * self.scale)

    def change(self, values: Doubles, count: int) -> Doubles:
        """float64[R]: the change of the controls. Args: values: float64[U], of the
        unknowns; count: number R of controls."""
        out = np.zeros(count)
        out[self.first] = out[self.second] = values * self.scale
        return out

    def values(self, change: Doubles) -> Doubles:
        """float64[U]: values of the unknowns. Args: change: float64[R], change of the controls,
        equal for partners."""
        return np.asarray(change[self.first] / self.scale)

    def limits(self, low: Doubles, high: Doubles) -> tuple[Doubles, Doubles]:
        """float64[U] each: limits of the unknowns. Args: low, high: float64[R], limits of the
        change of each control."""
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
        raise ArgumentError(
            "partners: each control's partner was expected to have that control as its partner"
        )
    first = np.unique(np.minimum(each, partner))
    second = partner[first].astype(np.int64)
    easier = np.maximum(ease[first], ease[second])
    scale = np.where(first == second, 1.0, np.sqrt(0.5)) * easier
    return Unknowns(first, second, easier, scale)


def least_squares(
    drag: Drag, begin: Doubles, start: Doubles, smallest: float, rounds: int
) -> Doubles:
    """float64[R]: the pose that minimises the squared residuals plus the price of the squared
    change, by Gauss-Newton.

    If a step does not reduce this sum, half and then a quarter of the step is tried.

    Args:
        drag: equations of the drag.
        begin: float64[R], the pose from which changes are measured.
        start: float64[R], the pose where the iteration starts.
        smallest: price of a change, relative to the effect of the strongest control.
        rounds: largest number of linearisations.
    """
    at = np.clip(start, drag.low, drag.high)
    missing = drag.residual(drag.positions(at))
    price, first = -1.0, float(missing @ missing)
    low, high = drag.unknowns.limits(drag.low - begin, drag.high - begin)
    for _ in range(max(1, rounds)):
        jacobian = drag.unknowns.columns(drag.jacobian(at))
        # The price is computed in the first round only. With another price, a later round could
        # give up the gain of an earlier one.
        if price < 0:
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
    """Linear equations for the change from the pose `begin`: derivatives float64[m, U] at the pose
    `at`, and the residual float64[m] that they predict for `begin`.

    Args:
        drag: equations of the drag.
        begin: float64[R], the pose at the beginning.
        at: float64[R], the pose of the derivatives.
    """
    jacobian = drag.unknowns.columns(drag.jacobian(at))
    here = drag.unknowns.values(at - begin)
    return jacobian, drag.residual(drag.positions(at)) + jacobian @ here
