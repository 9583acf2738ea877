# SPDX-License-Identifier: MIT
"""Differences of a mesh's skin weights, matched by joint within each vertex."""

from __future__ import annotations

import numpy as np

import risorius

from ...base.words import counted
from ..pairing.common import Place, order
from ..pairing.pairs import Ints, integers, pair_rows


def compare_skin(place: Place, a: risorius.Mesh, b: risorius.Mesh) -> None:
    """Report differences of skin weights, matched by joint within each vertex.

    Args:
        place: where the differences are reported.
        a, b: the same mesh of each face.
    """
    count_a, count_b = (max(0, len(mesh.skin_offsets) - 1) for mesh in (a, b))
    if count_a != count_b:
        text = f"skin weights of {counted(count_a, 'vertex', 'vertices')} -> {count_b:,}"
        place.at("skin_offsets").say(text)
        return
    faces = place.faces
    rows_a = (_vertices(a), faces.joints.in_a(a.skin_joint_indices))
    rows_b = (_vertices(b), faces.joints.in_b(b.skin_joint_indices))
    pairs = pair_rows(rows_a, rows_b)
    for side, left, rows in (("A", pairs.only_a, rows_a), ("B", pairs.only_b, rows_b)):
        if len(left):
            joints = faces.report.listed(faces.joints.labels(np.unique(rows[1][left])))
            number = counted(len(np.unique(rows[0][left])), "vertex")
            text = f"skin weights of {number} with joints that only {side} has there: {joints}"
            place.at("skin_joint_indices").say(text)
    x, y = a.skin_weights[pairs.a], b.skin_weights[pairs.b]
    changed = faces.changed(x, y)
    if changed.any():
        vertices = len(np.unique(rows_a[0][pairs.a[changed]]))
        place.at("skin_weights").say(
            f"skin weights of {counted(vertices, 'vertex', 'vertices')} changed "
            f"{faces.by(x[changed], y[changed])}"
        )
    order(place.at("skin_joint_indices"), pairs, "joints of some vertices")


def _vertices(mesh: risorius.Mesh) -> Ints:
    """int64[influences]: the vertex of each influence."""
    sizes = np.diff(integers(mesh.skin_offsets))
    return np.repeat(np.arange(len(sizes)), sizes)
