# SPDX-License-Identifier: MIT
"""Differences of layer defn: names, the skeleton, the elements that each LOD lists."""

from __future__ import annotations

import numpy as np

from ...base.words import counted
from ..pairing.amounts import Floats
from ..pairing.common import Place, lod_mapping, only_in, order
from ..pairing.comparison import Comparison
from ..pairing.pairs import Ints, pair_rows
from ..pairing.spaces import Space


def compare(faces: Comparison) -> None:
    place = Place(faces, "definition")
    for field, space in (
        ("gui_control_names", faces.gui),
        ("raw_control_names", faces.raw),
        ("joint_names", faces.joints),
        ("blend_shape_channel_names", faces.channels),
        ("animated_map_names", faces.maps),
        ("mesh_names", faces.meshes),
    ):
        names(place.at(field), space)
    _joints(faces, place)
    for field, space in (
        ("lod_joint_mapping", faces.joints),
        ("lod_blend_shape_mapping", faces.channels),
        ("lod_animated_map_mapping", faces.maps),
        ("lod_mesh_mapping", faces.meshes),
    ):
        lod_mapping(place.at(field), space, getattr(faces.a, field), getattr(faces.b, field))
    _mesh_channels(faces, place.at("mesh_blend_shape_channel_mapping"))


def names(place: Place, space: Space) -> None:
    """Report elements that are added, removed, renamed or reordered.

    Args:
        place: where the difference is reported.
        space: the elements of both faces.
    """
    pairs = space.pairs
    only_in(place, space, pairs)
    for i, j in zip(pairs.a.tolist(), pairs.b.tolist(), strict=True):
        old, new = space.names[i], space.names[len(space.a) + j]
        if old != new:
            place.say(f"{space.noun} {old or i} renamed to {new or j}")
    order(place, pairs, space.plural)


def _joints(faces: Comparison, place: Place) -> None:
    pairs, labels = faces.joints.pairs, faces.joints.labels(faces.joints.pairs.a)
    _parents(faces, place.at("joint_parents"), labels)
    for field, verb, kind in (
        ("neutral_joint_translations", "moved", "length"),
        ("neutral_joint_rotations", "turned", "angle"),
    ):
        a, b = getattr(faces.a, field), getattr(faces.b, field)
        inside = (pairs.a < len(a)) & (pairs.b < len(b))
        x, y = a[pairs.a[inside]], b[pairs.b[inside]]
        changed = np.flatnonzero(faces.changed(x, y).any(axis=1))
        _moved(place.at(field), verb, kind, [labels[i] for i in changed], x[changed], y[changed])


def _moved(place: Place, verb: str, kind: str, labels: list[str], a: Floats, b: Floats) -> None:
    """Report a line per joint whose neutral pose changed, the largest change first.

    Args:
        place: where the differences are reported.
        verb: word for the change, such as "moved".
        kind: "length" or "angle", for the unit.
        labels: names of the changed joints.
        a, b: float32[n, 3], neutral translation or rotation of these joints in each face.
    """
    with np.errstate(invalid="ignore", over="ignore"):
        apart = np.linalg.norm(a.astype(np.float64) - b, axis=1)
    for i in np.argsort(-np.nan_to_num(apart, nan=np.inf), kind="stable").tolist():
        x, y = a[i : i + 1], b[i : i + 1]
        amount = place.faces.distance(x, y) if kind == "length" else place.faces.by(x, y, kind)
        place.say(f"joint {labels[i]} {verb} {amount}")


def _parents(faces: Comparison, place: Place, labels: list[str]) -> None:
    pairs = faces.joints.pairs
    a, b = faces.joints.in_a(faces.a.joint_parents), faces.joints.in_b(faces.b.joint_parents)
    for label, i, j in zip(labels, pairs.a.tolist(), pairs.b.tolist(), strict=True):
        if i < len(a) and j < len(b) and a[i] != b[j]:
            old, new = (
                "none" if parent == faces.joints.a[i] else faces.joints.label(int(parent))
                for parent in (a[i], b[j])
            )
            place.say(f"joint {label} has another parent: {new} instead of {old}")


def _mesh_channels(faces: Comparison, place: Place) -> None:
    a, b = faces.a.mesh_blend_shape_channel_mapping, faces.b.mesh_blend_shape_channel_mapping
    rows_a = (faces.meshes.in_a(a[:, 0]), faces.channels.in_a(a[:, 1]))
    rows_b = (faces.meshes.in_b(b[:, 0]), faces.channels.in_b(b[:, 1]))
    pairs = pair_rows(rows_a, rows_b)

    def label(meshes: Ints, channels: Ints) -> list[str]:
        both = zip(faces.meshes.labels(meshes), faces.channels.labels(channels), strict=True)
        return [f"{mesh} has {channel}" for mesh, channel in both]

    for side, left, rows in (("A", pairs.only_a, rows_a), ("B", pairs.only_b, rows_b)):
        if len(left):
            listed = faces.report.listed(label(rows[0][left], rows[1][left]))
            pairs_of = counted(len(left), "pair of mesh and channel", "pairs of mesh and channel")
            place.say(f"{pairs_of} only in {side}: {listed}")
    order(place, pairs, "pairs of mesh and channel")
