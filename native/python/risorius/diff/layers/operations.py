# SPDX-License-Identifier: MIT
"""Differences of layer mlbe: graphs of operations, and the joints that networks move."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import risorius

from ...base.words import counted
from ..pairing.common import Place, choice, lod_mapping, order
from ..pairing.comparison import Comparison
from ..pairing.pairs import Ints, integers, pair, pair_in_place
from ..pairing.spaces import Space

_TYPES = ("unspecified", "gather", "scatter", "MLP", "weighted sum")
_GATHER, _SCATTER, _MLP = 1, 2, 3
_KEYS = (
    "translation type",
    "rotation type",
    "scale type",
    "x axis",
    "y axis",
    "z axis",
    "rotation sign x",
    "rotation sign y",
    "rotation sign z",
    "rotation sequence",
)


def compare(faces: Comparison) -> None:
    place = Place(faces, "machine learned behavior", "machine_learned_behavior_ext")
    a, b = faces.a.machine_learned_behavior_ext, faces.b.machine_learned_behavior_ext
    types_a, types_b = a.types, b.types
    if len(types_a) != len(types_b):
        place.at("types").say(f"{counted(len(types_a), 'graph')} -> {len(types_b)}")
    for i, (x, y) in enumerate(zip(types_a, types_b, strict=False)):
        _graph(place.at("types", f"graph {i}"), x, y)
    _joints(place.at("joints", "joints of networks"), a.joints, b.joints)


def _graph(place: Place, a: risorius.MlType, b: risorius.MlType) -> None:
    sets_a, sets_b = a.operations, b.operations
    if len(sets_a) != len(sets_b):
        place.at("operations").say(f"{counted(len(sets_a), 'set')} -> {len(sets_b)}")
    for i, (x, y) in enumerate(zip(sets_a, sets_b, strict=False)):
        one = place.at("operations", f"set {i}")
        if len(x) != len(y):
            one.say(f"{counted(len(x), 'operation')} -> {len(y)}")
        for j, (old, new) in enumerate(zip(x, y, strict=False)):
            _operation(one.at("", f"operation {j}"), old, new)
    maps_a, maps_b = a.lod_operation_mappings, b.lod_operation_mappings
    if len(maps_a) != len(maps_b):
        text = f"LOD lists of {counted(len(maps_a), 'set')} -> {len(maps_b)}"
        place.at("lod_operation_mappings").say(text)
    for i, (mapping_a, mapping_b) in enumerate(zip(maps_a, maps_b, strict=False)):
        space = _numbered("operation", _size(sets_a, i), _size(sets_b, i))
        lod_mapping(place.at("lod_operation_mappings", f"set {i}"), space, mapping_a, mapping_b)


def _size(sets: list[tuple[risorius.MlOperation, ...]], i: int) -> int:
    return len(sets[i]) if i < len(sets) else 0


def _numbered(noun: str, count_a: int, count_b: int) -> Space:
    """The elements of A and B of a kind without names; elements with the same index match."""
    pairs = pair(np.arange(count_a), np.arange(count_b))
    return Space(noun, [""] * count_a, [""] * count_b, pair_in_place(pairs, count_a, count_b))


def _operation(place: Place, a: risorius.MlOperation, b: risorius.MlOperation) -> None:
    types = a.operation_type, b.operation_type
    choice(place.at("operation_type", "type"), _TYPES, *types)
    x, y = _parameters(place.faces, a, "a"), _parameters(place.faces, b, "b")
    _list(place.at("parameters"), "parameter", x, y)
    for name in ("operation_set_dependency_indices", "operation_dependency_indices"):
        words = name.replace("operation_", "").replace("_", " ")
        _list(place.at(name, words), "index", getattr(a, name), getattr(b, name))


def _parameters(faces: Comparison, operation: risorius.MlOperation, side: str) -> Ints:
    """Parameters of an operation, with controls and networks as numbers common to both rigs."""
    numbers = integers(operation.parameters)
    if operation.operation_type in (_GATHER, _SCATTER):
        return faces.controls.in_a(numbers) if side == "a" else faces.controls.in_b(numbers)
    if operation.operation_type == _MLP and len(numbers):
        first = (
            faces.networks.in_a(numbers[:1]) if side == "a" else faces.networks.in_b(numbers[:1])
        )
        return np.concatenate([first, numbers[1:]])
    return numbers


def _list(place: Place, noun: str, a: npt.ArrayLike, b: npt.ArrayLike) -> None:
    """Report the difference of two integer lists, compared by index."""
    x, y = integers(a), integers(b)
    if len(x) != len(y):
        place.say(f"{counted(len(x), noun)} -> {len(y):,}")
    elif (x != y).any():
        place.say(f"{np.count_nonzero(x != y):,} of {counted(len(x), noun)} changed")


def _stride(joints: risorius.MlJoints) -> int:
    """The number of attributes of each joint: 10 if rotations are quaternions, otherwise 9."""
    keys, values = joints.parameter_keys.tolist(), joints.parameter_values.tolist()
    return 10 if (1, 1) in zip(keys, values, strict=False) else 9


def _joints(place: Place, a: risorius.MlJoints, b: risorius.MlJoints) -> None:
    faces = place.faces
    keys = pair(integers(a.parameter_keys), integers(b.parameter_keys))
    for side, left, joints in (("A", keys.only_a, a), ("B", keys.only_b, b)):
        for key in joints.parameter_keys[left].tolist():
            place.at("parameter_keys").say(f"{_key(key)} only in {side}")
    order(place.at("parameter_keys"), keys, "parameters")
    old, new = a.parameter_values[keys.a].tolist(), b.parameter_values[keys.b].tolist()
    for key, x, y in zip(a.parameter_keys[keys.a].tolist(), old, new, strict=True):
        if x != y:
            place.at("parameter_values").say(f"{_key(key)} {x} -> {y}")
    strides = _stride(a), _stride(b)
    rows_a = faces.rows_in_a(a.output_indices, strides[0])
    rows_b = faces.rows_in_b(b.output_indices, strides[1])
    pairs = pair(rows_a, rows_b)
    sides = (("A", pairs.only_a, rows_a, strides[0]), ("B", pairs.only_b, rows_b, strides[1]))
    for side, left, rows, stride in sides:
        if len(left):
            listed = faces.report.listed(faces.row_labels(rows[left], stride))
            text = f"{counted(len(left), 'attribute')} only in {side}: {listed}"
            place.at("output_indices").say(text)
    order(place.at("output_indices"), pairs, "attributes")
    x, y = (
        faces.controls.in_a(a.input_indices)[pairs.a],
        faces.controls.in_b(b.input_indices)[pairs.b],
    )
    labels = faces.row_labels(rows_a[pairs.a], strides[0])
    for i in np.flatnonzero(x != y).tolist():
        words = f"{faces.controls.label(int(y[i]))} instead of {faces.controls.label(int(x[i]))}"
        place.at("input_indices").say(f"{labels[i]} is moved by {words}")


def _key(key: int) -> str:
    return _KEYS[key] if key < len(_KEYS) else f"parameter {key}"
