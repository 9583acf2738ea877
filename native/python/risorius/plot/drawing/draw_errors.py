# SPDX-License-Identifier: MIT
"""Draws heads with expressions, coloured by the error of each vertex."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import risorius

from . import shade, skeleton
from .paper import MUTED, Canvas

Floats = npt.NDArray[np.float64]

COLUMNS = 6
_HEAD = 0.62  # inches above a picture, for the expression's name
_BAR = 0.75  # inches below all pictures, for the colour scale
# Colour scale from white over yellow and red to violet, so that the largest errors stand out.
_STOPS = np.array([0.0, 0.2, 0.45, 0.75, 1.0])
_COLORS = np.array(
    [[1.0, 1.0, 1.0], [1.0, 0.93, 0.55], [1.0, 0.6, 0.2], [0.85, 0.15, 0.25], [0.45, 0.05, 0.5]]
)


@dataclass(frozen=True)
class Expression:
    """An expression at weight 1: the meshes with this expression, and the error of each vertex."""

    name: str
    meshes: list[risorius.Mesh]
    errors: list[Floats]  # float64[V] of each mesh, in mm
    largest: float  # mm
    rms: float  # mm


def colors(errors: Floats, most: float) -> Floats:
    """float64[V, 3]: colours of errors, from white at 0 to violet at `most` and above.

    Args:
        errors: float64[V], in the unit of `most`.
        most: error at the end of the scale.
    """
    share = np.clip(errors / most, 0, 1)
    return np.stack([np.interp(share, _STOPS, _COLORS[:, c]) for c in range(3)], axis=1)


def height(count: int, width: float) -> float:
    """Height in inches of the drawing of several expressions.

    Args:
        count: number of expressions.
        width: width of the canvas in inches.
    """
    return -(-max(count, 1) // COLUMNS) * (1.25 * width / COLUMNS + _HEAD) + _BAR


def draw(
    canvas: Canvas, dna: risorius.Dna, expressions: Sequence[Expression], most: float, dpi: int
) -> None:
    """Draws a head for each expression, all with the same colour scale.

    Args:
        canvas: receives the drawing.
        dna: the face, whose coordinate system is used.
        expressions: expressions in drawing order.
        most: error at the end of the colour scale, in mm.
        dpi: resolution of the images in dots per inch.
    """
    if not expressions:
        canvas.say("No expression moves this face.")
        return
    axes = skeleton.view_axes(dna)
    wide = canvas.width / COLUMNS
    tall = 1.25 * wide
    for number, expression in enumerate(expressions):
        row, column = divmod(number, COLUMNS)
        paints = [colors(error, most) for error in expression.errors]
        shape = shade.surface(expression.meshes, paints, axes)
        low, high = shape.points[:, :2].min(axis=0), shape.points[:, :2].max(axis=0)
        middle, half = (low + high) / 2, 0.52 * max(high[1] - low[1], 1.25 * (high[0] - low[0]))
        frame = (
            middle[0] - half / 1.25,
            middle[0] + half / 1.25,
            middle[1] - half,
            middle[1] + half,
        )
        bottom = canvas.height - (row + 1) * (tall + _HEAD)
        place = canvas.place(column * wide, bottom, wide, tall)
        place.imshow(
            shade.render(shape, frame, round(tall * dpi)), extent=frame, aspect="auto",
            interpolation="none",
        )  # fmt: skip
        place.set_axis_off()
        place.set_title(
            f"{expression.name}\n{expression.largest:.2f} mm largest, {expression.rms:.3f} RMS",
            fontsize=8.5,
        )
    scale = canvas.place(0.3, 0.42, 4.0, 0.16)
    ramp = colors(np.linspace(0, most, 256), most)[None]
    scale.imshow(ramp, extent=(0, most, 0, 1), aspect="auto")
    scale.set_yticks([])
    scale.set_xlabel("mm from the requested shape", color=MUTED)
