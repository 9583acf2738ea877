# SPDX-License-Identifier: MIT
"""Makes wrinkles from compression: masks of expressions, and the relief of the folds.

Folds are perpendicular to the direction of compression, so their lines follow from the expression.
The smallest stretch of each polygon gives the depth of the folds. The direction perpendicular to
this stretch gives the lines (line integral convolution of noise: Cabral and Leedom, "Imaging Vector
Fields Using Line Integral Convolution", 1993). Maps and masks have MetaHuman's names, so that
programs which know these names show the wrinkles.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from risorius.base.easing import smooth_step

from .expressions import Expression
from .folds import from_laugh_line
from .part import Part
from .polygons import Floats, Ints, Polygons

_LEAST = 0.015  # fraction of its length that skin loses before it folds
_FULL = 0.15  # fraction of lost length at which folds have their full depth
_ROUNDS = 3  # smoothing rounds over neighbours, because skin is stiffer than a mesh
DEPTH = 0.007  # decimetres: depth of a fold
_FOLD_DEPTH = 0.015  # decimetres: depth of the smile's fold
_LINES = 24  # texels to each side over which noise is averaged along a line
_FINE, _COARSE = 1.5, 3.5  # texels: smallest and largest width of a fold
_TILE = 512  # texels after which the noise of the folds repeats
_SEED = 23


@dataclass(frozen=True)
class Region:
    """A mask of wrinkles: its texture set, and the controls that drive it."""

    number: int  # number of the texture set, 1 to 3
    # raw control without its side -> weight of the mask if the control is at 1
    drivers: Mapping[str, float]


REGIONS = {
    "blink": Region(1, {"eyeBlink": 1.0}),
    "browsRaiseInner": Region(1, {"browRaiseIn": 1.0}),
    "browsRaiseOuter": Region(1, {"browRaiseOuter": 1.0}),
    "chinRaise": Region(1, {"jawChinRaiseD": 1.0}),
    "squintInner": Region(1, {"eyeSquintInner": 1.0}),
    "browsDown": Region(2, {"browDown": 0.6}),
    "mouthStretch": Region(2, {"mouthStretch": 1.0}),
    "neckStretch": Region(2, {"neckStretch": 1.0}),
    "noseWrinkler": Region(2, {"noseWrinkle": 0.75}),
    "cheekRaiseOuter": Region(3, {"eyeCheekRaise": 1.0}),
    "smile": Region(3, {"mouthCornerPull": 1.0, "mouthSharpCornerPull": 0.6}),
}
SETS = (1, 2, 3)


def map_names() -> list[str]:
    """Names of the animated maps, in the order of REGIONS, left before right."""
    return [
        f"head_wm{region.number}_normal_{mask_name(name, side)}"
        for name, region in REGIONS.items()
        for side in "LR"
    ]


def mask_name(region: str, side: str) -> str:
    """The name of a mask and of its file, such as head_wm1_blink_L.

    Args:
        region: a key of REGIONS.
        side: L or R.
    """
    return f"head_wm{REGIONS[region].number}_{region}_{side}"


SMILE, FROWN = mask_name("smile", "L"), mask_name("browsDown", "L")


def masks_of(number: int) -> list[str]:
    """The masks of a texture set, left before right.

    Args:
        number: number of the texture set.
    """
    return [mask_name(n, side) for n, r in REGIONS.items() if r.number == number for side in "LR"]


def drivers() -> list[tuple[str, int, float]]:
    """(raw control, number of the map, slope) for each driver of each map."""
    out = []
    number = 0
    for region in REGIONS.values():
        for side in "LR":
            out += [(control + side, number, slope) for control, slope in region.drivers.items()]
            number += 1
    return out


class Surface:
    """The head as triangles in the neutral pose, with their texture coordinates."""

    def __init__(self, polygons: Polygons, uvs: Floats, positions: Floats) -> None:
        corners, places = [], []
        for face, uv_face in zip(polygons.faces, polygons.uv_faces, strict=True):
            for k in range(1, len(face) - 1):
                corners.append((face[0], face[k], face[k + 1]))
                places.append((uv_face[0], uv_face[k], uv_face[k + 1]))
        self.corners: Ints = np.array(corners)
        self._about = np.maximum(np.bincount(self.corners.ravel(), minlength=len(positions)), 1)
        self.rest = _frames(positions[self.corners])
        uv = uvs[np.array(places)]
        edges = np.stack([uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]], axis=2)
        size = np.linalg.det(edges)
        flat = np.abs(size) < 1e-12
        edges[flat] = np.eye(2)
        # `back` is the inverse of the neutral edges. to_uv maps directions in the triangle's plane
        # to directions in the texture.
        self.back = np.linalg.inv(self.rest)
        self.to_uv = edges @ self.back

    def folds(self, moved: Floats) -> Floats:
        """float64[V, 4]: compression at each vertex (0 to 1), and the direction of the folds in the
        texture as a tensor xx, xy, yy, multiplied by the compression.

        Args:
            moved: float64[V, 3], positions in the expression.
        """
        change = _frames(moved[self.corners]) @ self.back
        _, stretch, right = np.linalg.svd(change)
        depth = np.clip((1 - stretch[:, 1] - _LEAST) / (_FULL - _LEAST), 0, 1)
        along = right[:, 0]  # the axis perpendicular to the compression
        lines = np.einsum("tij,tj->ti", self.to_uv, along)
        lines /= np.maximum(np.linalg.norm(lines, axis=1, keepdims=True), 1e-12)
        x, y = lines.T
        rows = np.column_stack([depth, depth * x * x, depth * x * y, depth * y * y])
        return self.evened(self._at_vertices(rows), _ROUNDS)

    def evened(self, values: Floats, rounds: int) -> Floats:
        """Smooths values: each round averages each vertex with the mean of its triangles.

        Args:
            values: float64[V, ...].
            rounds: number of rounds.
        """
        for _ in range(rounds):
            middles = values[self.corners].mean(axis=1)
            values = 0.5 * values + 0.5 * self._at_vertices(middles)
        return values

    def _at_vertices(self, rows: Floats) -> Floats:
        """float64[V, ...]: mean of the triangles' values [T, ...] at each vertex."""
        sums = np.zeros((len(self._about), *rows.shape[1:]))
        for k in range(3):
            np.add.at(sums, self.corners[:, k], rows)
        return np.asarray(sums / self._about.reshape(-1, *[1] * (rows.ndim - 1)))


