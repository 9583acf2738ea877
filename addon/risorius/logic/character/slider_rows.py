# SPDX-License-Identifier: GPL-3.0-or-later
"""Arranges sliders in rows, with left and right side by side; mirrors and copies their values."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from ..base.face_regions import FaceRegions
from . import slider_words

_LEFT = re.compile(r"L(?=$|Ph\d$)|Left")


@dataclass(frozen=True)
class Row:
    """One line of the panel.

    Attributes:
        title: text before the sliders.
        sliders: controls from left to right; a pair is one control on both sides of the face, or
            one movement to the left and to the right.
    """

    title: str
    sliders: tuple[str, ...]

    @property
    def is_pair(self) -> bool:
        """Whether the row shows two sliders, a left one and a right one."""
        return len(self.sliders) == 2


def rows_of(names: Sequence[str], region: str, regions: FaceRegions, as_seen: bool) -> list[Row]:
    """Arrange the controls of a region in rows.

    Args:
        names: names of the region's controls, in their order.
        region: name of the region.
        regions: regions of the face; they find the partner of a control.
        as_seen: True: "left" in titles and in the order of sliders is the viewer's left; False: the
            character's left.

    Returns:
        Each control once: the two sides of a control, or its left and right direction, share a row.
    """
    there, done, rows = set(names), set(), []
    for name in names:
        if name in done:
            continue
        other = regions.across(name)
        twins = other != name
        if not twins:
            other = regions.mirrored(name)
        pair = other != name and other in there and other not in done
        done |= {name, other} if pair else {name}
        rows.append(_row(name, other if pair else "", region, as_seen, twins))
    return rows


def _row(name: str, other: str, region: str, as_seen: bool, twins: bool) -> Row:
    if not other:
        return Row(slider_words.title_in_region(name, region, swapped=as_seen), (name,))
    first, second = sorted((name, other), key=lambda one: not is_left(one, twins))
    if as_seen:
        first, second = second, first
    title = (
        slider_words.title_in_region(name, region, sided=False, swapped=as_seen)
        if twins
        else slider_words.title_of_directions(name, region)
    )
    return Row(title, (first, second))


def is_left(name: str, by_side: bool = True) -> bool:
    """Whether a control belongs to the character's left side or moves to its left.

    Args:
        name: name of a control with a partner.
        by_side: True: use the side at the end of the name, so eyeLookLeftR is not left; False: use
            the direction, so it is left.
    """
    last = slider_words.short_name(name)
    found = _LEFT.findall(last)
    return ("L" in found) if by_side else ("Left" in found)


def across_from(
    values: Mapping[str, float], regions: FaceRegions, from_left: bool
) -> dict[str, float]:
    """Copy the values of one side to the other.

    Args:
        values: values of existing controls by name.
        regions: regions of the face.
        from_left: True: copy the character's left to its right; False: right to left.

    Returns:
        The new values of the other side. Controls without a side are left out.
    """
    found = {}
    for name, value in values.items():
        other = regions.across(name)
        if other != name and other in values and is_left(name) == from_left:
            found[other] = value
    return found


def mirrored(values: Mapping[str, float], regions: FaceRegions) -> dict[str, float]:
    """Swap the left and right values of a face's controls.

    Args:
        values: values of controls by name.
        regions: regions of the face.

    Returns:
        The new values of the same controls; a control whose partner has no value keeps its value.
    """
    return {name: values.get(regions.mirrored(name), value) for name, value in values.items()}


def flipped(values: Mapping[str, float], regions: FaceRegions) -> dict[str, float]:
    """Swap left and right in a copied pose; the names may include controls that the face lacks.

    Args:
        values: values of controls by name.
        regions: regions of the face.
    """
    return {regions.mirrored(name): value for name, value in values.items()}


def pairs(names: Collection[str], regions: FaceRegions) -> list[tuple[str, str]]:
    """Pairs (left, right) of controls on the two sides of the character.

    Args:
        names: names of all controls.
        regions: regions of the face.
    """
    found = ((name, regions.across(name)) for name in names if is_left(name))
    return [(left, right) for left, right in found if left != right and right in names]
