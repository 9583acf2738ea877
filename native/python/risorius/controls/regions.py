# SPDX-License-Identifier: MIT
"""Face regions of controls, read from their names; as in the add-on's sliders (a test compares)."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

import numpy as np
import numpy.typing as npt

from ..base.errors import ArgumentError

# The order decides: mouthCheekBlow is a cheek, eyeCheekRaise an eye, jawChinRaise a jaw.
_STARTS = (
    ("brow", ("brow",)),
    ("cheek", ("cheek", "mouthcheek")),
    ("eye", ("eye", "lid", "lash", "pupil")),
    ("nose", ("nose", "nostril", "naso")),
    ("mouth", ("mouth", "lip", "smile")),
    ("jaw", ("jaw", "chin")),
    ("tongue", ("tongue",)),
    ("teeth", ("teeth", "tooth")),
    ("neck", ("neck", "throat", "head")),
    ("ear", ("ear",)),
)
REGIONS = (*(region for region, _ in _STARTS), "other")


def short_name(control: str) -> str:
    """The part after the last prefix: `CTRL_expressions.jawOpen` gives `jawOpen`."""
    return re.split(r"[.:|]", control)[-1] or control


def region_of(control: str) -> str:
    """The face region of a control, one of REGIONS."""
    # head.yaw and eyeL.pitch have their region before the dot.
    for word in (short_name(control), control):
        lower = word.lower().removeprefix("ctrl_")
        for region, starts in _STARTS:
            if lower.startswith(starts):
                return region
    return "other"


def side_of(control: str) -> str:
    """ "L" or "R" of a control with a side, else ""."""
    end = short_name(control)
    return end[-1] if end[-1:] in ("L", "R") else ""


def expand_sides(name: str) -> list[str]:
    """`browDown*` gives both sides, `mouthFunnel**` the four quarters of the lips, others
    themselves."""
    if name.endswith("**"):
        return [name[:-2] + quarter for quarter in ("UL", "UR", "DL", "DR")]
    if name.endswith("*"):
        return [name[:-1] + side for side in ("L", "R")]
    return [name]


def mask(
    names: Sequence[str], parts: Mapping[str, float], default: float = 0.0
) -> npt.NDArray[np.float32]:
    """A weight for each control.

    Args:
        names: the controls.
        parts: weight in [0, 1] by region ("mouth"), region and side ("brow.L"), control
            ("jawOpen", with its prefix or without) or pattern ("mouthCorner*"); a later one counts
            where two name the same control.
        default: the weight of all others.

    Returns:
        float32[names].

    Raises:
        ValueError: a weight out of range, or a part that names no control.
    """
    out = np.full(len(names), default, np.float32)
    for part, weight in parts.items():
        if not 0.0 <= weight <= 1.0:
            raise ArgumentError(f"mask {part}: a weight from 0 to 1 was expected, found {weight}")
        named = [i for i, name in enumerate(names) if _is_part(name, part)]
        if not named and part.partition(".")[0] not in REGIONS:
            raise ArgumentError(f"mask {part}: a region, a control or a pattern was expected")
        out[named] = weight
    return out


def _is_part(control: str, part: str) -> bool:
    region, _, side = part.partition(".")
    if region in REGIONS and side in ("", "L", "R"):
        return region_of(control) == region and side in ("", side_of(control))
    return part == control or fnmatchcase(short_name(control), part)