def _frames(triangles: Floats) -> Floats:
    """float64[n, 2, 2]: two edges of each triangle as columns, in the triangle's plane."""
    a, b = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    length = np.maximum(np.linalg.norm(a, axis=1), 1e-12)
    first = a / length[:, None]
    along = (b * first).sum(axis=1)
    across = np.linalg.norm(b - along[:, None] * first, axis=1)
    zero = np.zeros_like(length)
    out = np.stack([np.stack([length, along], axis=1), np.stack([zero, across], axis=1)], axis=1)
    out[across < 1e-9] = np.eye(2)
    return out


def vertex_folds(
    part: Part, uvs: Floats, positions: Floats, units: Mapping[str, Expression]
) -> dict[str, Floats]:
    """Name of a mask -> float64[V, 4]: compression at each vertex (0 to 1), and the direction of
    the folds in the texture as a tensor xx, xy, yy, multiplied by the compression.

    If several controls drive a mask, the mask has the folds of the first control at 1.

    Args:
        part: the head mesh, with V vertices.
        uvs: float64[T, 2] in [0, 1], texture coordinates.
        positions: float64[V, 3], neutral positions of the vertices in decimetres.
        units: raw control -> expression.
    """
    surface = Surface(part.polygons, uvs, positions)
    out = {}
    for name, region in REGIONS.items():
        control = next(iter(region.drivers))
        moves = {side: part.carry(units[control + side].displacement) for side in "LR"}
        for side, folds in folds_of_sides(surface, positions, moves).items():
            out[mask_name(name, side)] = folds
    return out


def folds_of_sides(
    surface: Surface, positions: Floats, moves: Mapping[str, Floats]
) -> dict[str, Floats]:
    """Side -> float64[V, 4]: folds of both sides together, divided between the sides.

    If only one side of an expression moves, its motion fades out in the middle of the face and
    compresses the skin there. Both sides together do not compress this skin, so no folds appear
    there.

    Args:
        surface: surface of the head.
        positions: float64[V, 3] of its vertices.
        moves: side -> float64[V, 3], displacement by that side's control.
    """
    both = surface.folds(positions + sum(moves.values()))
    # The displacements are smoothed as widely as the folds. Otherwise skin that stays still between
    # moving skin would get no folds.
    far = {
        side: surface.evened(np.linalg.norm(move, axis=1), _ROUNDS + 1)
        for side, move in moves.items()
    }
    whole = np.maximum(sum(far.values()), 1e-12)
    return {side: both * (own / whole)[:, None] for side, own in far.items()}


