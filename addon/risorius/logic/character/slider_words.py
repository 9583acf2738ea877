# SPDX-License-Identifier: GPL-3.0-or-later
"""Words for sliders, and the regions that they are shown under."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ..base.face_regions import FaceRegions

_OTHER = {"Left": "Right", "Right": "Left"}
_SIDE = re.compile(r"[LR](?=$|Ph\d$)")
# Endings of names: upper and lower lip or teeth, inner and outer part, phase.
_WORDS = {
    **{"U": " Upper ", "D": " Lower ", "C": " Centre ", "IN": " Inner ", "OUT": " Outer "},
    **{"Ph": "Phase ", "Fwd": "Forward"},
}
_SHORT = re.compile(
    r"\b[UD](?=$|IN$|OUT$|C$)|(?<=\b[UD])(IN|OUT|C)$|\b(IN|OUT)$|\bPh(?=\d$)|\bFwd\b"
)


def short_name(control: str) -> str:
    """The part after the last prefix: `CTRL_expressions.jawOpen` gives `jawOpen`."""
    return re.split(r"[.:|]", control)[-1] or control


def title(control: str) -> str:
    """Words for a slider: `CTRL_expressions.mouthCornerPullL` gives `Mouth Corner Pull L`."""
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|_", " ", short_name(control)).split()
    return " ".join(w[:1].upper() + w[1:] for w in words) or control


def title_in_region(control: str, region: str, sided: bool = True, swapped: bool = False) -> str:
    """The label of a slider in its region, without the name of the region: `Corner Pull L`.

    Args:
        control: the control's name.
        region: its region.
        sided: keep a final L or R; False: both sides share the label.
        swapped: swap left and right, for the viewer.
    """
    text, side = _without_side(title(control))
    if swapped:
        text = " ".join(_OTHER.get(word, word) for word in text.split())
        side = {"L": "R", "R": "L"}.get(side, side)
    text = _below(text, region)
    return f"{text} {side}" if sided and side else text


def title_of_directions(control: str, region: str) -> str:
    """The common label of a control to the left and its partner to the right.

    Args:
        control: one of them.
        region: their region.
    """
    words = ["Sideways" if word in _OTHER else word for word in title(control).split()]
    return _below(" ".join(words), region)


def _without_side(text: str) -> tuple[str, str]:
    """`Press UL` gives `Press U`, `L`; `Lips Sticky LPh1` gives `Lips Sticky Ph1`, `L`."""
    found = _SIDE.search(text)
    if not found:
        return text, ""
    return " ".join((text[: found.start()] + text[found.end() :]).split()), found[0]


def _below(text: str, region: str) -> str:
    """A title without its region's name, and with abbreviations in words."""
    first, _, rest = text.partition(" ")
    text = rest if rest and first.lower() == region else text
    return " ".join(_SHORT.sub(lambda part: _WORDS[part[0]], text).split())


def group_controls(controls: Sequence[str], regions: FaceRegions) -> dict[str, list[int]]:
    """Indices of the controls of each region.

    Args:
        controls: control names in index order.
        regions: of the face.

    Returns:
        Region -> indices in their order, regions in their order, none empty.
    """
    groups: dict[str, list[int]] = {region: [] for region in regions.titles}
    for index, control in enumerate(controls):
        groups[regions.of_slider(control)].append(index)
    return {region: indices for region, indices in groups.items() if indices}


def matches(control: str, search: str, known: str = "") -> bool:
    """Whether every word of the search occurs in the names of a control.

    Args:
        control: its name; a word may occur anywhere in it or in its title.
        search: typed text.
        known: further words of animators; these must begin with the typed text, so that "ear" does
            not find "fear".
    """
    text, more = f"{control} {title(control)}".casefold(), known.casefold().split()
    return all(
        word in text or any(one.startswith(word) for one in more)
        for word in search.casefold().split()
    )
