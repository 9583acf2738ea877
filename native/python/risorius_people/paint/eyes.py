# SPDX-License-Identifier: MIT
"""Paints the colour of the eyes: pupil, iris, sclera, vessels."""

from __future__ import annotations

import numpy as np
from risorius.base.easing import smooth_step

from ..eyes.eyeball import IRIS_AT, PUPIL, side_angle
from ..people import Person
from ..polygons import Floats
from .images import blend, noise, smooth
from .skin import depth_of

EYE_SIZE = 1024
_WHITE, _PINK, _VESSEL = (0.80, 0.755, 0.71), (0.83, 0.62, 0.56), (0.66, 0.24, 0.20)
_SHADE = (0.60, 0.47, 0.43)
# position of the collarette, as a fraction of the way from the pupil to the limbus
_COLLARETTE = 0.30
_CRYPTS = 46  # number of gaps between the iris' fibres
_VESSELS = 110  # number of blood vessels before they fork


def paint_eye(person: Person) -> Floats:
    """float64[EYE_SIZE, EYE_SIZE, 3]: pupil, fibres of the iris, soft limbus, sclera; the gaze is
    at the centre.

    The radius of the iris is IRIS_AT (0.26) of the texture's side, so the iris takes a larger part
    of the texture than of the ball.
    """
    random = np.random.default_rng(11)
    at = (np.arange(EYE_SIZE) + 0.5) / EYE_SIZE - 0.5
    x, y = np.meshgrid(at, at)
    away, around = np.hypot(x, y), np.arctan2(y, x) / (2 * np.pi) % 1
    colour = _sclera(side_angle(np.maximum(away, IRIS_AT)), x / np.maximum(away, 1e-9), random)
    # The sclera is darker if the skin is dark, because a white one would seem to glow beside dark
    # skin.
    colour *= 1 - 0.23 * depth_of(person)
    reach = (away / IRIS_AT - PUPIL) / (1 - PUPIL)  # 0 at the pupil, 1 at the limbus
    iris = _iris(person, around, reach, random)
    wobble = 0.012 * _polar(around, 0 * reach, 53, 1, random)
    # The limbus is soft, because the sclera becomes transparent over a millimetre.
    inside = 1 - smooth(0.955, 1.13, reach + wobble)
    colour = colour * (1 - inside[:, :, None]) + iris * inside[:, :, None]
    halo = np.exp(-(((reach - 1.07) / 0.10) ** 2))
    colour = blend(colour, (0.33, 0.32, 0.33), 0.33 * halo)
    return np.clip(colour, 0, 1)


def _polar(
    around: Floats, along: Floats, cells: int, rings: int, random: np.random.Generator
) -> Floats:
    """float64[h, w]: smooth noise from -1 to 1 without a seam around the pupil.

    Args:
        around: float64[h, w], angle about the pupil in turns.
        along: float64[h, w], 0 at the pupil, 1 at the limbus; other values are clipped.
        cells: number of noise cells around the pupil.
        rings: number of noise cells from the pupil to the limbus.
        random: generator of the noise.
    """
    grid = random.uniform(-1, 1, (cells, rings + 1))
    a = around % 1 * cells
    b = np.clip(along, 0, 1) * rings
    i, j = a.astype(int) % cells, np.minimum(b.astype(int), rings - 1)
    s, t = smooth_step(a - np.floor(a)), smooth_step(b - j)
    k = (i + 1) % cells
    near = grid[i, j] * (1 - s) + grid[k, j] * s
    far = grid[i, j + 1] * (1 - s) + grid[k, j + 1] * s
    return np.asarray(near * (1 - t) + far * t)


