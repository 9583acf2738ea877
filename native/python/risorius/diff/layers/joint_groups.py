# SPDX-License-Identifier: MIT
"""Differences of layer bhvr: the joint matrix, group by group."""

from __future__ import annotations

import numpy as np

import risorius

from ...base.words import counted, joined
from ..pairing.amounts import Floats
from ..pairing.common import Place, cut, members, order, rows_per_lod, value
from ..pairing.comparison import Comparison
from ..pairing.pairs import Bools, Ints, Pairs, pair, pair_sets


def compare(faces: Comparison) -> None:
    place = Place(faces, "behavior")
    for field in ("joint_row_count", "joint_column_count"):
        value(
            place.at(field, field.replace("_", " ")),
            getattr(faces.a, field),
            getattr(faces.b, field),
        )
    groups = place.at("joint_groups")
    a, b = faces.a.joint_groups, faces.b.joint_groups
    pairs = pair_sets(
        [faces.rows_in_a(group.output_indices) for group in a],
        [faces.rows_in_b(group.output_indices) for group in b],
    )
    for side, left, side_groups in (("A", pairs.only_a, a), ("B", pairs.only_b, b)):
        for i in left.tolist():
            rows = counted(len(side_groups[i].output_indices), "row")
            groups.say(f"joint group {i} only in {side} ({rows})")
    order(groups, pairs, "joint groups")
    for i, j in zip(pairs.a.tolist(), pairs.b.tolist(), strict=True):
        name = f"joint group {i}" if i == j else f"joint group {i} ({j} in B)"
        _group(groups.at("", name), a[i], b[j])


def _group(place: Place, a: risorius.JointGroup, b: risorius.JointGroup) -> None:
    faces = place.faces
    rows_a, rows_b = faces.rows_in_a(a.output_indices), faces.rows_in_b(b.output_indices)
    columns_a, columns_b = (
        faces.controls.in_a(a.input_indices),
        faces.controls.in_b(b.input_indices),
    )
    rows, columns = pair(rows_a, rows_b), pair(columns_a, columns_b)
    rows_per_lod(place.at("lods"), a.lods, b.lods)
    members(place.at("input_indices", "inputs"), faces.controls, a.input_indices, b.input_indices)
    outputs = place.at("output_indices")
    for side, left, numbers in (("A", rows.only_a, rows_a), ("B", rows.only_b, rows_b)):
        if len(left):
            listed = faces.report.listed(faces.row_labels(numbers[left]))
            outputs.say(f"{counted(len(left), 'row')} only in {side}: {listed}")
    order(outputs, rows, "rows")
    members(place.at("joint_indices", "joints"), faces.joints, a.joint_indices, b.joint_indices)
    if a.values.ndim == b.values.ndim == 2:
        _values(place.at("values"), a.values, b.values, rows, columns, rows_a)


def _values(place: Place, a: Floats, b: Floats, rows: Pairs, columns: Pairs, numbers: Ints) -> None:
    """Report changed values, matched by joint attribute and control.

    Args:
        place: where the difference is reported.
        a, b: float32[rows, columns], the values of the group in each face.
        rows: matched rows of both groups.
        columns: matched columns of both groups.
        numbers: int64[rows of A], common numbers of the joint attributes of the rows.
    """
    x, y = cut(a, rows.a, columns.a), cut(b, rows.b, columns.b)
    changed = place.faces.changed(x, y)
    if not changed.any():
        return
    numbers = numbers[rows.a]
    touched = np.unique(numbers[changed.any(axis=1)] // 9)
    joints = place.faces.report.listed(place.faces.joints.labels(touched))
    place.say(
        f"{np.count_nonzero(changed):,} of {counted(x.size, 'value')} changed "
        f"{_amounts(place.faces, x, y, changed, numbers % 9 // 3)} (of {joints})"
    )


def _amounts(faces: Comparison, a: Floats, b: Floats, changed: Bools, kinds: Ints) -> str:
    """The largest changes as text, e.g. "by up to 0.3 mm and by up to 2 degrees".

    Args:
        faces: both rigs.
        a, b: float32[n, m], matched values of each face.
        changed: bool[n, m], the values that differ.
        kinds: int64[n], 0 for rows of translation, 1 for rotation, 2 for scale.
    """
    parts = []
    for kind, measure in enumerate(("length", "angle", "number")):
        mask = changed & (kinds == kind)[:, None]
        if mask.any():
            parts.append(faces.by(a[mask], b[mask], measure) + (" of scale" if kind == 2 else ""))
    return joined(parts)
