# SPDX-License-Identifier: MIT
"""Finds the face region of joints by their names, and defines a colour for each region."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence

REGIONS = (
    "forehead, brow",
    "eye",
    "nose",
    "cheek",
    "mouth, lips",
    "teeth, tongue",
    "jaw, chin",
    "ear",
    "neck",
    "other",
)
# Region -> colour. The colours have a medium lightness, so that they are visible on white paper and
# on a dark screen.
COLORS = {
    "forehead, brow": "#8f6be0",
    "eye": "#2e86de",
    "nose": "#12a5a0",
    "cheek": "#f0932b",
    "mouth, lips": "#e04256",
    "teeth, tongue": "#ec86bd",
    "jaw, chin": "#a8744a",
    "ear": "#c9a517",
    "neck": "#54a24b",
    "other": "#8b95a1",
}
# Region, and the first letters of its joints' names. The first match counts: NasolabialBulge is a
# cheek although it begins like a nose.
_STARTS = (
    ("cheek", ("naso", "cheek", "masseter", "sideburn", "temple")),
    ("forehead, brow", ("forehead", "brow", "eyebrow", "hair", "skull", "corrugator")),
    ("eye", ("eye", "lid", "lash", "pupil", "iris")),
    ("nose", ("nose", "nostril")),
    ("mouth, lips", ("mouth", "lip", "lowerlip", "upperlip")),
    ("teeth, tongue", ("teeth", "tooth", "tongue", "gum")),
    ("jaw, chin", ("jaw", "chin", "underchin")),
    ("ear", ("ear",)),
    ("neck", ("neck", "adams", "throat", "clavicle", "spine")),
)
# Prefixes such as FACIAL_L_12IPV_, which state side and kind but not the region.
_PREFIX = re.compile(r"^(?:facial_)?(?:[lrc]_)?(?:12ipv_)?", re.IGNORECASE)


def joint_region(joint: str) -> str:
    """The face region of a joint, one of REGIONS."""
    word = _PREFIX.sub("", joint.rpartition(":")[2]).lower()
    for region, starts in _STARTS:
        if word.startswith(starts):
            return region
    return "other"


def regions_of(joints: Iterable[str]) -> list[str]:
    """The region of each joint."""
    return [joint_region(name) for name in joints]


def majority(indices: Iterable[int], regions: Sequence[str]) -> str:
    """The region that most of the joints have; on a tie the first one in REGIONS.

    "other" is returned only if no joint has another region.

    Args:
        indices: indices of joints; indices out of range are ignored.
        regions: region of each joint.
    """
    votes = Counter(regions[i] for i in indices if 0 <= i < len(regions))
    named = [region for region in REGIONS[:-1] if votes[region]]
    return max(named, key=lambda region: votes[region]) if named else "other"
