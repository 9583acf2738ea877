# SPDX-License-Identifier: MIT
"""Differences of layer mlbh: neural networks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

import risorius

from ...base.words import counted
from ..pairing.common import Place, choice, lod_mapping, members, only_in, order, reals
from ..pairing.comparison import Comparison
from ..pairing.pairs import pair_names
from .definition import names

_ACTIVATIONS = ("linear", "relu", "leaky relu", "tanh", "sigmoid")


def compare(faces: Comparison) -> None:
    place = Place(faces, "machine learned behavior", "machine_learned_behavior")
    a, b = faces.a.machine_learned_behavior, faces.b.machine_learned_behavior
    names(place.at("ml_control_names"), faces.ml)
    mappings = a.lod_neural_network_mapping, b.lod_neural_network_mapping
    lod_mapping(place.at("lod_neural_network_mapping"), faces.networks, *mappings)
    _regions(place, a, b)
    networks, pairs = place.at("neural_networks"), faces.networks.pairs
    only_in(networks, faces.networks, pairs)
    order(networks, pairs, "networks")
    for i, j in zip(pairs.a.tolist(), pairs.b.tolist(), strict=True):
        name = f"network {i}" if i == j else f"network {i} ({j} in B)"
        _network(networks.at("", name), a.neural_networks[i], b.neural_networks[j])


def _network(place: Place, a: risorius.NeuralNetwork, b: risorius.NeuralNetwork) -> None:
    controls = place.faces.controls
    members(place.at("input_indices", "inputs"), controls, a.input_indices, b.input_indices)
    members(place.at("output_indices", "outputs"), controls, a.output_indices, b.output_indices)
    layers_a, layers_b = a.layers, b.layers
    if len(layers_a) != len(layers_b):
        place.at("layers").say(f"{counted(len(layers_a), 'layer')} -> {len(layers_b)}")
    for i, (x, y) in enumerate(zip(layers_a, layers_b, strict=False)):
        layer = place.at("layers", f"layer {i}")
        reals(layer.at("biases"), "bias", x.biases, y.biases)
        reals(layer.at("weights"), "weight", x.weights, y.weights)
        reals(
            layer.at("activation_parameters"),
            "activation parameter",
            x.activation_parameters,
            y.activation_parameters,
        )
        functions = x.activation_function, y.activation_function
        choice(layer.at("activation_function", "activation"), _ACTIVATIONS, *functions)


def _regions(
    place: Place, a: risorius.MachineLearnedBehavior, b: risorius.MachineLearnedBehavior
) -> None:
    """Report differences of each mesh's regions, matched by name, and of their networks."""
    faces = place.faces
    names_a, names_b = a.region_names, b.region_names
    if len(names_a) != len(names_b):
        sizes = f"{counted(len(names_a), 'mesh', 'meshes')} -> {len(names_b)}"
        place.at("region_names").say(f"regions of {sizes}")
    indices_a, indices_b = a.region_network_indices, b.region_network_indices
    for i, j in zip(faces.meshes.pairs.a.tolist(), faces.meshes.pairs.b.tolist(), strict=True):
        mesh = f"regions of mesh {faces.meshes.label(i)}"
        old, new = _at(names_a, i), _at(names_b, j)
        pairs = pair_names(old, new)
        for side, left, texts in (("A", pairs.only_a, old), ("B", pairs.only_b, new)):
            if len(left):
                listed = faces.report.listed([texts[k] for k in left.tolist()])
                place.at("region_names", mesh).say(f"only in {side}: {listed}")
        order(place.at("region_names", mesh), pairs, "regions")
        for k, m in zip(pairs.a.tolist(), pairs.b.tolist(), strict=True):
            of = place.at("region_network_indices", f"{mesh}, {old[k]}")
            members(of, faces.networks, _at(_at(indices_a, i), k), _at(_at(indices_b, j), m))
        _unnamed(place, mesh, _at(indices_a, i)[len(old) :], _at(indices_b, j)[len(new) :])


def _unnamed(place: Place, mesh: str, a: Sequence[Any], b: Sequence[Any]) -> None:
    if len(a) != len(b) or not all(map(np.array_equal, a, b)):
        place.at("region_network_indices", mesh).say("lists beyond the names differ")


def _at(lists: Sequence[Any], i: int) -> Any:
    return lists[i] if i < len(lists) else []
