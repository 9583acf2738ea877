# SPDX-License-Identifier: MIT
"""How far each control goes in the captures of a person: learned, kept as a file, taken out.

    found = learn(clip)                     a take in which the person goes to all extremes
    Path("ada.range.toml").write_text(ranges_text(found))
    clip = load_ranges("ada.range.toml").apply(clip)

A capture app reads eyes that are closed as eyeBlink 0.67, and a face at rest as a smile of 0.05.
A range says which values of a control are its neutral and its extreme; they become 0 and 1.
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
