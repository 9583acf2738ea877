# SPDX-License-Identifier: MIT
"""Draws the joint matrix in the file's order, and regrouped into dense blocks."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, MaxNLocator

from ..content import matrix
from ..content.facts import Facts
from ..content.regions import COLORS, REGIONS
from .paper import INK, MUTED, RULE, Canvas, heading, rgb

_TITLES = {"raw": "raw controls", "psd": "correctives", "ml": "networks", "rbf": "RBF poses"}


def draw(canvas: Canvas, facts: Facts, dpi: int) -> None:
    """Draws the matrix in both orders, side by side.

    Args:
        canvas: receives the drawing.
        facts: facts of the rig.
        dpi: resolution of the images in dots per inch.
    """
    if not facts.stored:
        canvas.say("This file has no joint matrix: no control moves a joint.")
        return
    high, wide = canvas.height - 1.35, (canvas.width - 3.7) / 2
    pixels = (round(high * dpi), round(wide * dpi))
    _draw_by_index(canvas.place(0.95, 0.65, wide, high), facts, pixels)
    _draw_regrouped(canvas.place(0.95 + wide + 1.0, 0.65, wide, high), facts, pixels)


def _draw_by_index(axes: Axes, facts: Facts, pixels: tuple[int, int]) -> None:
    total = sum(count for _, count in facts.controls)
    cells = matrix.by_index(facts.dna, total)
    rows, columns = cells.shape
    _show(axes, cells, facts, pixels)
    share = facts.nonzero / (rows * columns)
    heading(
        axes,
        "By joint index: sparse",
        f"{rows:,} rows x {columns:,} columns, {share:.1%} not zero",
    )
    axes.set_ylabel("joint attribute (9 x joint + attribute)", labelpad=6)
    _draw_kinds(axes, facts, columns)
    _draw_row_owners(axes, facts, rows)


def _show(axes: Axes, cells: matrix.Cells, facts: Facts, pixels: tuple[int, int]) -> None:
    colors = np.array([rgb(region) for region in facts.group_regions]).reshape(-1, 3)
    rows, columns = cells.shape
    axes.imshow(
        matrix.image(cells, colors, pixels),
        extent=(0, columns, rows, 0),
        aspect="auto",
        interpolation="none",
    )
    axes.set(xlim=(0, columns), ylim=(rows, 0))
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MaxNLocator(6, integer=True, min_n_ticks=1))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    axes.spines[:].set_visible(True)


def _draw_kinds(axes: Axes, facts: Facts, columns: int) -> None:
    """Draws borders between the kinds of controls, and their names below the matrix."""
    at, kinds = 0, [(_TITLES[kind], count) for kind, count in facts.controls if count]
    if columns > (known := sum(count for _, count in kinds)):
        kinds.append(("unknown", columns - known))
    edges = [0, *np.cumsum([count for _, count in kinds]).tolist()]
    axes.set_xticks(edges, [f"{edge:,}" for edge in edges])
    for edge in edges[1:-1]:
        axes.axvline(edge, color=INK, linewidth=0.9)
    for title, count in kinds:
        # The name of a kind with few columns would overlap its neighbours, so it is left out.
        if count > 0.12 * columns:
            axes.annotate(
                title, (at + count / 2, 0), (0, -20), axes.get_xaxis_transform(), "offset points",
                ha="center", va="top", fontsize=9.5, color=MUTED, annotation_clip=False,
            )  # fmt: skip
        at += count
    labels = axes.get_xticklabels()[1:-1]
    for label, (edge, after) in zip(labels, pairwise(edges[1:]), strict=True):
        label.set_visible(after - edge > 0.08 * columns)


def _draw_row_owners(axes: Axes, facts: Facts, rows: int) -> None:
    """Draws a stripe left of the matrix with the region of each row's joint group, and lines
    between groups."""
    owner = np.full(rows, -1)
    for number, group in enumerate(facts.dna.joint_groups):
        owner[np.asarray(group.output_indices, np.int64)] = number
    joint_owner = owner[: rows // 9 * 9].reshape(-1, 9).max(axis=1)
    edges = [0, *(np.flatnonzero(np.diff(joint_owner)) + 1).tolist(), len(joint_owner)]
    width = 0.016 * axes.get_xlim()[1]
    stripes, colors, lines = [], [], []
    for first, last in pairwise(edges):
        if first < last and joint_owner[first] >= 0:
            stripes.append(Rectangle((-1.5 * width, 9 * first), width, 9 * (last - first)))
            colors.append(COLORS[facts.group_regions[int(joint_owner[first])]])
        lines.append([(0, 9 * first), (axes.get_xlim()[1], 9 * first)])
    patches = PatchCollection(stripes, facecolor=colors, edgecolor="none", clip_on=False)
    axes.add_collection(patches, autolim=False)
    # There is a line wherever the joint group of the rows changes. If there are more than 100
    # lines, none is drawn, because they would hide the coefficients.
    if len(lines) <= 100:
        axes.add_collection(LineCollection(lines, colors=MUTED, linewidths=0.35), autolim=False)
    axes.tick_params(axis="y", pad=9)


def _draw_regrouped(axes: Axes, facts: Facts, pixels: tuple[int, int]) -> None:
    cells, blocks = matrix.regrouped(facts.dna, facts.group_regions)
    _show(axes, cells, facts, pixels)
    axes.spines[["top", "right"]].set_visible(False)
    heading(
        axes,
        "By joint group: dense",
        f"{facts.stored:,} stored in {len(blocks)} group{'' if len(blocks) == 1 else 's'}, "
        f"{facts.nonzero / facts.stored:.0%} not zero",
    )
    axes.set_xlabel("controls that the group reads", labelpad=6)
    axes.set_ylabel("rows, group after group", labelpad=6)
    # The outlines show the extent of blocks whose rim consists of zeros.
    frames = PatchCollection(
        [Rectangle((0, block.top), block.columns, block.rows) for block in blocks],
        facecolor="none",
        edgecolor=[_darker(block.region) for block in blocks],
        linewidth=0.8,
    )
    axes.add_collection(frames, autolim=False)
    _draw_regions(axes, facts, blocks, cells.shape)


def _darker(region: str) -> tuple[float, float, float]:
    red, green, blue = (rgb(region) * 0.72).tolist()
    return red, green, blue


def _draw_regions(
    axes: Axes, facts: Facts, blocks: list[matrix.Block], shape: tuple[int, int]
) -> None:
    """Writes name, number of groups and share of coefficients of each region beside the blocks."""
    rows, _ = shape
    stored = facts.stored
    spans = []
    for region in REGIONS:
        own = [block for block in blocks if block.region == region]
        if own:
            top, bottom = own[0].top, own[-1].top + own[-1].rows
            share = sum(block.rows * block.columns for block in own) / stored
            spans.append((region, top / rows, bottom / rows, len(own), share))
    line = 0.052  # height of two lines of text as a fraction of the panel
    wanted = [(top + bottom) / 2 for _, top, bottom, _, _ in spans]
    for (region, begin, end, count, share), y in zip(spans, _apart(wanted, line), strict=True):
        color = COLORS[region]
        at = axes.transAxes
        axes.plot(
            [1.02, 1.02], [1 - begin, 1 - end], transform=at, color=color, linewidth=3,
            clip_on=False, solid_capstyle="butt",
        )  # fmt: skip
        middle = 1 - (begin + end) / 2
        axes.plot(
            [1.03, 1.06], [middle, 1 - y], transform=at, color=RULE, linewidth=0.8, clip_on=False
        )
        axes.text(1.07, 1 - y + 0.002, region, transform=at, fontsize=10, va="bottom", color=INK)
        groups = f"{count} group{'s' if count > 1 else ''}, {share:.0%}"
        axes.text(1.07, 1 - y - 0.002, groups, transform=at, fontsize=9, va="top", color=MUTED)


def _apart(places: list[float], gap: float) -> list[float]:
    """The positions, moved so that neighbours are at least `gap` apart.

    Args:
        places: ascending positions from 0 to 1.
        gap: smallest distance.
    """
    moved: list[float] = []
    for y in places:
        moved.append(max(y, moved[-1] + gap) if moved else max(y, gap / 2))
    limit = 1 - gap / 2
    for i in range(len(moved) - 1, -1, -1):
        moved[i] = min(moved[i], limit)
        limit = moved[i] - gap
    return moved
