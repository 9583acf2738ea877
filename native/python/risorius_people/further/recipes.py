# SPDX-License-Identifier: MIT
"""The rows of further.toml as displacements of all vertices."""

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
    """The raw controls of a row: its name, or one name per side."""
    return [row.replace(_SIDE, side) for side in "LR"] if _SIDE in row else [row]


CONTROLS_OF_CODE = [
    name for row, keys in _ROWS.items() if not _OF_DATA.issuperset(keys) for name in names_of(row)
]


def unit_shape(source: Source, origin: Mapping[str, float], name: str, count: int) -> Floats:
    """Displacement [V, 3] of a FACS-like unit, mixed from the data's origins, decimetres.

    Args:
        source: the data with the unit.
        origin: share of each origin of the data, with sum 1.
        name: name of the unit.
        count: V.
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
    """Displacements float64[V, 3] by raw control, and correctives by two raw controls, decimetres.

    Args:
        source: the data with the shapes.
        origin: share of each origin of the data, with sum 1.
        places: the places of the face.
        units: float64[V, 3] of the existing raw controls.
        sides: float64[V] by "L" and "R", with sum 1.
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
    """ "L" or "R": which of the row's two raw controls a name is."""
    return name[row.index(_SIDE)]


def _ways(
    source: Source,
    origin: Mapping[str, float],
    places: Places,
    units: Mapping[str, Floats],
    keys: Mapping[str, Any],
) -> Floats:
    """Displacement of a row before its weights, float64[V, 3]."""
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
    """Weights of a row's motion, float64[V]."""
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
