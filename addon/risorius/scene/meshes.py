# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes with their weights, and their shape keys in both modes."""

import re

import bmesh
import bpy
import numpy as np

from ..logic.plans import AUTO_KEYS, AUTO_LIMIT, LIVE_KEY
from . import parts
from .armatures import lock_place

_DRIVEN = re.compile(r'^\["channels"\]\[(\d+)\]$')
_LIVE_MARK = "KEY_BSPLINE"


def build_mesh(plan, mesh_plan, rig, made, normals=True):
    """Build one mesh object: faces, UVs, custom normals, vertex groups, armature modifier.

    Args:
        plan: the CharacterPlan.
        mesh_plan: the MeshPlan.
        rig: the deforming armature object.
        made: list that every new datablock is put on.
        normals: whether the file's normals are kept as custom normals.

    Returns:
        The mesh object, not linked anywhere.
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
    item = bpy.data.objects.new(name, mesh)
    made.append(item)
    _add_weights(item, mesh_plan, plan.armature.labels)
    mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
    if mesh_plan.uvs is not None:
        layer = mesh.uv_layers.new(name="UVMap", do_init=False)
        layer.uv.foreach_set("vector", mesh_plan.uvs.ravel())
    if normals and mesh_plan.normals is not None:
        mesh.normals_split_custom_set(mesh_plan.normals)
    modifier = item.modifiers.new("Armature", "ARMATURE")
    modifier.object = rig
    item.parent = rig
    lock_place(item)
    parts.point(item, parts.RIG, rig)
    item[parts.MESH] = mesh_plan.index
    item[parts.LODS] = list(mesh_plan.lods)
    item[parts.MODE] = "KEYS"
    item.property_overridable_library_set(f'["{parts.MODE}"]', True)
    return item


def _add_weights(item, mesh_plan, labels):
    """Vertex groups of the joints that this mesh uses, filled through the deform layer."""
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
            held = vertex[layer]
            for i in range(begin, end):
                # A joint may stand twice at a vertex: its weights add up.
                held[groups[i]] = held.get(groups[i], 0.0) + weights[i]
        edit.to_mesh(item.data)
    finally:
        edit.free()


def automatic_mode(target_count, vertex_count, all_targets):
    """KEYS where real keys are cheap enough each frame, else LIVE.

    Args:
        target_count, vertex_count: of the mesh.
        all_targets: of all meshes of the character.
    """
    few = target_count * vertex_count < AUTO_LIMIT and all_targets <= AUTO_KEYS
    return "KEYS" if few else "LIVE"


def real_channels(item):
    """Shape key name -> channel, of the keys of a mesh that channel drivers move."""
    key = item.data.shape_keys
    found = {}
    for curve in key.animation_data.drivers if key and key.animation_data else ():
        for variable in curve.driver.variables:
            match = _DRIVEN.match(variable.targets[0].data_path)
            name = re.match(r'key_blocks\["(.*)"\]\.value$', curve.data_path)
            if match and name:
                found[bpy.utils.unescape_identifier(name.group(1))] = int(match.group(1))
    return found


def live_block(item):
    """The key that bears the channel sum, also after it was renamed; None without one.

    It is marked by its interpolation, which has no meaning for relative keys and survives
    renames, reordering, copies and files; the name is only the short way to it.
    """
    key = item.data.shape_keys
    if key is None:
        return None
    block = key.key_blocks.get(LIVE_KEY)
    if block is None and item.get(parts.MODE) == "LIVE":
        block = next((b for b in key.key_blocks if b.interpolation == _LIVE_MARK), None)
    return block


def set_mode(item, rig, dna_mesh, matrix, labels, mode):
    """Bring a mesh's shapes into LIVE or KEYS mode; the same vertices in both.

    What the user changed in a real key stays: such a key is kept as a real one in LIVE mode.
    Keys of the user's own are not touched.

    Args:
        item: mesh object.
        rig: its deforming armature.
        dna_mesh: the Mesh of the Dna.
        matrix: float32[3, 3] that takes deltas to Blender units.
        labels: shape key names by channel.
        mode: LIVE or KEYS.
    """
    if not dna_mesh.blend_shape_targets:
        item[parts.MODE] = mode
        return
    if item.data.shape_keys is None:
        item.shape_key_add(name="Basis", from_mix=False)
    deltas = _deltas_by_channel(dna_mesh, matrix)
    if mode == "KEYS":
        _to_keys(item, rig, deltas, labels)
    else:
        _to_live(item, deltas)
    item[parts.MODE] = mode


def _deltas_by_channel(dna_mesh, matrix):
    """Channel -> (vertex indices, float32[K, 3] deltas); targets of one channel are joined."""
    joined = {}
    for target in dna_mesh.blend_shape_targets:
        indices = np.asarray(target.vertex_indices, np.int64)
        moved = np.asarray(target.deltas, np.float32).reshape(-1, 3) @ matrix.T
        joined.setdefault(int(target.blend_shape_channel_index), []).append((indices, moved))
    return {
        channel: (np.concatenate([i for i, _ in pairs]), np.concatenate([d for _, d in pairs]))
        for channel, pairs in joined.items()
    }


def points_of(block):
    """Coordinates of a shape key, float32[V, 3]."""
    flat = np.empty(len(block.points) * 3, np.float32)
    block.points.foreach_get("co", flat)
    return flat.reshape(-1, 3)


def _to_keys(item, rig, deltas, labels):
    key = item.data.shape_keys
    basis = points_of(key.reference_key)
    there = set(real_channels(item).values())
    for channel, (indices, moved) in deltas.items():
        if channel in there:
            continue
        block = item.shape_key_add(name=labels[channel], from_mix=False)
        block.slider_min, block.slider_max = -10.0, 10.0
        block.value = 0.0
        points = basis.copy()
        np.add.at(points, indices, moved)
        block.points.foreach_set("co", points.ravel())
        drive_key(key, block, rig, channel)
    live = live_block(item)
    if live is not None:
        item.shape_key_remove(live)
    if parts.REAL in key:
        del key[parts.REAL]


def _to_live(item, deltas):
    key = item.data.shape_keys
    basis = points_of(key.reference_key)
    size = float(np.max(np.ptp(basis, axis=0), initial=0.0))
    kept = []
    for name, channel in real_channels(item).items():
        block = key.key_blocks.get(name)
        points = basis.copy()
        indices, moved = deltas.get(channel, (np.zeros(0, np.int64), np.zeros((0, 3))))
        np.add.at(points, indices, moved)
        if block is None or np.max(np.abs(points_of(block) - points), initial=0.0) < size * 1e-6:
            key.driver_remove(f'key_blocks["{bpy.utils.escape_identifier(name)}"].value')
            if block is not None:
                item.shape_key_remove(block)
        else:
            kept.append(channel)
    if kept:
        key[parts.REAL] = kept
    if live_block(item) is None:
        block = item.shape_key_add(name=LIVE_KEY, from_mix=False)
        block.value = 1.0
        block.interpolation = _LIVE_MARK


def drive_key(key, block, rig, channel):
    """Drive a key's value by its channel through a plain SUM driver."""
    name = bpy.utils.escape_identifier(block.name)
    curve = key.driver_add(f'key_blocks["{name}"].value')
    plain_driver(curve, rig, f'["{parts.CHANNELS}"][{channel}]')


def plain_driver(curve, rig, data_path):
    """Make an F-curve follow one property of the rig, without any expression."""
    curve.driver.type = "SUM"
    variable = curve.driver.variables.new()
    variable.type = "SINGLE_PROP"
    variable.targets[0].id_type = "OBJECT"
    variable.targets[0].id = rig
    variable.targets[0].data_path = data_path
