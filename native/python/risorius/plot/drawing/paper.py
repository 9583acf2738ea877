# SPDX-License-Identifier: MIT
"""The style of all drawings, and a canvas with sizes in inches."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import FigureBase

from ..content.regions import COLORS

# Colours of the drawings. page.py replaces these values in the SVG text by colour variables of the
# HTML page, so that the drawings follow its light or dark theme.
INK = "#1d232b"
MUTED = "#66707d"
RULE = "#d4dae1"
ACCENT = "#4076b8"

_SETTINGS: dict[Any, Any] = {
    "font.family": ["DejaVu Sans"],
    "font.size": 10.0,
    "text.color": INK,
    "axes.labelcolor": MUTED,
    "axes.edgecolor": RULE,
    "axes.facecolor": "none",
    "axes.linewidth": 0.8,
    "axes.labelsize": 9.5,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelsize": 9.0,
    "ytick.labelsize": 9.0,
    "xtick.major.size": 0.0,
    "ytick.major.size": 0.0,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "svg.fonttype": "path",
    "svg.hashsalt": "risorius",  # makes the SVG of a rig reproducible
    "image.composite_image": False,
    "text.parse_math": False,  # names from files may contain dollar signs
}


@contextmanager
def settings() -> Iterator[None]:
    """Applies the style inside the context, and restores the caller's settings afterwards."""
    log = logging.getLogger("matplotlib.font_manager")
    level = log.level
    with matplotlib.rc_context(), warnings.catch_warnings():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS)
        # Matplotlib draws a box for a letter that the font lacks; the warning about it is hidden.
        warnings.filterwarnings("ignore", "Glyph")
        log.setLevel(logging.ERROR)
        try:
            yield
        finally:
            log.setLevel(level)


def rgb(region: str) -> npt.NDArray[np.float64]:
    """float64[3] in 0..1: the colour of a region."""
    return np.array(to_rgb(COLORS[region]))


@dataclass(frozen=True)
class Canvas:
    """A figure, or a part of one, with its size in inches. Drawings place their axes in inches."""

    figure: FigureBase
    width: float
    height: float

    def place(self, left: float, bottom: float, width: float, height: float) -> Axes:
        """Adds axes that show only their lower and left line.

        Args:
            left, bottom: lower left corner of the axes, in inches from the canvas's corner.
            width, height: size of the axes in inches.
        """
        part = (left / self.width, bottom / self.height, width / self.width, height / self.height)
        axes = self.figure.add_axes(part)
        axes.spines[["top", "right"]].set_visible(False)
        return axes

    def say(self, sentence: str) -> None:
        """Writes a sentence in place of a drawing."""
        self.figure.text(0.5, 0.5, sentence, ha="center", va="center", color=MUTED, fontsize=12)


def heading(axes: Axes, text: str, under: str = "") -> None:
    """Writes the name of a panel, left-aligned above it.

    Args:
        axes: axes of the panel.
        text: the name of the panel.
        under: a line of numbers below the name, or "".
    """
    lift = 22 if under else 8
    axes.annotate(
        text, (0, 1), (0, lift), "axes fraction", "offset points",
        fontsize=11, fontweight="bold", va="bottom", annotation_clip=False,
    )  # fmt: skip
    if under:
        axes.annotate(
            under, (0, 1), (0, 7), "axes fraction", "offset points",
            fontsize=9.5, color=MUTED, va="bottom", annotation_clip=False,
        )  # fmt: skip


def compact(value: float) -> str:
    """A count as text with few digits: 940, 5.2k, 1.08M."""
    if value < 1000:
        return f"{value:.0f}"
    if value < 100_000:
        return f"{value / 1000:.1f}k".replace(".0k", "k")
    if value < 999_500:
        return f"{value / 1000:.0f}k"
    return f"{value / 1_000_000:.2f}M"
