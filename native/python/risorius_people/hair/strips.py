# SPDX-License-Identifier: MIT
"""Strips of hair: guides with a width, which become cards of a mesh or strands of a render."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..paint.atlas import tile_corners
from ..polygons import Floats, Ints
from .surface import Roots, joined_roots

ROOT_DEEP = 0.014  # decimetres: largest depth in the skin of a strip's edge at the root


def unit(vectors: Floats) -> Floats:
    """float64[..., 3]: vectors scaled to length 1; a zero vector stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-12))


@dataclass
class Strips:
    """Strips of hair with the same number of rows, from root to tip.

    Attributes:
        points: float64[n, rows, 3], the guide of each strip, in decimetres.
        sides: float64[n, rows, 3], vector from the guide to the left edge.
        normals: float64[n, rows, 3], unit normals for shading, away from the skin.
        tiles: int64[n], tile of each strip in the atlas.
        roots: place of each strip on the skin.
        held: float64[n]; if above 0, each row follows the skin below it, else all follow the root.
    """

    points: Floats
    sides: Floats
    normals: Floats
    tiles: Ints
    roots: Roots
    held: Floats

    def __len__(self) -> int:
        return len(self.points)

    @property
    def rows(self) -> int:
        """Number of points of a guide."""
        return int(self.points.shape[1])

    def taken(self, chosen: Ints) -> Strips:
        """The strips with these indices, or with True in a mask."""
        return Strips(
            self.points[chosen],
            self.sides[chosen],
            self.normals[chosen],
            self.tiles[chosen],
            self.roots.taken(chosen),
            self.held[chosen],
        )

    def coarser(self, share: float, rows: int) -> Strips:
        """Fewer and wider strips that cover about the same area.

        Args:
            share: fraction of the strips to keep, 0 to 1.
            rows: largest number of rows of a strip.
        """
        count = max(1, round(share * len(self)))
        chosen = np.unique(np.linspace(0, len(self) - 1, count).round().astype(int))
        out = self.taken(chosen)
        at = np.linspace(0, self.rows - 1, min(rows, self.rows)).round().astype(int)
        out.points, out.normals = out.points[:, at], out.normals[:, at]
        out.sides = out.sides[:, at] * (len(self) / len(chosen)) ** 0.85
        return out


def make_strips(
    points: Floats,
    outside: Floats,
    half_width: Floats,
    taper: Floats,
    tiles: Ints,
    roots: Roots,
    turns: Floats | None = None,
    held: float = 1.0,
) -> Strips:
    """Makes strips along guides, with their faces away from the skin.

    Args:
        points: float64[n, rows, 3], points of the guides.
        outside: float64[n, rows, 3], vectors away from the skin.
        half_width: float64[n], half the width of each strip in decimetres.
        taper: float64[rows], factor on the width in each row.
        tiles: int64[n], tile of each strip in the atlas.
        roots: place of each strip on the skin.
        turns: float64[n], rotation of each strip about its own direction in radians; None: 0.
        held: value of `Strips.held` for all strips.
    """
    way = unit(np.gradient(points, axis=1))
    side = unit(np.cross(way, outside))
    # If a hair's direction passes through the outward direction, its left side changes its sign,
    # and the card would fold.
    along = np.sign((side[:, 1:] * side[:, :-1]).sum(axis=2, keepdims=True))
    side[:, 1:] *= np.cumprod(np.where(along < 0, -1, 1), axis=1)
    if turns is not None:
        up = np.cross(side, way)
        c, s = np.cos(turns)[:, None, None], np.sin(turns)[:, None, None]
        side = c * side + s * up
    sides = side * half_width[:, None, None] * taper[None, :, None]
    # A strip that stands on its edge would have half of its root deep in the skin, so its root
    # is narrowed.
    deep = np.abs((sides[:, 0] * outside[:, 0]).sum(axis=1))
    sides[:, 0] *= np.minimum(1, ROOT_DEEP / np.maximum(deep, 1e-9))[:, None]
    return Strips(points, sides, unit(outside), tiles, roots, np.full(len(points), held))


def joined(parts: list[Strips]) -> Strips:
    """Joins strips with the same number of rows into one object."""
    return Strips(
        np.concatenate([p.points for p in parts]),
        np.concatenate([p.sides for p in parts]),
        np.concatenate([p.normals for p in parts]),
        np.concatenate([p.tiles for p in parts]),
        joined_roots([p.roots for p in parts]),
        np.concatenate([p.held for p in parts]),
    )


def card_vertices(strips: Strips) -> tuple[Floats, Floats]:
    """Positions and normals, float64[V, 3] each: strip by strip and row by row, the vertex of the
    left edge, then of the right edge."""
    left, right = strips.points + strips.sides, strips.points - strips.sides
    positions = np.stack([left, right], axis=2).reshape(-1, 3)
    normals = np.repeat(strips.normals.reshape(-1, 3), 2, axis=0)
    return positions, normals


def card_faces(strips: Strips) -> tuple[list[list[int]], Floats]:
    """Vertices of faces, counter-clockwise from outside; float64[V, 2], texture coordinates."""
    n, rows = len(strips), strips.rows
    first = 2 * (np.arange(n)[:, None] * rows + np.arange(rows - 1)).reshape(-1)
    faces = np.stack([first + 1, first, first + 2, first + 3], axis=1)
    low, high = tile_corners(strips.tiles)
    along = np.concatenate(
        [np.zeros((n, 1)), np.cumsum(np.linalg.norm(np.diff(strips.points, axis=1), axis=2), 1)],
        axis=1,
    )
    along /= np.maximum(along[:, -1:], 1e-12)
    v = low[:, None, 1] + along * (high - low)[:, None, 1]
    u = np.stack([low[:, 0], high[:, 0]], axis=1)[:, None, :].repeat(rows, axis=1)
    uvs = np.stack([u, v[..., None].repeat(2, axis=2)], axis=-1).reshape(-1, 2)
    return faces.tolist(), uvs
