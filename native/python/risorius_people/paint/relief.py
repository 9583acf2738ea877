# SPDX-License-Identifier: MIT
"""Paints the skin's relief and roughness: pores, lips, creases. The shader adds finer detail.

Heights are in decimetres above the skin.
"""

from __future__ import annotations

import numpy as np

from ..polygons import Floats
from . import regions
from .images import smooth
from .raster import filled
from .skin import Skin

PORE = 0.0020  # depth of a pore
# Step of the stored components 0.5 n of a normal. Finer steps are invisible and compress badly.
_STEP = 2 / 255
_LIPS = 0.0004  # height of the lips' lines
_CREASE = 0.0045  # depth of a crease


def heights(skin: Skin, creases: Floats) -> Floats:
    """float32[n]: the relief at the texels, in decimetres.

    Args:
        skin: skin of the face.
        creases: float32[n], 0 to 1, depth of each texel in a fold.
    """
    field, texels = skin.field, skin.texels
    ring = field["mouth"]
    bare = smooth(regions.LIPS_RINGS, regions.LIPS_RINGS + 1.5, ring) * smooth(
        0.5, 2.5, field["eyes"]
    )
    share = field["pores"]
    tile, at = texels.dots(4.2, 51)
    holes = tile.over(np.clip(0.35 + 0.65 * share, 0, 1), at, 0.46, 1.0)
    # Skin is stretched over the forehead, where pores of full depth would look like orange peel.
    bare = bare * (1 - 0.55 * np.clip(field["forehead"], 0, 1))
    out = -PORE * (0.25 + 0.75 * share) * holes * bare
    out += bare * (0.00035 * texels.middle * (0.5 + share) + 0.00025 * texels.coarse)
    out -= _CREASE * creases
    around = smooth(regions.LIPS_RINGS + 5, regions.LIPS_RINGS + 1, ring)
    lines = skin.lips + 0.45 * skin.old * around * (1 - skin.lips)
    out += _LIPS * skin.lines * np.clip(lines, 0, 1) * smooth(0.5, 2.5, ring)
    rim = np.exp(-(((ring - regions.LIPS_RINGS - 0.9) / 0.8) ** 2))
    out += 0.0010 * rim
    return np.asarray(out)


def normals(skin: Skin, height: Floats) -> Floats:
    """float32[size, size, 3]: unit normals n of a relief in texture space, stored as 0.5 + 0.5 n.

    Args:
        skin: skin of the face.
        height: float32[n], heights at the texels in decimetres.
    """
    raster = skin.texels.raster
    image = filled(raster.spread(height), raster.covered)
    step = np.maximum(skin.texels.step, 0.3 * np.median(skin.texels.step, axis=0))
    across = np.gradient(image, axis=1).ravel()[raster.where] / step[:, 0]
    up = np.gradient(image, axis=0).ravel()[raster.where] / step[:, 1]
    out = np.stack([-across, -up, np.ones_like(across)], axis=1)
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    size = skin.texels.size
    flat = np.tile(np.array([0.5, 0.5, 1.0], np.float32), (size * size, 1))
    flat[raster.where] = np.minimum(0.5 + np.rint(0.5 * out / _STEP) * _STEP, 1)
    return flat.reshape(size, size, 3)


def roughness(skin: Skin, creases: Floats) -> Floats:
    """float32[n] in [0, 1]: roughness; cheeks are matte, nose, forehead and lips glossy, the mouth
    is wet.

    Args:
        skin: skin of the face.
        creases: float32[n], 0 to 1, depth of each texel in a fold.
    """
    field, texels = skin.field, skin.texels
    dry = float(np.interp(skin.person.age, (8, 20, 40, 75), (0.03, -0.01, 0.0, 0.05)))
    # Gloss is more visible on dark skin, so dark skin gets more roughness.
    matte = dry + 0.11 * skin.deep
    out = 0.48 + matte - (0.13 - 0.054 * skin.deep) * field["oil"]
    out += 0.02 * texels.coarse + 0.03 * texels.middle
    out += 0.02 * texels.fine + 0.12 * creases
    lips = 0.41 + 0.03 * texels.middle - 0.03 * skin.lines
    out += (lips - out) * skin.lips
    out += (0.20 - out) * skin.wet
    if skin.person.hair_style != "none":  # hair shades the skin below
        out += (0.9 - out) * np.maximum(skin.scalp, skin.field["grown"])
    return np.asarray(np.clip(out + (0.38 - out) * smooth(1.2, -0.2, field["eyes"]), 0.05, 1))
