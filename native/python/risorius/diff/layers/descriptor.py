# SPDX-License-Identifier: MIT
"""Differences of layers desc and dsce: the character, and the conventions of axes and units."""

from __future__ import annotations

from ..pairing.common import Place, value
from ..pairing.comparison import Comparison

_VALUES = (
    "name",
    "archetype",
    "gender",
    "age",
    "translation_unit",
    "rotation_unit",
    "coordinate_system",
    "rotation_sequence",
    "rotation_signs",
    "face_winding_order",
    "lod_count",
    "max_lod",
    "complexity",
    "db_name",
)


def compare(faces: Comparison) -> None:
    place = Place(faces, "descriptor")
    for name in _VALUES:
        value(
            place.at(name, name.replace("_", " ")), getattr(faces.a, name), getattr(faces.b, name)
        )
    _metadata(faces, place.at("metadata"))


def _metadata(faces: Comparison, place: Place) -> None:
    a, b = faces.a.metadata, faces.b.metadata
    for key, old in a.items():
        if key not in b:
            place.say(f"metadata key {key} only in A: {old!r}")
        elif b[key] != old:
            place.say(f"metadata key {key}: {old!r} -> {b[key]!r}")
    for key, new in b.items():
        if key not in a:
            place.say(f"metadata key {key} only in B: {new!r}")
    if [key for key in a if key in b] != [key for key in b if key in a]:
        place.say("the metadata keys stand in another order")
