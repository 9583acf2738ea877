# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the bones and skin weights of a face from Blender, compiled for the native skinning.

The skin of a mesh is the compiled form of its skin weights.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ... import native
from ..base import parts, saved, session
from ..base.blender_types import ArmatureObject, MeshObject
from ..character import meshes, runtime

_SAMPLES = 16  # approximate number of vertices compared to see whether undo changed a mesh


@dataclass
class Bones:
    """The bones of a deforming armature.

    Attributes:
        names: bone name -> index of the pose bone.
        joints: joint index -> index of its pose bone.
        chain: risorius.JointChain of the bones.
        location, rotation, scale: float32[B, 3 or 4 (w x y z)] of all bones; the evaluator writes
            the rows of its joints.
    """

    names: dict[str, int]
    joints: dict[int, int]
    chain: native.JointChain
    location: NDArray[np.float32]
    rotation: NDArray[np.float32]
    scale: NDArray[np.float32]


@dataclass
class Skin:
    """The skin of a mesh.

    Attributes:
        mesh: its index in the DNA file.
        skin: risorius.Skin of its vertex groups.
        base: float32[V, 3], basis shape key of the mesh.
        mark: values that change when undo reloads the mesh, from _mark.
        names: Bones.names when the skin was compiled.
    """

    mesh: int
    skin: native.Skin
    base: NDArray[np.float32]
    mark: tuple[object, ...]
    names: dict[str, int]


# _bones: session uid of a deforming armature -> Bones. _skins: session uid of a mesh object ->
# Skin.
_bones: dict[int, Bones] = session.table("skins.bones", ("rewrite", "undo", "load"))
_skins: dict[int, Skin] = session.table("skins.skins", ("load",))
_unsure: set[int] = session.keep("skins.unsure", set, ("load",))
# Session uids of mesh objects that were edited since the file was opened.
_edited: set[int] = session.keep("skins.edited", set, ("load",))


@session.at("undo")
def doubt() -> None:
    """Let `of` compare each cached skin with its mesh before the skin is used again.

    This is necessary after undo and redo, which may change meshes. Meshes that were not edited
    since the file was opened need no comparison.
    """
    _unsure.update(_edited & _skins.keys())


def forget(uids: set[int]) -> None:
    """Forget the skins of edited meshes.

    Args:
        uids: session uids of the mesh objects.
    """
    _edited.update(uids)
    for uid in uids:
        _skins.pop(uid, None)
        meshes.note_edit(uid)


def forget_bones(uid: int) -> None:
    """Forget bones that were edited or posed.

    Args:
        uid: session uid of the deforming armature.
    """
    _bones.pop(uid, None)


def bones_of(rig: ArmatureObject) -> Bones:
    """Read the bones of an armature, or return the cached Bones.

    Args:
        rig: deforming armature.
    """
    kept = _bones.get(rig.session_uid)
    if kept is None or len(kept.names) != len(rig.pose.bones):
        kept = _bones[rig.session_uid] = _read_bones(rig)
    return kept


def of(item: MeshObject, bones: Bones, live: runtime.Runtime) -> Skin:
    """The compiled skin weights of a mesh, cached; compiled again if the mesh has changed.

    Args:
        item: the mesh object.
        bones: bones of its deforming armature.
        live: the character's Runtime.
    """
    uid = item.session_uid
    kept = _skins.get(uid)
    if kept is not None and not _holds(kept, item, bones):
        kept = None
        meshes.note_edit(uid)
    _unsure.discard(uid)
    if kept is None:
        kept = _skins[uid] = _read_skin(item, bones, live)
    return kept


def _holds(kept: Skin, item: MeshObject, bones: Bones) -> bool:
    """Whether the skin of a mesh still matches its vertex groups and bones."""
    if kept.names is not bones.names:
        if kept.names != bones.names:
            return False
        kept.names = bones.names
    return item.session_uid not in _unsure or _is_as_read(kept, item)


