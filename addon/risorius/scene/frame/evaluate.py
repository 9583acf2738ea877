# SPDX-License-Identifier: GPL-3.0-or-later
"""Controls -> pose -> scene. Every frame is a function of the controls at that frame alone.

Values are read from the evaluated objects of the depsgraph that is passed in (the originals
are stale while an animation renders) and written to the originals, in bulk.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ..base import parts, written
from ..base.blender_types import ArmatureObject, Context, Depsgraph, MeshObject
from ..character import lods, meshes, rig_placement, runtime
from . import bone_writer, channel_preview, inputs, timing

_pauses: list[bool] = []


@contextmanager
def paused() -> Iterator[None]:
    """While this lasts no frame and no update brings a face up: what is read is read by others."""
    _pauses.append(True)
    try:
        yield
    finally:
        _pauses.pop()


def is_paused() -> bool:
    return bool(_pauses)


def evaluate_all(depsgraph: Depsgraph, force: bool = False) -> None:
    """Bring every character of this file up to its controls.

    Args:
        depsgraph: the evaluated dependency graph to read from.
        force: write also what seems unchanged.
    """
    if native.problem() or is_paused():
        return
    for rig in parts.rigs():
        evaluate(rig, depsgraph, force)


def evaluate(rig: ArmatureObject, depsgraph: Depsgraph, force: bool = False) -> bool:
    """Bring one character up to its controls.

    Args:
        rig: its deforming armature, the original.
        depsgraph: the evaluated dependency graph to read from.
        force: write also what seems unchanged.

    Returns:
        Whether there was anything to write.
    """
    controls = None if parts.BAKED in rig else parts.controls_of(rig)  # baked: its actions move it
    live = runtime.of(rig) if controls is not None else None
    if controls is None or live is None:
        return False
    times = [perf_counter()]
    seen = controls.evaluated_get(depsgraph)
    if not seen.is_evaluated and not rig.evaluated_get(depsgraph).is_evaluated:
        return False  # it is not in this scene
    if parts.FACE not in seen.pose.bones:
        return False  # renamed a moment ago, and not evaluated since
    raw, turns = inputs.read_inputs(seen, live, depsgraph, parts.maximum_of(controls))
    rig_placement.follow(rig, seen)
    lod = min(max(lods.choose(rig, seen, depsgraph), 0), max(live.rig.lod_count - 1, 0))
    test = channel_preview.override(rig, raw, depsgraph.scene)
    state = (raw.tobytes(), lod, test, *((name, *turn) for name, turn in turns.items()))
    if not written.is_new(written.inputs, rig, state) and not force:
        return False
    times.append(perf_counter())
    pose = live.rig.evaluate(raw, lod)
    channel_preview.apply(test, pose.blend_shapes)
    times.append(perf_counter())
    taken = bone_writer.write(rig, live, pose.joints, turns, depsgraph)
    written.note_refusal(rig, taken)
    if not taken:
        return False  # channels and maps shall not move without the bones
    _write_values(rig, pose)
    times.append(perf_counter())
    for item in parts.meshes_of(rig):
        if lod in list(item.get(parts.LODS, [lod])):
            _write_shape(item, live, pose.blend_shapes, force)
    rig.update_tag(refresh={"OBJECT"})
    times.append(perf_counter())
    timing.add(times)
    return True


def bring_up(context: Context, rig: ArmatureObject) -> None:
    """Show a change that an operator made: bring one character up and evaluate the scene.

    Args:
        context: its view layer is evaluated, before and after.
        rig: deforming armature of the character.
    """
    context.view_layer.update()
    evaluate(rig, context.evaluated_depsgraph_get(), force=True)
    context.view_layer.update()


def refused(rig: ArmatureObject) -> list[bpy.types.Object]:
    """Objects of a character, an override, that Blender lets nobody write to."""
    return [item for item in (rig, *parts.meshes_of(rig)) if written.is_refused(item)]


def _write_values(rig: ArmatureObject, pose: native.Pose) -> None:
    """Write channels and maps to the array properties that drivers read."""
    for name, values in ((parts.MAPS, pose.animated_maps), (parts.CHANNELS, pose.blend_shapes)):
        if len(values) and len(rig.get(name, ())) == len(values):
            rig[name][:] = values.tolist()


def _write_shape(
    item: MeshObject, live: runtime.Runtime, weights: NDArray[np.float32], force: bool
) -> None:
    """Write the sum of all channels to the live key of a mesh, where it has one."""
    key = item.data.shape_keys
    block = meshes.live_block(item)
    if key is None or block is None or item.mode == "EDIT":
        return
    index = item.get(parts.MESH, -1)
    if not 0 <= index < len(live.dna.meshes):
        return  # the data in the .blend is another file's
    morph = live.morph(index)
    if morph.vertex_count != len(block.points):
        return  # the user changed the topology
    if parts.REAL in key:
        weights = weights.copy()
        weights[list(key[parts.REAL])] = 0.0
    state = weights[morph.channel_indices].tobytes()
    if not written.is_new(written.weights, key, state) and not force:
        return
    basis = meshes.points_of(key.reference_key)
    points = morph.evaluate(weights, base=basis)
    block.points.foreach_set("co", points.ravel())
    if item.data.library or item.data.override_library:
        written.note_refusal(item, bone_writer.is_there(block.points, "co", points.ravel()))
    key.update_tag()
    item.data.update_tag()
