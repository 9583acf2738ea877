# SPDX-License-Identifier: MIT
"""Comparisons that several layers need. Each reports what differs and returns nothing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

import risorius

from .amounts import Floats
from .comparison import Comparison
from .pairs import Ints, Pairs, pair
from .report import counted
from .spaces import Space


class Place:
    """Where differences are reported: a layer, a field and the words before each text."""

    def __init__(self, c: Comparison, layer: str, field: str = "", what: str = ""):
        self.c, self.layer, self.field, self.what = c, layer, field, what

    def at(self, name: str, what: str = "") -> Place:
        """A field inside this one."""
        field = ".".join(part for part in (self.field, name) if part)
        return Place(self.c, self.layer, field, ", ".join(w for w in (self.what, what) if w))

    def say(self, text: str) -> None:
        words = f"{self.what}: {text}" if self.what else text
        self.c.report.add(self.layer, self.field, words)


def value(place: Place, a: Any, b: Any) -> None:
    """One value, e.g. a text, a number or a choice."""
    if a != b:
        place.say(f"{_shown(a)} -> {_shown(b)}")


def choice(place: Place, words: Sequence[str], a: int, b: int) -> None:
    """A number that stands for a word."""
    if a != b:
        place.say(" -> ".join(words[n] if n < len(words) else f"unknown value {n}" for n in (a, b)))


def _shown(x: Any) -> str:
    if isinstance(x, str):
        return repr(x)
    if isinstance(x, tuple):
        return " ".join(map(str, x))
    return f"{x:,}" if isinstance(x, int) else str(x)


def real(place: Place, a: float, b: float) -> None:
    """One float."""
    x, y = np.array([a], np.float32), np.array([b], np.float32)
    if place.c.changed(x, y).any():
        place.say(f"{x[0]!s} -> {y[0]!s}")


def reals(place: Place, noun: str, a: Floats, b: Floats, kind: str = "number") -> None:
    """Floats that are known by their place."""
    if len(a) != len(b):
        place.say(f"{counted(len(a), noun)} -> {len(b):,}")
        return
    changed = place.c.changed(a, b)
    if changed.any():
        amount = place.c.by(a[changed], b[changed], kind)
        place.say(f"{np.count_nonzero(changed):,} of {counted(len(a), noun)} changed {amount}")


def order(place: Place, pairs: Pairs, noun: str) -> None:
    """Whether partners stand in another order."""
    if pairs.reordered:
        place.say(f"the {noun} stand in another order")


def members(place: Place, space: Space, a: npt.ArrayLike, b: npt.ArrayLike) -> None:
    """A list of indices into a space."""
    x, y = space.in_a(a), space.in_b(b)
    text = more_and_less(place, pair(x, y), space, x, y)
    if text:
        place.say(text)


def more_and_less(place: Place, pairs: Pairs, space: Space, a: Any, b: Any) -> str:
    """E.g. "3 joints more: x, y, z"; "" for equal lists."""
    listed = place.c.report.listed
    parts = []
    for word, left, numbers in (("more", pairs.only_b, b), ("fewer", pairs.only_a, a)):
        if len(left):
            names = listed(space.labels(numbers[left]))
            parts.append(f"{counted(len(left), space.noun)} {word}: {names}")
    if pairs.reordered:
        parts.append(f"the {space.plural} in another order")
    return "; ".join(parts)


def rows_per_lod(place: Place, a: npt.NDArray[Any], b: npt.NDArray[Any]) -> None:
    """How many leading rows each LOD uses."""
    if not np.array_equal(a, b):
        rows = [" ".join(map(str, x.tolist())) or "none" for x in (a, b)]
        place.say(f"rows per LOD {rows[0]} -> {rows[1]}")


def lod_mapping(place: Place, space: Space, a: risorius.LodMapping, b: risorius.LodMapping) -> None:
    """Which elements each LOD lists."""
    found = len(place.c.report.differences)
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
    if found == len(place.c.report.differences) and not _same_storage(space, a, b):
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
    """Elements that one rig has and the other has not."""
    for side, left, numbers in (("A", pairs.only_a, space.a), ("B", pairs.only_b, space.b)):
        if len(left):
            names = place.c.report.listed(space.labels(numbers[left]))
            place.say(f"{counted(len(left), space.noun)} only in {side}: {names}")


def cut(values: Floats, rows: Ints, columns: Ints) -> Floats:
    """Some rows and columns of a matrix."""
    if values.shape == (len(rows), len(columns)) and _all(rows) and _all(columns):
        return values
    return values[np.ix_(rows, columns)]


def _all(indices: Ints) -> bool:
    return bool(np.array_equal(indices, np.arange(len(indices))))
