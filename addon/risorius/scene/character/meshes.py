# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds mesh objects with skin weights, and switches their shape keys between two modes.

In KEYS mode a mesh has a shape key for each blend shape channel, called a real key here. In LIVE
mode the mesh has one shape key, the live key, to which the evaluator writes the sum of all
channels.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, cast

import bmesh
import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ...logic.base.space import Space
from ...logic.character import plans, user_edits
from ...logic.character.plans import LIVE_KEY
from ..base import compat, drivers, parts, saved, session
from ..base.blender_types import ArmatureObject, MeshObject
from .armatures import lock_place

_DRIVEN = re.compile(r'^\["channels"\]\[(\d+)\]$')
_KEY_VALUE = re.compile(r'^key_blocks\["(.*)"\]\.value$')
_LIVE_MARK = "KEY_BSPLINE"  # interpolation that marks the live key

Deltas = tuple[NDArray[np.int64], NDArray[np.float32]]  # vertex indices, offsets [K, 3]


# Session uids of mesh objects that were not edited since they were built, so that their skin
# weights equal the weights in the DNA file.
_fresh: set[int] = session.keep("meshes.fresh", set, ("undo", "load"))


def fresh_weights(item: MeshObject) -> bool:
    """Whether a mesh was not edited since its import.

    Its skin weights then equal the weights in the DNA file. False after undo and after a file was
    opened, because edits made before are unknown.
    """
    return item.session_uid in _fresh


def note_edit(uid: int) -> None:
    """Record that a mesh was edited.

    Args:
        uid: session uid of the mesh object.
    """
    _fresh.discard(uid)


def build_mesh(
    plan: plans.CharacterPlan,
    mesh_plan: plans.MeshPlan,
    rig: ArmatureObject,
    made: list[bpy.types.ID],
    normals: bool = True,
) -> MeshObject:
    """Build one mesh object: faces, UVs, custom normals, vertex groups, armature modifier.

    Args:
        plan: names and joints of the character.
        mesh_plan: geometry and skin weights of the mesh.
        rig: the deforming armature object.
        made: receives every new datablock.
        normals: whether the file's normals are kept as custom normals.

    Returns:
        The mesh object, in no collection.
    """
    name = f"{plan.name}_{mesh_plan.label}"
    mesh = bpy.data.meshes.new(name)
    made.append(mesh)
    mesh.vertices.add(len(mesh_plan.positions))
    mesh.vertices.foreach_set("co", mesh_plan.positions.ravel())
    mesh.loops.add(len(mesh_plan.corners))
    mesh.loops.foreach_set("vertex_index", mesh_plan.corners)
    mesh.polygons.add(len(mesh_plan.face_starts))
    mesh.polygons.foreach_set("loop_start", mesh_plan.face_starts)
    mesh.update(calc_edges=True)
    item = cast("MeshObject", bpy.data.objects.new(name, mesh))
    made.append(item)
    _add_weights(item, mesh_plan, plan.armature.labels)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    if mesh_plan.uvs is not None:
        layer = mesh.uv_layers.new(name="UVMap", do_init=False)
        layer.uv.foreach_set("vector", mesh_plan.uvs.ravel())
    if normals and mesh_plan.normals is not None:
        mesh.normals_split_custom_set(mesh_plan.normals)
    modifier = cast("bpy.types.ArmatureModifier", item.modifiers.new("Armature", "ARMATURE"))
    modifier.object = rig
    item.parent = rig
    lock_place(item)
    parts.point(item, parts.RIG, rig)
    item[parts.MESH] = mesh_plan.index
    item[parts.LODS] = list(mesh_plan.lods)
    item[parts.MODE] = "KEYS"
    item.property_overridable_library_set(f'["{parts.MODE}"]', True)
    _fresh.add(item.session_uid)
    return item


