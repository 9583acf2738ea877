# SPDX-License-Identifier: MIT
"""Draws the memory layout of joint matrices in a file and in a Rig: draw_layout.py OUT.png"""

from __future__ import annotations

import sys

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.patches import Rectangle

# Two joint groups: (number of rows, number of rows that the coarse LOD uses, for each column the
# index of its control in CONTROLS).
GROUPS = [(7, 3, [0, 1, 3, 4]), (5, 2, [1, 2, 4])]
CONTROLS = ["jawOpen", "smileL", "blinkL", "smileL x jawOpen", "browUp"]
ACTIVE = {1, 3}
REST, LIVE, FADED, FRAME = "#d7dde1", "#0b6e8f", "#8fc1d1", "#5a6770"


def cell(axis: plt.Axes, x: float, y: float, control: int, kept: bool, width: float = 0.92) -> None:
    color = REST if control not in ACTIVE else LIVE if kept else FADED
    axis.add_patch(Rectangle((x, y), width, 0.92, color=color, lw=0))


def draw_file(axis: plt.Axes) -> None:
    x = 0.0
    for g, (rows, kept, controls) in enumerate(GROUPS):
        for c, control in enumerate(controls):
            for r in range(rows):
                cell(axis, x + c, r, control, r < kept)
            axis.text(
                x + c + 0.46, -0.4, CONTROLS[control], rotation=55, fontsize=8, va="bottom",
                color=LIVE if control in ACTIVE else FRAME,
            )  # fmt: skip
        axis.plot([x - 0.2, x + len(controls) + 0.1], [kept - 0.04] * 2, color=FRAME, lw=1, ls=":")
        axis.text(x, rows + 0.9, f"joint group {g + 1}", fontsize=9, color=FRAME)
        x += len(controls) + 1.6
    axis.text(x - 0.9, 2.1, "rows below the line: fine LODs only", fontsize=8, color=FRAME)
    axis.text(x - 0.9, 3.6, "smileL and its corrective are active:", fontsize=8, color=FRAME)
    axis.text(x - 0.9, 4.6, "dark is read at every LOD,", fontsize=8, color=LIVE)
    axis.text(x - 0.9, 5.6, "light at fine ones as well,", fontsize=8, color="#4d93a8")
    axis.text(x - 0.9, 6.6, "grey never", fontsize=8, color=FRAME)
    axis.set_title("in the file: a dense matrix per group, by rows", fontsize=10, loc="left")


def draw_rig(axis: plt.Axes) -> None:
    x = 0.0
    for control, name in enumerate(CONTROLS):
        first = x
        for g, (rows, kept, controls) in enumerate(GROUPS):
            if control not in controls:
                continue
            for r in range(rows):
                cell(axis, x + r * 0.5, 0, control, r < kept, 0.44)
            axis.text(x, 1.35, str(g + 1), fontsize=8, color=FRAME)
            x += rows * 0.5 + 0.12
        axis.text(
            (first + x) / 2 - 0.1, -0.5, name, fontsize=8, ha="center",
            color=LIVE if control in ACTIVE else FRAME,
        )  # fmt: skip
        x += 0.35
    axis.set_title(
        "in a Rig: control after control, each with its columns of all groups",
        fontsize=10,
        loc="left",
    )


def main(out: str) -> None:
    figure, (top, bottom) = plt.subplots(
        2, 1, figsize=(9, 4.6), height_ratios=[3, 1.1], layout="constrained"
    )
    draw_file(top)
    draw_rig(bottom)
    for axis, (left, right, low, high) in (
        (top, (-0.5, 24.5, 8.4, -4.6)),
        (bottom, (-0.5, 24.5, 1.9, -1.3)),
    ):
        axis.set_xlim(left, right)
        axis.set_ylim(low, high)
        axis.set_aspect("equal" if axis is top else "auto")
        axis.set_axis_off()
    figure.savefig(out, dpi=110)


if __name__ == "__main__":
    main(sys.argv[1])
