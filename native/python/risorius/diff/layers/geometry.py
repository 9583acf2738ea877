# SPDX-License-Identifier: MIT
"""Differences of layer geom: vertices, faces, skin weights and blend shape targets of each mesh."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import risorius

from ...base.words import counted
from ..pairing.amounts import Floats
from ..pairing.common import Place, value
from ..pairing.comparison import Comparison
from ..pairing.pairs import Bools, Ints, integers
from .skin import compare_skin
from .targets import compare_targets

Numbers = npt.NDArray[np.uint32]

# Arrays of a mesh that are compared: the name of the array, the noun for one of its elements, the
# verb for a changed element, and "length" or "number", which decides the unit of a change.
_POINTS = (
    ("positions", "vertex", "moved", "length"),
    ("texture_coordinates", "UV", "changed", "number"),
    ("normals", "normal", "changed", "number"),
)
_LAYOUTS = (
    ("layout_positions", "position"),
    ("layout_texture_coordinates", "UV"),
    ("layout_normals", "normal"),
)


def compare(faces: Comparison) -> None:
    place = Place(faces, "geometry")
    pairs = faces.meshes.pairs
    for i, j in zip(pairs.a.tolist(), pairs.b.tolist(), strict=True):
        mesh = place.at("meshes", f"mesh {faces.meshes.label(i)}")
        if i < len(faces.meshes_a) and j < len(faces.meshes_b):
            _mesh(mesh, faces.meshes_a[i], faces.meshes_b[j])
        elif i < len(faces.meshes_a) or j < len(faces.meshes_b):
            mesh.say(f"geometry only in {'A' if i < len(faces.meshes_a) else 'B'}")


def _mesh(place: Place, a: risorius.Mesh, b: risorius.Mesh) -> None:
    for name, noun, verb, kind in _POINTS:
        _points(place.at(name), getattr(a, name), getattr(b, name), noun, verb, kind)
    for name, noun in _LAYOUTS:
        _layout(place.at(name), noun, getattr(a, name), getattr(b, name))
    _faces(place, a, b)
    name = "maximum_influence_per_vertex"
    value(place.at(name, "most influences per vertex"), getattr(a, name), getattr(b, name))
    compare_skin(place, a, b)
    compare_targets(place.at("blend_shape_targets"), a, b)


def _points(place: Place, a: Floats, b: Floats, noun: str, verb: str, kind: str) -> None:
    if len(a) != len(b):
        place.say(f"{counted(len(a), noun)} -> {len(b):,}")
        return
    changed = place.faces.changed(a, b).any(axis=1)
    if not changed.any():
        return
    x, y = a[changed], b[changed]
    amount = place.faces.distance(x, y) if kind == "length" else place.faces.by(x, y, kind)
    place.say(f"{counted(len(x), noun)} of {len(a):,} {verb} {amount}")


def _layout(place: Place, noun: str, a: Numbers, b: Numbers) -> None:
    """Report changed vertex layouts; a layout refers to a position, a UV and a normal."""
    if len(a) != len(b):
        place.say(f"{counted(len(a), 'layout')} -> {len(b):,}")
        return
    changed = int(np.count_nonzero(a != b))
    if changed:
        place.say(f"{counted(changed, 'layout')} of {len(a):,} with another {noun}")


def _faces(place: Place, a: risorius.Mesh, b: risorius.Mesh) -> None:
    count_a, count_b = (max(0, len(mesh.face_offsets) - 1) for mesh in (a, b))
    if count_a != count_b:
        place.at("face_offsets").say(f"{counted(count_a, 'face')} -> {count_b:,}")
        return
    offsets_a, offsets_b = integers(a.face_offsets), integers(b.face_offsets)
    resized = np.diff(offsets_a) != np.diff(offsets_b)
    if resized.any():
        number = int(np.count_nonzero(resized))
        place.at("face_offsets").say(f"{counted(number, 'face')} with another number of corners")
    changed = rows_changed(offsets_a, a.face_layouts, offsets_b, b.face_layouts) & ~resized
    if changed.any():
        number = int(np.count_nonzero(changed))
        place.at("face_layouts").say(f"{counted(number, 'face')} of {count_a:,} with other corners")


def rows_changed(offsets_a: Ints, a: Numbers, offsets_b: Ints, b: Numbers) -> Bools:
    """bool[rows]: which rows differ between two lists with the same number of rows.

    Args:
        offsets_a, offsets_b: int64[rows + 1], start of each row in `a` and `b`; empty for no rows.
        a, b: the elements of all rows.
    """
    sizes = np.diff(offsets_a)
    changed = sizes != np.diff(offsets_b)
    kept = np.repeat(~changed, sizes)
    left = np.asarray(a)[: len(kept)][kept]
    right = np.asarray(b)[: int(np.sum(np.diff(offsets_b)))]
    right = right[np.repeat(~changed, np.diff(offsets_b))]
    row = np.repeat(np.arange(len(sizes)), sizes)[kept]
    changed[row[left != right]] = True
    return changed
