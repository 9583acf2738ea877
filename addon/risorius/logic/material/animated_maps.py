# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the effect of an animated map on the skin from its name."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

# Area of the face -> words in names of animated maps. The first match decides: cheekRaiseInner
# belongs to the area "smile", cheekRaiseUpper to the area "eye".
_AREA_WORDS = (
    ("forehead", ("browsraise", "browraise", "forehead")),
    ("glabella", ("brow", "frown", "glabella")),
    ("nose", ("nose", "nostril", "sneer")),
    ("eye", ("blink", "squint", "eye", "lid", "cheekraiseouter", "cheekraiseupper", "crow")),
    ("smile", ("smile", "cheek", "mouthstretch", "jawopen", "nasolabial", "dimple")),
    ("chin", ("chin", "mentalis")),
    ("neck", ("neck", "throat")),
    ("lips", ("lip", "purse", "pucker", "mouth", "funnel")),
)
AREAS = ("forehead", "glabella", "eye", "nose", "smile", "lips", "chin", "neck")
# Course of the folds in each area: lines along x (level), lines along z (upright), rays from the
# eye, an arc around the mouth, or dimples.
FOLDS = {
    "forehead": "level",
    "glabella": "upright",
    "eye": "rays",
    "nose": "level",
    "smile": "arc",
    "lips": "upright",
    "chin": "dimples",
    "neck": "level",
    "all": "dimples",
}
_COLOR_WORDS = ("color", "colour", "flush", "blush", "redden", "blood", "pale")
_NORMAL_WORDS = ("normal", "wrinkle", "fold", "crease", "bump")
_REGION = re.compile(r"head_wm(\d+)_(?!normal)([A-Za-z]+(?:_[A-Za-z]{1,2})?)$")
_SET = re.compile(r"head_([cw])m([1-9])(?!\d)")
_SIDE = re.compile(r"(?:_[UD]?|[a-z])([LR])$")


@dataclass(frozen=True)
class MapUse:
    """One animated map.

    Attributes:
        index: index of the map in the DNA file.
        label: name of the map.
        color, normal: whether the map changes the colour and the normals.
        number: number of the wrinkle set in the name, usually 1 to 3; 0 for none.
        region: name of its mask such as `head_wm1_blink_l`, lower case; "" if the map's name has
            none.
        area: one of AREAS, or "all".
        side: "L", "R" or "".
    """

    index: int
    label: str
    color: bool
    normal: bool
    number: int
    region: str
    area: str
    side: str


def use_of(index: int, label: str) -> MapUse:
    """The effect of a map: `head_cm1_color.head_wm1_blink_L` tints the left eye's area with set 1.

    A map whose name says neither "colour" nor "normals" changes both.

    Args:
        index: index of the map in the DNA file.
        label: name of the map.
    """
    word = label.lower()
    found = _REGION.search(label)
    region = found.group(0).lower() if found else ""
    sets = _SET.search(label)
    side = _SIDE.search(label)
    color = any(w in word for w in _COLOR_WORDS) or bool(sets and sets.group(1) == "c")
    normal = any(w in word for w in _NORMAL_WORDS) or bool(sets and sets.group(1) == "w")
    if not (color or normal):
        color = normal = True
    elif color and not any(w in word for w in _NORMAL_WORDS):
        normal = False  # head_cm1_color.head_wm1_...: "wm" here is part of the mask's name
    return MapUse(
        index=index,
        label=label,
        color=color,
        normal=normal,
        number=int(sets.group(2)) if sets else 0,
        region=region,
        area=area_of(found.group(2) if found else label),
        side=side.group(1) if side else "",
    )


def area_of(name: str) -> str:
    """The area of the face that a region's name indicates, or "all"."""
    word = name.lower()
    for area, starts in _AREA_WORDS:
        if any(s in word for s in starts):
            return area
    return "all"


def uses_of(labels: Sequence[str]) -> list[MapUse]:
    """The effect of each map of a file, in index order."""
    return [use_of(i, label) for i, label in enumerate(labels)]
