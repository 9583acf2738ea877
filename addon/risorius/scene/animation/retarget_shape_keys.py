# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the shape-key animation of another rig as a clip, which is then mapped to a face."""

from __future__ import annotations

from typing import cast

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ...logic.animation.clip_units import ClipError
from ...logic.base.sentences import told
from ..base import parts
from ..base.blender_types import Context, MeshObject
from . import clip_actions


def sources(context: Context) -> list[MeshObject]:
    """Mesh objects of the scene that have animated shape keys and belong to no face."""
    items = [item for item in context.scene.objects if item.type == "MESH"]
    meshes = cast(list[MeshObject], items)
    return [item for item in meshes if parts.rig_of(item) is None and _moves(item)]


def source_of(context: Context) -> MeshObject | None:
    """The mesh to read: a selected object from `sources`, or the only one that `sources` finds.

    None if there is neither.
    """
    there = sources(context)
    selected = cast(list[MeshObject], context.selected_objects)
    chosen = [item for item in selected if item in there]
    if chosen:
        return chosen[0]
    return there[0] if len(there) == 1 else None


def _moves(item: MeshObject) -> bool:
    keys = item.data.shape_keys
    data = keys.animation_data if keys is not None else None
    if data is None:
        return False
    return bool(data.action or len(data.drivers) or any(len(t.strips) for t in data.nla_tracks))


def clip_of(
    context: Context,
    item: MeshObject,
    first: float | None = None,
    last: float | None = None,
) -> native.Clip:
    """The animation of an object's shape keys as a clip.

    A single action is read directly. NLA strips and drivers are evaluated frame by frame.

    Args:
        context: scene and view layer.
        item: a mesh object.
        first, last: first and last frame to read; None: the first or last frame of the shape
            keys' action, or of the scene if there are NLA strips or drivers.

    Returns:
        A clip with one curve for each shape key that moves or is not 0; frame 0 is second 0.

    Raises:
        ClipError: all shape keys are 0 at all frames.
    """
    keys = parts.keys_there(item)
    data = keys.animation_data
    assert data is not None
    stacked = len(data.drivers) or any(len(t.strips) for t in data.nla_tracks)
    span = (context.scene.frame_start, context.scene.frame_end)
    if data.action is not None and not stacked:
        span = data.action.frame_range[:]
    begin = span[0] if first is None else first
    end = span[1] if last is None else last
    frames = np.arange(np.floor(begin), np.floor(end) + 1.0)
    table = _stepped(context, keys, frames) if stacked else _read(keys, frames)
    moving = {n: v for n, v in table.items() if (v != v[0]).any() or v[0]}
    if not moving:
        raise ClipError(
            told(
                "no shape key of {name} moves from frame {begin:g} to {end:g}",
                name=item.name,
                begin=begin,
                end=end,
            )
        )
    rate = clip_actions.frame_rate(context.scene)
    return native.module().Clip(
        list(moving),
        np.array(list(moving.values()), np.float32),
        rate,
        start=float(frames[0]) / rate,
        metadata={"source": item.name},
    )


def _blocks(keys: bpy.types.Key) -> list[bpy.types.ShapeKey]:
    return [b for b in keys.key_blocks if b != keys.reference_key]


def _read(keys: bpy.types.Key, frames: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    data = keys.animation_data
    assert data is not None
    assert data.action is not None
    curves = {c.data_path: c for c in clip_actions.playing_curves(data.action, keys)}
    table = {}
    for block in _blocks(keys):
        path = f'key_blocks["{bpy.utils.escape_identifier(block.name)}"].value'
        curve = curves.get(path)
        table[block.name] = (
            np.full(len(frames), block.value)
            if curve is None
            else clip_actions.sampled(curve, frames)
        )
    return table


def _stepped(
    context: Context, keys: bpy.types.Key, frames: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    scene = context.scene
    before = scene.frame_current, scene.frame_subframe
    rows = []
    try:
        for frame in frames:
            scene.frame_set(int(frame))
            seen = keys.evaluated_get(context.evaluated_depsgraph_get())
            rows.append([seen.key_blocks[b.name].value for b in _blocks(keys)])
    finally:
        scene.frame_set(before[0], subframe=before[1])
    columns = np.array(rows).reshape(len(frames), -1).T
    return {b.name: column for b, column in zip(_blocks(keys), columns, strict=True)}
