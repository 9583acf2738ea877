# SPDX-License-Identifier: MIT
"""Draws the joint matrix of one face before and after regrouping."""

from __future__ import annotations

import io
import textwrap

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure, SubFigure

from .content.facts import Facts
from .content.regions import COLORS
from .drawing import draw_matrix
from .drawing.paper import INK, MUTED, settings
from .sheet import panel, split

# Sizes in inches.
WIDTH, HEAD, BODY = 23.0, 1.05, 9.0
_EDGE = 0.35


def render(before: Facts, after: Facts, kind: str, dpi: int) -> bytes:
    """Draws both joint matrices side by side.

    Args:
        before: the face with its old joint groups.
        after: the face with its new joint groups.
        kind: "png" or "svg".
        dpi: resolution in dots per inch.

    Returns:
        The bytes of the picture.
    """
    with settings():
        figure = Figure(figsize=(WIDTH, HEAD + BODY), dpi=dpi, facecolor="white")
        FigureCanvasAgg(figure)
        head, body = split(figure, rows=[HEAD, BODY])
        _draw_head(head, before)
        half = WIDTH / 2
        for part, title, facts in zip(
            split(body, columns=[1, 1]), ("Before", "After"), (before, after), strict=True
        ):
            draw_matrix.draw(panel(part, title, _caption(facts), half, BODY), facts, dpi)
        out = io.BytesIO()
        about = {"Date": None} if kind == "svg" else {"Software": "risorius"}
        figure.savefig(out, format=kind, facecolor="white", metadata=about)
        return out.getvalue()


def _caption(facts: Facts) -> str:
    groups = len(facts.dna.joint_groups)
    share = facts.nonzero / facts.stored if facts.stored else 0
    return (
        f"{groups:,} joint group{'' if groups == 1 else 's'} with {facts.stored:,} coefficients, "
        f"{facts.nonzero:,} ({share:.1%}) of them not zero."
    )


def _draw_head(figure: SubFigure, facts: Facts) -> None:
    """Draws the face's title, the file name, and the legend of regions."""
    edge, step = _EDGE / WIDTH, 1.75 / WIDTH
    title = textwrap.shorten(facts.title, 60, placeholder="...")
    figure.text(edge, 0.66, title, fontsize=22, fontweight="bold", va="center")
    figure.text(
        edge, 0.24, f"{facts.file_name} | joint matrix before and after regrouping",
        fontsize=10.5, color=MUTED, va="center",
    )  # fmt: skip
    found = list(facts.region_counts())
    columns = (len(found) + 1) // 2
    for i, region in enumerate(found):
        row, column = divmod(i, columns)
        x, y = 1 - edge - (columns - column) * step, (0.66, 0.26)[row]
        figure.text(x, y, "\u25cf", fontsize=15, color=COLORS[region], va="center")
        figure.text(x + 0.22 / WIDTH, y, region, fontsize=10.5, va="center", color=INK)
