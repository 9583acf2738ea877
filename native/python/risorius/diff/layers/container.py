# SPDX-License-Identifier: MIT
"""Differences of the file's version, its index of layers, and the bytes of unknown layers."""

from __future__ import annotations

from ...base.words import counted
from ..pairing.common import Place
from ..pairing.comparison import Comparison
from ..pairing.pairs import pair_names


def compare(faces: Comparison) -> None:
    file = Place(faces, "file")
    versions = [f"{dna.generation}.{dna.version}" for dna in (faces.a, faces.b)]
    if versions[0] != versions[1]:
        file.at("version", "version").say(" -> ".join(versions))
    names_a, names_b = faces.a.layers, faces.b.layers
    pairs = pair_names(names_a, names_b)
    layers = file.at("layers")
    for side, left, names in (("A", pairs.only_a, names_a), ("B", pairs.only_b, names_b)):
        for i in left.tolist():
            layers.say(f"layer {names[i]} only in {side}")
    if pairs.reordered:
        layers.say("the layers stand in another order in the file")
    _unknown_layers(faces, file.at("unknown_layers"))


def _unknown_layers(faces: Comparison, place: Place) -> None:
    a, b = faces.a.unknown_layers, faces.b.unknown_layers
    names_a, names_b = ([f"{id_} {version}" for id_, version, _ in side] for side in (a, b))
    pairs = pair_names(names_a, names_b)
    for side, left, names in (("A", pairs.only_a, names_a), ("B", pairs.only_b, names_b)):
        for i in left.tolist():
            place.say(f"unknown layer {names[i]} only in {side}")
    for i, j in zip(pairs.a.tolist(), pairs.b.tolist(), strict=True):
        old, new = a[i][2], b[j][2]
        if old != new:
            sizes = f"{counted(len(old), 'byte')} -> {len(new):,}"
            place.say(f"unknown layer {names_a[i]}: other bytes ({sizes})")
    if pairs.reordered:
        place.say("the unknown layers stand in another order")
