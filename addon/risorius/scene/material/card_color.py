# SPDX-License-Identifier: GPL-3.0-or-later
"""Computes the colour of hair cards in the solid view: the mean of their image."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...logic.character import plans
from .look import Look

Color = tuple[float, float, float, float]

_SAMPLES = 4096  # largest number of face corners near which the picture is sampled
_INWARD = (0.0, 0.35, 0.65)  # sample points, as fractions of the way from corner to face centre
_LEAST = 0.02  # smallest opacity, so that hair stays visible


def color_of(look: Look, mesh: plans.MeshPlan) -> Color | None:
    """Mean colour and opacity of the part of an image that hair cards show.

    The solid view has one colour for each material. Cards of one dark, half transparent colour
    would look like blocks, because most of a card is transparent and overlaps other cards.

    Args:
        look: Look of the mesh's material.
        mesh: cards of hair.

    Returns:
        Linear colour and opacity, 0 to 1; None without UV map, without a readable picture with
        alpha, or if the cards show only transparent parts of the picture.
    """
    picture = look.image("color")
    if picture is None or picture.channels != 4 or mesh.uvs is None or not len(mesh.face_starts):
        return None
    pixels = look.small("color")
    if pixels is None:
        return None
    found = _at(pixels, _places(mesh.uvs, mesh.face_starts))
    opacity = float(found[:, 3].mean())
    if opacity <= 0.0:
        return None
    seen = (found[:, :3] * found[:, 3:]).sum(axis=0) / found[:, 3].sum()
    linear = np.where(seen < 0.04045, seen / 12.92, ((seen + 0.055) / 1.055) ** 2.4)
    red, green, blue = (float(x) for x in linear)
    return red, green, blue, max(opacity, _LEAST)


def _places(uvs: NDArray[np.float32], starts: NDArray[np.int32]) -> NDArray[np.float64]:
    """float64[n, 2]: UV coordinates of sample points within the faces.

    Args:
        uvs: float32[N, 2] per corner.
        starts: int32[F], first corner of each face; each face has corners.
    """
    counts = np.diff(np.append(starts, len(uvs)))
    middles = np.add.reduceat(uvs.astype(np.float64), starts) / counts[:, None]
    some = np.unique(np.linspace(0, len(uvs) - 1, min(_SAMPLES, len(uvs))).astype(np.int64))
    middle = np.repeat(middles, counts, axis=0)[some]
    return np.concatenate([uvs[some] + share * (middle - uvs[some]) for share in _INWARD])


def _at(pixels: NDArray[np.float32], places: NDArray[np.float64]) -> NDArray[np.float32]:
    """float32[n, 4]: the texels of a repeating picture at UV coordinates.

    Args:
        pixels: float32[h, w, 4], row 0 at v = 0.
        places: float64[n, 2], the UV coordinates.
    """
    height, width = pixels.shape[:2]
    column, row = (
        (np.nan_to_num(places[:, axis]) % 1.0 * size).astype(np.int64).clip(0, size - 1)
        for axis, size in ((0, width), (1, height))
    )
    return pixels[row, column]
