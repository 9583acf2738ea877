# SPDX-License-Identifier: GPL-3.0-or-later
"""Sliders in rows, with left and right."""

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
        sliders: controls from left to right; two are the sides of a control, or its two directions.
    """

    title: str
    sliders: tuple[str, ...]

    @property
    def is_pair(self) -> bool:
        """Whether one of the sliders is the left one, and one the right."""
        return len(self.sliders) == 2


def rows_of(names: Sequence[str], region: str, regions: FaceRegions, as_seen: bool) -> list[Row]:
    """The rows of a region.

    Args:
        names: controls of the region, in their order.
        region: their region.
        regions: regions of the face, which know partners.
        as_seen: True: left is as seen by the viewer; False: the character's own left. Names and
            places follow it.

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
        by_side: True: use the side at the end of the name, so that eyeLookLeftR is not left.
    """
    last = slider_words.short_name(name)
    found = _LEFT.findall(last)
    return ("L" in found) if by_side else ("Left" in found)


def across_from(
    values: Mapping[str, float], regions: FaceRegions, from_left: bool
) -> dict[str, float]:
    """The values of the other side that make both sides alike.

    Args:
        values: values of existing controls by name.
        regions: of the face.
        from_left: True: copy the character's left side.

    Returns:
        The new values of the other side; the gaze stays. Controls without a side are left out.
    """
    found = {}
    for name, value in values.items():
        other = regions.across(name)
        if other != name and other in values and is_left(name) == from_left:
            found[other] = value
    return found


def mirrored(values: Mapping[str, float], regions: FaceRegions) -> dict[str, float]:
    """Values with left and right swapped.

    Args:
        values: of controls, by name.
        regions: of the face.

    Returns:
        The same controls; a control without an existing partner keeps its value.
    """
    return {name: values.get(regions.mirrored(name), value) for name, value in values.items()}


def flipped(values: Mapping[str, float], regions: FaceRegions) -> dict[str, float]:
    """A copied pose with left and right swapped, for a face that may have other controls.

    Args:
        values: of controls, by name.
        regions: of the face.
    """
    return {regions.mirrored(name): value for name, value in values.items()}


def pairs(names: Collection[str], regions: FaceRegions) -> list[tuple[str, str]]:
    """Pairs of controls of the character's left and right side.

    Args:
        names: of all controls.
        regions: of the face.
    """
    found = ((name, regions.across(name)) for name in names if is_left(name))
    return [(left, right) for left, right in found if left != right and right in names]
