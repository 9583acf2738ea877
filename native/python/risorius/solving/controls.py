# SPDX-License-Identifier: MIT
"""Defines arguments of the solvers: limits of controls, and how a drag is divided among them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple, TypedDict, TypeVar

import numpy as np
import numpy.typing as npt

from ..base.errors import ArgumentError
from .surface import Doubles, limits, vector


class Bounds(NamedTuple):
    """Checked limits of all controls of a face."""

    low: Doubles
    """float64[R]: smallest values."""
    high: Doubles
    """float64[R]: largest values."""
    free: npt.NDArray[np.bool_]
    """bool[R], controls that may change; for the others low and high equal the pose."""


@dataclass(frozen=True, eq=False)
class ControlLimits:
    """The controls that a solver may change, and their ranges.

    A control whose initial value is outside its range may keep that value.
    """

    free: npt.ArrayLike | None = None
    """bool[R], controls that may change; None: all, in solve_clip all but rotation components."""
    lowest: npt.ArrayLike | None = None
    """float[R] or one number, smallest values; None: 0."""
    highest: npt.ArrayLike | None = None
    """float[R] or one number, largest values; None: 1."""

    def around(self, pose: Doubles, usual: npt.ArrayLike = True) -> Bounds:
        """Checks the limits for a face, and widens them to contain the pose.

        Args:
            pose: float64[R], initial values of the controls.
            usual: bool or bool[R], whether a control may change, used if `free` is None.

        Raises:
            ArgumentError: a wrong shape, not a number, a lowest above its highest.
        """
        low, high = limits(len(pose), self.lowest, self.highest)
        low, high = np.minimum(low, pose), np.maximum(high, pose)
        free = vector("free", usual if self.free is None else self.free, len(pose)).astype(bool)
        low[~free] = high[~free] = pose[~free]
        return Bounds(low, high, free)


@dataclass(frozen=True, eq=False)
class ControlSharing:
    """How a drag is distributed over the controls: ease (how readily each changes), partners
    (controls that change equally) and opposites (controls that exclude each other)."""

    ease: npt.ArrayLike | None = None
    """float[R] above 0, how readily each control changes: 0.1 costs ten times as much as 1. Two
    partners have the larger ease of both. None: 1."""
    partners: npt.ArrayLike | None = None
    """int[R], index of each control's partner, or its own index: partners change by the same
    amount, such as left and right in a symmetric drag. None: no partners."""
    opposites: Sequence[tuple[int, int]] = ()
    """Pairs of controls of which at most one may be on, such as mouthLeft and mouthRight. On an
    asymmetric face both together would fit best but look wrong. Opposites that are also partners
    keep their values."""


class LimitFields(TypedDict, total=False):
    """The fields of ControlLimits as keyword arguments."""

    free: npt.ArrayLike | None
    lowest: npt.ArrayLike | None
    highest: npt.ArrayLike | None


class DragFields(LimitFields, total=False):
    """The fields of ControlLimits and of ControlSharing as keyword arguments."""

    ease: npt.ArrayLike | None
    partners: npt.ArrayLike | None
    opposites: Sequence[tuple[int, int]]


_Structure = TypeVar("_Structure", ControlLimits, ControlSharing)


def structure(
    name: str, given: _Structure | None, kind: type[_Structure], keywords: Mapping[str, object]
) -> _Structure:
    """The given structure, or one made from the keywords that are fields of its class.

    Args:
        name: name of the structure's argument, for errors.
        given: the structure; None if it was not given.
        kind: class of the structure.
        keywords: keyword arguments of the call; other keywords are ignored.

    Raises:
        ArgumentError: both the structure and one of its fields were given.
    """
    make: Callable[..., _Structure] = kind
    own = {field.name for field in fields(kind)} & keywords.keys()
    if given is None:
        return make(**{field: keywords[field] for field in own})
    if own:
        found = ", ".join(sorted(own))
        raise ArgumentError(
            f"{name}: no {found} beside it was expected, found both: give the values in one of "
            "the two"
        )
    return given


def check_keywords(
    function: str,
    keywords: Mapping[str, object],
    *kinds: type[ControlLimits] | type[ControlSharing],
) -> None:
    """Refuses unknown keywords with Python's own error.

    Args:
        function: name of the function, for the error.
        keywords: keywords of the call.
        kinds: structures whose fields are valid keywords.

    Raises:
        TypeError: an unknown keyword.
    """
    known = {field.name for kind in kinds for field in fields(kind)}
    for keyword in keywords:
        if keyword not in known:
            raise TypeError(f"{function}() got an unexpected keyword argument {keyword!r}")
