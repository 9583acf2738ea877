# SPDX-License-Identifier: MIT
"""Searches for faults of combined expressions, and makes correctives that repair them.

A fault is a state that none of the expressions has alone: skin inside teeth, eyes or itself, faces
with more than 2.5 times their area, or folded faces. A repair changes only the skin near a fault:
there it fades out the parts of the pose that contribute little to the pose near the fault
(native/author/correct.h).
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
_BLOCK = 64  # number of combinations between two reports of progress
_ENOUGH = 3000  # smallest number of vertices of a skin that shows faults
_MOVED_MM = 0.1  # vertices that move less count as resting
_SHARED = 4  # a pair is checked if both expressions move at least this many common vertices
# _VOLUME mm3 of intersection are as bad as _FACES stretched or folded faces: both have severity 1.
# _LEAST is the largest severity that is ignored.
_VOLUME, _FACES, _LEAST = 100.0, 5.0, 0.1
KINDS = ("volume", "stretched", "folded")
_ALIKE = np.array([_VOLUME, _FACES, _FACES])  # equally bad sums, by kind
_PACES = np.geomspace(4.0, 0.1, 40)  # step sizes of the weights of kinds, one for each round


@dataclass(frozen=True)
class CorrectiveOptions:
    """Options of the search for correctives."""

    most: int = 500  # largest number of correctives of pairs and triples
    solids: tuple[str, ...] = SOLIDS  # parts of the names of meshes that the skin must not enter
    triples: int = 200  # number of combinations of three that are checked
    # Number of further pairs that are repaired in the finished face of joints; None: 3/8 of `most`.
    again: int | None = None
    together: tuple[tuple[str, ...], ...] = ()  # larger combinations, by names of controls
    apart: tuple[tuple[str, str], ...] = ()  # pairs of opposites, which are not combined

    @property
    def once_more(self) -> int:
        return 3 * self.most // 8 if self.again is None else self.again


@dataclass
class Corrective:
    """A combination of controls, its faults, and the displacements that repair it with all controls
    at 1."""

    controls: Controls
    displacement: Doubles  # [V, 3] displacements of the posed skin, in the file's unit
    shape: Doubles  # [V, 3] displacements before skinning
    before: FaultSums  # faults without the corrective
    after: FaultSums  # faults with the corrective


@dataclass
class Found:
    """All correctives, and the faults of the checked combinations."""

    skin: int  # index of the mesh
    correctives: list[Corrective] = field(default_factory=list)
    looked_at: int = 0  # number of checked pairs
    faulty: int = 0  # number of pairs with faults
    # kind of fault ("volume", "stretched" or "folded") -> sum of these faults over all checked
    # pairs, without correctives
    before: dict[str, float] = field(default_factory=dict)
    # kind of fault -> sum of these faults over all checked pairs, with the correctives of pairs
    after: dict[str, float] = field(default_factory=dict)


class Search:
    """Checks combinations for faults, and repairs the worst ones."""

    def __init__(
        self,
        dna: Dna,
        options: CorrectiveOptions,
        progress: Progress | None,
        sculpted: Collection[frozenset[int]] | None = None,
    ) -> None:
        """Prepare a face, and check its single controls.

        Args:
            dna: the face.
            options: options of the search.
            progress: gets the finished fraction; returns False to stop.
            sculpted: combinations with hand-made correctives, which are not changed; None: all
                combinations with correctives.
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
        """The faults that a combination may have, because the neutral pose, one of its controls or,
        for three or more controls, a pair of them has these faults."""
        parts: list[Controls] = [(), *((c,) for c in on)]
        if len(on) > 2:
            parts += itertools.combinations(on, 2)
        for part in parts:
            if part not in self._faults:
                self._faults[part] = self.faults(part)
        return worst(self._faults[part] for part in parts)

    def pairs(self) -> list[Controls]:
        """Pairs of controls that move common vertices, and are neither opposites nor sculpted."""
        apart = {frozenset(pair) for pair in self.options.apart}
        return [
            (a, b)
            for a, b in itertools.combinations(range(self.poser.controls), 2)
            if frozenset((self.names[a], self.names[b])) not in apart
            and frozenset((a, b)) not in self.sculpted
            and np.count_nonzero(self._moves[a] & self._moves[b]) >= _SHARED
        ]

    def sums(self, combinations: Sequence[Controls], share: tuple[float, float]) -> list[FaultSums]:
        """The faults of each combination that none of its controls and pairs of controls has.

        Args:
            combinations: the combinations.
            share: begin and end of this step as fractions of the whole work.
        """

        def look(on: Controls) -> FaultSums:
            return self.checker.sum(self.faults(on), self.allowed(on))

        return self._all(look, combinations, share)

    def repair(self, combinations: Sequence[Controls], share: tuple[float, float]) -> None:
        """Make correctives for combinations. Poses include the correctives of earlier calls. A
        corrective that moves no vertex by more than 0.1 mm is not kept.

        Args:
            combinations: the combinations.
            share: begin and end of this step as fractions of the whole work.
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
    """The coarsest LOD whose skin has blend shapes and at least _ENOUGH (3000) vertices; 0 if there
    is none."""

    def fine(lod: int) -> bool:
        skin = dna.meshes[skin_and_solids(dna, (), lod)[0]]
        return len(skin.positions) >= _ENOUGH and len(skin.blend_shape_targets) > 0

    return max(filter(fine, range(max(1, dna.lod_count))), default=0)


def severity(sums: FaultSums) -> float:
    """A single number for the visibility of faults: 1 for 100 mm3 of intersection, or for five
    stretched or folded faces."""
    return sums.volume / _VOLUME + (sums.stretched + sums.folded) / _FACES


def find_correctives(
    dna: Dna, options: CorrectiveOptions | None = None, progress: Progress | None = None
) -> Found:
    """Find correctives for the worst pairs and triples of controls, and for the combinations in
    options.together.

    Args:
        dna: a face of shapes; it is not changed.
        options: options of the search.
        progress: gets the finished fraction, 0 to 1; returns False to stop.

    Raises:
        ArgumentError: the face has no mesh, or a named control does not exist.
        DnaError: a value is not finite, or progress returned False.
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
    # Pairs are repaired only as much as necessary, so triples may still have small faults.
    search.repair(_worst_of(wrong, rest, 0.0), (0.8, 0.9))
    for on in sorted(together, key=len):
        search.repair([on], (0.9, 1.0))
    out.correctives = list(search.found.values())
    return out


