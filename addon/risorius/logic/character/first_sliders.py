# SPDX-License-Identifier: GPL-3.0-or-later
"""Which sliders stand first under the heading of their region."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from . import slider_words
from .slider_rows import Row

# By region at most ten lines, in the order in which the panel shows them; all other sliders of the
# region stand under More. * is the side; a control that goes left shares its line with the one that
# goes right. Chosen by how often the expressions of Risorius use them, then by what captures have.
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
    """The lines of a region: those that are shown at once, and those under More."""

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
        rows: all of them, in the order of the file.
        region: under whose heading they stand.

    Returns:
        All rows once. Where the table has none of them, as in files with names of their own, all
        are first.
    """
    ranks = {name: rank for rank, name in enumerate(table().get(region, ()))}

    def rank(row: Row) -> int:
        return min(ranks.get(slider_words.short_name(name), len(ranks)) for name in row.sliders)

    first = sorted((row for row in rows if rank(row) < len(ranks)), key=rank)
    if not first:
        return Parted(list(rows), [])
    return Parted(first, [row for row in rows if rank(row) == len(ranks)])
