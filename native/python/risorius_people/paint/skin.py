# SPDX-License-Identifier: MIT
"""Paints the colour of the skin: pigment and blood on the person's own tone.

Each pigment absorbs light by its own curve, so that amounts add up and the colour is tone *
exp(-amounts). A blush on dark skin is therefore darker than on light skin.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..people import Person
from ..polygons import Floats, Ints
from . import patterns, regions
from .images import smooth
from .places import HAIRLINES, beard_density, brow_density, hairline_height, thinned
from .raster import Raster

HEAD_SIZE = 2048
# Absorption of linear red, green and blue by a unit of a pigment: melanin, blood in veins under the
# skin, and the skin's yellow.
_MELANIN = np.array([0.42, 0.70, 1.0], np.float32)
_VEINS = np.array([0.42, 0.26, 0.10], np.float32)
_YELLOW = np.array([-0.02, 0.04, 0.36], np.float32)
_MUCOSA = (0.73, 0.41, 0.385)
_IN_SHADE = 0.55  # brightness of hair at its roots relative to its tips
_THROAT = (0.36, 0.15, 0.14)
_LID_MARGIN = (0.54, 0.29, 0.26)


def linear(colour: Floats) -> Floats:
    """Converts sRGB to linear light."""
    c = np.asarray(colour, np.float32)
    return np.asarray(np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4), np.float32)


def encoded(light: Floats) -> Floats:
    """Converts linear light to sRGB."""
    c = np.clip(light, 0, 1)
    return np.asarray(np.where(c <= 0.0031308, 12.92 * c, 1.055 * c ** (1 / 2.4) - 0.055))


def depth_of(person: Person) -> float:
    """Darkness of a person's skin, from 0 (light) to 1 (dark)."""
    light = float(linear(np.array(person.skin)) @ [0.21, 0.72, 0.07])
    return float(smooth(0.42, 0.06, np.array(light)))


def _hairline(face: regions.Face, person: Person) -> Floats:
    """float64[V]: distance from the hairline in decimetres, positive on the side with hair; smaller
    for sparse hair and on ears."""
    at = np.column_stack([face.x, face.y, face.z])
    inside = hairline_height(at, *HAIRLINES[person.hair_style])
    ear = smooth(0.8, 0.86, face.aside) * (1 - smooth(0.35, 0.45, face.y))
    thin = thinned(at, person.hair_style)
    return np.asarray(np.where(inside > 0, inside * (1 - thin), inside) - 0.5 * ear)


def _grown_beard(face: regions.Face, person: Person) -> Floats:
    """float64[V], 0 to 1: density of the hair cards of the beard, 0 without a beard."""
    if person.beard_style == "none":
        return np.zeros(len(face.x))
    at = np.column_stack([face.x, face.y, face.z])
    return beard_density(at, regions.lips_of(face.mouth), person.beard_style)


