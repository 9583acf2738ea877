# SPDX-License-Identifier: MIT
"""Draws bar charts of the LODs: joints by region; coefficients, blend shapes, animated maps."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, MaxNLocator

from ..content.facts import Facts
from ..content.regions import COLORS, REGIONS
from .paper import ACCENT, MUTED, RULE, Canvas, compact, heading


def draw(canvas: Canvas, facts: Facts) -> None:
    """Draws a chart of joints, and small charts of coefficients, blend shapes and animated
    maps, per LOD.

    Args:
        canvas: receives the drawing.
        facts: facts of the face.
    """
    if not facts.lods:
        canvas.say("This file has no levels of detail.")
        return
    high, half = canvas.height - 0.95, canvas.width / 2
    _draw_joints(canvas.place(0.85, 0.45, half - 0.85, high), facts)
    rows = [
        ("Joint coefficients", [lod.coefficients for lod in facts.lods]),
        ("Blend shape channels", [lod.channels for lod in facts.lods]),
        ("Animated maps", [lod.maps for lod in facts.lods]),
    ]
    for i, (title, values) in enumerate(rows):
        bottom = 0.45 + (2 - i) * (high + 0.5) / 3
        axes = canvas.place(half + 0.6, bottom, half - 0.95, (high + 0.5) / 3 - 0.5)
        _draw_work(axes, title, values, last=i == 2)


def _ticks(axes: Axes, count: int) -> None:
    axes.set_xticks(range(count), [f"LOD {i}" if count < 10 else str(i) for i in range(count)])
    axes.set_xlim(-0.6, max(count, 4) - 0.4)
    axes.spines["left"].set_visible(False)


def _draw_joints(axes: Axes, facts: Facts) -> None:
    count = len(facts.lods)
    heading(axes, "Joints per level, by region")
    totals = [sum(lod.joints.values()) for lod in facts.lods]
    base = [0] * count
    for region in reversed(REGIONS):
        values = [lod.joints[region] for lod in facts.lods]
        if any(values):
            axes.bar(range(count), values, 0.72, base, color=COLORS[region], linewidth=0)
            base = [a + b for a, b in zip(base, values, strict=True)]
    top = max([*totals, 1])
    for i, total in enumerate(totals):
        axes.text(i, total + 0.015 * top, f"{total:,}", ha="center", fontsize=10)
    _ticks(axes, count)
    axes.set_ylim(0, 1.06 * top)
    axes.set_axisbelow(True)
    axes.grid(axis="y", color=RULE, linewidth=0.6)
    axes.yaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))


def _draw_work(axes: Axes, title: str, values: list[int], last: bool) -> None:
    heading(axes, title)
    axes.bar(range(len(values)), values, 0.72, color=ACCENT, linewidth=0)
    top = max([*values, 1])
    for i, value in enumerate(values):
        axes.text(
            i, value + 0.04 * top, compact(value), ha="center", fontsize=9,
            color=MUTED,
        )  # fmt: skip
    _ticks(axes, len(values))
    axes.tick_params(axis="x", labelsize=8)
    axes.set_ylim(0, 1.22 * top)
    axes.set_yticks([])
    axes.tick_params(axis="x", labelbottom=last)
