# SPDX-License-Identifier: MIT
"""Draws all LODs of a face side by side: shaded meshes, and joints coloured by region."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.collections import LineCollection

from ..content.facts import Facts
from . import draw_face, shade
from .paper import INK, Canvas, rgb

COLUMNS = 4
_HEAD = 0.62  # inches above a picture, for its title


def height(count: int, width: float) -> float:
    """Height in inches of the drawing of several LODs.

    Args:
        count: number of LODs.
        width: width of the canvas in inches.
    """
    return -(-max(count, 1) // COLUMNS) * (1.2 * width / COLUMNS + _HEAD)


def draw(canvas: Canvas, facts: Facts, words: Sequence[str], dpi: int) -> None:
    """Draws a head with its edges and joints for each LOD.

    Args:
        canvas: receives the drawing.
        facts: facts of the face.
        words: text below the title of each LOD.
        dpi: resolution of the images in dots per inch.
    """
    if not facts.lods:
        canvas.say("This file has no levels of detail.")
        return
    wide = canvas.width / COLUMNS
    tall = 1.2 * wide
    frame = draw_face.frame_of(draw_face.scene(facts, 0))
    middle = (frame[0] + frame[1]) / 2
    half = max((frame[3] - frame[2]) / 2.4, (frame[1] - frame[0]) / 2)
    up = (frame[2] + frame[3]) / 2
    frame = (middle - half, middle + half, up - 1.2 * half, up + 1.2 * half)
    for lod in range(len(facts.lods)):
        row, column = divmod(lod, COLUMNS)
        axes = canvas.place(column * wide, canvas.height - (row + 1) * (tall + _HEAD), wide, tall)
        seen = draw_face.scene(facts, lod)
        picture = shade.render(seen.shape, frame, round(tall * dpi))
        axes.imshow(picture, extent=frame, aspect="auto", interpolation="none")
        axes.set(xlim=frame[:2], ylim=frame[2:])
        axes.set_axis_off()
        _edges(axes, seen)
        joints = seen.joints[seen.shown]
        shade_of = np.array([rgb(facts.joint_regions[j]) for j in seen.shown.tolist()])
        axes.scatter(
            joints[:, 0], joints[:, 1], s=float(np.clip(3000 / max(1, len(joints)), 9, 40)),
            c=shade_of, edgecolors="white", linewidths=0.4, zorder=3,
        )  # fmt: skip
        axes.set_title(f"LOD {lod}\n{words[lod]}", fontsize=8.5)


def _edges(axes: object, seen: draw_face.Scene) -> None:
    """Draws the edges of triangles that face the viewer, unless there are too many to see."""
    points, triangles = seen.shape.points, seen.shape.triangles
    if not 0 < len(triangles) <= 6000:
        return
    corners = points[triangles][:, :, :2]
    ahead, behind = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    front = triangles[ahead[:, 0] * behind[:, 1] - ahead[:, 1] * behind[:, 0] > 0]
    pairs = np.unique(np.sort(front[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    lines = LineCollection(list(points[pairs][:, :, :2]), colors=INK, linewidths=0.3, alpha=0.25)
    axes.add_collection(lines, autolim=False)  # type: ignore[attr-defined]
