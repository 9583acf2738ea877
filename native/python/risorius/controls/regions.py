# SPDX-License-Identifier: MIT
"""Finds the face region of a control from the beginning of its name, listed in regions.toml."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from importlib import resources

import numpy as np
import numpy.typing as npt

from ..base import toml
from ..base.errors import ArgumentError

_TABLE = toml.parse(
    resources.files(__package__).joinpath("regions.toml").read_text(encoding="utf-8")
)
TITLES: dict[str, str] = {region: row["title"] for region, row in _TABLE.items()}
REGIONS = tuple(TITLES)
_STARTS = sorted(
    ((start, region) for region, row in _TABLE.items() for start in row["starts"]),
    key=lambda pair: -len(pair[0]),
)


def short_name(control: str) -> str:
    """The part after the last separator: `CTRL_expressions.jawOpen` gives `jawOpen`."""
    return re.split(r"[.:|]", control)[-1] or control


def region_of(control: str, *, by_last_part: bool = False) -> str:
    """The face region of a control, such as "mouth"; regions.toml lists the regions.

    Args:
        control: name of the control.
        by_last_part: True: use only short_name. False: if it gives no region, use the parts before
            it: head.yaw and eyeL.pitch have their region before the dot.
    """
    words = [short_name(control)] if by_last_part else re.split(r"[.:|]", control)[::-1]
    for word in words:
        lower = word.lower().removeprefix("ctrl_")
        for start, region in _STARTS:
            if lower.startswith(start):
                return region
    return "other"


def side_of(control: str) -> str:
    """The side of a control: "L", "R", or "" for none."""
    end = short_name(control)
    return end[-1] if end[-1:] in ("L", "R") else ""


def expand_sides(name: str) -> list[str]:
    """Expand a name: `browDown*` to both sides, `mouthFunnel**` to the four quarters of the lips.

    Any other name gives itself.
    """
    if name.endswith("**"):
        return [name[:-2] + quarter for quarter in ("UL", "UR", "DL", "DR")]
    if name.endswith("*"):
        return [name[:-1] + side for side in ("L", "R")]
    return [name]


def mask(
    names: Sequence[str], parts: Mapping[str, float], default: float = 0.0
) -> npt.NDArray[np.float32]:
    """Make a weight for each control from weights of regions, sides, controls or patterns.

    Args:
        names: names of the controls.
        parts: weight in [0, 1] by region ("mouth"), region and side ("brow.L"), control ("jawOpen",
            with or without its prefix) or pattern ("mouthCorner*"); for the same control a later
            entry wins.
        default: weight of all other controls.

    Returns:
        float32[names].

    Raises:
        ValueError: a weight out of range, or a part that is no region and matches no control.
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
