# SPDX-License-Identifier: MIT
"""The colour of the eyes: pupil, iris, sclera, vessels."""

from __future__ import annotations

import numpy as np

from ..people import Person
from ..polygons import Floats
from .images import blend, noise, smooth

EYE_SIZE = 1024


def paint_eye(person: Person) -> Floats:
    """Pupil, iris with fibres and a dark rim, sclera that is not white; the gaze in the middle."""
    random = np.random.default_rng(11)
    at = (np.arange(EYE_SIZE) + 0.5) / EYE_SIZE - 0.5
    x, y = np.meshgrid(at, at)
    angle = 2 * np.pi * np.hypot(x, y)  # from the gaze, in radians
    around = np.arctan2(y, x)
    iris, pupil = 0.44, 0.165
    colour = np.ones((EYE_SIZE, EYE_SIZE, 3)) * np.array([0.90, 0.88, 0.85])
    blush = 0.5 + 0.5 * noise(EYE_SIZE, 9, random)
    colour = blend(colour, (0.86, 0.66, 0.60), 0.4 * blush * smooth(0.6, 1.6, angle))
    colour = blend(colour, (0.72, 0.30, 0.26), 0.5 * vessels(random, 0.13))
    fibres = np.zeros_like(angle)
    for count in (37, 61, 97, 149):
        fibres += np.sin(count * around + random.uniform(0, 6) + 3 * noise(EYE_SIZE, 24, random))
    shade = 0.5 + 0.14 * fibres
    depth = smooth(pupil, iris, angle)
    base = np.array(person.iris[0]) * (1 - depth)[:, :, None]
    base = base + np.array(person.iris[1]) * depth[:, :, None]
    inside = (1 - smooth(iris - 0.02, iris + 0.025, angle))[:, :, None]
    colour = colour * (1 - inside) + base * (0.7 + 0.6 * shade[:, :, None]) * inside
    rim = np.exp(-(((angle - iris) / 0.045) ** 2))
    colour = blend(colour, (0.07, 0.07, 0.07), 0.75 * rim)
    colour = blend(colour, (0.01, 0.01, 0.01), 1 - smooth(pupil - 0.02, pupil + 0.02, angle))
    return np.clip(colour, 0, 1)


def vessels(random: np.random.Generator, angle_limit: float) -> Floats:
    """Fine blood vessels [EYE_SIZE, EYE_SIZE], 0 to 1: they wander in from behind and thin out.

    Args:
        random: gives their ways.
        angle_limit: how near they come to the pupil at most, as a distance in texture space; the
            back of the eyeball is at 0.5.
    """
    image = np.zeros((EYE_SIZE, EYE_SIZE))
    for _ in range(90):
        around, step = random.uniform(0, 2 * np.pi), 0.0
        away, end = 0.5, random.uniform(angle_limit, 0.42)
        while away > end:
            step = 0.85 * step + random.normal(0, 0.004)
            around += step / away
            away -= 0.0012
            x, y = ((0.5 + away * f(around)) * EYE_SIZE for f in (np.cos, np.sin))
            i, j = int(y), int(x)
            strength = min(1.0, (away - end) / 0.15) * 0.8
            if 0 < i < EYE_SIZE - 1 and 0 < j < EYE_SIZE - 1:
                for di, dj, share in ((0, 0, 1.0), (0, 1, x % 1), (1, 0, y % 1)):
                    here = image[i + di, j + dj]
                    image[i + di, j + dj] = max(here, strength * share)
    return image
