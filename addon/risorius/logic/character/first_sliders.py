# SPDX-License-Identifier: GPL-3.0-or-later
"""The sliders that are shown first in their region."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from . import slider_words
from .slider_rows import Row

# At most ten lines for each region, in the order of the panel; other sliders are under More. * is
# the side. A control to the left shares its line with the one to the right. The choice follows
# their use in expressions of Risorius, then in captures.
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
    """The lines of a region: shown at once, and under More."""

    first: list[Row]
    more: list[Row]


def table() -> Mapping[str, tuple[str, ...]]:
    """Region -> names of controls without their prefix, both sides of each, in their order."""
    return _TABLE


def _both_sides(names: Sequence[str]) -> list[str]:
    return [
        name.replace("*", side) for name in names for side in (("L", "R") if "*" in name else ("",))
    ]


_TABLE = {region: tuple(_both_sides(names)) for region, names in _FIRST.items()}


def part(rows: Sequence[Row], region: str) -> Parted:
    """The lines of a region, the most used ones first.

    Args:
        rows: all lines, in the order of the file.
        region: their region.

    Returns:
        All rows once. If the table knows none of them, all are shown at once.
    """
    ranks = {name: rank for rank, name in enumerate(table().get(region, ()))}

    def rank(row: Row) -> int:
        return min(ranks.get(slider_words.short_name(name), len(ranks)) for name in row.sliders)

    first = sorted((row for row in rows if rank(row) < len(ranks)), key=rank)
    if not first:
        return Parted(list(rows), [])
    return Parted(first, [row for row in rows if rank(row) == len(ranks)])
