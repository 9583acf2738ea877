# SPDX-License-Identifier: MIT
"""Paints the hairs on cards of scalp, brows, lashes and beard, with their opacity."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..people import Colour, Person
from ..polygons import Floats
from .atlas import ATLAS_SIZE, DENSE, TILES

_GREY = (0.74, 0.73, 0.71)
_LASH_DARK = 0.3  # the lashes' colour is the brows' colour multiplied by this
_LOOSE = 0.6  # _Hairs.loose of the beard's tiles and of the thin tiles of straight scalp hair
_CURLY = 0.6  # hair_curl above which single hairs are not visible


@dataclass
class _Hairs:
    """The look of the hairs in one kind of tile.

    Attributes:
        counts: number of hairs in each tile; tiles repeat these numbers.
        thick: smallest and largest half width of a hair at its root, in texels.
        length: smallest and largest length, as a fraction of the tile's height.
        begin: largest height of the roots, as a fraction of the tile's height.
        lean: standard deviation of the sideways lean, as a fraction of the tile's width.
        bend: standard deviation of the sideways bend, as a fraction of the tile's width.
        wave: amplitude of waves, as a fraction of the tile's width.
        waves: number of waves over the tile's height.
        gather: how far tips move towards the middle, 0 to 1.
        taper: fraction of a hair's length from which it tapers.
        loose: how much sparser hairs are at the edges than in the middle, 0 to 1; with evenly
            spaced hairs the card would look like a rectangle.
    """

    counts: tuple[int, ...]
    thick: tuple[float, float]
    length: tuple[float, float]
    begin: float = 0.0
    lean: float = 0.05
    bend: float = 0.05
    wave: float = 0.0
    waves: float = 2.0
    gather: float = 0.0
    taper: float = 0.0
    loose: float = 0.0


def _kinds(person: Person) -> dict[str, _Hairs]:
    curl = person.hair_curl
    straight = curl < _CURLY  # single hairs are visible side by side, so they must be thin
    thin = (0.8, 1.35) if straight else (1.0, 1.7)
    wave, waves = 0.16 * curl, 1.5 + 7.0 * curl
    long = person.hair_style in ("long", "bun")
    length = (0.75, 1.0) if long else (0.5, 1.0)
    # roots are at most about a centimetre above the lower edge of the card
    begin = {"long": 0.05, "bun": 0.1}.get(person.hair_style, 0.3)
    scalp = (74, 68, 61, 70, 64, 32, 24, 16) if straight else (34, 31, 28, 33, 30, 17, 13, 9)
    return {
        "scalp": _Hairs(
            scalp, thin, length, begin, 0.08, 0.08, wave, waves, 0.25 if not long else 0.1, 0.45
        ),
        "brows": _Hairs((5, 4, 5, 3, 4, 4, 3, 5), (1.9, 2.7), (0.6, 1.0), 0.25, 0.16, 0.16),
        "lashes": _Hairs((3, 2, 3, 2) * 4, (2.4, 3.3), (0.7, 1.0), 0.0, 0.12, 0.16, gather=0.35),
        "beard": _Hairs(
            (13, 11, 14, 10, 13, 8, 7, 11),
            (1.05, 1.6),
            (0.5, 1.0),
            0.3,
            0.14,
            0.2,
            0.05 + 0.07 * curl,
            1 + 2.5 * curl,
            loose=_LOOSE,
        ),
        "solid": _Hairs((70, 70, 70, 70), (1.4, 2.2), (0.9, 1.0), 0.3, 0.05, 0.05),
    }


def _shades(colour: Colour, grey: float, count: int, random: np.random.Generator) -> Floats:
    """float64[count, 3]: colours of single hairs, some of them grey.

    Args:
        colour: mean colour of the hairs, sRGB in [0, 1].
        grey: fraction of grey hairs.
        count: number of hairs.
        random: generator of the colours.
    """
    own = np.array(colour) * random.uniform(0.78, 1.28, (count, 1))
    own = own + random.normal(0, 0.012, (count, 1)) * [1.2, 0.6, 0.2]  # some hairs are redder
    white = np.array(_GREY) * random.uniform(0.55, 1.0, (count, 1))
    return np.asarray(np.where(random.random((count, 1)) < grey, white, own))


def _paint_tile(
    hairs: _Hairs,
    number: int,
    size: tuple[int, int],
    colour: Colour,
    grey: float,
    random: np.random.Generator,
) -> Floats:
    """float64[height, width, 4]: a tile of hairs from root (row 0) to tip; later hairs are on top.

    Args:
        hairs: look of the hairs.
        number: number of the tile, which selects the number of hairs.
        size: width and height of the tile in texels.
        colour: mean colour of the hairs.
        grey: fraction of grey hairs.
        random: generator of the hairs.
    """
    width, height = size
    image = np.zeros((height, width, 4))
    v = (np.arange(height) + 0.5) / height
    count = hairs.counts[number % len(hairs.counts)]
    tint = random.uniform(0.9, 1.12)
    shades = tint * _shades(colour, grey, count, random)
    image[..., :3] = 0.8 * shades.mean(axis=0)
    places = (np.arange(count) + random.uniform(0.1, 0.9, count)) / count
    off = 2 * places - 1
    places = 0.5 + 0.5 * np.sign(off) * np.abs(off) ** (1 + hairs.loose)
    aside = 0.05 + hairs.wave  # a curl that leaves the tile would be cut off in a straight line
    for place, shade in zip(random.permutation(places), shades, strict=True):
        begin = random.uniform(0, hairs.begin)
        length = begin + (1 - begin) * random.uniform(*hairs.length)
        s = np.clip((v - begin) / (length - begin), 0, 1)
        lean, bend = random.normal(0, hairs.lean), random.normal(0, hairs.bend)
        start = aside + (1 - 2 * aside) * place
        # A hair that leaves the tile would be cut in a straight line, so it leans the other way.
        if abs(start + lean + bend - 0.5) > 0.5 - aside:
            lean, bend = -lean, -bend
        middle = start + lean * s + bend * s**2
        middle = middle + hairs.gather * s * (0.5 - middle)
        turn = random.uniform(0, 2 * np.pi)
        waves = hairs.waves * random.uniform(0.85, 1.15)
        middle = middle + hairs.wave * np.minimum(2 * s, 1) * np.sin(2 * np.pi * waves * v + turn)
        half = random.uniform(*hairs.thick) * np.sqrt(
            np.clip((1 - s) / max(1 - hairs.taper, 1e-6), 0, 1)
        )
        half = np.where((v >= begin) & (v <= length), np.maximum(half, 0.35), 0)
        _lay(image, middle * width, half, shade, s, random.uniform(0.85, 1.0))
    return image


def _lay(
    image: Floats, middle: Floats, half: Floats, shade: Floats, along: Floats, strength: float
) -> None:
    """Paints one hair over a tile.

    Args:
        image: float64[h, w, 4], the tile; changed.
        middle: float64[h], column of the hair in each row, in texels.
        half: float64[h], half its width in texels; 0 in rows without the hair.
        shade: float64[3], colour of the hair.
        along: float64[h], 0 at the root, 1 at the tip.
        strength: opacity of the hair, 0 to 1.
    """
    width = image.shape[1]
    low = int(np.clip(middle.min() - 4, 0, width))
    high = int(np.clip(middle.max() + 5, 0, width))
    if high <= low:
        return
    x = np.arange(low, high) + 0.5
    gap = np.abs(x[None, :] - middle[:, None])
    cover = np.clip(half[:, None] - gap + 0.5, 0, 1) * (half[:, None] > 0) * strength
    # A hair is round, and lighter towards its tip.
    round_ = 1 - 0.3 * np.clip(gap / np.maximum(half[:, None], 0.5), 0, 1) ** 2
    tone = (0.78 + 0.42 * along)[:, None] * round_
    colour = shade * tone[..., None]
    part = image[:, low:high]
    part[..., :3] += (colour - part[..., :3]) * cover[..., None]
    part[..., 3] = np.maximum(part[..., 3], cover)


def paint_strands(person: Person) -> Floats:
    """float64[ATLAS_SIZE, ATLAS_SIZE, 4]: sRGB colour and opacity of the person's hairs.

    Args:
        person: the person, with hair colours, curl and share of grey hairs.
    """
    random = np.random.default_rng(11)
    image = np.zeros((ATLAS_SIZE, ATLAS_SIZE, 4))
    image[..., :3] = person.hair
    lash = tuple(_LASH_DARK * c for c in person.brows)
    colours: dict[str, tuple[Colour, float]] = {
        "scalp": (person.hair, person.hair_grey),
        "brows": (person.brows, 0.5 * person.hair_grey),
        "lashes": ((lash[0], lash[1], lash[2]), 0.0),
        "beard": (person.hair, person.hair_grey),
        "solid": (person.hair, person.hair_grey),
    }
    for kind, hairs in _kinds(person).items():
        left, low, width, height, count = TILES[kind]
        colour, grey = colours[kind]
        for k in range(count):
            thin = kind == "scalp" and k >= DENSE and person.hair_curl < _CURLY
            own = replace(hairs, loose=_LOOSE) if thin else hairs
            tile = _paint_tile(own, k, (width, height), colour, grey, random)
            if kind == "solid":
                tile[..., 3] = np.maximum(tile[..., 3], np.where(tile[..., 3] > 0, 1, 0.97))
            image[low : low + height, left + k * width : left + (k + 1) * width] = tile
    return np.clip(image, 0, 1)
