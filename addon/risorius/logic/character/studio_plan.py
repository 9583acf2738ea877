# SPDX-License-Identifier: GPL-3.0-or-later
"""Places camera, lights and backdrop of a portrait around a head.

All places are in the head's axes: the face looks along -y, z is up, and the origin is the midpoint
between the eyes. The constants are metres for an adult head; results are Blender units, scaled by
the distance between the eyes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

Triple = tuple[float, float, float]

GROWN = 0.063  # metres between the eyes of the adult head
LENS = 100.0  # mm: focal length, as of a portrait lens
SENSOR = 24.0  # mm: height of a full frame sensor
_HEIGHT = 0.39  # metres: height of a picture of head and shoulders, in the plane of the eyes
_HEADROOM = 0.014  # metres above the hair, at least
_EDGE = 0.02  # metres from the lower edge of the picture to the lower end of the mesh, at least
_CHIN = 0.13  # metres below the eyes that every picture contains
_NECK = 0.185  # metres below the eyes: a mesh that ends above has no neck
_THIRD = 1.0 / 3.0  # distance of the eyes from the upper edge, as a share of the picture
_ASIDE = 8.0  # degrees: turns the camera to the side of the fill light
_ABOVE = 0.045  # metres: height of the camera above the eyes
_DEPTH = 0.075  # metres from the eyes back to the middle of the head
_WALL = 1.7  # metres from the middle of the head to the backdrop, at least
_WALL_SIZE = (6.0, 4.0)


@dataclass(frozen=True)
class Lamp:
    """One softbox.

    Attributes:
        name: key, fill or rim light.
        place: centre of the softbox in Blender units; the softbox points at the origin.
        size: width and height in Blender units.
        watts: radiant power.
        colour: linear RGB, 0 to 1.
    """

    name: str
    place: Triple
    size: tuple[float, float]
    watts: float
    colour: Triple


@dataclass(frozen=True)
class Studio:
    """The setting of a portrait; lengths and places in Blender units.

    Attributes:
        camera: place of the camera.
        target: centre of the picture.
        lens: focal length in mm, for a sensor with a height of SENSOR mm.
        lamps: key, fill and rim.
        wall: centre of the backdrop, behind the head as seen from the camera.
        wall_turn: rotation of the backdrop about z in radians, towards the camera.
        wall_size: width and height of the backdrop.
        glow: radius of the lighter centre of the backdrop.
    """

    camera: Triple
    target: Triple
    lens: float
    lamps: tuple[Lamp, ...]
    wall: Triple
    wall_turn: float
    wall_size: tuple[float, float]
    glow: float


_Row = tuple[str, float, float, float, tuple[float, float], float, Triple]
# Each lamp: name, degrees to the viewer's right, degrees up, distance in metres, width and height
# in metres, light at the face as a share of the key light, linear RGB colour. The fill light is two
# stops darker than the key light.
_LAMPS: tuple[_Row, ...] = (
    ("Key", -45.0, 30.0, 1.3, (0.6, 0.6), 1.0, (1.0, 0.925, 0.84)),
    ("Fill", 42.0, 4.0, 2.0, (1.5, 1.5), 0.25, (0.86, 0.93, 1.0)),
    ("Rim", 148.0, 38.0, 1.35, (0.45, 0.9), 0.8, (0.93, 0.97, 1.0)),
)
_EXPOSURE = 4.6  # irradiance of the key at the face, in W/m2


def plan(apart: float, low: Sequence[float], high: Sequence[float]) -> Studio:
    """Plan the setting for a head.

    Args:
        apart: distance between the eyes, in Blender units.
        low, high: corners of the bounding box of all meshes of the face, in the head's axes and
            Blender units.

    Raises:
        ValueError: `apart` is not above 0.
    """
    if not apart > 0.0 or not math.isfinite(apart):
        raise ValueError(f"apart: a distance above 0 was expected, found {apart!r}")
    unit = apart / GROWN
    height, lift = _frame(unit, low[2], high[2])
    away = height * LENS / SENSOR
    turn = math.radians(_ASIDE)
    towards = (math.sin(turn), -math.cos(turn))  # from the head to the camera
    middle = (0.0, _DEPTH * unit)
    camera = [m + (away + _DEPTH * unit) * t for m, t in zip(middle, towards, strict=True)]
    wall = [m - max(_WALL * unit, high[1] + unit) * t for m, t in zip(middle, towards, strict=True)]
    above = _ABOVE * unit
    farther = (away + _DEPTH * unit) / away  # the ray through `lift` at the eyes meets the middle
    return Studio(
        camera=(camera[0], camera[1], above),
        target=(middle[0], middle[1], above + (lift - above) * farther),
        lens=LENS,
        lamps=tuple(_lamp(row, unit) for row in _LAMPS),
        wall=(wall[0], wall[1], 0.0),
        wall_turn=turn,
        wall_size=(_WALL_SIZE[0] * unit, _WALL_SIZE[1] * unit),
        glow=0.62 * unit,
    )


def _frame(unit: float, low: float, high: float) -> tuple[float, float]:
    """Height of the picture, and height of its centre above the eyes, both in Blender units.

    The eyes are a third of the picture's height below its top, unless hair needs more room. The
    picture of a face with a neck ends above the lower end of its mesh; a face without a neck is
    shown completely.

    Args:
        unit: Blender units per metre of the adult head.
        low, high: z of the lowest and of the highest vertex minus z of the eyes, in Blender units.
    """
    below = min(_HEIGHT * (1.0 - _THIRD) * unit, max(-low - _EDGE * unit, _CHIN * unit))
    if -low <= _NECK * unit:
        below = -low + _HEADROOM * unit
    above = max(below * _THIRD / (1.0 - _THIRD), high + _HEADROOM * unit)
    return above + below, (above - below) / 2


def has_neck(apart: float, low: float) -> bool:
    """Whether the mesh of a face includes a neck.

    Args:
        apart: distance between the eyes, in Blender units.
        low: z of the lowest vertex minus z of the eyes, in Blender units.
    """
    return -low > _NECK * apart / GROWN


def _lamp(row: _Row, unit: float) -> Lamp:
    name, aside, up, away, size, share, colour = row
    turn, lift, far = math.radians(aside), math.radians(up), away * unit
    place = (
        far * math.cos(lift) * math.sin(turn),
        -far * math.cos(lift) * math.cos(turn),
        far * math.sin(lift),
    )
    # A softbox of W watts emits W / pi per steradian along its axis. At the distance `far`, the
    # face gets W / (pi far^2) per unit area. The wanted light at the face is share * _EXPOSURE.
    watts = share * _EXPOSURE * math.pi * far * far
    return Lamp(name, place, (size[0] * unit, size[1] * unit), watts, colour)