class Texels:
    """The covered texels of a head: their positions, and patterns over them.

    Attributes:
        raster: raster of the head's texture.
        place: float32[n, 3], position of each texel in decimetres.
        step: float32[n, 2], width and height of each texel on the surface in decimetres.
        scale: side of this texture divided by HEAD_SIZE.
    """

    def __init__(self, raster: Raster, positions: Floats) -> None:
        self.raster = raster
        self.place = raster.values(positions)
        self.step = raster.steps(positions)
        self.size = len(raster.covered)
        self.scale = self.size / HEAD_SIZE
        self.side = max(64, self.size // 2)

    def mottling(self, width: float, seed: int, high: float | None = None) -> Floats:
        """float32[n]: noise with mean 0 and standard deviation 1.

        Args:
            width: width of its spots in texels at HEAD_SIZE.
            seed: seed of the spots.
            high: height of its spots in texels at HEAD_SIZE; None: equal to `width`.
        """
        random = np.random.default_rng(seed)
        tall = None if high is None else high * self.scale
        tile = patterns.mottling(self.side, width * self.scale, random, tall)
        return np.asarray(tile.ravel()[self.at(seed)])

    def dots(self, cell: float, seed: int) -> tuple[patterns.Dots, Ints]:
        """A tile of dots; and int[n], the tile's texel at each texel of the texture.

        Args:
            cell: side of a cell in texels at HEAD_SIZE.
            seed: seed of the dots.
        """
        tile = patterns.dots(self.side, cell * self.scale, np.random.default_rng(seed))
        return tile, self.at(seed)

    def at(self, seed: int) -> Ints:
        """int[n]: the texel of a tile at each texel of the texture.

        Args:
            seed: determines the shift of the tile, so that two tiles do not coincide.
        """
        shift = (37 * seed * self.side // 100, 53 * seed * self.side // 100)
        return patterns.laid(self.raster.where, self.size, self.side, shift)

    @cached_property
    def coarse(self) -> Floats:
        """float32[n]: mottling with spots of half a centimetre."""
        return self.mottling(26, 1)

    @cached_property
    def middle(self) -> Floats:
        """float32[n]: mottling with spots of two millimetres."""
        return self.mottling(9, 2)

    @cached_property
    def fine(self) -> Floats:
        """float32[n]: mottling with spots of half a millimetre."""
        return self.mottling(2.6, 3)


class Skin:
    """Values of a face at the texels, such as its blood and pores, and colours made from them.

    field: name of a value -> float32[n].
    """

    def __init__(self, person: Person, face: regions.Face, texels: Texels, eye: Floats) -> None:
        self.person, self.texels, self.eye = person, texels, eye
        self.deep = depth_of(person)
        self.old = float(np.interp(person.age, (35, 75), (0, 1)))
        fields = {
            "blood": regions.blood(face, person.age),
            "veins": regions.shade_of_eyes(face),
            "yellow": regions.yellow(face),
            "beard": regions.beard(face),
            "hairline": _hairline(face, person),
            "grown": _grown_beard(face, person),
            "pores": regions.pores(face),
            "oil": regions.oil(face),
            "freckled": regions.freckled(face),
            "weathered": regions.weathered(face),
            "forehead": regions.forehead(face),
            "lids": face.lids,
            "mouth": face.mouth,
            "eyes": face.eyes,
            "tone": face.uneven[:, 2],
        }
        columns = texels.raster.values(np.column_stack(list(fields.values())))
        self.field = dict(zip(fields, np.ascontiguousarray(columns.T), strict=True))
        rim = self.field["mouth"] + 0.16 * texels.coarse + 0.10 * texels.middle + 0.08 * texels.fine
        self.lips = smooth(regions.LIPS_RINGS + 0.5, regions.LIPS_RINGS - 0.9, rim)
        self.wet = smooth(3.6, 1.2, self.field["mouth"] + 0.2 * texels.middle)
        uneven = 0.006 * (texels.middle + texels.coarse)
        self.scalp = smooth(-0.01, 0.17, self.field["hairline"] + uneven)

    def colour(self, creases: Floats) -> Floats:
        """float32[n, 3]: the colour of the skin, sRGB in [0, 1].

        Args:
            creases: float32[n], 0 to 1, depth of each texel in a fold.
        """
        person, tone = self.person, linear(np.array(self.person.skin))
        blush = np.log(tone / np.maximum(linear(np.array(person.flush)), 1e-3))
        shade = np.log(tone / np.maximum(linear(np.array(person.lids)), 1e-3))
        taken = self._amount("blood", creases)[:, None] * blush.astype(np.float32)
        taken += self._amount("melanin", creases)[:, None] * _MELANIN
        taken += self._amount("veins", creases)[:, None] * _VEINS
        taken += (self.field["yellow"] * (1 - 0.5 * self.deep))[:, None] * _YELLOW
        taken += ((0.42 + 0.2 * self.deep) * self.field["lids"])[:, None] * shade.astype(np.float32)
        light = tone * np.exp(-taken)
        light = self._hair(light)
        return encoded(self._inside(self._lips(light)))

    def _amount(self, what: str, creases: Floats) -> Floats:
        field, texels = self.field, self.texels
        if what == "blood":
            uneven = 1 + 0.12 * texels.coarse + 0.08 * texels.middle
            out = field["blood"] * uneven + 0.008 * texels.coarse + 0.012 * texels.middle
            return np.asarray(out + 0.03 * texels.fine + 0.35 * creases + self._vessels())
        if what == "veins":
            temples = np.clip(texels.coarse - 1.2, 0, 1) * (1 - self.deep)
            return np.asarray(field["veins"] * (0.42 + 0.05 * texels.coarse) + 0.05 * temples)
        uneven = 0.07 * field["tone"] + (0.012 + 0.02 * self.old) * texels.coarse
        out = uneven + (0.014 + 0.010 * self.old) * texels.middle + 0.016 * texels.fine
        out += self.deep * (0.22 * field["veins"] + 0.12 * field["forehead"])
        out += 0.18 * creases + self._spots()
        return np.asarray(out)

    def _vessels(self) -> Floats:
        """float32[n]: amount of fine blood vessels, which are visible on cheeks and noses of old
        people with light skin."""
        amount = self.old * (1 - self.deep)
        if amount <= 0:
            return np.zeros(1, np.float32)
        net, at = self.texels.dots(11, 14)
        lines = np.clip(1 - net.gap.ravel()[at] / 0.07, 0, 1)
        there = np.clip(self.field["blood"] * 2.2 - 0.25, 0, 1)
        return np.asarray(0.5 * amount * there * lines * np.clip(self.texels.coarse, 0, 1.5))

    def _spots(self) -> Floats:
        """float32[n]: amount of melanin in freckles, age spots and moles."""
        field, texels, person = self.field, self.texels, self.person
        out = np.zeros(len(texels.place), np.float32)
        bent = 0.05 * texels.middle
        if person.freckles:
            share = np.clip(person.freckles * field["freckled"], 0, 1)
            for cell, seed, dark in ((11, 21, 0.34), (21, 22, 0.40)):
                tile, at = texels.dots(cell, seed)
                out += dark * tile.over(0.75 * share, at, 0.42, 0.8, bent)
        if self.old > 0.1:
            tile, at = texels.dots(64, 23)
            share = 0.5 * self.old * field["weathered"]
            out += 0.30 * tile.over(share, at, 0.34, 0.45, 0.06 * texels.middle)
        random = np.random.default_rng(sum(map(ord, person.name)))
        front = np.flatnonzero((texels.place[:, 2] > 0.9) & (field["mouth"] > 10))
        for at in random.choice(front, 5 if person.age > 12 else 2) if len(front) else ():
            away = np.linalg.norm(texels.place - texels.place[at], axis=1)
            radius = random.uniform(0.006, 0.013)
            out += random.uniform(0.5, 1.3) * smooth(radius, 0.45 * radius, away)
        return out

    def _hair(self, light: Floats) -> Floats:
        """float32[n, 3]: linear light with the roots of beard, brows and hair.

        The roots are a shadow in the skin; stubble consists of dots.

        Args:
            light: float32[n, 3], linear light of the skin.
        """
        person, texels = self.person, self.texels
        hair = linear(np.array(person.hair))
        scalp = self.scalp
        roots, at = texels.dots(3.4, 31)
        dark = roots.over(0.9 * scalp, at, 0.5)
        shadow = person.scalp * scalp * (0.78 + 0.08 * texels.middle) + 0.2 * person.scalp * dark
        # The colours of skin and hair are mixed by a product of their powers, because light passes
        # many hairs, and each absorbs a fraction of it.
        deep = (np.clip(shadow, 0, 0.95) * scalp).astype(np.float32)[:, None]
        light = light ** (1 - deep) * np.maximum(hair, 1e-3).astype(np.float32) ** deep
        if person.beard_style != "none":  # roots between the beard's cards
            share = np.clip(self.field["grown"] * (1 + 0.25 * texels.coarse), 0, 1)
            dark = roots.over(0.9 * share, at, 0.5)
            light = _over(light, _IN_SHADE * hair, 0.5 * share + 0.4 * share * dark)
        brows = linear(np.array(person.brows))
        light = _over(light, brows, 0.30 * person.scalp * self._brows())
        if person.beard:
            share = np.clip(self.field["beard"] * (1 + 0.10 * texels.coarse), 0, 1)
            light = light * np.exp(-(1.5 * person.beard * share)[:, None] * 2 * _VEINS)
            stubble, at = texels.dots(2.5, 32)
            dark = stubble.over(share, at, 0.46, 0.9)
            light = _over(light, 0.5 * brows + 0.02, np.clip(2.6 * person.beard, 0, 0.6) * dark)
        return light

    def _brows(self) -> Floats:
        """float32[n], 0 to 1: mask of the brows' cards with a frayed edge."""
        texels = self.texels
        at = texels.place - np.array([0, *self.eye[1:]])
        near = np.flatnonzero((at[:, 1] > 0) & (at[:, 1] < 0.4) & (at[:, 2] > -0.4))
        out = np.zeros(len(at), np.float32)
        share = brow_density(at[near], self.eye[0]) * (1 + 0.25 * texels.middle[near])
        out[near] = np.clip(share, 0, 1)
        return out

    def _lips(self, light: Floats) -> Floats:
        """float32[n, 3]: linear light with the red of the lips.

        The lips are pale and pigmented at the rim, have lines across, and are darker where they
        meet.

        Args:
            light: float32[n, 3], linear light of the skin.
        """
        person, texels, ring = self.person, self.texels, self.field["mouth"]
        if not (ring < regions.FAR_RINGS).any():
            return light
        lips = linear(np.array(person.lips))
        red = lips * np.exp(
            -0.30
            * (self.lines + 0.5 * texels.fine + texels.coarse)[:, None]
            * np.array([0.25, 0.6, 0.55], np.float32)
        )
        inner = smooth(6.5, 2.5, ring)
        pink = linear(np.array(_MUCOSA)) * (1 - 0.35 * self.deep)
        red = _over(red, pink, (0.30 + 0.10 * self.deep) * inner)
        red = red * np.exp(-0.22 * self.deep * _MELANIN)
        red *= (1 - 0.18 * smooth(4.0, 2.2, ring))[:, None]
        rim = np.exp(-(((ring - regions.LIPS_RINGS) / 1.1) ** 2)) * self.deep
        light = light * np.exp(-(0.25 * rim)[:, None] * _MELANIN)
        return _over(light, red, (0.80 + 0.05 * texels.coarse) * self.lips)

    @cached_property
    def lines(self) -> Floats:
        """float32[n]: lines across the lips, with mean 0 and standard deviation 1."""
        texels = self.texels
        tile = patterns.mottling(512, 2.3, np.random.default_rng(41), 14)
        across = np.rint(texels.place[:, 0] / 0.0042 + 1.5 * texels.middle).astype(int) % 512
        down = np.rint(4 * self.field["mouth"]).astype(int) % 512
        return np.asarray(tile[down, across])

    def _inside(self, light: Floats) -> Floats:
        """float32[n, 3]: linear light with the wet colours of the inside of the mouth and of the
        skin behind the lids.

        Args:
            light: float32[n, 3], linear light of the skin.
        """
        ring, texels = self.field["mouth"], self.texels
        mucosa = linear(np.array(_MUCOSA)) * (1 - 0.25 * self.deep)
        mucosa = mucosa * np.exp(-0.16 * (texels.coarse + texels.middle)[:, None] * [0.3, 1.0, 0.9])
        back = smooth(0.1, -0.75, texels.place[:, 2] - self.eye[2])
        mucosa = _over(mucosa, linear(np.array(_THROAT)), back)
        light = _over(light, mucosa, smooth(2.4, 0.4, ring))
        pink = linear(np.array(_LID_MARGIN)) * (1 - 0.45 * self.deep)
        return _over(light, pink, 0.85 * smooth(3.6, 1.2, self.field["eyes"]))


def _over(light: Floats, colour: Floats, mask: Floats) -> Floats:
    """Blends a colour over linear light by a mask from 0 to 1.

    Args:
        light: float32[n, 3], linear light.
        colour: float[3] or [n, 3], linear light of the colour.
        mask: float[n]; values are clipped to 0 to 1.
    """
    mask = np.clip(mask, 0, 1).astype(np.float32)[:, None]
    out = np.asarray(light * (1 - mask))
    out += colour.astype(np.float32) * mask
    return out