def _fibres(around: Floats, reach: Floats, random: np.random.Generator) -> Floats:
    """float64[h, w] from 0 to 1: fibres that wander, part and meet on their way outward.

    Args:
        around: float64[h, w], angle about the pupil in turns.
        reach: float64[h, w], 0 at the pupil, 1 at the limbus.
        random: generator of the fibres.
    """
    bent = around + 0.0055 * _polar(around, reach, 17, 3, random)
    bent = bent + 0.0025 * _polar(around, reach, 61, 4, random)
    out = np.zeros_like(around)
    for cells, rings, share in ((74, 2, 0.30), (137, 3, 0.34), (263, 4, 0.24), (431, 6, 0.12)):
        ridge = 1 - np.abs(_polar(bent, reach, cells, rings, random))
        out += share * ridge**2
    return np.asarray(np.clip((out - 0.15) / 0.6, 0, 1))


def _iris(person: Person, around: Floats, reach: Floats, random: np.random.Generator) -> Floats:
    """float64[h, w, 3]: the iris with the pupil; beyond the limbus the iris' rim continues.

    Args:
        person: the person, with the colours of the iris.
        around: float64[h, w], angle about the pupil in turns.
        reach: float64[h, w], 0 at the pupil, 1 at the limbus.
        random: generator of fibres and crypts.
    """
    inner, outer = np.array(person.iris[0]), np.array(person.iris[1])
    frill = _COLLARETTE + 0.035 * _polar(around, 0 * reach, 41, 1, random)
    frill += 0.045 * _polar(around, 0 * reach, 9, 1, random)
    beyond = smooth(-0.10, 0.16, reach - frill)
    patches = 0.16 * _polar(around, reach, 11, 3, random)
    depth = np.clip(beyond * 0.75 + 0.3 * smooth(0.2, 0.95, reach) + patches, 0, 1)[:, :, None]
    colour = inner * (1 - depth) + outer * depth
    fibres = _fibres(around, reach, random)
    # Inside the collarette the fibres are fine, so they have less contrast.
    contrast = 0.45 + 0.55 * beyond
    light = 0.50 + 1.05 * (0.5 + contrast * (fibres - 0.5))
    light += 0.30 * np.exp(-(((reach - frill) / 0.045) ** 2)) * (0.4 + fibres)
    light *= 1 - 0.62 * _crypts(around, reach, frill, random)
    for ring, deep in ((0.66, 0.10), (0.80, 0.13)):
        wave = ring + 0.02 * _polar(around, 0 * reach, 13, 1, random)
        broken = np.clip(0.5 + _polar(around, 0 * reach, 15, 1, random), 0, 1)
        light *= 1 - deep * broken * np.exp(-(((reach - wave) / 0.018) ** 2))
    colour = colour * light[:, :, None]
    pale = smooth(0.55, 1.0, fibres) * beyond * smooth(0.95, 0.6, reach)
    colour = colour + 0.10 * pale[:, :, None] * (0.35 + colour)
    colour *= 1 - 0.80 * smooth(0.80, 1.02, reach)[:, :, None]
    grey = colour.mean(axis=2, keepdims=True)
    colour = 0.85 * colour + 0.15 * grey
    ruff = np.exp(-(((reach - 0.015) / 0.028) ** 2))
    colour = blend(colour, (0.055, 0.03, 0.018), 0.85 * ruff)
    return blend(colour, (0.004, 0.004, 0.004), 1 - smooth(-0.02, 0.012, reach))


def _crypts(around: Floats, reach: Floats, frill: Floats, random: np.random.Generator) -> Floats:
    """float64[h, w] from 0 to 1: crypts, which are lozenge-shaped gaps between fibres, mostly at
    the collarette.

    Args:
        around: float64[h, w], angle about the pupil in turns.
        reach: float64[h, w], 0 at the pupil, 1 at the limbus.
        frill: float64[h, w], `reach` of the collarette.
        random: generator of the crypts.
    """
    out = np.zeros_like(around)
    for _ in range(_CRYPTS):
        where, at = random.uniform(), random.choice([0.06, 0.16, 0.30]) + random.normal(0, 0.04)
        wide, long = random.uniform(0.006, 0.014), random.uniform(0.05, 0.11)
        turn = (around - where + 0.5) % 1 - 0.5
        near = np.abs(turn) < 2 * wide
        edge = np.abs(turn[near]) / wide + np.abs(reach[near] - frill[near] - at) / long
        out[near] = np.maximum(out[near], random.uniform(0.5, 1.0) * (1 - smooth(0.45, 1.05, edge)))
    return out


