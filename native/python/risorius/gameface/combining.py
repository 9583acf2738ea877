# SPDX-License-Identifier: MIT
"""Finds where a sum of morph targets deviates from the rig, and makes targets that correct it."""

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
"""Formulas of a combination's weight from the weights a and b of its targets. PRODUCT: a b. HALF: 4
a (1 - a). For a target a on top of b, such as mouthClose on jawOpen: BELOW, 4 a (1 - b), 1 if both
are half on; SHARE, 4 a (b - a), largest if a is half of b."""
CUBIC, EARLY, LATE, MIDDLE = "cubic", "early", "late", "middle"
TRIPLE, SHUT = "triple", "shut"
"""More formulas, each 0 at the poses where the formulas above are exact: 32/3 a (1 - a) (1 - 2 a);
4 a (1 - a) b; 4 a b (1 - b); 16 a b (1 - a) (1 - b); a b c; and SHUT, for a target a on top of b:
(1 - b) c times the share of b that a takes back."""
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
_LEAST = 2e-6  # metres: shorter displacements are set to 0
_TRIED = 2000  # pairs of a group: of a larger number, about this many are tried, spread evenly


@dataclass(frozen=True)
class Combination:
    """A corrective morph target for two or three active targets, or for one target at half weight.

    The driver adds it to the linear sum of its targets.

    Attributes:
        name: name of its morph target.
        of: names of the targets that drive it.
        weight: name of the formula of its weight, such as "product" for the product of the
            weights of two targets.
        error_mm: largest deviation of the linear sum from the rig in mm, without this combination;
            0 if it was not measured, as for the combinations that Refiner adds.
    """

    name: str
    of: tuple[str, ...]
    weight: str
    error_mm: float


class Sums:
    """Compares linear sums of morph targets with the rig.

    Attributes:
        tried: group of targets -> (number of pairs of targets that were compared, number of pairs
            in the group).
    """

    def __init__(self, points: Points, rig: Rig, targets: Sequence[Target]) -> None:
        """Args: points: vertices of a LOD; rig: the face's rig; targets: targets of the file."""
        self._points = points
        self._names = rig.raw_control_names
        self._rest = np.asarray(rig.initial_raw_controls, np.float32)
        self._targets = {t.name: t for t in targets}
        self._deltas: dict[str, Floats] = {}
        self._against = {frozenset(pair) for pair in load_exclusives().opposites}
        self.tried: dict[str, tuple[int, int]] = {}

    def delta(self, name: str) -> Floats:
        """float32[P, 3]: the displacement of the vertices by a target, in metres."""
        if name not in self._deltas:
            target = self._targets[name]
            found = self._points.at(target.raw) - self._points.at(target.base)
            found[np.abs(found).max(axis=1) < _LEAST] = 0.0
            self._deltas[name] = found.astype(np.float32)
        return self._deltas[name]

    def combination(self, one: Combination) -> Floats:
        """float32[P, 3]: the displacement of a combination's morph target, in metres."""
        found = self._missing(one.weight, one.of)
        found[np.abs(found).max(axis=1) < _LEAST] = 0.0
        return found.astype(np.float32)

    def errors(self, group: str) -> list[Combination]:
        """Combinations for pairs of targets and for single targets, largest deviation first. Of
        more than _TRIED (2000) pairs, at most 2000 are tried, spread evenly.

        Args:
            group: name of the group of targets.
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
        """The largest deviation of a linear sum of targets from the rig in mm, at the target
        weights at which the combination's weight is largest.

        Args:
            of: names of the targets.
            kind: formula of the weight, such as PRODUCT."""
        missing = self._missing(kind, of)
        return 1000.0 * float(np.sqrt(np.square(missing).sum(axis=1).max(initial=0.0)))

    def _missing(self, kind: str, of: tuple[str, ...]) -> Doubles:
        """float64[P, 3]: rig minus linear sum in metres, at the combination's largest weight."""
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
        """float64[P, 3]: rig minus linear sum in metres, as _missing(), for a target such as
        mouthClose, which takes back a share of another target.

        Args:
            kind: formula of the weight.
            top: the target that acts on top of another.
            of: names of the targets that drive the combination.
        """
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
        """Whether a face can show both targets: not two opposites, such as looking left and right,
        and not a target together with the one that it acts on top of."""
        if a.name == b.needs or b.name == a.needs:
            return False
        on = [[self._names[i] for i in np.flatnonzero(t.raw != self._rest)] for t in (a, b)]
        return not any(frozenset((x, y)) in self._against for x in on[0] for y in on[1])


def weight_of(kind: str, *drivers: Doubles) -> Doubles:
    """The weight of a combination. Args: kind: its formula; drivers: target weights, 0 to 1."""
    return _WEIGHTS[kind](*drivers)


def chosen(found: Sequence[Combination], within_mm: float, most: int) -> list[Combination]:
    """The combinations with a larger deviation than allowed, largest first.

    Args:
        found: from Sums.errors, largest deviation first.
        within_mm: allowed deviation of a linear sum, in mm.
        most: largest number of combinations.
    """
    return [one for one in found if one.error_mm > within_mm][:most]


def driver_table(file: str, made: Sequence[Combination]) -> dict[str, object]:
    """The content of the JSON file that combinations.js reads.

    Args:
        file: file name of the .glb.
        made: combinations whose morph targets are in the .glb.
    """
    rows = [{"target": one.name, "of": list(one.of), "weight": one.weight} for one in made]
    return {"format": "risorius.combinations", "version": 1, "file": file, "combinations": rows}