def blurred(image: Floats, width: float) -> Floats:
    """An image [h, w, ...] blurred by a Gaussian; border texels are repeated outward.

    Args:
        image: float64[h, w, ...].
        width: standard deviation in texels.
    """
    reach = int(np.ceil(3 * width))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        padded = np.pad(
            image, [(reach, reach) if a == axis else (0, 0) for a in range(image.ndim)], "edge"
        )
        image = sum(
            share * np.take(padded, range(k, k + image.shape[axis]), axis)
            for k, share in enumerate(kernel)
        )
    return np.asarray(image)


def relief(tensors: Floats, there: Floats) -> Floats:
    """float64[h, w]: folds along the lines of a tensor field, from -1 (deepest) to 0.

    Args:
        tensors: float64[h, w, 3], xx, xy, yy of the lines' direction in the texture.
        there: bool[h, w], texels that are computed.
    """
    size = len(tensors)
    noise = np.random.default_rng(_SEED).normal(size=(_TILE, _TILE))
    band = blurred(noise, _FINE) - blurred(noise, _COARSE)
    xx, xy, yy = np.moveaxis(tensors, 2, 0)
    angle = 0.5 * np.arctan2(2 * xy, xx - yy).ravel()
    across, up = np.cos(angle), np.sin(angle)
    times = -(-size // _TILE)
    band = np.tile(band, (times, times))[:size, :size].ravel()
    rows, columns = np.nonzero(there)
    if not len(rows):
        return np.zeros((size, size))
    start = rows * size + columns
    total = band[start]
    for way in (1, -1):
        x, y = columns.astype(float), rows.astype(float)
        dx, dy = way * across[start], way * up[start]
        for _ in range(_LINES):
            x, y = x + dx, y + dy
            at = np.rint(y).clip(0, size - 1) * size + np.rint(x).clip(0, size - 1)
            at = at.astype(np.intp)
            total += band[at]
            x_here, y_here = across[at], up[at]
            turned = x_here * dx + y_here * dy < 0
            dx, dy = np.where(turned, -x_here, x_here), np.where(turned, -y_here, y_here)
    total /= total.std() or 1.0
    out = np.zeros((size, size))
    # The curve makes valleys of the relief narrow and hills round.
    out[rows, columns] = -smooth_step(np.clip(total, 0, 2) / 2)
    return out


def normals(heights: Floats, places: Floats) -> Floats:
    """float64[h, w, 3]: unit normals n of a relief in texture space, stored as 0.5 + 0.5 n.

    Args:
        heights: float64[h, w], in decimetres.
        places: float64[h, w, 3], position of each texel on the head, in decimetres.
    """
    slopes = []
    for axis in (1, 0):
        length = np.linalg.norm(np.gradient(places, axis=axis), axis=2)
        typical = np.median(length[length > 1e-6])
        length = np.clip(length, 0.3 * typical, 3 * typical)
        slopes.append(np.gradient(heights, axis=axis) / length)
    out = np.stack([-slopes[0], -slopes[1], np.ones_like(heights)], axis=2)
    out /= np.linalg.norm(out, axis=2, keepdims=True)
    return np.asarray(0.5 + 0.5 * out)


def laugh_fold(places: Floats, eye: Floats) -> tuple[Floats, Floats]:
    """The fold of a smile from the wing of the nose past the corner of the mouth.

    Compression alone gives only fine lines there, but the cheek's fat slides over the lip as one
    mass.

    Args:
        places: float64[h, w, 3], position of each texel on the head, in decimetres.
        eye: float64[3], middle of the left eye.

    Returns:
        Heights in decimetres, float64[h, w], and a mask of the fold, float64[h, w], 0 to 1.
    """
    away, there = from_laugh_line(places - [0, eye[1], eye[2]])
    groove = -_FOLD_DEPTH * np.exp(-((away / 0.022) ** 2))
    cheek = 0.7 * _FOLD_DEPTH * np.exp(-(((away - 0.055) / 0.05) ** 2))
    return there * (groove + cheek), there * np.exp(-((away / 0.14) ** 2))


def fold_heights(folds: Floats, strength: Floats) -> Floats:
    """float64[h, w]: the relief of all folds of a texture set, in decimetres, 0 without folds.

    Args:
        folds: float64[h, w, 4], sum of the folds of the set's masks at each texel: compression, and
            xx, xy, yy of their direction.
        strength: float64[h, w], factor on the depth: 1 for a forehead at 30 years.
    """
    depth = np.clip(folds[..., 0], 0, 1)
    height = relief(folds[..., 1:], depth > 0.01)
    return np.asarray(height * strength * DEPTH * smooth_step(np.clip(3 * depth, 0, 1)))
