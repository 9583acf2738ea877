# SPDX-License-Identifier: MIT
"""Converts the rows of further.toml to displacements of all vertices."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from typing import Any

import numpy as np
from risorius.base import toml
from risorius.base.easing import smooth_step

from ..polygons import Floats
from ..source import TARGETS, Source
from .motions import MOTIONS
from .places import MM, Places, bell

_ROWS = toml.parse(files(__package__).joinpath("further.toml").read_text(encoding="utf-8"))
_SIDE = "{s}"
_OF_DATA = {"data", "units", "size", "with"}


def names_of(row: str) -> list[str]:
    """The raw controls of a row: the row's name, or one name per side if the name contains {s}."""
    return [row.replace(_SIDE, side) for side in "LR"] if _SIDE in row else [row]


CONTROLS_OF_CODE = [
    name for row, keys in _ROWS.items() if not _OF_DATA.issuperset(keys) for name in names_of(row)
]


def unit_shape(source: Source, origin: Mapping[str, float], name: str, count: int) -> Floats:
    """float64[V, 3]: displacement of a FACS-like unit in decimetres, mixed from the shapes of the
    origins.

    Args:
        source: the data with the unit.
        origin: one of ORIGINS (parts of the world) -> its share in the person; the sum is 1.
        name: name of the unit.
        count: number of vertices V.
    """
    folder = f"{TARGETS}expression/units"
    parts = (
        share * source.target(f"{folder}/{of}/{name}.target.gz", count)
        for of, share in origin.items()
    )
    return np.asarray(sum(parts))


def further_units(
    source: Source,
    origin: Mapping[str, float],
    places: Places,
    units: Mapping[str, Floats],
    sides: Mapping[str, Floats],
) -> tuple[dict[str, Floats], dict[tuple[str, str], Floats]]:
    """The displacements of further.toml in decimetres.

    Returns raw control -> float64[V, 3], and for correctives two raw controls -> float64[V, 3]. The
    displacement of a row with the key `with` is a corrective, and its control alone moves nothing.

    Args:
        source: the data with the shapes.
        origin: one of ORIGINS (parts of the world) -> its share in the person; the sum is 1.
        places: regions of the face.
        units: raw control -> float64[V, 3], of the controls that exist already.
        sides: "L" or "R" -> float64[V], weight of the side; the sum is 1.
    """
    out, correctives = {}, {}
    for row, keys in _ROWS.items():
        whole = _ways(source, origin, places, units, keys) * _weight(places, keys)[:, None]
        if keys.get("flat"):
            whole -= places.normals * np.einsum("ij,ij->i", whole, places.normals)[:, None]
        if "size" in keys:
            whole = whole * (keys["size"] * MM / np.linalg.norm(whole, axis=1).max())
        for name in names_of(row):
            half = whole * (sides[_side(row, name)][:, None] if _SIDE in row else 1.0)
            out[name] = half
            if "with" in keys:
                correctives[(keys["with"], name)] = half
                out[name] = np.zeros_like(half)
    return out, correctives


def _side(row: str, name: str) -> str:
    """ "L" or "R": the side of a raw control that the row makes."""
    return name[row.index(_SIDE)]


def _ways(
    source: Source,
    origin: Mapping[str, float],
    places: Places,
    units: Mapping[str, Floats],
    keys: Mapping[str, Any],
) -> Floats:
    """float64[V, 3]: displacement of a row before it is multiplied by its weights.

    Args:
        source: the data with the shapes.
        origin: one of ORIGINS (parts of the world) -> its share in the person.
        places: regions of the face.
        units: raw control -> float64[V, 3], of the controls that exist already.
        keys: keys of the row in further.toml.
    """
    count = len(places.positions)
    out = np.zeros((count, 3))
    for name, weight in keys.get("data", {}).items():
        folder, _, last = name.partition("/")
        unit = folder == "unit"
        shape = unit_shape(source, origin, last, count) if unit else source.feature(name, count)
        out += weight * shape
    for name, weight in keys.get("units", {}).items():
        for of in (name, name + "L", name + "R"):
            out += weight * units[of] if of in units else 0.0
    skin = places.skin[:, None]
    if "shift" in keys:
        side = np.sign(places.positions[:, :1]) * [1, 0, 0] + [0, 1, 1]
        out += skin * side * np.asarray(keys["shift"], float)
    if "slide" in keys:
        out += skin * np.asarray(keys["slide"], float)
    if "swell" in keys:
        out += skin * places.normals * keys["swell"]
    if "code" in keys:
        out += MOTIONS[keys["code"]](places, keys.get("by", 1))
    return out


def _weight(places: Places, keys: Mapping[str, Any]) -> Floats:
    """float64[V]: weights of a row's displacement: the product of the areas that its keys name.

    Args:
        places: regions of the face.
        keys: keys of the row in further.toml.
    """
    out = np.ones(len(places.positions))
    if "lip" in keys:
        out *= places.lips[keys["lip"]]
    if "window" in keys:
        middle, half = keys["window"]
        along = np.abs(places.along)
        out *= 1 - smooth_step(np.abs(along - middle) / half)
    if "lip_mm" in keys:
        out *= bell(places.lip_distance / (keys["lip_mm"] * MM))
    if "at" in keys:
        away = places.positions.copy()
        away[:, 0] = np.abs(away[:, 0])
        distance = np.linalg.norm(away - keys["at"], axis=1)
        out *= bell(distance / (keys["mm"] * MM))
    if "on" in keys:
        on = keys["on"]
        out *= places.brows if on == "brows" else places.lids[on[-1]]
    return out
