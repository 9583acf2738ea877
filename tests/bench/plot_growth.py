# SPDX-License-Identifier: MIT
"""Plots the output of `risorius bench FILE --sweep`: plot_growth.py GROWTH.csv OUT.png"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.ticker import NullFormatter

PANELS = {
    "active controls": ("active raw controls", "us"),
    "joints": ("joints that the matrices move", "us"),
    "LOD": ("coefficients that the LOD keeps", "us"),
    "faces": ("faces or frames at once", "us each"),
    "cores": ("cores, 64 faces on each", "us each"),
}
OURS, CSR, READ = "#0b6e8f", "#b3541e", "#7a7a7a"
Point = tuple[float, float, float | None, float | None]


def read(path: Path) -> tuple[str, dict[str, list[Point]]]:
    """The title in the first line of the file, and panel -> points sorted by x.

    A point is x, then the microseconds of Risorius, of a CSR matrix, and of only reading the active
    columns. The last two are None if they were not measured.
    """
    lines = path.read_text(encoding="utf-8").splitlines()
    points: dict[str, list[Point]] = {name: [] for name in PANELS}
    for row in csv.DictReader(lines[1:]):
        csr, tight = (float(row[name]) if row[name] else None for name in ("csr", "read"))
        points[row["what"]].append((float(row["x"]), float(row["us"]), csr, tight))
    return lines[0].removeprefix("# "), {name: sorted(p) for name, p in points.items()}


def draw(about: str, points: dict[str, list[Point]], out: Path) -> None:
    figure, axes = plt.subplots(1, len(PANELS), figsize=(15, 3.9), layout="constrained")
    for axis, (name, (x_label, y_label)) in zip(axes, PANELS.items(), strict=True):
        xs, ours, csr, tight = zip(*points[name], strict=True)
        for other, color, label in (
            (csr, CSR, "scalar CSR"),
            (tight, READ, "tight read of the active columns"),
        ):
            if any(b is not None for b in other):
                axis.loglog(xs, other, "o-", color=color, ms=3, lw=1, label=label)
        axis.loglog(xs, ours, "o-", color=OURS, ms=4, lw=1.5, label="Risorius")
        axis.set_xlabel(x_label)
        axis.set_ylabel(y_label)
        axis.grid(which="major", lw=0.5, color="#dddddd")
        axis.xaxis.set_minor_formatter(NullFormatter())
        for side in ("top", "right"):
            axis.spines[side].set_visible(False)
        if len(xs) < 4:
            axis.set_xticks(xs, [f"{x:g}" for x in xs])
            axis.minorticks_off()
    # The same range of times in all panels, so that they can be compared.
    low = min(axis.get_ylim()[0] for axis in axes)
    high = max(axis.get_ylim()[1] for axis in axes)
    for axis in axes:
        axis.set_ylim(low, high)
    named = axes[0].get_legend_handles_labels()
    figure.legend(*named, frameon=False, loc="outside lower center", ncols=3, fontsize=9)
    figure.suptitle(about, fontsize=9, color="#666666")
    figure.savefig(out, dpi=110)


if __name__ == "__main__":
    draw(*read(Path(sys.argv[1])), Path(sys.argv[2]))
