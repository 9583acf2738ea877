# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the primary board: the outline of a face, with frames and labels of its handles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from . import board_layout, board_letters, primary_table
from .board_layout import DOWN, LEFT, RIGHT, UP, Board, Direction, Handle, Line
from .board_table import BoardTable

_TEXT, _LINE = 0.26, 0.36  # heights of letters and of lines, in board units
_GAP, _DISC = 0.12, 0.32  # from a frame to its label; radius of a handle at rest
# A board unit, and the distance of the board from the head, both as shares of the head's height. So
# head and board fill a view side by side.
_UNIT, _AWAY = 0.122, 0.07  # over the height of the head
_MARGIN = 0.1  # around the board
_SMOOTH = 6  # segments between two corners of an outline
# Half of the face's outline, with x >= 0, from the forehead down to the chin, in board units.
_FACE = (
    (0.0, 6.52), (1.6, 6.5), (3.35, 6.28), (4.45, 5.5), (4.82, 4.0), (4.8, 1.6), (4.72, -1.0),
    (4.55, -3.4), (4.15, -5.0), (3.3, -6.3), (2.2, -6.95), (0.0, -7.0),
)  # fmt: skip
# Tongue, in board units: x of its middle, half its width, y of its root, y at which the tip begins,
# length of the tip.
_TONGUE = (6.0, 1.05, 2.95, -5.2, 0.7)


def lay_out(table: BoardTable, handles: Sequence[Handle]) -> Board:
    """Draw the board around its handles.

    Args:
        table: the GUI controls of the primary board.
        handles: the handles of the primary board, with their places.

    Returns:
        Board with its centre at 0, 0.
    """
    lines = [*_outlines()]
    parts = primary_table.sides_of(table)
    for handle, (part, side) in zip(handles, parts, strict=True):
        x, y = handle.place
        lines += [[(x + a, y + b) for a, b in line] for line in board_layout.track_of(handle)]
        at = (-part.label_at[0], part.label_at[1]) if side == "R" else part.label_at
        lines += _label(handle, [_words(text, side) for text in part.label], at)
    return _centred(handles, lines)


def beside(low: ArrayLike, high: ArrayLike, width: float) -> tuple[list[float], float]:
    """Place the board beside the head, in the plane of the face.

    Args:
        low, high: float[3], corners of the bounding box of the head in Blender units; the face
            looks along -y.
        width: width of the board, in board units.

    Returns:
        Centre of the board, and the length of a board unit in Blender units.
    """
    low, high = np.asarray(low, np.float64), np.asarray(high, np.float64)
    tall = float(high[2] - low[2]) or 1.0
    x = float(high[0]) + tall * (_AWAY + _UNIT * width / 2)
    return [x, float(low[1]), float(low[2] + high[2]) / 2], tall * _UNIT


def _words(text: str, side: str) -> str:
    """The label of a handle. If the text names both ends of an axis, such as `inwards | outwards`,
    the order of the ends is reversed for a handle on the character's right side.

    Args:
        text: label of the handle, as in primary_table.Part.
        side: "L" or "R" of the character, or "" for the middle.
    """
    ends = text.split(" | ")
    return "   ".join(reversed(ends) if side == "R" else ends)


def _label(handle: Handle, rows: Sequence[str], at: Direction) -> Iterator[Line]:
    """The letters of a handle's label beside, above or below its frame.

    Args:
        handle: the handle.
        rows: the lines of the label, from the top down.
        at: side of the frame on which the label is placed: UP, DOWN, LEFT or RIGHT.
    """
    left, bottom, right, top = board_layout.frame_of(handle)
    left, bottom = min(left, _GAP - _DISC), min(bottom, _GAP - _DISC)
    right, top = max(right, _DISC - _GAP), max(top, _DISC - _GAP)
    x, y = handle.place
    high = _TEXT + _LINE * (len(rows) - 1)
    first = {
        UP: y + top + _GAP + high - _TEXT,
        DOWN: y + bottom - _GAP - _TEXT,
    }.get(at, y + (top + bottom + high) / 2 - _TEXT)
    for number, text in enumerate(rows):
        wide = board_letters.width(text, _TEXT)
        start = {RIGHT: x + right + _GAP, LEFT: x + left - _GAP - wide}.get(
            at, x + (left + right - wide) / 2
        )
        yield from board_letters.lines(text, start, first - number * _LINE, _TEXT)


def _outlines() -> Iterator[Line]:
    half = _smooth(_FACE)
    yield [*half, *((-x, y) for x, y in half[-2::-1])]
    middle, wide, root, low, bend = _TONGUE
    turns = np.linspace(np.pi, 2 * np.pi, 4 * _SMOOTH + 1)
    tip = [(middle + wide * float(np.cos(t)), low + bend * float(np.sin(t))) for t in turns]
    yield [(middle - wide, root), *tip, (middle + wide, root)]


def _smooth(corners: Sequence[tuple[float, float]]) -> Line:
    """A smooth curve through all corners (Catmull-Rom)."""
    points = np.array([corners[0], *corners, corners[-1]])
    out = [corners[0]]
    for a, b, c, d in zip(points, points[1:], points[2:], points[3:], strict=False):
        for t in np.arange(1, _SMOOTH + 1) / _SMOOTH:
            place = 0.5 * (
                2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2
                + (3 * b - a - 3 * c + d) * t**3
            )  # fmt: skip
            out.append((float(place[0]), float(place[1])))
    return out


def _centred(handles: Sequence[Handle], lines: Sequence[Line]) -> Board:
    points = np.array([point for line in lines for point in line])
    low, high = points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN
    x, y = ((low + high) / 2).tolist()
    width, height = (high - low).tolist()
    right, top = width / 2, height / 2
    corners = [(-right, top), (right, top), (right, -top), (-right, -top), (-right, top)]
    return Board(
        tuple(replace(h, place=(h.place[0] - x, h.place[1] - y)) for h in handles),
        tuple([(a - x, b - y) for a, b in line] for line in lines),
        (corners,),
        width,
        height,
    )
