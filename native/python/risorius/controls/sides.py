# SPDX-License-Identifier: MIT
"""Finds the partner of a control by left and right in its name."""

from __future__ import annotations

import re

_SIDES = {"L": "R", "R": "L"}
_WORDS = {"Left": "Right", "Right": "Left"}
_AT_THE_END = re.compile(r"[LR](?=$|Ph\d$)")


def mirrored_name(name: str) -> str:
    """The partner of a control in a mirror: ...L and ...R, ...Left and ...Right.

    Both are swapped if a name contains both: eyeLookLeftL gives eyeLookRightR. A control without a
    side is its own partner.
    """
    before, dot, last = name.rpartition(".")
    if before in ("eyeL", "eyeR"):
        return f"eye{_SIDES[before[-1]]}.{last}"
    last = re.sub("Left|Right", lambda match: _WORDS[match[0]], last)
    return before + dot + _on_the_other_side(last)


def name_across(name: str) -> str:
    """The same control on the other side: eyeLookLeftL gives eyeLookLeftR, the same direction.

    A name without L or R at its end, such as jawLeft or eyeL.yaw, gives itself.
    """
    before, dot, last = name.rpartition(".")
    return before + dot + _on_the_other_side(last)


def _on_the_other_side(last: str) -> str:
    return _AT_THE_END.sub(lambda match: _SIDES[match[0]], last)
