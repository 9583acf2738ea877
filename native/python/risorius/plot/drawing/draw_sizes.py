# SPDX-License-Identifier: MIT
"""Draws a bar for the size of each layer of the file, optionally with the counts."""

from __future__ import annotations

from matplotlib.axes import Axes

from ..content.facts import Facts, counts, human_bytes
from .paper import ACCENT, INK, MUTED, RULE, Canvas, heading


def draw(canvas: Canvas, facts: Facts, with_counts: bool) -> None:
    """Draws the bars, and the counts if requested.

    Args:
        canvas: receives the drawing.
        facts: facts of the face.
        with_counts: whether to draw the counts, which the HTML page has in a table.
    """
    high, counted = canvas.height - 0.7, 3.1 if with_counts else 0.0
    _draw_bars(canvas.place(2.35, 0.2, canvas.width - 2.7 - counted, high), facts)
    if with_counts:
        _draw_counts(canvas.place(canvas.width - 2.95, 0.2, 2.6, high), facts)


def _draw_bars(axes: Axes, facts: Facts) -> None:
    layers, total = facts.layers, max(facts.file_size, 1)
    heading(axes, f"{human_bytes(facts.file_size)} in {len(layers)} parts")
    places = range(len(layers))
    axes.barh(places, [layer.size for layer in layers], 0.66, color=ACCENT, linewidth=0)
    most = max(layer.size for layer in layers)
    for y, layer in zip(places, layers, strict=True):
        words = f"{human_bytes(layer.size)}  {layer.size / total:.1%}"
        axes.text(layer.size + 0.015 * most, y, words, va="center", fontsize=9.5, color=MUTED)
    axes.set_yticks(places, [_name(layer.title, layer.key) for layer in layers])
    axes.tick_params(axis="y", labelcolor=INK)
    axes.set(xlim=(0, 1.3 * most), ylim=(len(layers) - 0.4, -0.6))
    axes.set_xticks([])
    axes.spines["bottom"].set_visible(False)


def _name(title: str, key: str) -> str:
    return f"{title}  {key}" if key else title


def _draw_counts(axes: Axes, facts: Facts) -> None:
    heading(axes, "Counts")
    rows = counts(facts)
    axes.set(xlim=(0, 1), ylim=(len(rows) - 0.4, -0.6))
    axes.set_axis_off()
    for y, (name, value) in enumerate(rows):
        axes.axhline(y + 0.5, color=RULE, linewidth=0.6)
        axes.text(0, y, name, va="center", fontsize=9.5)
        shown = f"{value:,}" if value else "-"
        axes.text(1, y, shown, va="center", ha="right", fontsize=9.5, color=INK)
