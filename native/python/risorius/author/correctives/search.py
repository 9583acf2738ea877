# SPDX-License-Identifier: MIT
"""Correctives that are found by themselves: where expressions together go wrong, what repairs it.

What goes wrong is what none of the expressions does alone: skin inside of teeth, eyes or itself,
faces of more than 2.5 times their area, faces that lie on one another. What repairs it undoes, near
the fault alone, what does little there (native/author/correct.h).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from ... import Dna, DnaError
from ..._native import FaultSums, SkinFaults
from ...base.errors import ArgumentError
from ..fitting import Progress
from ..geometry.skeleton import Doubles, psd_parts
from ..work import MM
from .adding import add_correctives
from .poser import SOLIDS, Controls, Poser, make_checker, skin_and_solids, worst

T = TypeVar("T")
_THREADS = 2
_BLOCK = 64  # combinations between two reports of progress
_ENOUGH = 3000  # vertices of a skin that shows what goes wrong
_MOVED_MM = 0.1  # what less moves is at rest
_SHARED = 4  # vertices that two expressions both move, at least, to be looked at together
# Sums of faults that count alike, and what is left alone.
_VOLUME, _FACES, _LEAST = 100.0, 5.0, 0.1
KINDS = ("volume", "stretched", "folded")
_ALIKE = np.array([_VOLUME, _FACES, _FACES])  # of each kind
_PACES = np.geomspace(4.0, 0.1, 40)  # how fast weights of kinds change, from round to round


@dataclass(frozen=True)
class CorrectiveOptions:
    """Which correctives are made."""

    most: int = 500
    solids: tuple[str, ...] = SOLIDS  # parts of the names of meshes that the skin is kept out of
    triples: int = 200  # combinations of three that are looked at
    # More pairs that are mended in the finished face of joints; None: a share of most.
    again: int | None = None
    together: tuple[tuple[str, ...], ...] = ()  # larger ones, by names of controls
    apart: tuple[tuple[str, str], ...] = ()  # opposites: never at the same time

    @property
    def once_more(self) -> int:
        return 3 * self.most // 8 if self.again is None else self.again


@dataclass
class Corrective:
    """A combination, and what is added to the skin where all its controls are 1."""

    controls: Controls
    displacement: Doubles  # [V, 3] of the posed skin, in the file's unit
    shape: Doubles  # [V, 3] the same before the joints
    before: FaultSums
    after: FaultSums


@dataclass
class Found:
    """All correctives, and what is wrong in all combinations that were looked at."""

    skin: int  # the mesh
    correctives: list[Corrective] = field(default_factory=list)
    looked_at: int = 0
    faulty: int = 0
    before: dict[str, float] = field(default_factory=dict)  # sums over pairs, by kind
    after: dict[str, float] = field(default_factory=dict)


class Search:
    """Looks at combinations, and repairs those that are worst."""

    def __init__(
        self,
        dna: Dna,
        options: CorrectiveOptions,
        progress: Progress | None,
        sculpted: Collection[frozenset[int]] | None = None,
    ) -> None:
        """Args:
        dna: the face.
        options: which.
        progress: told the share that is done.
        sculpted: combinations that look as somebody wanted them, None: all that have a corrective.
        """
        self.options, self.progress = options, progress
        given = psd_parts(dna).values() if sculpted is None else sculpted
        self.sculpted = frozenset(given)
        self.skin, self.solids = skin_and_solids(dna, options.solids, _level(dna))
        self.checker = make_checker(dna, self.skin, self.solids)
        self.poser = Poser(dna, self.skin, self.solids)
        self.names = [name.rpartition(".")[2] for name in dna.raw_control_names]
        self.found: dict[Controls, Corrective] = {}
        self.mm = MM.get(dna.translation_unit, 10.0)
        neutral = self.poser.neutral
        self._faults: dict[Controls, SkinFaults] = {(): self._look(neutral)}
        self._moves: list[npt.NDArray[np.bool_]] = []
        for control in range(self.poser.controls):
            pose = self.poser.pose((control,))
            self._faults[(control,)] = self._look(pose)
            self._moves.append(np.linalg.norm(pose[0] - neutral[0], axis=1) * self.mm > _MOVED_MM)

    def _look(self, pose: list[Doubles]) -> SkinFaults:
        return self.checker.look(pose[0], pose[1:])

    def faults(self, on: Controls) -> SkinFaults:
        return self._look(self.poser.pose(on))

    def allowed(self, on: Controls) -> SkinFaults:
        """What single controls and, where there are more than two, their pairs have."""
        parts: list[Controls] = [(), *((c,) for c in on)]
        if len(on) > 2:
            parts += itertools.combinations(on, 2)
        for part in parts:
            if part not in self._faults:
                self._faults[part] = self.faults(part)
        return worst(self._faults[part] for part in parts)

    def pairs(self) -> list[Controls]:
        """All that move some vertices together, are no opposites and not sculpted."""
        apart = {frozenset(pair) for pair in self.options.apart}
        return [
            (a, b)
            for a, b in itertools.combinations(range(self.poser.controls), 2)
            if frozenset((self.names[a], self.names[b])) not in apart
            and frozenset((a, b)) not in self.sculpted
            and np.count_nonzero(self._moves[a] & self._moves[b]) >= _SHARED
        ]

    def sums(self, combinations: Sequence[Controls], share: tuple[float, float]) -> list[FaultSums]:
        """Of each what none of its parts has.

        Args:
            combinations: which.
            share: of the whole work, where this begins and ends.
        """

        def look(on: Controls) -> FaultSums:
            return self.checker.sum(self.faults(on), self.allowed(on))

        return self._all(look, combinations, share)

    def repair(self, combinations: Sequence[Controls], share: tuple[float, float]) -> None:
        """Correctives of combinations, where some repair them; those before them are at work.

        Args:
            combinations: which.
            share: of the whole work, where this begins and ends.
        """

        def mend(on: Controls) -> Corrective:
            pose = self.poser.pose(on)
            without = [self.poser.pose(tuple(c for c in on if c != out))[0] for out in on]
            moved, before, after = self.checker.repair(pose[0], pose[1:], self.allowed(on), without)
            return Corrective(on, moved, self.poser.before_joints(on, moved), before, after)

        for one in self._all(mend, combinations, share):
            if np.linalg.norm(one.displacement, axis=1).max(initial=0) * self.mm > _MOVED_MM:
                self.found[one.controls] = one
        self.poser.added = {on: one.shape for on, one in self.found.items()}
        self._faults = {on: f for on, f in self._faults.items() if len(on) < 2}

    def _all(
        self, work: Callable[[Controls], T], rows: Sequence[Controls], share: tuple[float, float]
    ) -> list[T]:
        out: list[T] = []
        with ThreadPoolExecutor(_THREADS) as pool:
            for begin in range(0, len(rows), _BLOCK):
                out += pool.map(work, rows[begin : begin + _BLOCK])
                done = share[0] + (share[1] - share[0]) * len(out) / len(rows)
                if self.progress is not None and self.progress(done) is False:
                    raise DnaError("stopped")
        return out


def _level(dna: Dna) -> int:
    """The coarsest level whose skin has shapes and is fine enough to be looked at."""

    def fine(lod: int) -> bool:
        skin = dna.meshes[skin_and_solids(dna, (), lod)[0]]
        return len(skin.positions) >= _ENOUGH and len(skin.blend_shape_targets) > 0

    return max(filter(fine, range(max(1, dna.lod_count))), default=0)


def severity(sums: FaultSums) -> float:
    """How bad it looks, one number."""
    return sums.volume / _VOLUME + (sums.stretched + sums.folded) / _FACES


def find_correctives(
    dna: Dna, options: CorrectiveOptions | None = None, progress: Progress | None = None
) -> Found:
    """Correctives of the pairs that are worst, of triples of these, and of what the options name.

    Args:
        dna: a face of shapes; it stays as it is.
        options: which.
        progress: told the share that is done, 0 to 1; False stops.

    Raises:
        ArgumentError: no mesh, or a control that is not there.
        DnaError: a value that is not finite, or progress said False.
    """
    o = options or CorrectiveOptions()
    search = Search(dna, o, progress)
    together = [_named(search, names) for names in o.together]
    out = Found(search.skin)
    pairs = search.pairs()
    sums = dict(zip(pairs, search.sums(pairs, (0.0, 0.2)), strict=True))
    search.repair(fairest_of(sums, o.most), (0.2, 0.7))
    out.looked_at, out.faulty = len(pairs), sum(severity(s) > 0 for s in sums.values())
    ends = {on: search.found[on].after if on in search.found else s for on, s in sums.items()}
    for kind in KINDS:
        out.before[kind] = float(sum(getattr(s, kind) for s in sums.values()))
        out.after[kind] = float(sum(getattr(s, kind) for s in ends.values()))
    triples = triples_of(search, sums, o.triples)
    rest = max(0, o.most - len(search.found))
    wrong = dict(zip(triples, search.sums(triples, (0.7, 0.8)), strict=True))
    # Pairs undo no more than they have to, so that their sum may fall short by little.
    search.repair(_worst_of(wrong, rest, 0.0), (0.8, 0.9))
    for on in sorted(together, key=len):
        search.repair([on], (0.9, 1.0))
    out.correctives = list(search.found.values())
    return out


def correct_again(
    rig: Dna, source: Dna, options: CorrectiveOptions, progress: Progress | None = None
) -> Dna:
    """A finished face whose pairs have been looked at and mended once more, by shapes.

    What joints and shapes leave of each expression is small, but not where lips and lids lie on
    one another; and turns do not add up as the shapes did that were looked at first. A pair that
    has a corrective gets more of it, others one of their own.

    Args:
        rig: of joints and shapes; it stays as it is.
        source: the face without the correctives that were found: those it has stay as they are.
        options: which; beside pairs that have a corrective, once_more others at most.
        progress: told the share that is done, 0 to 1; False stops.

    Raises:
        DnaError: a value that is not finite, or progress said False.
    """
    search = Search(rig, options, progress, psd_parts(source).values())
    pairs = search.pairs()
    sums = dict(zip(pairs, search.sums(pairs, (0.0, 0.6)), strict=True))
    found = frozenset(psd_parts(rig).values()) - search.sculpted
    had = {on: s for on, s in sums.items() if frozenset(on) in found}
    new = {on: s for on, s in sums.items() if on not in had}
    wrong = [*_worst_of(had, len(had), 0.0), *fairest_of(new, options.once_more)]
    search.repair(wrong, (0.6, 1.0))
    rows = [(one.controls, one.shape) for one in search.found.values()]
    return add_correctives(rig, search.skin, rows)


def _named(search: Search, names: Sequence[str]) -> Controls:
    for name in names:
        if name not in search.names:
            raise ArgumentError(f"correctives: there is no control {name}")
    return tuple(sorted(search.names.index(name) for name in names))


def values_of(sums: Sequence[FaultSums]) -> Doubles:
    """float64[n, 3]: how much of each of KINDS is wrong."""
    return np.array([[getattr(s, kind) for kind in KINDS] for s in sums], np.float64)


def fairest_of(sums: dict[Controls, FaultSums], most: int) -> list[Controls]:
    """The combinations to repair, the worst first, so that each kind of fault falls alike.

    By one measure of all kinds one of them would be left behind: a pair with much volume is not
    the one with many folds. The least of the shares that they have of the three totals is to be
    as large as can be; weights of kinds are found for that (Arora, Hazan and Kale, "The
    Multiplicative Weights Update Method", 2012), beginning with those of the severity.

    Args:
        sums: what is wrong in each.
        most: at most so many.

    Returns:
        Combinations that are worse than what is left alone.
    """
    bad = _worst_of(sums, len(sums))
    if len(bad) <= most or most == 0:
        return bad[:most]
    values = values_of([sums[on] for on in bad])
    totals = values.sum(axis=0)
    kinds = totals > 0
    shares, weights = values[:, kinds] / totals[kinds], (totals / _ALIKE)[kinds]
    best, least = np.arange(most), -1.0
    for pace in _PACES:
        weights /= weights.sum()
        picked = np.argsort(-(shares @ weights), kind="stable")[:most]
        taken = shares[picked].sum(axis=0)
        if taken.min() > least:
            best, least = picked, float(taken.min())
        weights *= np.exp(-pace * (taken - taken.min()))
    return [bad[i] for i in best]


def _worst_of(sums: dict[Controls, FaultSums], most: int, least: float = _LEAST) -> list[Controls]:
    bad = [on for on, s in sums.items() if severity(s) > least]
    return sorted(bad, key=lambda on: (-severity(sums[on]), on))[:most]


def triples_of(search: Search, pairs: dict[Controls, FaultSums], most: int) -> list[Controls]:
    """Three controls that meet, of which two pairs at least are repaired: the worst of these.

    Args:
        search: has found correctives of pairs.
        pairs: what is wrong in each pair that meets.
        most: at most so many.
    """
    near: dict[int, set[int]] = {}
    for a, b in search.found:
        near.setdefault(a, set()).add(b)
        near.setdefault(b, set()).add(a)
    weights = {}
    for middle, around in near.items():
        for a, b in itertools.combinations(sorted(around), 2):
            on = tuple(sorted((middle, a, b)))
            parts = list(itertools.combinations(on, 2))
            if all(part in pairs for part in parts):
                weights[on] = sum(severity(pairs[part]) for part in parts)
    return sorted(weights, key=lambda on: (-weights[on], on))[:most]
