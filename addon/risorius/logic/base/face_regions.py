# SPDX-License-Identifier: GPL-3.0-or-later
"""The regions of a face and the functions that assign controls to them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass


def _itself(name: str) -> str:
    return name


@dataclass(frozen=True)
class FaceRegions:
    """The regions of a face, and functions that find the region and the partner of a control.

    The caller takes the functions from the package `risorius`, which modules in `logic` do not
    import.

    Attributes:
        titles: region -> heading, in the order of display; empty without the native module.
        of_slider: name of a control -> region that shows its slider.
        of_control: name of a control -> region that it moves.
        mirrored: name of a control -> its partner in a mirror: eyeLookLeftL has eyeLookRightR; a
            control without a side is its own partner.
        across: name of a control -> the same control of the other side: eyeLookLeftL has
            eyeLookLeftR.
    """

    titles: Mapping[str, str]
    of_slider: Callable[[str], str]
    of_control: Callable[[str], str]
    mirrored: Callable[[str], str] = _itself
    across: Callable[[str], str] = _itself
