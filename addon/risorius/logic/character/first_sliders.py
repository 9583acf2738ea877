# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses the sliders that each region shows first; the others are under More."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from . import slider_words
from .slider_rows import Row

# Most used controls of each region, in the order of the panel, at most ten rows; * stands for the
# sides L and R. Left and right share a row. The controls were chosen by how often expressions
# of Risorius use them, and then by how often face captures use them.
_FIRST = {
    "brow": (
        "browRaiseIn*",
        "browRaiseOuter*",
        "browDown*",
        "browLateral*",
    ),
    "eye": (
        "eyeBlink*",
        "eyeWiden*",
        "eyeSquintInner*",
        "eyeCheekRaise*",
        "eyeLookUp*",
        "eyeLookDown*",
        "eyeLookLeft*",
        "eyeLookRight*",
        "eyeLidPress*",
        "eyeRelax*",
    ),
    "nose": (
        "noseWrinkle*",
        "noseNasolabialDeepen*",
        "noseNostrilDilate*",
    ),
    "mouth": (
        "mouthCornerPull*",
        "mouthCornerDepress*",
        "mouthUpperLipRaise*",
        "mouthLowerLipDepress*",
        "mouthStretch*",
        "mouthLipsPurseU*",
        "mouthLipsPurseD*",
        "mouthFunnelU*",
        "mouthFunnelD*",
        "mouthLeft",
        "mouthRight",
    ),
    "jaw": (
        "jawOpen",
        "jawLeft",
        "jawRight",
        "jawFwd",
        "jawBack",
        "jawChinRaiseD*",
        "jawChinRaiseU*",
        "jawClench*",
        "jawChinCompress*",
        "jawOpenExtreme",
    ),
    "tongue": (
        "tongueOut",
        "tongueUp",
        "tongueDown",
        "tongueLeft",
        "tongueRight",
        "tongueTipUp",
        "tongueTipDown",
        "tongueWide",
        "tongueNarrow",
        "tongueIn",
        "tongueBendUp",
    ),
    "neck": (
        "neckStretch*",
        "neckThroatInhale",
        "neckThroatExhale",
        "neckThroatUp",
        "neckThroatDown",
        "neckMastoidContract*",
        "neckSwallowPh1",
        "neckSwallowPh2",
        "neckSwallowPh3",
        "neckSwallowPh4",
    ),
}


class Parted(NamedTuple):
    """The rows of a region: `first` are always visible, `more` are under the heading More."""

    first: list[Row]
    more: list[Row]


def table() -> Mapping[str, tuple[str, ...]]:
    """Region -> names of the first controls without prefix, both sides, in the order of display."""
    return _TABLE


def _both_sides(names: Sequence[str]) -> list[str]:
    return [
        name.replace("*", side) for name in names for side in (("L", "R") if "*" in name else ("",))
    ]


_TABLE = {region: tuple(_both_sides(names)) for region, names in _FIRST.items()}


def part(rows: Sequence[Row], region: str) -> Parted:
    """Split the rows of a region into most used and other rows.

    Args:
        rows: all rows of the region, in the order of the DNA file.
        region: name of the region.

    Returns:
        All rows, each once. If the region has no most used row, all rows are in `first`.
    """
    ranks = {name: rank for rank, name in enumerate(table().get(region, ()))}

    def rank(row: Row) -> int:
        return min(ranks.get(slider_words.short_name(name), len(ranks)) for name in row.sliders)

    first = sorted((row for row in rows if rank(row) < len(ranks)), key=rank)
    if not first:
        return Parted(list(rows), [])
    return Parted(first, [row for row in rows if rank(row) == len(ranks)])
