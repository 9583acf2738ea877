# SPDX-License-Identifier: MIT
"""The report of a rig made from expressions and its accuracy: one self-contained HTML page."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .content import words
from .content.facts import Facts
from .drawing import draw_errors, draw_face, draw_levels, draw_matrix
from .drawing.paper import settings
from .page import WIDTH, document, section


@dataclass(frozen=True)
class LevelRow:
    """The page's data on a level of detail."""

    joints: int
    vertices: int
    deltas: int
    size: int  # bytes of a file with only this level
    microseconds: float  # median time of a pose requested from Python
    rms: float  # mm, with joints only
    largest: float  # mm, with joints only
    with_shapes: float  # mm, largest error with blend shapes


@dataclass(frozen=True)
class ExpressionRow:
    """The page's data on an expression at LOD 0, in millimetres."""

    name: str
    motion: float
    rms: float
    largest: float
    between: float  # the largest at 0.25, 0.5 and 0.75
    with_shapes: float
    worst: str  # mesh and vertex


def render(
    facts: Facts,
    levels: Sequence[LevelRow],
    rows: Sequence[ExpressionRow],
    worst: Sequence[draw_errors.Expression],
    dpi: int,
) -> bytes:
    """The page as HTML in UTF-8.

    Args:
        facts: facts of the new face.
        levels: one row per LOD.
        rows: one row per expression.
        worst: the expressions to draw, with joints only.
        dpi: dots per inch of its pictures.
    """
    # A single large error would leave everything else colourless, so it may exceed the scale.
    most = 1.25 * float(np.median([e.largest for e in worst] or [0.05]))
    lines = [
        f"{level.joints:,} joints, {level.vertices:,} vertices\n"
        f"{level.rms:.3f} mm RMS, {level.largest:.2f} mm largest"
        for level in levels
    ]
    with settings():
        sections = [
            section("errors", "Where joints alone are off",
                    "The expressions with the largest errors at LOD 0, each at 1 and in its "
                    "requested form; blend shape deltas are not counted.",
                    draw_errors.height(len(worst), WIDTH), dpi,
                    lambda canvas: draw_errors.draw(canvas, facts.dna, worst, most, dpi),
                    after=_expressions(rows)),
            section("levels", "Levels of detail",
                    "The meshes of each level and its joints, coloured by region. A joint of a "
                    "coarser level is one of the finer, and moves as it does there.",
                    draw_levels.height(len(levels), WIDTH), dpi,
                    lambda canvas: draw_levels.draw(canvas, facts, lines, dpi),
                    after=_levels(levels)),
            section("face", words.FACE, words.face(0), 8.1, dpi,
                    lambda canvas: draw_face.draw(canvas, facts, 0, dpi)),
            section("matrix", words.MATRIX, words.matrix(facts), 9.2, dpi,
                    lambda canvas: draw_matrix.draw(canvas, facts, 2 * dpi)),
        ]  # fmt: skip
    links = [("errors", "errors"), ("levels", "levels"), ("face", "joints"), ("matrix", "matrix")]
    return document(facts, "\n".join(sections), links).encode()


def _table(titles: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f"<th>{html.escape(title)}</th>" for title in titles)
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    return f'<div class="tables">{table}</div>'


def _levels(levels: Sequence[LevelRow]) -> str:
    titles = ["LOD", "joints", "vertices", "deltas", "kB", "us a pose", "RMS mm", "largest mm"]
    return _table(
        [*titles, "with shapes mm"],
        [
            [
                str(lod), f"{x.joints:,}", f"{x.vertices:,}", f"{x.deltas:,}",
                f"{x.size / 1e3:,.0f}", f"{x.microseconds:.2f}", f"{x.rms:.4f}",
                f"{x.largest:.3f}", f"{x.with_shapes:.3f}",
            ]
            for lod, x in enumerate(levels)
        ],
    )  # fmt: skip


def _expressions(rows: Sequence[ExpressionRow]) -> str:
    titles = [
        "expression",
        "motion RMS mm",
        "RMS mm",
        "largest mm",
        "on the way mm",
        "with shapes mm",
    ]
    return _table(
        [*titles, "worst vertex"],
        [
            [
                x.name, f"{x.motion:.3f}", f"{x.rms:.4f}", f"{x.largest:.3f}", f"{x.between:.3f}",
                f"{x.with_shapes:.3f}", x.worst,
            ]
            for x in sorted(rows, key=lambda row: -row.largest)
        ],
    )  # fmt: skip
