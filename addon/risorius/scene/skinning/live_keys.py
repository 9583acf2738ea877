# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the sum of all blend shape channels to the live shape key of a mesh.

For Blender, writing a shape key is an edit of the mesh, and an edit resets simulations: cloth would
stay at its first step. So before a frame, the live shape key of a mesh with a simulation is written
without notifying Blender, both in the original and in its copies in the graphs of all scenes.
Graphs of renders and exporters are notified afterwards.
"""

from __future__ import annotations

import ctypes

import bpy
import numpy as np
from numpy.typing import NDArray

from ..base import last_written, parts, saved
from ..base.blender_types import Depsgraph, MeshObject
from ..character import meshes, runtime
from . import bone_writer, caches


def write(
    item: MeshObject,
    live: runtime.Runtime,
    weights: NDArray[np.float32],
    force: bool,
    ahead: bool = False,
) -> None:
    """Write the sum of all blend shape channels to the live key of a mesh, if it has one.

    Channels with a shape key of their own (parts.REAL) are left out. Nothing is written in edit
    mode, or if the number of vertices differs from the DNA file.

    Args:
        item: the mesh object.
        live: the Runtime of its character.
        weights: float32[C] weights of the channels.
        force: True writes unchanged values too.
        ahead: True if Blender has not evaluated the frame yet.
    """
    key = item.data.shape_keys
    block = meshes.live_block(item)
    if key is None or block is None or item.mode == "EDIT":
        return
    number = runtime.mesh_number(live, item)
    if number is None:
        return  # the mesh belongs to another DNA file
    morph = live.morph(number)
    if morph.vertex_count != len(block.points):
        return  # the user changed the topology
    if parts.REAL in key:
        weights = weights.copy()
        weights[saved.wholes(key, parts.REAL, 0, len(weights) - 1)] = 0.0
    state = weights[morph.channel_indices].tobytes()
    if not last_written.is_new(last_written.weights, key, state) and not force:
        return
    basis = meshes.points_of(key.reference_key)
    points = morph.evaluate(weights, base=basis)
    linked = item.data.library or item.data.override_library
    if ahead and not linked and bears_simulation(item):
        _write_unheard(key, block, points)
        return
    last_written.unheard.discard(key.session_uid)
    block.points.foreach_set("co", points.ravel())
    if linked:
        last_written.note_refusal(item, bone_writer.is_there(block.points, "co", points.ravel()))
    key.update_tag()
    item.data.update_tag()


def bears_simulation(item: bpy.types.Object) -> bool:
    """Whether an edit of an object resets a simulation.

    The object may be simulated, or influence other simulated objects, for example by a force field.
    """
    field = item.field is not None and item.field.type != "NONE"
    body = item.rigid_body is not None
    return field or body or any(m.type in caches.SIMULATED for m in item.modifiers)


def reach(depsgraph: Depsgraph) -> None:
    """Tag live shape keys for an update if their copies in a graph have other positions.

    This happens if positions were written without notifying Blender, and the graph belongs to a
    render or an exporter.

    Args:
        depsgraph: the evaluated graph.
    """
    if not last_written.unheard:
        return
    for item in (item for rig in parts.rigs() for item in parts.meshes_of(rig)):
        key, block = item.data.shape_keys, meshes.live_block(item)
        if key is None or block is None or key.session_uid not in last_written.unheard:
            continue
        seen = key.evaluated_get(depsgraph)
        if seen.is_evaluated:
            there = meshes.points_of(seen.key_blocks[block.name])
            if not np.array_equal(there, meshes.points_of(block)):
                key.update_tag()
                item.data.update_tag()


def _write_unheard(
    key: bpy.types.Key, block: bpy.types.ShapeKey, points: NDArray[np.float32]
) -> None:
    """Write points to a shape key and to its copies in all graphs, without notifying Blender."""
    points = np.ascontiguousarray(points, np.float32)
    ctypes.memmove(block.points[0].as_pointer(), points.ctypes.data, points.nbytes)
    last_written.unheard.add(key.session_uid)
    layers = (layer for scene in bpy.data.scenes for layer in scene.view_layers)
    for graph in (layer.depsgraph for layer in layers):
        seen = key.evaluated_get(graph) if graph is not None else key
        if seen.is_evaluated:
            seen.key_blocks[block.name].points.foreach_set("co", points.ravel())
