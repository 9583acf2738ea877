# SPDX-License-Identifier: MIT
"""Matches the elements of two lists."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Pairs:
    """Matched and unmatched positions of two lists A and B.

    Attributes:
        a: int64[pairs], ascending positions of matched elements in A.
        b: int64[pairs], positions of the same elements in B.
        only_a: int64, ascending positions of elements of A without a match.
        only_b: int64, ascending positions of elements of B without a match.
    """

    a: Ints
    b: Ints
    only_a: Ints
    only_b: Ints

    @property
    def whole(self) -> bool:
        """Whether every element has a match."""
        return len(self.only_a) == len(self.only_b) == 0

    @property
    def reordered(self) -> bool:
        """Whether matched elements have another order in B; an insertion alone does not count."""
        return bool(np.any(np.diff(self.b) < 0))

    @property
    def identical(self) -> bool:
        """Whether both lists have the same elements in the same order."""
        return self.whole and not self.reordered


def integers(values: npt.ArrayLike) -> Ints:
    return np.asarray(values, np.int64).reshape(-1)


def pair(a: Ints, b: Ints) -> Pairs:
    """Match equal numbers; of repeated numbers, the first in A matches the first in B, and so on.

    Args:
        a, b: int64[n] and int64[m].
    """
    none = np.zeros(0, np.int64)
    if len(a) == len(b) and np.array_equal(a, b):
        same = np.arange(len(a))
        return Pairs(same, same, none, none)
    keys, repeats = together((a, b)), np.concatenate([occurrence(a), occurrence(b)])
    keys = keys * (int(np.max(repeats, initial=0)) + 1) + repeats
    _, at_a, at_b = np.intersect1d(
        keys[: len(a)], keys[len(a) :], assume_unique=True, return_indices=True
    )
    order = np.argsort(at_a)
    at_a, at_b = at_a[order].astype(np.int64), at_b[order].astype(np.int64)
    return Pairs(at_a, at_b, _rest(at_a, len(a)), _rest(at_b, len(b)))


def _rest(taken: Ints, count: int) -> Ints:
    left = np.ones(count, np.bool_)
    left[taken] = False
    return np.flatnonzero(left)


def occurrence(keys: Ints) -> Ints:
    """int64[n]: for each element of `keys`, how many earlier elements are equal to it."""
    order = np.argsort(keys, kind="stable")
    run = keys[order]
    first = np.ones(len(keys), np.bool_)
    first[1:] = run[1:] != run[:-1]
    starts = np.maximum.accumulate(np.where(first, np.arange(len(keys)), 0))
    out = np.empty(len(keys), np.int64)
    out[order] = np.arange(len(keys)) - starts
    return out


def together(parts: Sequence[Ints]) -> Ints:
    """Join the lists and replace each integer by a small number from 0; equal ones stay equal."""
    _, small = np.unique(np.concatenate(parts), return_inverse=True)
    return small.reshape(-1).astype(np.int64)


def pair_rows(a: Sequence[Ints], b: Sequence[Ints]) -> Pairs:
    """Match equal rows of two tables of integers, as `pair` matches single numbers.

    Args:
        a, b: the columns of each table: int64[n] each in `a`, int64[m] each in `b`; both tables
            have the same number of columns.
    """
    if all(len(x) == len(y) and np.array_equal(x, y) for x, y in zip(a, b, strict=True)):
        return pair(np.arange(len(a[0])), np.arange(len(b[0])))
    keys = np.zeros(len(a[0]) + len(b[0]), np.int64)
    for x, y in zip(a, b, strict=True):
        small = together((x, y))
        keys = together((keys * (int(np.max(small, initial=0)) + 1) + small,))
    return pair(keys[: len(a[0])], keys[len(a[0]) :])


def pair_names(a: Sequence[str], b: Sequence[str]) -> Pairs:
    """Match equal texts of the lists `a` and `b`, like `pair` for numbers."""
    number: dict[str, int] = {}
    numbered = [integers([number.setdefault(name, len(number)) for name in x]) for x in (a, b)]
    return pair(*numbered)


def with_renamed(pairs: Pairs, extra_a: Ints, extra_b: Ints) -> Pairs:
    """Add matches to the pairs.

    Args:
        pairs: known matches.
        extra_a, extra_b: int64[n], unmatched positions; extra_a[i] matches extra_b[i].
    """
    a, b = np.concatenate([pairs.a, extra_a]), np.concatenate([pairs.b, extra_b])
    order = np.argsort(a)
    return Pairs(
        a[order], b[order], np.setdiff1d(pairs.only_a, extra_a), np.setdiff1d(pairs.only_b, extra_b)
    )


def pair_in_place(pairs: Pairs, count_a: int, count_b: int) -> Pairs:
    """Add matches of unmatched elements at the same position in both lists.

    Args:
        pairs: known matches.
        count_a, count_b: lengths of the lists; nothing is added if they differ.
    """
    if count_a != count_b:
        return pairs
    both = np.intersect1d(pairs.only_a, pairs.only_b)
    return with_renamed(pairs, both, both)


def pair_sets(a: Sequence[Ints], b: Sequence[Ints]) -> Pairs:
    """Match sets of integers: first equal sets, then sets that share most integers, last by index.

    Args:
        a, b: int64[...] per set, the integers of the set.
    """
    exact = pair_names([_name(keys) for keys in a], [_name(keys) for keys in b])
    votes = _votes(a, b, exact)
    found_a: list[int] = []
    found_b: list[int] = []
    for _, i, j in sorted(votes, key=lambda vote: (-vote[0], vote[1], vote[2])):
        if i not in found_a and j not in found_b:
            found_a.append(i)
            found_b.append(j)
    paired = with_renamed(exact, integers(found_a), integers(found_b))
    both = np.intersect1d(paired.only_a, paired.only_b)
    return with_renamed(paired, both, both)


def _name(keys: Ints) -> str:
    return np.sort(keys).tobytes().hex()


def _votes(a: Sequence[Ints], b: Sequence[Ints], exact: Pairs) -> list[tuple[int, int, int]]:
    owner: dict[int, list[int]] = {}
    for j in exact.only_b.tolist():
        for key in np.unique(b[j]).tolist():
            owner.setdefault(key, []).append(j)
    votes: list[tuple[int, int, int]] = []
    for i in exact.only_a.tolist():
        count: dict[int, int] = {}
        for key in np.unique(a[i]).tolist():
            for j in owner.get(key, ()):
                count[j] = count.get(j, 0) + 1
        votes += [(n, i, j) for j, n in count.items()]
    return votes