def _sclera(angle: Floats, aside: Floats, random: np.random.Generator) -> Floats:
    """float64[h, w, 3]: the sclera, warm grey, redder and darker at the corners, with faint
    vessels.

    Args:
        angle: float64[h, w], angle from the gaze in radians.
        aside: float64[h, w], 1 and -1 towards the corners of the eye, 0 above and below.
        random: generator of patches and vessels.
    """
    colour = np.ones((*angle.shape, 3)) * np.array(_WHITE)
    patches = 0.5 + 0.5 * noise(len(angle), 14, random)
    corners = smooth(0.62, 1.25, angle) * (0.35 + 0.65 * aside**2)
    colour = blend(colour, _PINK, 0.7 * corners * (0.6 + 0.4 * patches) + 0.05 * patches)
    colour = blend(colour, _VESSEL, 0.62 * vessels(random) * (0.5 + 0.5 * aside**2))
    return blend(colour, _SHADE, 0.55 * smooth(0.62, 1.35, angle))


def vessels(random: np.random.Generator) -> Floats:
    """float64[EYE_SIZE, EYE_SIZE], 0 to 1: fine blood vessels that run from the back of the ball
    towards the iris, fork and thin out.

    Args:
        random: generator of their paths.
    """
    image = np.zeros((EYE_SIZE, EYE_SIZE))
    ways = []
    for _ in range(_VESSELS):
        side = random.choice([0.0, np.pi])
        ways.append((side + random.normal(0, 0.75), 0.49, random.uniform(0.285, 0.42), 1.0))
    while ways:
        around, away, end, strength = ways.pop()
        lean, begin = random.normal(0, 0.0006), away
        points = []
        while away > end:
            lean = 0.93 * lean + random.normal(0, 0.00035)
            around += lean / away
            away -= 0.0006
            fall = strength * min(1.0, 0.25 + (away - end) / max(begin - end, 1e-9))
            points.append((around, away, fall))
            if strength > 0.4 and random.uniform() < 0.012:
                ways.append((around, away, max(end, away - random.uniform(0.03, 0.09)), 0.6 * fall))
        _draw(image, np.array(points).reshape(-1, 3))
    return _soft(image)


def _draw(image: Floats, points: Floats) -> None:
    """Draws a thin line onto an image.

    Args:
        image: float64[size, size]; changed.
        points: float64[n, 3]: angle about the image's centre in radians, distance from the centre
            as a fraction of the image's side, strength from 0 to 1.
    """
    x = (0.5 + points[:, 1] * np.cos(points[:, 0])) * EYE_SIZE - 0.5
    y = (0.5 + points[:, 1] * np.sin(points[:, 0])) * EYE_SIZE - 0.5
    i, j = np.floor(y).astype(int), np.floor(x).astype(int)
    s, t = y - i, x - j
    for down, aside, share in (
        (0, 0, (1 - s) * (1 - t)),
        (0, 1, (1 - s) * t),
        (1, 0, s * (1 - t)),
        (1, 1, s * t),
    ):
        rows, columns = np.clip(i + down, 0, EYE_SIZE - 1), np.clip(j + aside, 0, EYE_SIZE - 1)
        np.maximum.at(image, (rows, columns), np.sqrt(share) * points[:, 2])


def _soft(image: Floats) -> Floats:
    """The image with lines widened to two texels, and with a faint halo."""
    near = sum(np.roll(image, shift, axis) for axis in (0, 1) for shift in (-1, 1))
    return np.asarray(np.clip(0.7 * image + 0.2 * near, 0, 1))
