# SPDX-License-Identifier: MIT
"""What targets that are added up leave to the rig: combinations of two, and targets half on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from .._native import Rig
from ..anim.reactions import load_exclusives
from ..controls.shares import share_of
from .parts import Points
from .targets import Target

Doubles = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]

PRODUCT, HALF, BELOW, SHARE = "product", "half", "below", "share"
"""How a combination's weight comes of a and b that drive it: a b; 4 a (1 - a); and where a acts on
top of b, as mouthClose does on jawOpen: 4 a (1 - b), which counts where both are half on, and
4 a (b - a), which counts where a is half of what b is."""
CUBIC, EARLY, LATE, MIDDLE = "cubic", "early", "late", "middle"
TRIPLE, SHUT = "triple", "shut"
"""Weights that are 0 where the others count: 32/3 a (1 - a) (1 - 2 a); 4 a (1 - a) b;
4 a b (1 - b); 16 a b (1 - a) (1 - b); a b c; and where a
acts on top of b, (1 - b) c for the share of b that a is."""
_WEIGHTS: dict[str, Callable[..., Doubles]] = {
    PRODUCT: lambda a, b: a * b,
    HALF: lambda a: 4 * a * (1 - a),
    BELOW: lambda a, b: 4 * a * (1 - b),
    SHARE: lambda a, b: 4 * a * np.maximum(0.0, b - a),
    CUBIC: lambda a: 32 / 3 * a * (1 - a) * (1 - 2 * a),
    EARLY: lambda a, b: 4 * a * (1 - a) * b,
    LATE: lambda a, b: 4 * a * b * (1 - b),
    MIDDLE: lambda a, b: 16 * a * b * (1 - a) * (1 - b),
    TRIPLE: lambda a, b, c: a * b * c,
    SHUT: lambda a, b, c: share_of(a, b) * (1 - b) * c,
}
_LEAST = 2e-6  # metres: what a target moves less, it does not move
_TRIED = 2000  # pairs of a group: of more, as many that are spread evenly


@dataclass(frozen=True)
class Combination:
    """What is added where targets are on together, or where one is half on.

    Attributes:
        name: of its morph target.
        of: the targets that drive it.
        weight: PRODUCT, HALF, BELOW or SHARE, or of refining CUBIC to SHUT.
        error_mm: the largest deviation of the linear sum without it.
    """

    name: str
    of: tuple[str, ...]
    weight: str
    error_mm: float


class Sums:
    """Sums of targets against the rig.

    Attributes:
        tried: pairs of each group that were looked at, and how many it has.
    """

    def __init__(self, points: Points, rig: Rig, targets: Sequence[Target]) -> None:
        """Args: points: of a level; rig: of the face; targets: those that the file has."""
        self._points = points
        self._names = rig.raw_control_names
        self._rest = np.asarray(rig.initial_raw_controls, np.float32)
        self._targets = {t.name: t for t in targets}
        self._deltas: dict[str, Floats] = {}
        self._against = {frozenset(pair) for pair in load_exclusives().opposites}
        self.tried: dict[str, tuple[int, int]] = {}

    def delta(self, name: str) -> Floats:
        """float32[P, 3], metres, of a target."""
        if name not in self._deltas:
            target = self._targets[name]
            found = self._points.at(target.raw) - self._points.at(target.base)
            found[np.abs(found).max(axis=1) < _LEAST] = 0.0
            self._deltas[name] = found.astype(np.float32)
        return self._deltas[name]

    def combination(self, one: Combination) -> Floats:
        """float32[P, 3], metres, of a combination's morph target."""
        found = self._missing(one.weight, one.of)
        found[np.abs(found).max(axis=1) < _LEAST] = 0.0
        return found.astype(np.float32)

    def errors(self, group: str) -> list[Combination]:
        """Pairs of a group, and its targets half on, the largest deviation first.

        Args:
            group: of the targets.
        """
        mine = [t for t in self._targets.values() if t.group == group and self._moves(t)]
        pairs = [(a, b) for a, b in combinations(mine, 2) if self._meet(a, b)]
        every = max(1, -(-len(pairs) // _TRIED))
        self.tried[group] = (len(pairs[::every]), len(pairs))
        wanted: list[tuple[str, tuple[str, ...]]] = [
            (PRODUCT, (a.name, b.name)) for a, b in pairs[::every]
        ]
        for t in mine:
            kinds = [(kind, (t.name, t.needs)) for kind in (BELOW, SHARE)]
            wanted += kinds if t.needs else [(HALF, (t.name,))]
        out = list[Combination]()
        for kind, of in wanted:
            name = "_x_".join(of) if kind == PRODUCT else f"{of[0]}_{kind}"
            out.append(Combination(name, of, kind, self.apart(of, kind)))
        return sorted(out, key=lambda one: -one.error_mm)

    def apart(self, of: tuple[str, ...], kind: str = PRODUCT) -> float:
        """Millimetres of a sum from the rig at most. Args: of: its targets; kind: of weight."""
        missing = self._missing(kind, of)
        return 1000.0 * float(np.sqrt(np.square(missing).sum(axis=1).max(initial=0.0)))

    def _missing(self, kind: str, of: tuple[str, ...]) -> Doubles:
        """What the linear sum lacks where targets are on as their weight counts most."""
        top = next((t for t in map(self._targets.__getitem__, of) if t.needs), None)
        if top is not None:
            return self._missing_on_top(kind, top, of)
        share = 1.0 if kind == PRODUCT else 0.5
        raw = self._rest + np.float32(share) * sum(
            (self._targets[name].raw - self._rest for name in of), np.zeros_like(self._rest)
        )
        linear = self._points.rest + share * sum(
            (self.delta(name) for name in of), np.zeros_like(self._points.rest)
        )
        return self._points.at(np.clip(raw, -1.0, 1.0)) - linear

    def _missing_on_top(self, kind: str, top: Target, of: tuple[str, ...]) -> Doubles:
        """The same of one that acts on top of another: its raw controls are shares of that one."""
        below, on, share = top.base, np.float32(1.0), 0.5
        if kind == BELOW:
            below = self._rest + np.float32(0.5) * (top.base - self._rest)
        elif kind == SHARE:
            on = np.float32(0.5)
        else:
            other = self._targets[next(name for name in of if name != top.name)]
            below, share = top.base + other.raw - self._rest, 1.0
        above = below + on * (top.raw - top.base)
        ends = [self._points.at(np.clip(raw, -1.0, 1.0)) for raw in (above, below)]
        return np.asarray(ends[0] - ends[1] - share * self.delta(top.name), np.float64)

    def _moves(self, target: Target) -> bool:
        return bool((target.raw != target.base).any())

    def _meet(self, a: Target, b: Target) -> bool:
        """Whether a face does both: not where they look, shift or turn to opposite sides; and one
        on top of the other is what it is."""
        if a.name == b.needs or b.name == a.needs:
            return False
        on = [[self._names[i] for i in np.flatnonzero(t.raw != self._rest)] for t in (a, b)]
        return not any(frozenset((x, y)) in self._against for x in on[0] for y in on[1])


def weight_of(kind: str, *drivers: Doubles) -> Doubles:
    """The weight of a combination. Args: kind: of weight; drivers: weights from 0 to 1."""
    return _WEIGHTS[kind](*drivers)


def chosen(found: Sequence[Combination], within_mm: float, most: int) -> list[Combination]:
    """Those that leave more than allowed, the largest first.

    Args:
        found: of Sums.errors.
        within_mm: what a sum may deviate.
        most: so many at most.
    """
    return [one for one in found if one.error_mm > within_mm][:most]


def driver_table(file: str, made: Sequence[Combination]) -> dict[str, object]:
    """The JSON that combinations.js reads.

    Args:
        file: the name of the .glb.
        made: combinations whose targets the file has.
    """
    rows = [{"target": one.name, "of": list(one.of), "weight": one.weight} for one in made]
    return {"format": "risorius.combinations", "version": 1, "file": file, "combinations": rows}
