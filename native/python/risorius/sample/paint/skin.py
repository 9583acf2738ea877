# SPDX-License-Identifier: MIT
"""The colour of the skin."""

from __future__ import annotations

import numpy as np

from ..expressions import Expression
from ..part import Part
from ..people import Person
from ..polygons import Floats
from .images import blend, noise, smooth
from .raster import Raster, bleed

HEAD_SIZE = 2048


def brow_mask(texels: Floats, eye: Floats, random: np.random.Generator) -> Floats:
    """Strands along an arched line above each eye, float64[h, w] from 0 to 1.

    Args:
        texels: float64[h, w, 3], each texel's place on the head, decimetres.
        eye: float64[3], the left eye's middle.
        random: gives the strands.
    """
    x, y = np.abs(texels[:, :, 0]), texels[:, :, 1] - eye[1]
    along = (x - (eye[0] - 0.19)) / 0.44  # 0 at the nose, 1 at the temple
    ridge = (
        0.165
        + 0.055 * np.sin(np.clip(along, 0, 1.1) * 2.2)
        - 0.045 * np.clip(along - 0.55, 0, 1) / 0.5
    )
    half = 0.05 * (1 - 0.62 * np.clip(along, 0, 1)) * smooth(-0.04, 0.1, along) + 0.002
    across = (y - ridge) / half
    body = (1 - smooth(0.45, 1.05, np.abs(across))) * smooth(-0.03, 0.1, along)
    body *= 1 - smooth(0.9, 1.02, along)
    front = smooth(0.05, 0.2, texels[:, :, 2] - eye[2] + 0.1)
    # Strands lean outward: lines of equal (t * lean - y) are one strand.
    phase = (x * (1.0 + 0.8 * np.clip(along, 0, 1)) - y * (1.2 - 0.9 * np.clip(along, 0, 1))) * 620
    jitter = 2.5 * noise(len(texels), 300, random)
    strands = 0.5 + 0.5 * np.sin(phase + jitter)
    return np.asarray(body * front * (0.55 + 0.45 * strands))


def hair_mask(texels: Floats, eye: Floats, random: np.random.Generator) -> Floats:
    """A shaved head's shadow, with a soft natural hairline, float64[h, w] from 0 to 1.

    Args:
        texels: float64[h, w, 3], each texel's place on the head, decimetres.
        eye: float64[3], the left eye's middle.
        random: makes the hairline uneven.
    """
    back = texels[:, :, 2] - eye[2]
    line = np.interp(
        back,
        [-1.9, -1.35, -1.05, -0.85, -0.62, -0.45, 0.1],
        [-0.62, -0.5, -0.2, 0.1, 0.22, 0.5, 0.76],
    )
    height = texels[:, :, 1] - eye[1] - line
    wobble = 0.03 * noise(len(texels), 60, random)
    ear = smooth(0.8, 0.86, np.abs(texels[:, :, 0])) * (
        1 - smooth(0.35, 0.45, texels[:, :, 1] - eye[1])
    )
    return np.asarray(smooth(-0.06, 0.12, height + wobble) * (1 - ear))