def _read_bones(rig: ArmatureObject) -> Bones:
    rests, posed = rig.data.bones, rig.pose.bones
    names = {bone.name: place for place, bone in enumerate(posed)}
    rest = np.empty((len(rests), 4, 4), np.float32)
    rests.foreach_get("matrix_local", rest.ravel())
    rest = rest.transpose(0, 2, 1)  # Blender stores matrices column by column
    order = [names[bone.name] for bone in rests]
    parents = np.full(len(posed), -1, np.int32)
    for place, bone in zip(order, rests, strict=True):
        if bone.parent is not None:
            parents[place] = names[bone.parent.name]
    sorted_rest = np.empty_like(rest)
    sorted_rest[order] = rest
    location = np.zeros((len(posed), 3), np.float32)
    rotation = np.tile(np.array([1, 0, 0, 0], np.float32), (len(posed), 1))
    scale = np.ones((len(posed), 3), np.float32)
    basis = np.empty((len(posed), 16), np.float32)
    posed.foreach_get("matrix_basis", basis.ravel())
    straight = np.eye(4, dtype=np.float32).ravel()
    for place in np.flatnonzero((basis != straight).any(axis=1)).tolist():
        matrix = Matrix(basis[place].reshape(4, 4).T.tolist())
        moved, turned, sized = matrix.decompose()
        location[place], rotation[place], scale[place] = moved, turned, sized
    chain = native.module().JointChain(parents, sorted_rest)
    numbers = {bone.name: saved.whole(bone, parts.JOINT, -1) for bone in rests}
    joints = {number: names[name] for name, number in numbers.items() if number >= 0}
    return Bones(names, joints, chain, location, rotation, scale)


def _read_skin(item: MeshObject, bones: Bones, live: runtime.Runtime) -> Skin:
    count = len(item.data.vertices)
    fresh = meshes.fresh_weights(item)
    counts, places, weights = (
        _weights_of_file(item, bones, live) if fresh else _weights_of_groups(item, bones)
    )
    kept = (places >= 0) & (weights > 0.0)
    owner = np.repeat(np.arange(count), counts)[kept]
    offsets = np.zeros(count + 1, np.uint32)
    np.cumsum(np.bincount(owner, minlength=count), out=offsets[1:])
    skin = native.module().Skin(
        count, offsets, places[kept].astype(np.uint32), weights[kept], len(bones.names)
    )
    return Skin(item[parts.MESH], skin, meshes.basis_of(item), _mark(item), bones.names)


_Weights = tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float32]]


def _weights_of_file(item: MeshObject, bones: Bones, live: runtime.Runtime) -> _Weights:
    """The skin weights of a mesh without edited weights, read from the DNA.

    Returns:
        int64[V] number of weights of each vertex; int64[N] index of the pose bone of each weight,
        -1 for none; float32[N] the weights.
    """
    data = live.dna.meshes[item[parts.MESH]]
    place_of = np.full(len(live.rest), -1, np.int64)
    place_of[list(bones.joints)] = list(bones.joints.values())
    counts = np.diff(np.asarray(data.skin_offsets, np.int64))
    places = place_of[np.asarray(data.skin_joint_indices, np.int64)]
    weights = np.asarray(data.skin_weights, np.float32)
    if len(counts) != len(item.data.vertices):  # built without weights: the file has no skin
        return np.zeros(len(item.data.vertices), np.int64), places[:0], weights[:0]
    return counts, places, weights


def _weights_of_groups(item: MeshObject, bones: Bones) -> _Weights:
    """The weights of a mesh's vertex groups.

    Returns:
        int64[V] number of weights of each vertex; int64[N] index of the pose bone of each weight,
        -1 for none; float32[N] the weights.
    """
    vertices, groups_there = item.data.vertices, item.vertex_groups
    counts = np.fromiter((len(v.groups) for v in vertices), np.int64, len(vertices))
    groups, weights = np.empty(counts.sum(), np.int32), np.empty(counts.sum(), np.float32)
    begin = 0
    for vertex, count in zip(vertices, counts.tolist(), strict=True):
        held = vertex.groups  # in bulk: a Python object for each weight takes four times as long
        held.foreach_get("group", groups[begin : begin + count])
        held.foreach_get("weight", weights[begin : begin + count])
        begin += count
    places = np.full(max(len(groups_there), int(groups.max(initial=-1)) + 1), -1, np.int64)
    places[: len(groups_there)] = [bones.names.get(group.name, -1) for group in groups_there]
    return counts, places[groups], weights


def _is_as_read(skin: Skin, item: MeshObject) -> bool:
    return skin.mark == _mark(item) and np.array_equal(skin.base, meshes.basis_of(item))


def _mark(item: MeshObject) -> tuple[object, ...]:
    """Values that change when undo reloads a mesh: addresses, and weights of some vertices."""
    data = item.data
    count = len(data.vertices)
    rows: list[object] = [count, tuple(group.name for group in item.vertex_groups)]
    for place in range(0, count, max(1, count // _SAMPLES)):
        groups = data.vertices[place].groups
        rows.append(tuple((e.as_pointer(), e.group, e.weight) for e in groups))
    return tuple(rows)
