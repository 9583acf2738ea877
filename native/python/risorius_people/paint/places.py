# SPDX-License-Identifier: MIT
"""Computes where hair grows on the man's head, as densities from 0 to 1 at given points.

Positions are in decimetres: x from the middle of the face to the side, y up and z to the front from
the middle of the eyes.
"""

from __future__ import annotations

import numpy as np
from risorius.base.easing import smooth_step

from ..polygons import Floats

# The hairline seen from the side, (z, y) from the nape over the ear to the middle of the forehead.
_LINE = np.array(
    [
        (-2.20, -0.66),
        (-1.50, -0.70),
        (-1.28, -0.64),
        (-1.12, -0.42),
        (-1.05, -0.12),
        (-1.00, 0.06),
        (-0.90, 0.13),
        (-0.70, 0.12),
        (-0.60, 0.06),
        (-0.575, -0.20),
        (-0.44, -0.22),
        (-0.40, -0.02),
        (-0.36, 0.14),
        (-0.29, 0.32),
        (-0.20, 0.46),
        (-0.06, 0.58),
        (0.08, 0.655),
        (0.30, 0.70),
        (0.90, 0.74),
    ]
)
HAIRLINES = {  # style -> the arguments recession, sideburn and low of hairline_height, 0 to 1
    "none": (0.0, 1.0, 0.0),
    "crop": (0.0, 1.0, 0.0),
    "receding": (0.75, 1.0, 0.0),
    "long": (0.0, 0.7, 1.0),
    "bun": (0.0, 0.45, 0.7),
    "afro": (0.0, 0.6, 0.0),
}
_THIN_TOP = {"receding": 0.55}
_NO_SIDEBURN = slice(9, 12)  # points of the hairline in front of the ear


def wavy(points: Floats, random: np.random.Generator, waves: float, count: int = 12) -> Floats:
    """float64[n]: smooth noise in about [-1, 1] at points in space.

    Args:
        points: float64[n, 3], in decimetres.
        random: generator of the noise.
        waves: number of waves per decimetre.
        count: number of sine waves in random directions whose sum is the noise.
    """
    ways = random.normal(0, 1, (count, 3))
    ways *= 2 * np.pi * waves / np.linalg.norm(ways, axis=1, keepdims=True)
    turns = random.uniform(0, 2 * np.pi, count)
    return np.asarray(np.sin(points @ ways.T + turns).sum(axis=1) / np.sqrt(count))


def hairline_height(
    points: Floats, recession: float = 0.0, sideburn: float = 1.0, low: float = 0.0
) -> Floats:
    """float64[n]: distance from the hairline in decimetres, positive on the side with hair.

    Args:
        points: float64[n, 3], on the man's head.
        recession: amount by which the hairline has receded at temples and forehead, 0 to 1.
        sideburn: length of the hair in front of the ear, 0 to 1.
        low: 0 to 1: 0 for the usual hairline; 1 for a hairline that is lower and rounder over the
            forehead, as of many women.
    """
    line = _LINE.copy()
    line[_NO_SIDEBURN, 1] = (1 - sideburn) * 0.1 + sideburn * line[_NO_SIDEBURN, 1]
    x, back, up = np.abs(points[:, 0]), points[:, 2].copy(), points[:, 1].copy()
    front = smooth_step((back + 0.75) / 0.4)
    corner = np.exp(-(((x - 0.40) / 0.16) ** 2))
    gone = (0.05 - 0.09 * low) * corner + recession * (0.30 + 0.35 * corner) - 0.045 * low
    up -= front * gone * smooth_step((up - 0.25) / 0.3)
    inside = up > np.interp(back, line[:, 0], line[:, 1])
    place = np.column_stack([back, up])
    a, b = line[:-1], line[1:]
    way = b - a
    t = ((place[:, None] - a) * way).sum(-1) / (way * way).sum(-1)
    foot = a + np.clip(t, 0, 1)[..., None] * way
    distance = np.linalg.norm(place[:, None] - foot, axis=-1).min(axis=1)
    return np.where(inside, distance, -distance)


