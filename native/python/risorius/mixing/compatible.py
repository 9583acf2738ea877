# SPDX-License-Identifier: MIT
"""Which faces may be mixed: those that differ in numbers alone."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from .. import Dna, Mesh
from ..base.errors import ArgumentError
from .hair import without_hair

_NAMES = {
    "raw_control_names": "raw control",
    "gui_control_names": "GUI control",
    "joint_names": "joint",
    "blend_shape_channel_names": "blend shape channel",
    "animated_map_names": "animated map",
    "mesh_names": "mesh",
}
_SYSTEM = (
    "translation_unit",
    "rotation_unit",
    "coordinate_system",
    "rotation_sequence",
    "rotation_signs",
    "face_winding_order",
    "lod_count",
)
_LISTS = {
    "lod_joint_mapping": "joints",
    "lod_mesh_mapping": "meshes",
    "lod_blend_shape_mapping": "blend shapes",
    "lod_animated_map_mapping": "animated maps",
}
_TOPOLOGY = (
    "face_offsets",
    "face_layouts",
    "layout_positions",
    "layout_texture_coordinates",
    "layout_normals",
)
_OTHERS = {  # layers that are taken as they are, and so must be alike
    "rbf_behavior": "RBF solvers",
    "twist_swing_behavior": "twists and swings",
    "machine_learned_behavior": "neural networks",
}


def difference(one: Dna, other: Dna) -> str | None:
    """Why two faces cannot be mixed, in a few words; None: they can.

    Args:
        one: a face.
        other: another one.
    """
    one, other = without_hair(one), without_hair(other)
    for tell in (_names, _system, _lists, _behavior, _meshes):
        why = tell(one, other)
        if why is not None:
            return why
    return None


def check_compatible(faces: Sequence[Dna], names: Sequence[str]) -> None:
    """Raises ValueError with the name of the first face that does not go with the first one.

    Args:
        faces: at least one.
        names: what they are called, such as their files.
    """
    for face, name in zip(faces[1:], names[1:], strict=True):
        why = difference(faces[0], face)
        if why is not None:
            raise ArgumentError(f"{name} cannot be mixed with {names[0]}: {why}")


def _names(one: Dna, other: Dna) -> str | None:
    for field, word in _NAMES.items():
        a, b = list(getattr(one, field)), list(getattr(other, field))
        if a == b:
            continue
        lacking = [n for n in a if n not in set(b)]
        more = [n for n in b if n not in set(a)]
        if lacking:
            return f"it has no {word} {lacking[0]}"
        if more:
            return f"it has a {word} {more[0]} that the other lacks"
        return f"its {word}s are in another order"
    if [int(p) for p in one.joint_parents] != [int(p) for p in other.joint_parents]:
        return "a joint hangs on another one"
    return None


def _system(one: Dna, other: Dna) -> str | None:
    for field in _SYSTEM:
        a, b = getattr(one, field), getattr(other, field)
        if a != b:
            return f"{field} is {b}, not {a}"
    return None


def _lists(one: Dna, other: Dna) -> str | None:
    for field, word in _LISTS.items():
        a, b = getattr(one, field), getattr(other, field)
        rows = [[np.asarray(x[lod]).tolist() for lod in range(len(x))] for x in (a, b)]
        if rows[0] != rows[1]:
            return f"its levels of detail list other {word}"
    return None


def _same(a: object, b: object, fields: Iterable[str]) -> bool:
    return all(np.array_equal(getattr(a, f), getattr(b, f)) for f in fields)


def _behavior(one: Dna, other: Dna) -> str | None:
    if not _same(one.psds, other.psds, ("rows", "columns", "values")):
        return "its correctives fire otherwise"
    conditionals = ("input_indices", "output_indices", "from_values", "to_values")
    if not _same(one.gui_to_raw, other.gui_to_raw, (*conditionals, "slope_values", "cut_values")):
        return "its GUI controls drive other raw controls"
    if not _same(one.animated_maps.conditionals, other.animated_maps.conditionals, conditionals):
        return "its animated maps are driven otherwise"
    for group in (*one.joint_groups, *other.joint_groups):
        if any(int(i) >= 9 * len(one.joint_names) for i in group.output_indices):
            return "joints that turn by quaternions cannot be mixed"
    for field, word in _OTHERS.items():
        a, b = Dna(), Dna()
        setattr(a, field, getattr(one, field))
        setattr(b, field, getattr(other, field))
        if a.to_bytes() != b.to_bytes():
            return f"its {word} are others"
    return None


def _meshes(one: Dna, other: Dna) -> str | None:
    for name, a, b in zip(one.mesh_names, one.meshes, other.meshes, strict=True):
        counts = [_counts(m) for m in (a, b)]
        if counts[0] != counts[1]:
            return f"{name} has {counts[1][0]} vertices and {counts[1][1]} faces, not " + (
                f"{counts[0][0]} and {counts[0][1]}"
            )
        if not _same(a, b, _TOPOLOGY):
            return f"{name} has its faces in another order"
    return None


def _counts(mesh: Mesh) -> tuple[int, int]:
    return len(mesh.positions), max(0, len(mesh.face_offsets) - 1)
