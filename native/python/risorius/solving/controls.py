# SPDX-License-Identifier: MIT
"""Arguments that say how a solver treats the controls: their limits, how they share a drag."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple, TypedDict, TypeVar

import numpy as np
import numpy.typing as npt

from ..base.errors import ArgumentError
from .surface import Doubles, limits, vector


class Bounds(NamedTuple):
    """Limits, checked: between which values each control of a face may go."""

    low: Doubles
    """float64[R]"""
    high: Doubles
    """float64[R]"""
    free: npt.NDArray[np.bool_]
    """bool[R]: the others have the value of the pose as their low and high."""


@dataclass(frozen=True, eq=False)
class ControlLimits:
    """Which controls a solver may change, and between which values.

    A control that begins beyond its limits may stay where it is.
    """

    free: npt.ArrayLike | None = None
    """bool[R], which controls may change; None is all, of a clip all but the parts of rotations."""
    lowest: npt.ArrayLike | None = None
    """float[R] or one number; None is 0."""
    highest: npt.ArrayLike | None = None
    """float[R] or one number; None is 1."""

    def around(self, pose: Doubles, usual: npt.ArrayLike = True) -> Bounds:
        """The limits of a face's controls, with the pose inside.

        Args:
            pose: float64[R], where the controls begin.
            usual: bool or bool[R], which controls may change where `free` is None.

        Raises:
            ArgumentError: another shape, no number, a lowest above its highest.
        """
        low, high = limits(len(pose), self.lowest, self.highest)
        low, high = np.minimum(low, pose), np.maximum(high, pose)
        free = vector("free", usual if self.free is None else self.free, len(pose)).astype(bool)
        low[~free] = high[~free] = pose[~free]
        return Bounds(low, high, free)


@dataclass(frozen=True, eq=False)
class ControlSharing:
    """How controls share a drag: how readily each changes, and which go together or never do."""

    ease: npt.ArrayLike | None = None
    """float[R] above 0, how readily each control changes: one of 0.1 costs ten times as much; of
    two partners the readier one counts; None is 1."""
    partners: npt.ArrayLike | None = None
    """int[R], each control's partner, itself where it has none: the two change alike, as left and
    right of a symmetric drag; None is no partners."""
    opposites: Sequence[tuple[int, int]] = ()
    """Pairs of controls of which one at most shall be on, as mouthLeft and mouthRight. A face whose
    halves differ finds a use for both at once, and nobody wants that. Two that are partners as well
    stay as they are."""


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
    """A structure as a caller gave it, or made of the keywords that are its fields.

    Args:
        name: of the argument.
        given: the structure; None where it was not given.
        kind: its class.
        keywords: of the call, perhaps with others.

    Raises:
        ArgumentError: the structure and some of its fields were given.
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
    """Refuse keywords as Python does.

    Args:
        function: its name.
        keywords: of the call.
        kinds: the structures whose fields are its keywords.

    Raises:
        TypeError: a keyword that the function does not have.
    """
    known = {field.name for kind in kinds for field in fields(kind)}
    for keyword in keywords:
        if keyword not in known:
            raise TypeError(f"{function}() got an unexpected keyword argument {keyword!r}")
