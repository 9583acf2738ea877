# SPDX-License-Identifier: MIT
"""Arguments for the controls of a solver: their limits, and the way in which they share a drag."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple, TypedDict, TypeVar

import numpy as np
import numpy.typing as npt

from ..base.errors import ArgumentError
from .surface import Doubles, limits, vector


class Bounds(NamedTuple):
    """Checked limits: the range of each control of a face."""

    low: Doubles
    """float64[R]"""
    high: Doubles
    """float64[R]"""
    free: npt.NDArray[np.bool_]
    """bool[R]; for all other controls low and high equal the pose."""


@dataclass(frozen=True, eq=False)
class ControlLimits:
    """The controls that a solver may change, and their ranges.

    A control that starts outside of its range may keep its value.
    """

    free: npt.ArrayLike | None = None
    """bool[R], controls that may change; None: all, for a clip all except parts of rotations."""
    lowest: npt.ArrayLike | None = None
    """float[R] or one number; None is 0."""
    highest: npt.ArrayLike | None = None
    """float[R] or one number; None is 1."""

    def around(self, pose: Doubles, usual: npt.ArrayLike = True) -> Bounds:
        """The limits of a face's controls, widened to contain the pose.

        Args:
            pose: float64[R], the initial values.
            usual: bool or bool[R], used if `free` is None.

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
    """How controls share a drag: their ease, partners and opposites."""

    ease: npt.ArrayLike | None = None
    """float[R] above 0, how readily each control changes: 0.1 costs ten times as much as 1. Of two
    partners the larger ease counts. None: 1."""
    partners: npt.ArrayLike | None = None
    """int[R], each control's partner, or itself: partners change by the same amount, like left and
    right of a symmetric drag. None: no partners."""
    opposites: Sequence[tuple[int, int]] = ()
    """Pairs of controls of which at most one may be on, such as mouthLeft and mouthRight. On an
    asymmetric face both together would fit best, but look wrong. Opposites that are partners too
    are not affected."""


class LimitFields(TypedDict, total=False):
    """The fields of ControlLimits as keywords."""

    free: npt.ArrayLike | None
    lowest: npt.ArrayLike | None
    highest: npt.ArrayLike | None


class DragFields(LimitFields, total=False):
    """The fields of ControlLimits and of ControlSharing as keywords."""

    ease: npt.ArrayLike | None
    partners: npt.ArrayLike | None
    opposites: Sequence[tuple[int, int]]


_Structure = TypeVar("_Structure", ControlLimits, ControlSharing)


def structure(
    name: str, given: _Structure | None, kind: type[_Structure], keywords: Mapping[str, object]
) -> _Structure:
    """The structure that a caller gave, or one made from its fields among the keywords.

    Args:
        name: name of the argument.
        given: the structure; None if it was not given.
        kind: its class.
        keywords: keywords of the call; may have others.

    Raises:
        ArgumentError: both the structure and some of its fields were given.
    """
    make: Callable[..., _Structure] = kind
    own = {field.name for field in fields(kind)} & keywords.keys()
    if given is None:
        return make(**{field: keywords[field] for field in own})
    if own:
        found = ", ".join(sorted(own))
        raise ArgumentError(f"{name}: no {found} beside it was expected, found both")
    return given


def check_keywords(
    function: str,
    keywords: Mapping[str, object],
    *kinds: type[ControlLimits] | type[ControlSharing],
) -> None:
    """Refuse unknown keywords like Python does.

    Args:
        function: its name.
        keywords: keywords of the call.
        kinds: structures whose fields are valid keywords.

    Raises:
        TypeError: an unknown keyword.
    """
    known = {field.name for kind in kinds for field in fields(kind)}
    for keyword in keywords:
        if keyword not in known:
            raise TypeError(f"{function}() got an unexpected keyword argument {keyword!r}")
