# SPDX-License-Identifier: MIT
"""Draws all four figures of a rig on one sheet, as PNG."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, FigureBase, SubFigure

from .content import words
from .content.facts import Facts, descriptor
from .content.regions import COLORS
from .drawing import draw_face, draw_lods, draw_matrix, draw_sizes
from .drawing.paper import INK, MUTED, RULE, Canvas, settings

# Sizes in inches: WIDTH of the sheet; heights of the line with the name (HEAD), of the upper row of
# drawings (UPPER) and of the lower row (LOWER); LEFT, the width of two views of a head that are as
# high as the joint matrix beside them.
WIDTH, HEAD, UPPER, LOWER = 22.0, 1.15, 9.6, 5.9
LEFT = 10.8
_EDGE = 0.35


def render(facts: Facts, lod: int, dpi: int) -> bytes:
    """Draws the sheet, and returns the bytes of a PNG file.

    Args:
        facts: facts of the face.
        lod: number of the LOD to draw, from 0.
        dpi: resolution in dots per inch.
    """
    with settings():
        figure = Figure(figsize=(WIDTH, HEAD + UPPER + LOWER), dpi=dpi, facecolor="white")
        FigureCanvasAgg(figure)
        head, upper, lower = split(figure, rows=[HEAD, UPPER, LOWER])
        _draw_head(head, facts)
        widths = [LEFT, WIDTH - LEFT]
        face, matrix = split(upper, columns=widths)
        lods, sizes = split(lower, columns=widths)
        right = WIDTH - LEFT
        draw_face.draw(panel(face, words.FACE, words.face(lod), LEFT, UPPER), facts, lod, dpi)
        draw_matrix.draw(panel(matrix, words.MATRIX, words.matrix(facts), right, UPPER), facts, dpi)
        draw_lods.draw(panel(lods, words.LODS, words.lods(), LEFT, LOWER), facts)
        draw_sizes.draw(
            panel(sizes, words.SIZES, words.sizes(facts), right, LOWER), facts, with_counts=True
        )
        out = io.BytesIO()
        figure.savefig(out, format="png", facecolor="white", metadata={"Software": "risorius"})
        return out.getvalue()


def split(
    figure: FigureBase, rows: Sequence[float] = (1,), columns: Sequence[float] = (1,)
) -> list[SubFigure]:
    """Divides a figure into parts, from top to bottom or from left to right.

    Args:
        figure: a figure or a part of one.
        rows: relative heights of the parts.
        columns: relative widths of the parts.
    """
    parts = figure.subfigures(
        len(rows), len(columns), squeeze=False, height_ratios=rows, width_ratios=columns,
        hspace=0, wspace=0,
    )  # fmt: skip
    return list(np.ravel(np.asarray(parts)))


def _draw_head(figure: SubFigure, facts: Facts) -> None:
    """Draws the character's name and the legend of regions."""
    edge = _EDGE / WIDTH
    title = textwrap.shorten(facts.title, 60, placeholder="...")
    figure.text(edge, 0.64, title, fontsize=22, fontweight="bold", va="center")
    figure.text(
        edge, 0.22, f"{facts.file_name} | {descriptor(facts)}", fontsize=10.5, color=MUTED,
        va="center",
    )  # fmt: skip
    found = list(facts.region_counts().items())
    columns, step = (len(found) + 1) // 2, 2.0 / WIDTH
    for i, (region, count) in enumerate(found):
        row, column = divmod(i, columns)
        x, y = 1 - edge - (columns - column) * step, (0.64, 0.24)[row]
        figure.text(x, y, "\u25cf", fontsize=15, color=COLORS[region], va="center")
        figure.text(x + 0.22 / WIDTH, y, region, fontsize=10.5, va="center", color=INK)
        figure.text(
            x + 1.78 / WIDTH, y, f"{count:,}", fontsize=10, va="center", ha="right", color=MUTED
        )


def panel(figure: SubFigure, title: str, caption: str, width: float, height: float) -> Canvas:
    """Draws a heading with a caption, and returns the canvas below them.

    Args:
        figure: the part of the sheet to fill.
        title: the heading.
        caption: a sentence below the heading, broken into lines.
        width, height: size of the part in inches.
    """
    edge = _EDGE / width
    lines = textwrap.wrap(caption, round(width * 13))
    top = 0.68 + 0.19 * len(lines)
    head, rest = split(figure, rows=[top, height - top])
    rule = head.add_axes((edge, 0.95, 1 - 2 * edge, 0.001))
    rule.set_axis_off()
    rule.axhline(0, color=RULE, linewidth=1.2, clip_on=False)
    head.text(edge, 1 - 0.36 / top, title, fontsize=15, fontweight="bold", va="center")
    head.text(
        edge, 1 - 0.58 / top, "\n".join(lines), fontsize=10, color=MUTED, va="top", linespacing=1.3
    )
    return Canvas(rest, width, height - top)