def thinned(points: Floats, style: str) -> Floats:
    """float64[n]: fraction of hair that is lost on top, 0 to 1.

    Args:
        points: float64[n, 3], on the man's head.
        style: one of people.HAIR_STYLES.
    """
    return np.asarray(_THIN_TOP.get(style, 0.0) * smooth_step((points[:, 1] - 0.55) / 0.3))


def brow_place(points: Floats, eye: float) -> tuple[Floats, Floats]:
    """Position along a brow, 0 at the nose and 1 at the temple, and height above the brow's middle
    line in decimetres.

    Args:
        points: float64[n, 3], on the man's head.
        eye: decimetres from the middle of the face to the middle of his eye.
    """
    along = (np.abs(points[:, 0]) - (eye - 0.185)) / 0.44
    return along, points[:, 1] - brow_ridge(along)


def brow_ridge(along: Floats) -> Floats:
    """float64[n]: height of a brow's middle line above the eye's middle, in decimetres.

    Args:
        along: float64[n], 0 at the nose and 1 at the temple.
    """
    return np.interp(
        along,
        [-0.2, 0.0, 0.2, 0.4, 0.6, 0.75, 0.9, 1.0, 1.2],
        [0.150, 0.158, 0.178, 0.198, 0.214, 0.214, 0.196, 0.175, 0.125],
    )


def brow_width(along: Floats) -> Floats:
    """float64[n]: half the width of a brow, in decimetres.

    Args:
        along: float64[n], 0 at the nose and 1 at the temple.
    """
    return np.interp(along, [0.0, 0.15, 0.5, 0.8, 1.0], [0.024, 0.033, 0.031, 0.019, 0.007])


def brow_density(points: Floats, eye: float) -> Floats:
    """float64[n], 0 to 1: density of a brow, sparse at both ends.

    Args:
        points: float64[n, 3], on the man's head.
        eye: decimetres from the middle of the face to the middle of his eye.
    """
    along, height = brow_place(points, eye)
    across = height / brow_width(np.clip(along, 0, 1))
    body = 1 - smooth_step((np.abs(across) - 0.45) / 0.75)
    ends = smooth_step((along + 0.03) / 0.2) * (1 - smooth_step((along - 0.86) / 0.18))
    return np.asarray(body * ends * (points[:, 2] > -0.35))


def beard_density(points: Floats, lips: Floats, style: str) -> Floats:
    """float64[n], 0 to 1: density of the beard.

    Args:
        points: float64[n, 3], on the man's head.
        lips: float64[n], 1 on the lips and in the mouth, else 0.
        style: one of people.BEARD_STYLES except "none".
    """
    x, y, z = np.abs(points[:, 0]), points[:, 1], points[:, 2]
    # The upper edge goes from the front of the ear over the cheek to the corner of the mouth.
    cheek = np.interp(z, [-0.62, -0.45, -0.2, 0.0, 0.15], [-0.10, -0.22, -0.46, -0.56, -0.66])
    under = np.interp(z, [-0.6, -0.3, 0.0, 0.3], [-0.90, -1.02, -1.20, -1.30])
    edge = smooth_step((cheek - y) / 0.10) * smooth_step((y - under) / 0.12)
    edge *= smooth_step((z + 0.66) / 0.08)
    moustache = smooth_step((0.33 - x) / 0.05) * smooth_step((y + 0.76) / 0.04)
    moustache *= smooth_step((-0.52 - y) / 0.05) * (z > 0.12)
    chin = smooth_step((0.36 - x) / 0.10) * smooth_step((z + 0.02) / 0.12) * edge
    # bare skin on both sides of the tuft of hair below the lower lip
    bare = np.exp(-(((x - 0.17) / 0.07) ** 2) - ((y + 0.88) / 0.05) ** 2)
    full = np.maximum(edge * (1 - 0.7 * bare * (z > 0.1)), moustache)
    goatee = np.maximum(moustache, chin * smooth_step((-0.66 - y) / 0.05) * (1 - 0.8 * bare))
    shape = {"full": full, "short": full, "goatee": goatee, "moustache": moustache}[style]
    return np.asarray(shape * (1 - np.clip(1.5 * lips, 0, 1)))