def lip_mask(part: Part, positions: Floats, place: Floats, units: dict[str, Expression]) -> Floats:
    """The vermilion, from the line where the lips meet, float64[h, w] from 0 to 1.

    That line is where vertices that the jaw takes along touch vertices that it leaves.

    Args:
        part: the head.
        positions: float64[v, 3], positions of its vertices, decimetres.
        place: float64[h, w, 3], each texel's place on the head, decimetres.
        units: what each raw control does, by its name.
    """
    travel = np.linalg.norm(part.carry(units["jawOpen"].displacement), axis=1)
    mouth = np.flatnonzero(
        np.linalg.norm(part.carry(units["mouthUpperLipRollInL"].displacement), axis=1) > 0.004
    )
    mouth = np.union1d(
        mouth,
        np.flatnonzero(
            np.linalg.norm(part.carry(units["mouthUpperLipRollInR"].displacement), axis=1) > 0.004
        ),
    )
    low_lip = np.flatnonzero(travel > 0.6 * travel[np.abs(positions[:, 0]) < 0.2].max())
    gap = np.linalg.norm(positions[mouth][:, None, :] - positions[low_lip][None, :, :], axis=2).min(
        axis=1
    )
    seam = positions[mouth[gap < 0.03]]
    seam = seam[seam[:, 2] > seam[:, 2].max() - 0.25]
    width = float(np.abs(seam[:, 0]).max())
    line = np.polyfit(np.abs(seam[:, 0]), seam[:, 1], 2)
    depth = np.polyfit(np.abs(seam[:, 0]), seam[:, 2], 2)
    x = np.abs(place[:, :, 0])
    t = np.clip(x / (1.04 * width), 0, 1)
    y = place[:, :, 1] - np.polyval(line, np.minimum(x, width))
    z = place[:, :, 2] - np.polyval(depth, np.minimum(x, width))
    bow = 1 + 0.10 * np.exp(-(((x - 0.07) / 0.05) ** 2)) - 0.12 * np.exp(-((x / 0.035) ** 2))
    upper = 0.078 * np.sqrt(1 - t**2) * bow
    lower = 0.098 * np.sqrt(1 - t**2)
    high = np.where(y > 0, upper, lower)
    inside = 1 - smooth(0.8, 1.12, np.abs(y) / np.maximum(high, 1e-3))
    return np.asarray(inside * (z > -0.2) * (t < 1))


def paint_head(
    person: Person,
    part: Part,
    raster: Raster,
    positions: Floats,
    eye: Floats,
    units: dict[str, Expression],
) -> tuple[Floats, Floats]:
    """Skin colour [h, w, 3] and each texel's place [h, w, 3].

    Args:
        person: has the colours.
        part: the head.
        raster: of its texture, HEAD_SIZE texels a side.
        positions: float64[v, 3], positions of its vertices, decimetres.
        eye: float64[3], the left eye's middle.
        units: what each raw control does, by its name.
    """
    random = np.random.default_rng(7)
    blink = sum(
        np.linalg.norm(part.carry(units[n].displacement), axis=1)
        for n in ("eyeBlinkL", "eyeBlinkR")
    )
    lids = smooth(0.1, 0.8, blink / blink.max())
    image, covered = raster.image(np.column_stack([positions, lids])), raster.covered
    place = image[:, :, :3]
    lips = lip_mask(part, positions, place, units)
    colour = np.ones((HEAD_SIZE, HEAD_SIZE, 3)) * np.array(person.skin)
    mottle = 0.5 * noise(HEAD_SIZE, 40, random) + 0.3 * noise(HEAD_SIZE, 150, random)
    colour += 0.018 * mottle[:, :, None] * np.array([0.6, 1.0, 1.0])
    pores = random.normal(0, 0.008, (HEAD_SIZE, HEAD_SIZE))
    colour += pores[:, :, None]
    x, y = np.abs(place[:, :, 0]), place[:, :, 1] - eye[1]
    z = place[:, :, 2] - eye[2]
    cheeks = np.exp(-(((x - 0.42) / 0.22) ** 2) - ((y + 0.4) / 0.2) ** 2) * (z > -0.35)
    nose = np.exp(-((x / 0.16) ** 2) - ((y + 0.42) / 0.16) ** 2) * (z > 0.1)
    ears = smooth(0.8, 0.9, x) * (np.abs(y + 0.15) < 0.5)
    colour = blend(colour, person.flush, 0.4 * cheeks + 0.4 * nose + 0.35 * ears)
    colour = blend(colour, person.lids, 0.35 * image[:, :, 3])
    beard = smooth(-0.62, -0.78, y) * smooth(-0.85, -0.55, z) * (1 - lips)
    beard *= smooth(-1.45, -1.2, y)
    speckle = 0.6 + 0.8 * random.random((HEAD_SIZE, HEAD_SIZE))
    colour = blend(colour, (0.42, 0.33, 0.30), person.beard * beard * speckle)
    colour = blend(colour, person.lips, 0.8 * lips)
    colour = blend(colour, person.hair, 0.62 * hair_mask(place, eye, random) * speckle)
    colour = blend(colour, person.brows, 0.92 * brow_mask(place, eye, random))
    return bleed(np.clip(colour, 0, 1), covered), place
