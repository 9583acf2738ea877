# SPDX-License-Identifier: MIT
"""Common numbers for the elements of two rigs, equal for matched elements."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ...base.words import plural
from .pairs import Ints, Pairs, integers

_OUTSIDE = 1 << 40  # numbers from here on stand for indices beyond the end of a list


class Space:
    """The elements of lists A and B with common numbers.

    Attributes:
        noun: noun for an element, e.g. "joint".
        plural: plural of the noun.
        names: names by common number; A's names, then B's.
        a: int64[elements of A], the common number of each element.
        b: int64[elements of B], the common number of each element.
        pairs: the matched elements.
    """

    def __init__(self, noun: str, names_a: Sequence[str], names_b: Sequence[str], pairs: Pairs):
        self.noun, self.plural = noun, plural(noun)
        self.pairs = pairs
        self.names = [*names_a, *names_b]
        self.a = np.arange(len(names_a))
        self.b = len(names_a) + np.arange(len(names_b))
        self.b[pairs.b] = pairs.a

    def in_a(self, indices: npt.ArrayLike) -> Ints:
        """The common numbers of elements of A, by their indices in A. An index beyond the end of A
        gets a number that no element has; in_b() gives the same number for this index."""
        return _look_up(self.a, integers(indices))

    def in_b(self, indices: npt.ArrayLike) -> Ints:
        """The common numbers of elements of B, by their indices in B. An index beyond the end of B
        gets a number that no element has; in_a() gives the same number for this index."""
        return _look_up(self.b, integers(indices))

    def label(self, number: int) -> str:
        """The name of an element for display, or its noun and index."""
        if number >= _OUTSIDE:
            return f"{self.noun} {number - _OUTSIDE}"
        place = number if number < len(self.a) else number - len(self.a)
        return self.names[number] or f"{self.noun} {place}"

    def labels(self, numbers: Ints) -> list[str]:
        return [self.label(number) for number in numbers.tolist()]


def _look_up(numbers: Ints, indices: Ints) -> Ints:
    inside = indices < len(numbers)
    if inside.all():
        return numbers[indices]
    out = indices + _OUTSIDE
    out[inside] = numbers[indices[inside]]
    return out


def chain(noun: str, parts: Sequence[Space]) -> Space:
    """Join several spaces into one.

    The space of all controls is joined from raw controls, correctives, outputs of networks and RBF
    poses.

    Args:
        noun: noun for an element of the joined space.
        parts: the spaces, in the order in which they are joined.
    """
    first_a = np.cumsum([0] + [len(part.a) for part in parts])
    first_b = np.cumsum([0] + [len(part.b) for part in parts])
    pairs = Pairs(
        *(
            np.concatenate(
                [
                    getattr(part.pairs, name) + first[i]
                    for i, part in enumerate(parts)
                    for first in [first_a if name.endswith("a") else first_b]
                ]
            )
            for name in ("a", "b", "only_a", "only_b")
        )
    )
    names_a = [part.label(n) for part in parts for n in part.a.tolist()]
    names_b = [part.label(n) for part in parts for n in part.b.tolist()]
    return Space(noun, names_a, names_b, pairs)
