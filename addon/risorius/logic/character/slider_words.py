# SPDX-License-Identifier: GPL-3.0-or-later
"""Words for sliders, and the regions that they are shown under."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ..base.face_regions import FaceRegions


def short_name(control: str) -> str:
    """The part after the last prefix: `CTRL_expressions.jawOpen` gives `jawOpen`."""
    return re.split(r"[.:|]", control)[-1] or control


def title(control: str) -> str:
    """Words for a slider: `CTRL_expressions.mouthCornerPullL` gives `Mouth Corner Pull L`."""
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|_", " ", short_name(control)).split()
    return " ".join(w[:1].upper() + w[1:] for w in words) or control


def title_in_region(control: str, region: str, sided: bool = True) -> str:
    """Words for a slider under its region's heading: no `Mouth` before `Corner Pull L`.

    Args:
        control: the control's name.
        region: the one that it is shown under.
        sided: keep a last L or R; without, both sides share the words.
    """
    text = title(control)
    if not sided and text[-1:] in ("L", "R"):
        text = text[:-1].rstrip()
    first, _, rest = text.partition(" ")
    return rest if rest and first.lower() == region else text


def group_controls(controls: Sequence[str], regions: FaceRegions) -> dict[str, list[int]]:
    """Indices of the controls of each region.

    Args:
        controls: control names in index order.
        regions: of the face.

    Returns:
        Region -> indices in their order, regions in the order in which they are shown, none empty.
    """
    groups: dict[str, list[int]] = {region: [] for region in regions.titles}
    for index, control in enumerate(controls):
        groups[regions.of_slider(control)].append(index)
    return {region: indices for region, indices in groups.items() if indices}


def matches(control: str, search: str) -> bool:
    """Whether every word of the search stands somewhere in the control's name or title."""
    text = f"{control} {title(control)}".lower()
    return all(word in text for word in search.lower().split())