def _add_weights(item: MeshObject, mesh_plan: plans.MeshPlan, labels: Sequence[str]) -> None:
    """Add a vertex group with weights for each joint that the mesh uses.

    Args:
        item: the mesh object.
        mesh_plan: skin weights of the mesh.
        labels: bone names by joint index.
    """
    used = np.unique(mesh_plan.skin_joints)
    group_of = {int(j): item.vertex_groups.new(name=labels[int(j)]).index for j in used}
    edit = bmesh.new()
    try:
        edit.from_mesh(item.data)
        layer = edit.verts.layers.deform.verify()
        offsets = mesh_plan.skin_offsets.tolist()
        groups = [group_of[j] for j in mesh_plan.skin_joints.tolist()]
        weights = mesh_plan.skin_weights.tolist()
        for vertex, begin, end in zip(edit.verts, offsets[:-1], offsets[1:], strict=True):
            held: Any = vertex[layer]  # weights by group, as a dict
            for i in range(begin, end):
                # A vertex may list a joint twice; then its weights are summed.
                held[groups[i]] = held.get(groups[i], 0.0) + weights[i]
        edit.to_mesh(item.data)
    finally:
        edit.free()


def real_channels(item: MeshObject) -> dict[str, int]:
    """Name of a real key that Risorius made -> index of its blend shape channel.

    Real keys are identified by the variable name of their drivers, so a shape key that the user
    drives by a channel does not count. If a driver was copied to another shape key, only the first
    of the two keys counts.
    """
    key = item.data.shape_keys
    driven: dict[str, int] = {}
    for curve in key.animation_data.drivers if key and key.animation_data else ():
        name = _KEY_VALUE.match(curve.data_path)
        for variable in compat.driver_of(curve).variables if name else ():
            match = _DRIVEN.match(variable.targets[0].data_path)
            if name and match and variable.name == parts.CHANNEL_VARIABLE:
                driven[bpy.utils.unescape_identifier(name.group(1))] = int(match.group(1))
    found, seen = {}, set()
    for block in key.key_blocks if key and driven else ():
        channel = driven.get(block.name)
        if channel is not None and channel not in seen:
            found[block.name] = channel
            seen.add(channel)
    return found


def live_block(item: MeshObject) -> bpy.types.ShapeKey | None:
    """The live key, also after renaming; None if the mesh has none.

    Its interpolation identifies the key, because this setting has no effect on relative keys and
    survives renaming, reordering, copying and saving. The search by name is only a shortcut.
    """
    key = item.data.shape_keys
    if key is None:
        return None
    block = key.key_blocks.get(LIVE_KEY)
    if block is None and item.get(parts.MODE) == "LIVE":
        block = next((b for b in key.key_blocks if b.interpolation == _LIVE_MARK), None)
    return block


def set_mode(
    item: MeshObject,
    rig: ArmatureObject,
    dna_mesh: native.Mesh,
    space: Space,
    labels: Sequence[str],
    mode: str,
) -> bool:
    """Switch the shape keys of a mesh to LIVE or KEYS mode.

    A real key that the user edited stays a real key in LIVE mode. The user's own keys do not
    change.

    Args:
        item: mesh object.
        rig: deforming armature of the mesh.
        dna_mesh: the mesh in the DNA file.
        space: conversion from the DNA's axes and unit to Blender's.
        labels: shape key names by channel.
        mode: LIVE or KEYS.

    Returns:
        Whether the mode was set; False, without a change, if the number of vertices differs from
        the file.
    """
    if not dna_mesh.blend_shape_targets:
        item[parts.MODE] = mode
        return True
    if len(item.data.vertices) != len(dna_mesh.positions):
        return False
    if item.data.shape_keys is None:
        item.shape_key_add(name="Basis", from_mix=False)
    deltas = deltas_by_channel(dna_mesh, space.delta_matrix)
    if mode == "KEYS":
        _to_keys(item, rig, deltas, labels)
    else:
        _to_live(item, deltas, imported_basis(dna_mesh, space), labels)
    item[parts.MODE] = mode
    return True


