# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds the shape keys that a bake animates to meshes in LIVE mode, and removes them later."""

from __future__ import annotations

from collections.abc import Iterable

from ..base import parts, saved
from ..base.blender_types import ArmatureObject, MeshObject
from ..character import build, meshes, runtime

OPENED = "risorius_opened"  # on a Key: "channel index, space, name" of each shape key for a bake


def opened(item: MeshObject, live: runtime.Runtime, used: Iterable[int]) -> dict[int, str]:
    """The shape keys of a mesh that show blend shape channels.

    A mesh in LIVE mode has one shape key with the sum of all channels, which a bake cannot animate.
    Such a mesh gets a shape key for each used channel.

    Args:
        item: mesh object.
        live: Runtime of the mesh's character.
        used: indices of the channels that differ from 0 in the bake.

    Returns:
        Index of a channel -> name of its shape key; empty if the mesh has no shape keys, is not in
        the DNA file, or has another number of vertices than there.
    """
    dna_mesh = runtime.dna_mesh(live, item)
    key = item.data.shape_keys
    if dna_mesh is None or key is None or len(item.data.vertices) != len(dna_mesh.positions):
        return {}
    found = {channel: name for name, channel in meshes.real_channels(item).items()}
    block = meshes.live_block(item)
    if block is None:
        return found
    active, added, labels = item.active_shape_key_index, [], build.channel_labels(live.dna)
    deltas = meshes.deltas_by_channel(dna_mesh, live.space.delta_matrix)
    for channel in sorted(set(deltas) & set(used) - set(found)):
        made = meshes.add_key(item, labels[channel], deltas[channel])
        found[channel] = made.name
        added.append(f"{channel} {made.name}")
    key[OPENED] = added
    block.mute = True
    item.active_shape_key_index = active
    return found


def close(item: MeshObject, rig: ArmatureObject, live: runtime.Runtime) -> None:
    """Remove the shape keys that a bake added.

    A shape key that the user edited stays and gets a driver that reads its channel.

    Args:
        item: mesh object; its baked action is removed already.
        rig: deforming armature of the character.
        live: Runtime of the character.
    """
    key = item.data.shape_keys
    dna_mesh = runtime.dna_mesh(live, item)
    if dna_mesh is None or key is None or OPENED not in key:
        return
    active, kept = item.active_shape_key, saved.wholes(key, parts.REAL, 0)
    name = active.name if active is not None else ""
    basis = meshes.imported_basis(dna_mesh, live.space)
    deltas = meshes.deltas_by_channel(dna_mesh, live.space.delta_matrix)
    same = len(item.data.vertices) == len(dna_mesh.positions)
    for words in saved.texts(key, OPENED):
        number, _space, label = words.partition(" ")
        block = key.key_blocks.get(label)
        channel = int(number) if number.isdecimal() and len(number) < 6 else -1
        if block is None or channel not in deltas:
            continue
        if same and meshes.touched(key, block, basis, deltas[channel]):
            meshes.drive_key(key, block, rig, channel)
            kept.append(channel)
        else:
            item.shape_key_remove(block)
    if kept:
        key[parts.REAL] = kept
    del key[OPENED]
    block = meshes.live_block(item)
    if block is not None:
        block.mute = False
    if name in key.key_blocks:
        item.active_shape_key_index = key.key_blocks.find(name)
