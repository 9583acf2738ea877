# SPDX-License-Identifier: MIT
"""Writes a report on the accuracy of a rig made from expressions, as one HTML page."""

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
    """One LOD in the report."""

    joints: int
    vertices: int
    deltas: int  # blend shape deltas
    size: int  # bytes of a file with only this LOD
    microseconds: float  # median duration of one evaluation from Python
    rms: float  # mm, RMS error with joints only
    largest: float  # mm, largest error with joints only
    with_shapes: float  # mm, largest error with blend shapes


@dataclass(frozen=True)
class ExpressionRow:
    """One expression at LOD 0 in the report; lengths in millimetres."""

    name: str
    motion: float  # RMS displacement of the vertices
    rms: float  # RMS error with joints only
    largest: float  # largest error with joints only
    between: float  # largest error with joints only at the weights 0.25, 0.5 and 0.75
    with_shapes: float  # largest error with blend shapes
    worst: str  # mesh name and vertex index of `largest`, with a space between


def render(
    facts: Facts,
    levels: Sequence[LevelRow],
    rows: Sequence[ExpressionRow],
    worst: Sequence[draw_errors.Expression],
    dpi: int,
) -> bytes:
    """The report as HTML in UTF-8.

    Args:
        facts: facts of the new face.
        levels: one row per LOD.
        rows: one row per expression.
        worst: the expressions to draw, which have the largest errors, with the errors of a rig
            without blend shapes.
        dpi: resolution of bitmaps in dots per inch.
    """
    # The colour scale ends at 1.25 times the median of the drawn expressions' largest errors,
    # because with a scale up to one very large error all other heads would have no colour.
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
