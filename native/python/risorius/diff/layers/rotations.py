# SPDX-License-Identifier: MIT
"""Differences of layers jbmd and twsw: the rotation of joints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import risorius

from ...base.words import counted
from ..pairing.common import Place, choice, members, only_in, order, real
from ..pairing.comparison import Comparison
from ..pairing.pairs import pair, pair_sets
from ..pairing.spaces import Space

_REPRESENTATIONS = (
    ("translation", ("vector",)),
    ("rotation", ("Euler angles", "quaternion")),
    ("scale", ("vector",)),
)


def compare(faces: Comparison) -> None:
    _representations(faces)
    a, b = faces.a.twist_swing_behavior, faces.b.twist_swing_behavior
    for name, noun in (("twists", "twist"), ("swings", "swing")):
        place = Place(faces, "twist and swing", f"twist_swing_behavior.{name}")
        _setups(place, noun, getattr(a, name), getattr(b, name))


def _representations(faces: Comparison) -> None:
    place = Place(faces, "joint behavior metadata", "joint_behavior_metadata.joint_representations")
    a = faces.a.joint_behavior_metadata.joint_representations
    b = faces.b.joint_behavior_metadata.joint_representations
    if len(a) != len(b):
        place.say(f"representations of {counted(len(a), 'joint')} -> {len(b):,}")
    pairs = faces.joints.pairs
    inside = (pairs.a < len(a)) & (pairs.b < len(b))
    at_a, at_b = pairs.a[inside], pairs.b[inside]
    for i in np.flatnonzero((a[at_a] != b[at_b]).any(axis=1)).tolist():
        of = f"joint {faces.joints.label(int(at_a[i]))}"
        for column, (what, words) in enumerate(_REPRESENTATIONS):
            old, new = int(a[at_a[i], column]), int(b[at_b[i], column])
            choice(place.at("", f"{of}, {what}"), words, old, new)
    if not np.array_equal(a[len(faces.joints.a) :], b[len(faces.joints.b) :]):
        place.say("representations of joints without a name differ")


def _setups(
    place: Place,
    noun: str,
    a: Sequence[risorius.TwistSwingSetup],
    b: Sequence[risorius.TwistSwingSetup],
) -> None:
    """Report differences of setups, which are matched by the joints that they rotate."""
    faces = place.faces
    pairs = pair_sets(
        [faces.joints.in_a(setup.output_joint_indices) for setup in a],
        [faces.joints.in_b(setup.output_joint_indices) for setup in b],
    )
    space = Space(noun, [""] * len(a), [""] * len(b), pairs)
    only_in(place, space, pairs)
    order(place, pairs, space.plural)
    for i, j in zip(pairs.a.tolist(), pairs.b.tolist(), strict=True):
        _setup(place.at("", f"{noun} {i}" if i == j else f"{noun} {i} ({j} in B)"), a[i], b[j])


def _setup(place: Place, a: risorius.TwistSwingSetup, b: risorius.TwistSwingSetup) -> None:
    faces = place.faces
    choice(place.at("twist_axis", "twist axis"), ("x", "y", "z"), a.twist_axis, b.twist_axis)
    inputs = a.input_control_indices, b.input_control_indices
    members(place.at("input_control_indices", "inputs"), faces.controls, *inputs)
    outputs = a.output_joint_indices, b.output_joint_indices
    members(place.at("output_joint_indices", "joints"), faces.joints, *outputs)
    joints = faces.joints.in_a(outputs[0])
    pairs = pair(joints, faces.joints.in_b(outputs[1]))
    inside = (pairs.a < len(a.blend_weights)) & (pairs.b < len(b.blend_weights))
    at_a, at_b = pairs.a[inside], pairs.b[inside]
    x, y = a.blend_weights[at_a], b.blend_weights[at_b]
    for i in np.flatnonzero(faces.changed(x, y)).tolist():
        joint = faces.joints.label(int(joints[at_a[i]]))
        real(place.at("blend_weights", f"blend weight of {joint}"), x[i], y[i])
    if len(a.blend_weights) != len(b.blend_weights):
        number = counted(len(a.blend_weights), "blend weight")
        place.at("blend_weights").say(f"{number} -> {len(b.blend_weights)}")
