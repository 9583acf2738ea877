# SPDX-License-Identifier: GPL-3.0-or-later
"""A stroke font for labels on the face board: letters 4 units wide and 6 units high."""

from __future__ import annotations

from collections.abc import Iterator

Point = tuple[float, float]

# Letter -> its strokes, separated by commas. A stroke lists its points with spaces between them. A
# point is two digits, x and y: 06 is x = 0, y = 6.
_STROKES = {
    "A": "00 05 16 36 45 40,03 43", "B": "00 06 36 45 44 33 03,33 42 41 30 00",
    "C": "45 36 16 05 01 10 30 41", "D": "00 06 26 44 42 20 00", "E": "46 06 00 40,03 33",
    "F": "46 06 00,03 33", "G": "45 36 16 05 01 10 30 41 43 23", "H": "00 06,40 46,03 43",
    "I": "16 36,26 20,10 30", "J": "46 41 30 10 01", "K": "00 06,46 02,13 40", "L": "06 00 40",
    "M": "00 06 23 46 40", "N": "00 06 40 46", "O": "10 01 05 16 36 45 41 30 10",
    "P": "00 06 36 45 44 33 03", "Q": "10 01 05 16 36 45 41 30 10,22 40",
    "R": "00 06 36 45 44 33 03,23 40", "S": "45 36 16 05 04 13 33 42 41 30 10 01",
    "T": "06 46,26 20", "U": "06 01 10 30 41 46", "V": "06 20 46", "W": "06 10 23 30 46",
    "X": "00 46,06 40", "Y": "06 23 46,23 20", "Z": "06 46 00 40",
    "0": "10 01 05 16 36 45 41 30 10",
    "1": "15 26 20,10 30", "2": "05 16 36 45 44 00 40", "3": "06 46 23 33 42 41 30 10 01",
    "4": "30 36 02 42", "5": "46 06 03 33 42 41 30 10 01", "6": "36 16 05 01 10 30 41 42 33 03",
    "7": "06 46 10", "8": "13 04 05 16 36 45 44 33 13 02 01 10 30 41 42 33",
    "9": "10 30 41 45 36 16 05 04 13 43", "-": "13 33", ".": "20 21", "+": "13 33,22 24",
    "/": "00 46",
}  # fmt: skip
_WIDTH = 0.62  # factor that narrows the letters
_ADVANCE = 5.6 / 6.0 * _WIDTH  # distance between letters of height 1


def width(text: str, height: float) -> float:
    """The width of a text.

    Args:
        text: the text, in one line.
        height: height of the letters, in the unit of the result.
    """
    return max(0.0, (len(text) * _ADVANCE - 1.6 / 6.0 * _WIDTH) * height)


def lines(text: str, x: float, y: float, height: float) -> Iterator[list[Point]]:
    """The strokes of a text as lines.

    Args:
        text: one line; unknown letters leave a gap.
        x, y: lower left corner of the text.
        height: height of the letters, in the unit of x and y.
    """
    unit = height / 6.0
    for place, letter in enumerate(text.upper()):
        start = x + place * _ADVANCE * height
        for stroke in _STROKES.get(letter, "").split(","):
            corners = stroke.split()
            if corners:
                yield [(start + int(c[0]) * unit * _WIDTH, y + int(c[1]) * unit) for c in corners]
