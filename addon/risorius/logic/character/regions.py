# SPDX-License-Identifier: GPL-3.0-or-later
"""Face regions of controls, read from their names."""

from __future__ import annotations

import re
from collections.abc import Sequence

REGIONS = (
    "brow",
    "eye",
    "nose",
    "cheek",
    "mouth",
    "jaw",
    "tongue",
    "teeth",
    "neck",
    "ear",
    "other",
)
TITLES = {
    "brow": "Brows",
    "eye": "Eyes",
    "nose": "Nose",
    "cheek": "Cheeks",
    "mouth": "Mouth",
    "jaw": "Jaw",
    "tongue": "Tongue",
    "teeth": "Teeth",
    "neck": "Neck",
    "ear": "Ears",
    "other": "Other",
}

# The order decides: mouthCheekBlow is a cheek, eyeCheekRaise an eye, jawChinRaise a jaw.
_STARTS = (
    ("brow", ("brow",)),
    ("cheek", ("cheek", "mouthcheek")),
    ("eye", ("eye", "lid", "lash", "pupil")),
    ("nose", ("nose", "nostril", "naso")),
    ("mouth", ("mouth", "lip", "smile")),
    ("jaw", ("jaw", "chin")),
    ("tongue", ("tongue",)),
    ("teeth", ("teeth", "tooth")),
    ("neck", ("neck", "throat", "head")),
    ("ear", ("ear",)),
)


def short_name(control: str) -> str:
    """The part after the last prefix: `CTRL_expressions.jawOpen` gives `jawOpen`."""
    return re.split(r"[.:|]", control)[-1] or control


def title(control: str) -> str:
    """Words for a slider: `CTRL_expressions.mouthCornerPullL` gives `Mouth Corner Pull L`."""
    words = re.sub(r"(?<=[a-z0-9])(?=[A-Z])|_", " ", short_name(control)).split()
    return " ".join(w[:1].upper() + w[1:] for w in words) or control


def title_in_region(control: str, sided: bool = True) -> str:
    """Words for a slider under its region's heading: no `Mouth` before `Corner Pull L`.

    Args:
        control: the control's name.
        sided: keep a last L or R; without, both sides share the words.
    """
    text = title(control)
    if not sided and text[-1:] in ("L", "R"):
        text = text[:-1].rstrip()
    first, _, rest = text.partition(" ")
    return rest if rest and first.lower() == region_of(control) else text


def region_of(control: str) -> str:
    """The face region of a control, one of REGIONS."""
    word = short_name(control).lower().removeprefix("ctrl_")
    for region, starts in _STARTS:
        if word.startswith(starts):
            return region
    return "other"


def group_controls(controls: Sequence[str]) -> dict[str, list[int]]:
    """Indices of the controls of each region.

    Args:
        controls: control names in index order.

    Returns:
        Region -> indices in their order, regions in the order of REGIONS, none empty.
    """
    groups: dict[str, list[int]] = {region: [] for region in REGIONS}
    for index, control in enumerate(controls):
        groups[region_of(control)].append(index)
    return {region: indices for region, indices in groups.items() if indices}


def matches(control: str, search: str) -> bool:
    """Whether every word of the search stands somewhere in the control's name or title."""
    text = f"{control} {title(control)}".lower()
    return all(word in text for word in search.lower().split())
