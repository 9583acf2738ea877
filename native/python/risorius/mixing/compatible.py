# SPDX-License-Identifier: MIT
"""Checks that faces can be mixed: names, topology and behavior must be equal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from .. import Dna, Mesh
from ..base.errors import ArgumentError
from ..base.words import counted, plural
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
_VALUES = ("texture_coordinates", "normals")
_OTHERS = {  # a mix takes these layers from the first face, so they must be equal in all faces
    "blend_shape_channels": "drivers of blend shapes",
    "rbf_behavior": "RBF solvers",
    "rbf_behavior_ext": "poses of RBF solvers",
    "twist_swing_behavior": "twists and swings",
    "machine_learned_behavior": "neural networks",
    "machine_learned_behavior_ext": "operations and joints of neural networks",
    "joint_behavior_metadata": "kinds of joint rotations",
}
_QUATERNION = 1  # value in joint_representations for quaternion rotation


def difference(one: Dna, other: Dna) -> str | None:
    """The first reason why two faces cannot be mixed, in a few words; None if they can be mixed.

    Args:
        one: a face.
        other: another face.
    """
    one, other = without_hair(one), without_hair(other)
    for tell in (_names, _system, _lists, _behavior, _meshes):
        why = tell(one, other)
        if why is not None:
            return why
    return None


def check_compatible(faces: Sequence[Dna], names: Sequence[str]) -> None:
    """Raises ValueError for the first face that cannot be mixed with faces[0]; the message names
    it.

    Args:
        faces: faces to mix, at least one.
        names: names of the faces in errors, such as file names.
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
        ours, theirs = set(a), set(b)
        lacking = [n for n in a if n not in theirs]
        more = [n for n in b if n not in ours]
        if lacking:
            return f"it has no {word} {lacking[0]}"
        if more:
            return f"the other face has no {word} {more[0]}"
        return f"its {plural(word)} are in another order"
    if [int(p) for p in one.joint_parents] != [int(p) for p in other.joint_parents]:
        return "a joint hangs on another one"
    for dna, word in ((one, "the first face"), (other, "it")):
        for field in ("neutral_joint_translations", "neutral_joint_rotations"):
            odd = np.argwhere(~np.isfinite(getattr(dna, field)))
            if len(odd):
                return f"{word} has no finite number as {field} of {dna.joint_names[odd[0, 0]]}"
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
    for field, word in _OTHERS.items():
        if not alike(getattr(one, field), getattr(other, field)):
            return f"its {word} are others"
    if _turned_lists(one) != _turned_lists(other):
        return "joints that turn by quaternions have their controls in another order"
    return None


def alike(one: object, other: object) -> bool:
    """Whether two parts of faces have equal numbers and texts at every depth.

    Args:
        one: an array, a text, a number, a list of parts, or an object whose attributes are parts.
        other: a value of the same kind.
    """
    if isinstance(one, np.ndarray):
        return bool(one.tobytes() == np.asarray(other).tobytes())
    if isinstance(one, str | bytes | int | float):
        return repr(one) == repr(other)  # repr has all digits, and is equal for NaN
    if isinstance(one, Sequence):
        assert isinstance(other, Sequence)
        return len(one) == len(other) and all(map(alike, one, other))
    names = [name for name in vars(type(one)) if not name.startswith("_")]
    return all(alike(getattr(one, name), getattr(other, name)) for name in names)


def turned_groups(dna: Dna) -> list[int]:
    """Indices of the joint groups that move a joint with quaternion rotation.

    Args:
        dna: a face.
    """
    kinds = np.asarray(dna.joint_behavior_metadata.joint_representations)
    if not len(kinds):
        return []
    turned = np.flatnonzero(kinds[:, 1] == _QUATERNION)
    return [
        number
        for number, group in enumerate(dna.joint_groups)
        if np.isin(np.asarray(group.output_indices) // 9, turned).any()
    ]


def _turned_lists(dna: Dna) -> list[tuple[bytes, ...]]:
    """(LODs, inputs, outputs) of each joint group that moves a joint with quaternion rotation, as
    bytes. The lists of both faces must be equal, because quaternions are multiplied in the order of
    the columns, so that a mean of columns in different orders is meaningless."""
    groups = dna.joint_groups
    return [
        (g.lods.tobytes(), g.input_indices.tobytes(), g.output_indices.tobytes())
        for g in (groups[number] for number in turned_groups(dna))
    ]


def _meshes(one: Dna, other: Dna) -> str | None:
    if len(one.meshes) != len(other.meshes):
        return f"it has {counted(len(other.meshes), 'mesh')}, not {len(one.meshes)}"
    for name, a, b in zip(one.mesh_names, one.meshes, other.meshes, strict=False):
        counts = [_counts(m) for m in (a, b)]
        if counts[0] != counts[1]:
            return f"{name} has {counts[1][0]} vertices and {counts[1][1]} faces, not " + (
                f"{counts[0][0]} and {counts[0][1]}"
            )
        same = all(len(getattr(a, v)) == len(getattr(b, v)) for v in _VALUES)
        if not same or not _same(a, b, _TOPOLOGY):
            return f"{name} has its faces in another order"
    return None


def _counts(mesh: Mesh) -> tuple[int, int]:
    return len(mesh.positions), max(0, len(mesh.face_offsets) - 1)