def correct_again(
    rig: Dna, source: Dna, options: CorrectiveOptions, progress: Progress | None = None
) -> Dna:
    """Check the pairs of controls of a finished rig again, and repair them by blend shapes. Returns
    the new face.

    A rig's small errors matter where lips or lids touch. And rotations of joints do not add up like
    the shapes that were checked first. Existing correctives of pairs are extended; other pairs get
    new ones.

    Args:
        rig: the rig of joints and shapes; it is not changed.
        source: the face before correctives were searched; its correctives are not changed.
        options: options of the search. At most options.once_more pairs get new correctives.
        progress: gets the finished fraction, 0 to 1; returns False to stop.

    Raises:
        ArgumentError: the face has no mesh, or has networks or solvers.
        DnaError: a value is not finite, or progress returned False.
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
    """float64[n, 3]: the sums of faults, one row for each of the n sums. The columns are the volume
    of intersections in mm3, the number of stretched faces, and the number of folded faces."""
    return np.array([[getattr(s, kind) for kind in KINDS] for s in sums], np.float64)


def fairest_of(sums: dict[Controls, FaultSums], most: int) -> list[Controls]:
    """Choose the combinations to repair, so that all kinds of faults decrease similarly.

    A single measure would neglect a kind of fault, because the pairs with large volumes differ from
    the pairs with many folds. For each kind, the chosen combinations contain a fraction of all
    faults of this kind. The smallest of the three fractions is maximised by weights of the kinds
    (Arora, Hazan and Kale, "The Multiplicative Weights Update Method", 2012), which start with the
    weights of severity().

    Args:
        sums: combination -> its faults.
        most: largest number of combinations.

    Returns:
        The chosen combinations; each has a severity above _LEAST (0.1).
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
    """The worst triples of controls that move common vertices and contain two repaired pairs.

    Args:
        search: the search; it has correctives of pairs.
        pairs: pair -> its faults.
        most: largest number of triples.
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
