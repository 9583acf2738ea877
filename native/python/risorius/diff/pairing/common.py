# SPDX-License-Identifier: MIT
"""Comparisons shared by several layers. Each reports its differences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

import risorius

from ...base.words import counted
from .amounts import Floats
from .comparison import Comparison
from .pairs import Ints, Pairs, pair
from .spaces import Space


class Place:
    """The place of differences: a layer, a field, and a prefix of each reported text."""

    def __init__(self, faces: Comparison, layer: str, field: str = "", what: str = ""):
        self.faces, self.layer, self.field, self.what = faces, layer, field, what

    def at(self, name: str, what: str = "") -> Place:
        """The place of a field inside this place.

        Args:
            name: name of the field, appended after a dot; "" for the same field.
            what: prefix of each text that is reported at the new place; it follows the prefix of
                this place.
        """
        field = ".".join(part for part in (self.field, name) if part)
        return Place(self.faces, self.layer, field, ", ".join(w for w in (self.what, what) if w))

    def say(self, text: str) -> None:
        words = f"{self.what}: {text}" if self.what else text
        self.faces.report.add(self.layer, self.field, words)


def value(place: Place, a: Any, b: Any) -> None:
    """Report a value (a text, an integer or a tuple) if it differs.

    Args:
        place: where the difference is reported.
        a, b: the value in each face.
    """
    if a != b:
        place.say(f"{_shown(a)} -> {_shown(b)}")


def choice(place: Place, words: Sequence[str], a: int, b: int) -> None:
    """Report a number that stands for a word, if it differs.

    Args:
        place: where the difference is reported.
        words: the word of each number; a larger number is called unknown.
        a, b: the number in each face, from 0.
    """
    if a != b:
        place.say(" -> ".join(words[n] if n < len(words) else f"unknown value {n}" for n in (a, b)))


def _shown(x: Any) -> str:
    if isinstance(x, str):
        return repr(x)
    if isinstance(x, tuple):
        return " ".join(map(str, x))
    return f"{x:,}" if isinstance(x, int) else str(x)


def real(place: Place, a: float, b: float) -> None:
    """Report a float if it differs.

    Args:
        place: where the difference is reported.
        a, b: the number in each face; compared as float32.
    """
    x, y = np.array([a], np.float32), np.array([b], np.float32)
    if place.faces.changed(x, y).any():
        place.say(f"{x[0]!s} -> {y[0]!s}")


def reals(place: Place, noun: str, a: Floats, b: Floats, kind: str = "number") -> None:
    """Report differences of two lists of floats, compared by index, or of their lengths.

    Args:
        place: where the difference is reported.
        noun: noun for a number, e.g. "weight".
        a, b: float32[n] and float32[m], the numbers of each face.
        kind: "length", "angle" or "number", for the unit of the amount.
    """
    if len(a) != len(b):
        place.say(f"{counted(len(a), noun)} -> {len(b):,}")
        return
    changed = place.faces.changed(a, b)
    if changed.any():
        amount = place.faces.by(a[changed], b[changed], kind)
        place.say(f"{np.count_nonzero(changed):,} of {counted(len(a), noun)} changed {amount}")


def order(place: Place, pairs: Pairs, noun: str) -> None:
    """Report a different order of matched elements.

    Args:
        place: where the difference is reported.
        pairs: matched elements of A and B.
        noun: noun for the elements, in the plural.
    """
    if pairs.reordered:
        place.say(f"the {noun} stand in another order")


def members(place: Place, space: Space, a: npt.ArrayLike, b: npt.ArrayLike) -> None:
    """Report the difference of two lists of indices.

    Args:
        place: where the difference is reported.
        space: the elements to which the indices refer.
        a, b: int[n] and int[m], indices into the elements of A and of B.
    """
    x, y = space.in_a(a), space.in_b(b)
    text = more_and_less(place, pair(x, y), space, x, y)
    if text:
        place.say(text)


def more_and_less(place: Place, pairs: Pairs, space: Space, a: Any, b: Any) -> str:
    """The difference of two lists in words, e.g. "3 joints more: x, y, z"; "" if they are equal.

    Args:
        place: place whose report shortens lists of names.
        pairs: matched positions in the lists `a` and `b`.
        space: the elements with their common numbers.
        a, b: int64[n] and int64[m], the lists, as common numbers of the elements.
    """
    listed = place.faces.report.listed
    parts = []
    for word, left, numbers in (("more", pairs.only_b, b), ("fewer", pairs.only_a, a)):
        if len(left):
            names = listed(space.labels(numbers[left]))
            parts.append(f"{counted(len(left), space.noun)} {word}: {names}")
    if pairs.reordered:
        parts.append(f"the {space.plural} in another order")
    return "; ".join(parts)


def rows_per_lod(place: Place, a: npt.NDArray[Any], b: npt.NDArray[Any]) -> None:
    """Report the number of leading rows that each LOD uses, if it differs.

    Args:
        place: where the difference is reported.
        a, b: int[LODs of A], int[LODs of B].
    """
    if not np.array_equal(a, b):
        rows = [" ".join(map(str, x.tolist())) or "none" for x in (a, b)]
        place.say(f"rows per LOD {rows[0]} -> {rows[1]}")


def lod_mapping(place: Place, space: Space, a: risorius.LodMapping, b: risorius.LodMapping) -> None:
    """Report the elements that each LOD lists, if they differ.

    Also reports equal lists that the two files store, or share between LODs, in different ways.

    Args:
        place: where the difference is reported.
        space: the listed elements.
        a, b: the LOD lists of each face.
    """
    found = len(place.faces.report.differences)
    for lod in range(max(len(a), len(b))):
        lists = [_list(mapping, lod) for mapping in (a, b)]
        if lists[0] is None or lists[1] is None:
            if lists[0] is not lists[1]:
                place.say(
                    f"LOD {lod} lists {space.plural} only in {'B' if lists[0] is None else 'A'}"
                )
            continue
        x, y = space.in_a(lists[0]), space.in_b(lists[1])
        text = more_and_less(place, pair(x, y), space, x, y)
        if text:
            place.say(f"LOD {lod} lists {text}")
    if found == len(place.faces.report.differences) and not _same_storage(space, a, b):
        place.say(f"the LODs' lists of {space.plural} are stored or shared in another way")


def _list(mapping: risorius.LodMapping, lod: int) -> npt.NDArray[Any] | None:
    try:
        return mapping[lod]
    except IndexError:
        return None


def _same_storage(space: Space, a: risorius.LodMapping, b: risorius.LodMapping) -> bool:
    rows_a, rows_b = a.rows, b.rows
    return (
        np.array_equal(a.lods, b.lods)
        and len(rows_a) == len(rows_b)
        and all(
            np.array_equal(space.in_a(x), space.in_b(y))
            for x, y in zip(rows_a, rows_b, strict=True)
        )
    )


def only_in(place: Place, space: Space, pairs: Pairs) -> None:
    """Report elements that only one face has.

    Args:
        place: where the difference is reported.
        space: the elements of both faces.
        pairs: matched elements of A and B.
    """
    for side, left, numbers in (("A", pairs.only_a, space.a), ("B", pairs.only_b, space.b)):
        if len(left):
            names = place.faces.report.listed(space.labels(numbers[left]))
            place.say(f"{counted(len(left), space.noun)} only in {side}: {names}")


def cut(values: Floats, rows: Ints, columns: Ints) -> Floats:
    """The selected rows and columns of a matrix; the matrix itself if all are selected.

    Args:
        values: float32[n, m].
        rows: int64, selected rows in order.
        columns: int64, selected columns in order.
    """
    if values.shape == (len(rows), len(columns)) and _all(rows) and _all(columns):
        return values
    return values[np.ix_(rows, columns)]


def _all(indices: Ints) -> bool:
    return bool(np.array_equal(indices, np.arange(len(indices))))
