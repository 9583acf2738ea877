# SPDX-License-Identifier: MIT
"""Guesses the part of a surface that contains the head from names of vertex groups and joints."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from ...author.geometry.skeleton import Doubles
from ...base import toml
from ..surface import Surface

Box = tuple[Doubles, Doubles]  # the lowest and the highest corner, float64[3] each
_OUTLIERS = 0.02  # share of a group's vertices at each end that do not count
_SMALLER = 0.9  # of the longest side of the surface: a larger part tells nothing
_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")


def place_of(name: str) -> str:
    """The place of a head that a name means, such as "head", "lip" or "eye_L"; "" if unknown.

    Args:
        name: name of a vertex group, a joint or a mesh, such as DEF-eye.L or mixamorig:Head.
    """
    table = _table()
    own = re.sub(r"^(DEF|ORG|MCH)-", "", name.strip())
    if own in table["whole"]:
        return str(table["whole"][own])
    words = [_singular(word.lower()) for word in _WORD.findall(name)]
    places = [word for word in words if word in table["places"]]
    sides = [table["sides"][word] for word in words if word in table["sides"]]
    known = {*table["places"], *table["sides"], *table["others"]["words"]}
    if "face" in places and len(places) > 1:  # as in the joint FaceEye of VRM
        places.remove("face")
    if len(places) != 1 or len(sides) > 1 or not known.issuperset(words):
        return ""
    return places[0] + "".join(sides)


def _singular(word: str) -> str:
    return word[:-1] if word.endswith("s") and word[:-1] in _table()["places"] else word


@cache
def _table() -> dict[str, Any]:
    return toml.parse(files(__package__).joinpath("groups.toml").read_text(encoding="utf-8"))


def head_box(groups: Iterable[tuple[str, Doubles]]) -> Box | None:
    """A box around the head by the names of groups; None if no name means a place of a head.

    Args:
        groups: name, and float64[n, 3], positions of the vertices of the group.
    """
    rows: dict[str, list[Doubles]] = {}
    for name, points in groups:
        place = place_of(name)
        if place and len(points) and np.isfinite(points).all():
            rows.setdefault(place, []).append(points)
    lows, highs = [], []
    for place, own in rows.items():
        low, high = np.quantile(np.concatenate(own), [_OUTLIERS, 1 - _OUTLIERS], axis=0)
        reach = float(_table()["places"][place.partition("_")[0]]) * float((high - low).max())
        lows.append(low - reach)
        highs.append(high + reach)
    return (np.min(lows, axis=0), np.max(highs, axis=0)) if rows else None


def part_in(surface: Surface, box: Box | None) -> Surface | None:
    """The part of a surface in a box, without its other vertices; None if the part is nearly as
    large as the surface, if no triangle is in the box, or if `box` is None.

    Args:
        surface: the surface; it is not changed.
        box: the result of head_box.
    """
    if box is None:
        return None
    inside = ((surface.points >= box[0]) & (surface.points <= box[1])).all(axis=1)
    kept = surface.triangles[inside[surface.triangles].all(axis=1)]
    own, every = np.unique(kept), np.unique(surface.triangles)
    if not len(own):
        return None
    large, whole = (float(np.ptp(surface.points[used], axis=0).max()) for used in (own, every))
    if large > _SMALLER * whole:
        return None
    return Surface(surface.points[own], np.searchsorted(own, kept))
