# SPDX-License-Identifier: MIT
"""Learns the range of each control from a person's captures, stores it, and rescales clips by it.

    found = learn(clip)                     a take in which the person goes to all extremes
    Path("ada.range.toml").write_text(ranges_text(found))
    clip = load_ranges("ada.range.toml").apply(clip)

A capture app may report closed eyes as eyeBlink 0.67, and a face at rest as a smile of 0.05. A
range holds a control's neutral and extreme value; rescaling maps them to 0 and 1.
"""

from __future__ import annotations

from .learning import MOST_GAIN, SHORTEST, learn
from .remap import NEUTRALS, WIDTHS, Learned, Range, Ranges, Remap, is_captured
from .text import load_ranges, parse_ranges, ranges_text

__all__ = [
    "MOST_GAIN",
    "NEUTRALS",
    "SHORTEST",
    "WIDTHS",
    "Learned",
    "Range",
    "Ranges",
    "Remap",
    "is_captured",
    "learn",
    "load_ranges",
    "parse_ranges",
    "ranges_text",
]
