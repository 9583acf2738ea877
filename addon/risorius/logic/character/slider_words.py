# SPDX-License-Identifier: GPL-3.0-or-later
"""Titles of sliders, their search, and their assignment to regions."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ..base.face_regions import FaceRegions

_OTHER = {"Left": "Right", "Right": "Left"}
_SIDE = re.compile(r"[LR](?=$|Ph\d$)")
# Abbreviation in a control's name -> word in the title of its slider.
_WORDS = {
    **{"U": " Upper ", "D": " Lower ", "C": " Centre ", "IN": " Inner ", "OUT": " Outer "},
    **{"Ph": "Phase ", "Fwd": "Forward"},
}
_SHORT = re.compile(
    r"\b[UD](?=$|IN$|OUT$|C$)|(?<=\b[UD])(IN|OUT|C)$|\b(IN|OUT)$|\bPh(?=\d$)|\bFwd\b"
)


def short_name(control: str) -> str:
    """A control's name without its prefixes: `CTRL_expressions.jawOpen` gives `jawOpen`."""
    return re.split(r"[.:|]", control)[-1] or control


def title(control: str) -> str:
    """The title of a slider: `CTRL_expressions.mouthCornerPullL` gives `Mouth Corner Pull L`."""
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|_", " ", short_name(control)).split()
    return " ".join(w[:1].upper() + w[1:] for w in words) or control


def title_in_region(control: str, region: str, sided: bool = True, swapped: bool = False) -> str:
    """The title of a slider under its region's heading, without the region's name: `Corner Pull L`.

    Args:
        control: name of the control.
        region: name of the region.
        sided: True: keep a final L or R; False: both sides share the label.
        swapped: True: swap left and right, so that the title names the viewer's side.
    """
    text, side = _without_side(title(control))
    if swapped:
        text = " ".join(_OTHER.get(word, word) for word in text.split())
        side = {"L": "R", "R": "L"}.get(side, side)
    text = _below(text, region)
    return f"{text} {side}" if sided and side else text


def title_of_directions(control: str, region: str) -> str:
    """The common label of two controls that move to the left and to the right.

    Args:
        control: one of the two controls.
        region: region of both.
    """
    words = ["Sideways" if word in _OTHER else word for word in title(control).split()]
    return _below(" ".join(words), region)


def _without_side(text: str) -> tuple[str, str]:
    """Split a title into the title without its side, and the side: "L", "R", or "" for none.

    For example, `Press UL` gives (`Press U`, `L`), and `Lips Sticky LPh1` gives
    (`Lips Sticky Ph1`, `L`).
    """
    found = _SIDE.search(text)
    if not found:
        return text, ""
    return " ".join((text[: found.start()] + text[found.end() :]).split()), found[0]


def _below(text: str, region: str) -> str:
    """A title without the name of its region, and with abbreviations written out."""
    first, _, rest = text.partition(" ")
    text = rest if rest and first.lower() == region else text
    return " ".join(_SHORT.sub(lambda part: _WORDS[part[0]], text).split())


def group_controls(controls: Sequence[str], regions: FaceRegions) -> dict[str, list[int]]:
    """Group the indices of controls by region.

    Args:
        controls: control names in index order.
        regions: regions of the face.

    Returns:
        Region -> indices in ascending order; regions in the order of display, without empty ones.
    """
    groups: dict[str, list[int]] = {region: [] for region in regions.titles}
    for index, control in enumerate(controls):
        groups[regions.of_slider(control)].append(index)
    return {region: indices for region, indices in groups.items() if indices}


def matches(control: str, search: str, known: str = "") -> bool:
    """Whether a control matches every word of a search.

    Args:
        control: name of the control; a search word may occur anywhere in the name or its title.
        search: the typed search.
        known: further search words of the control. A typed word matches such a word only if the
            word begins with it, so that "ear" does not find "fear".
    """
    text, more = f"{control} {title(control)}".casefold(), known.casefold().split()
    return all(
        word in text or any(one.startswith(word) for one in more)
        for word in search.casefold().split()
    )
