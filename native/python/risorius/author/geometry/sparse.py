# SPDX-License-Identifier: MIT
"""Stores displacements by expressions; an expression takes memory only for vertices it moves."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, MutableMapping
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from .blocks import LARGE
from .skeleton import Doubles

K = TypeVar("K")
L = TypeVar("L")
Numbers = npt.NDArray[Any]


class SparseShapes(MutableMapping[K, Doubles]):
    """Displacements float64[V, 3] by key; only the vertices that move are stored.

    Reading a key makes a new array. If there are more than LARGE (60,000) vertices, the
    displacements are stored as float32.

    Attributes:
        count: number of vertices.
    """

    def __init__(self, count: int, shapes: Mapping[K, Doubles] | None = None) -> None:
        """Hold displacements.

        Args:
            count: number of vertices.
            shapes: float64[count, 3] by key; None: none.
        """
        self.count = count
        self._dtype = np.float32 if count > LARGE else np.float64
        self._held: dict[K, tuple[npt.NDArray[np.int32], Numbers]] = {}
        if isinstance(shapes, SparseShapes):
            self._held.update(shapes._held)
        elif shapes is not None:
            self.update(shapes)

    def __getitem__(self, key: K) -> Doubles:
        vertices, values = self._held[key]
        out = np.zeros((self.count, 3))
        out[vertices] = values
        return out

    def __setitem__(self, key: K, value: Doubles) -> None:
        moved = np.flatnonzero(value.any(axis=1)).astype(np.int32)
        self._held[key] = moved, value[moved].astype(self._dtype)

    def __delitem__(self, key: K) -> None:
        del self._held[key]

    def __iter__(self) -> Iterator[K]:
        return iter(self._held)

    def __len__(self) -> int:
        return len(self._held)

    def __contains__(self, key: object) -> bool:
        return key in self._held

    def add(self, key: K, value: Doubles, first: int) -> None:
        """Add displacements of some vertices to a key that has no displacements of them yet.

        Args:
            key: the key; it may be new.
            value: float64[n, 3], displacements of the vertices `first` to `first + n - 1`.
            first: index of the first of these vertices.
        """
        none = np.zeros(0, np.int32), np.zeros((0, 3), self._dtype)
        vertices, values = self._held.get(key, none)
        moved = np.flatnonzero(value.any(axis=1))
        self._held[key] = (
            np.concatenate([vertices, (moved + first).astype(np.int32)]),
            np.concatenate([values, value[moved].astype(self._dtype)]),
        )

    def take(self, key: K, other: SparseShapes[L], their: L) -> None:
        """Take the displacements of a key of another object without a copy.

        Args:
            key: the key here.
            other: an object of the same vertices.
            their: the key in the other object.
        """
        self._held[key] = other._held[their]


def subset(shapes: Mapping[K, Doubles], keys: Iterable[K]) -> MutableMapping[K, Doubles]:
    """The shapes of some keys, in the same form as all shapes.

    Args:
        shapes: SparseShapes or another mapping.
        keys: the keys whose shapes are returned.
    """
    if not isinstance(shapes, SparseShapes):
        return {key: shapes[key] for key in keys}
    out = SparseShapes[K](shapes.count)
    for key in keys:
        out.take(key, shapes, key)
    return out
