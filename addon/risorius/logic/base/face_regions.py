# SPDX-License-Identifier: GPL-3.0-or-later
"""The regions of a face, as the `risorius` package knows them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass


def _itself(name: str) -> str:
    return name


@dataclass(frozen=True)
class FaceRegions:
    """What logic is handed to sort controls by.

    Attributes:
        titles: heading of each region, in the order in which they are shown; empty without the
            native module.
        of_slider: the region that a control's slider is shown under, by the last part of its name.
        of_control: the region that a control moves; that of head.yaw stands before the dot.
        mirrored: the name of a control's partner in a mirror: eyeLookLeftL has eyeLookRightR; one
            without a side is its own.
        across: that of the same control of the other side: eyeLookLeftL has eyeLookLeftR.
    """

    titles: Mapping[str, str]
    of_slider: Callable[[str], str]
    of_control: Callable[[str], str]
    mirrored: Callable[[str], str] = _itself
    across: Callable[[str], str] = _itself