def imported_basis(dna_mesh: native.Mesh, space: Space) -> NDArray[np.float32]:
    """The vertices of the neutral mesh after an import.

    Args:
        dna_mesh: the mesh in the DNA file, with V vertices.
        space: conversion from the DNA's axes and unit to Blender's.

    Returns:
        float32[V, 3] in Blender units.
    """
    return np.ascontiguousarray(space.points(dna_mesh.positions), np.float32)


def deltas_by_channel(dna_mesh: native.Mesh, matrix: NDArray[np.float32]) -> dict[int, Deltas]:
    """The blend shape targets of a mesh by channel; targets of the same channel are concatenated.

    Args:
        dna_mesh: the mesh in the DNA file.
        matrix: float32[3, 3], converts deltas from the DNA's axes and unit to Blender's.

    Returns:
        Channel -> (vertex indices, float32[K, 3] deltas).
    """
    joined = {}
    for target in dna_mesh.blend_shape_targets:
        indices = np.asarray(target.vertex_indices, np.int64)
        moved = np.asarray(target.deltas, np.float32).reshape(-1, 3) @ matrix.T
        joined.setdefault(int(target.blend_shape_channel_index), []).append((indices, moved))
    return {
        channel: (np.concatenate([i for i, _ in pairs]), np.concatenate([d for _, d in pairs]))
        for channel, pairs in joined.items()
    }


def points_of(block: bpy.types.ShapeKey) -> NDArray[np.float32]:
    """Coordinates of a shape key, float32[V, 3]."""
    flat = np.empty(len(block.points) * 3, np.float32)
    block.points.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def basis_of(item: MeshObject) -> NDArray[np.float32]:
    """Current coordinates of the neutral mesh (the reference key if any), float32[V, 3]."""
    key = item.data.shape_keys
    if key is not None:
        return points_of(key.reference_key)
    flat = np.empty(len(item.data.vertices) * 3, np.float32)
    item.data.vertices.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def edits_of(
    block: bpy.types.ShapeKey, imported: NDArray[np.float32], deltas: Deltas
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Find the user's edits of a real key.

    Args:
        block: the key.
        imported: float32[V, 3], the neutral mesh from imported_basis.
        deltas: (vertex indices, float32[K, 3]) of the key's channel in the DNA file.

    Returns:
        bool[V], whether a vertex was edited, and float64[V, 3], the offset of each edited vertex
        from the unedited shape key; 0 elsewhere.
    """
    base = points_of(block.relative_key)
    return user_edits.key_edits(base, points_of(block), imported, user_edits.shaped(base, *deltas))


def add_key(item: MeshObject, name: str, deltas: Deltas) -> bpy.types.ShapeKey:
    """Add a real shape key with value 0 and range -10 to 10.

    Args:
        item: the mesh object.
        name: name of the key.
        deltas: (vertex indices, float32[K, 3]) from the reference key, in Blender units.

    Returns:
        The key.
    """
    block = item.shape_key_add(name=name, from_mix=False)
    block.slider_min, block.slider_max = -10.0, 10.0
    block.value = 0.0
    points = user_edits.shaped(points_of(parts.keys_there(item).reference_key), *deltas)
    block.points.foreach_set("co", points.ravel())
    return block


def add_channel_key(
    item: MeshObject, rig: ArmatureObject, channel: int, name: str, deltas: Deltas
) -> bpy.types.ShapeKey:
    """Add a real shape key with a driver that follows a channel.

    Args:
        item: the mesh object.
        rig: deforming armature with the weights of channels.
        channel: index of the blend shape channel.
        name: name of the key.
        deltas: (vertex indices, float32[K, 3]) from the reference key, in Blender units.

    Returns:
        The key.
    """
    block = add_key(item, name, deltas)
    drive_key(parts.keys_there(item), block, rig, channel)
    return block


def remove_channel_key(item: MeshObject, block: bpy.types.ShapeKey) -> None:
    """Remove a shape key that add_channel_key made, and its driver.

    Args:
        item: the mesh object.
        block: the shape key of this mesh.
    """
    path = f'key_blocks["{bpy.utils.escape_identifier(block.name)}"].value'
    parts.keys_there(item).driver_remove(path)
    item.shape_key_remove(block)


def _to_keys(
    item: MeshObject, rig: ArmatureObject, deltas: Mapping[int, Deltas], labels: Sequence[str]
) -> None:
    key = parts.keys_there(item)
    there = set(real_channels(item).values())
    given = saved.table(key, parts.KEY_NAMES) or {}
    order = [c for c in saved.wholes(key, parts.KEY_ORDER) if c in deltas]
    for channel in dict.fromkeys([*order, *deltas]):
        if channel not in there:
            name = saved.text(given, str(channel), labels[channel])
            add_channel_key(item, rig, channel, name, deltas[channel])
    live = live_block(item)
    if live is not None:
        item.shape_key_remove(live)
    for name in (parts.REAL, parts.KEY_NAMES, parts.KEY_ORDER):
        if name in key:
            del key[name]


def _to_live(
    item: MeshObject,
    deltas: Mapping[int, Deltas],
    imported: NDArray[np.float32],
    labels: Sequence[str],
) -> None:
    key = parts.keys_there(item)
    if item.get(parts.MODE) == "KEYS":
        _remember_keys(item, labels)
    kept = []
    for name, channel in real_channels(item).items():
        block = key.key_blocks[name]
        if channel not in deltas or touched(key, block, imported, deltas[channel]):
            kept.append(channel)
        else:
            remove_channel_key(item, block)
    if kept:
        key[parts.REAL] = kept
    elif parts.REAL in key:
        del key[parts.REAL]
    if live_block(item) is None:
        add_live_key(item)


def add_live_key(item: MeshObject) -> None:
    """Add a live key to a mesh.

    Args:
        item: the mesh object.
    """
    if item.data.shape_keys is None:
        item.shape_key_add(name="Basis", from_mix=False)
    block = item.shape_key_add(name=LIVE_KEY, from_mix=False)
    block.value = 1.0
    block.interpolation = _LIVE_MARK
    # Edits of the live key are lost at the next change of a control, so the user must not edit it.
    block.lock_shape = True
    item.active_shape_key_index = 0
    item[parts.MODE] = "LIVE"


def touched(
    key: bpy.types.Key, block: bpy.types.ShapeKey, imported: NDArray[np.float32], deltas: Deltas
) -> bool:
    """Whether a real key of Risorius has an edit that the live key cannot contain.

    Args:
        key: the shape keys of the mesh.
        block: the real key.
        imported: float32[V, 3], the imported neutral mesh.
        deltas: (vertex indices, float32[K, 3]) of its channel in the DNA file.
    """
    if block.mute or block.vertex_group or block.relative_key != key.reference_key:
        return True
    return bool(edits_of(block, imported, deltas)[0].any())


def _remember_keys(item: MeshObject, labels: Sequence[str]) -> None:
    """Store names and order that the user gave to real keys, before LIVE mode removes the keys."""
    key, channels = parts.keys_there(item), real_channels(item)
    renamed = {str(c): name for name, c in channels.items() if name != labels[c]}
    if renamed:
        key[parts.KEY_NAMES] = renamed
    order = [channels[b.name] for b in key.key_blocks if b.name in channels]
    if order != sorted(order):
        key[parts.KEY_ORDER] = order


def drive_key(
    key: bpy.types.Key, block: bpy.types.ShapeKey, rig: ArmatureObject, channel: int
) -> None:
    """Add a driver that copies the weight of a channel to the value of a shape key.

    Args:
        key: the shape keys of the mesh.
        block: the shape key to drive.
        rig: deforming armature, which stores the channels' weights.
        channel: index of the blend shape channel.
    """
    name = bpy.utils.escape_identifier(block.name)
    curve = cast("bpy.types.FCurve", key.driver_add(f'key_blocks["{name}"].value'))
    drivers.plain_driver(curve, rig, f'["{parts.CHANNELS}"][{channel}]', parts.CHANNEL_VARIABLE)
