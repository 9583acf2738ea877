# SPDX-License-Identifier: GPL-3.0-or-later
"""Prepares a face's animation for export: a baked copy for Blender's exporters, or a clip.

The copy is in a temporary scene while an exporter runs. The character, its scene and the current
frame do not change.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import cast

import bpy
import numpy as np
from mathutils import Quaternion
from numpy.typing import NDArray

from ... import native
from ...logic.animation import clip_units, key_reduction
from ...logic.base.names import unique_labels, without_lod
from ...logic.base.sentences import told
from ..animation import actions
from ..bake import bake_face, baked_shape_keys, baked_tracks, sampling
from ..base import compat, last_written, parts
from ..base.blender_types import ArmatureObject, Context, MeshObject, Override
from ..character import meshes, runtime
from ..frame import evaluate
from ..lod import lods
from .lent_names import Loans


@dataclass(frozen=True)
class ShipOptions:
    """Options of an export.

    Attributes:
        start, end, step: range and step in frames.
        lod: level of detail; -1: the level in the viewport.
        wanted: animation to export, from "BONES", "SHAPES".
        all_shapes: True: also export shape keys that are 0 at all exported frames.
        lod_groups: also export the coarser built levels, in LOD groups of FBX.
    """

    start: float = 1
    end: float = 250
    step: float = 1
    lod: int = -1
    wanted: frozenset[str] = frozenset(("BONES", "SHAPES"))
    all_shapes: bool = False
    lod_groups: bool = False


def sampled(
    context: Context, rigs: Sequence[ArmatureObject], options: ShipOptions
) -> Generator[float, None, list[tuple[ArmatureObject, int, sampling.Samples]]]:
    """Sample characters for an export; a generator that yields progress and can be cancelled.

    Args:
        context: scene and view layer to sample.
        rigs: deforming armatures of the characters.
        options: range of frames, step and level of detail.

    Yields:
        The progress, 0 to 1.

    Returns:
        (rig, level of detail, Samples) of each character.

    Raises:
        BakeError: a character is baked, so that its controls do not give its animation, or the
            level was not built.
        ValueError: the range ends before it starts, or the step is not above 0.
    """
    for rig in rigs:
        if bake_face.baked(rig) == bake_face.RESULT:
            raise bake_face.BakeError(
                told("{face} is baked: choose Back to Live first.", face=rig.name)
            )
    frames = key_reduction.frame_list(options.start, options.end, options.step)
    levels = [bake_face.level_of(rig, options.lod) for rig in rigs]
    keys = [k for rig, n in zip(rigs, levels, strict=True) for k in bake_face.animated_keys(rig, n)]
    found = yield from sampling.sample(context, rigs, frames, keys)
    return list(zip(rigs, levels, found, strict=True))


@contextmanager
def copies(
    context: Context,
    characters: Sequence[tuple[ArmatureObject, int, sampling.Samples]],
    options: ShipOptions,
) -> Iterator[tuple[Override, Loans]]:
    """Context manager: baked copies of characters, alone in a temporary visible scene.

    Args:
        context: with the window whose scene is replaced.
        characters: from `sampled`.
        options: options of the export.

    Yields:
        The context override for an exporter, as a dict, and the Loans of names: the copies have the
        names for the file, and the originals temporarily have other names.
    """
    window, user = context.window, context.scene
    before, loans = _everything(), Loans()
    shown = cast(bpy.types.Scene, window.scene) if window is not None else None
    with evaluate.paused():
        try:
            stage = _stage(user, characters[0][2].frames)
            # Some formats name the animation (the take) after the scene.
            loans.take("scenes", stage, _name(characters[0][0]))
            for rig, level, samples in characters:
                _copy(stage, rig, level, samples, options, loans)
            layer = stage.view_layers[0]
            if window is not None:
                window.scene = stage
            stage.frame_set(stage.frame_start)
            layer.objects.active = layer.objects[0]
            yield {"scene": stage, "view_layer": layer}, loans
        finally:
            if window is not None and shown is not None:
                window.scene = shown
            _remove_all_but(before)
            loans.give_back()
            last_written.forget()


def _stage(user: bpy.types.Scene, frames: NDArray[np.float64]) -> bpy.types.Scene:
    stage = bpy.data.scenes.new("Risorius Export")
    for name in ("fps", "fps_base"):
        setattr(stage.render, name, getattr(user.render, name))
    for name in ("system", "scale_length", "length_unit"):
        setattr(stage.unit_settings, name, getattr(user.unit_settings, name))
    stage.frame_start = int(np.floor(frames[0]))
    stage.frame_end = int(np.ceil(frames[-1]))
    return stage


def _name(rig: ArmatureObject) -> str:
    """The name of a character in an exported file."""
    return rig.name.removesuffix("_rig")


def _copy(
    stage: bpy.types.Scene,
    rig: ArmatureObject,
    level: int,
    samples: sampling.Samples,
    options: ShipOptions,
    loans: Loans,
) -> None:
    """Copy one character: armature, meshes of the exported levels, and their baked actions.

    Args:
        stage: the temporary scene.
        rig: deforming armature of the character.
        level: level of detail.
        samples: inputs of the face.
        options: options of the export.
        loans: names for the copies.
    """
    live = runtime.there(rig)
    pose = baked_tracks.evaluate(live, samples, level)
    copy = rig.copy()
    copy.animation_data_clear()
    loans.take("objects", copy, _name(rig))
    stage.collection.objects.link(copy)
    _show(copy)
    if "BONES" in options.wanted:
        tracks = baked_tracks.rig_tracks(rig, live, samples, pose, {"BONES"}, copy)
        _play(copy, samples.frames, tracks)
    groups: dict[str, bpy.types.Object] = {}
    copied: set[MeshObject] = set()
    for own in _levels(rig, level, options):
        shapes = (pose if own == level else baked_tracks.evaluate(live, samples, own)).blend_shapes
        weights = shapes if "SHAPES" in options.wanted else shapes * 0.0
        for item in bake_face.shown(rig, own):
            if item in copied:
                continue
            copied.add(item)
            made = _copy_mesh(stage, item, copy, live, loans)
            _shapes(made, item, live, samples, weights, options)
            _forget(made)
            if options.lod_groups:
                base = without_lod(made.name)
                if base not in groups:
                    groups[base] = _lod_group(stage, copy, base, loans)
                made.parent = groups[base]
    _forget(copy)


def _levels(rig: ArmatureObject, level: int, options: ShipOptions) -> list[int]:
    """The exported levels of detail: the given level, and if lod_groups is set, coarser levels.

    Only levels whose meshes were built are exported.
    """
    coarser = [other for other in lods.built(rig) if other > level] if options.lod_groups else []
    return [level, *sorted(coarser)]


def _lod_group(
    stage: bpy.types.Scene, rig_copy: ArmatureObject, base: str, loans: Loans
) -> bpy.types.Object:
    """An empty that Blender exports as a LOD group of FBX. Its children must be added from the
    finest to the coarsest level."""
    group = bpy.data.objects.new(base, None)
    loans.take("objects", group, f"{base}_LODGroup")
    group["fbx_type"] = "LodGroup"  # Blender's FBX exporter reads this property
    group.parent = rig_copy
    stage.collection.objects.link(group)
    return group


def _copy_mesh(
    stage: bpy.types.Scene,
    item: MeshObject,
    rig_copy: ArmatureObject,
    live: runtime.Runtime,
    loans: Loans,
) -> MeshObject:
    made = item.copy()
    made.data = item.data.copy()
    made.animation_data_clear()
    known, number = live.dna.mesh_names, int(item[parts.MESH])
    name = known[number] if number < len(known) else item.name
    loans.take("objects", made, name)
    loans.take("meshes", made.data, name)
    made.parent = rig_copy
    for modifier in made.modifiers:
        if modifier.type == "ARMATURE":
            cast("bpy.types.ArmatureModifier", modifier).object = rig_copy
            if parts.FINISHED in item:
                modifier.show_viewport = modifier.show_render = True
    stage.collection.objects.link(made)
    _show(made)
    return made


def _shapes(
    made: MeshObject,
    item: MeshObject,
    live: runtime.Runtime,
    samples: sampling.Samples,
    weights: NDArray[np.float32],
    options: ShipOptions,
) -> None:
    """Give a copied mesh a shape key with baked animation for each exported blend shape channel.

    Other shape keys that Risorius made are removed from the copy.

    Args:
        made: the copied mesh object.
        item: the original mesh object.
        live: Runtime of the character.
        samples: inputs of the face.
        weights: float32[N, C], weights of the blend shape channels at N frames.
        options: options of the export.
    """
    key = made.data.shape_keys
    if key is None:
        return
    used = set(np.flatnonzero(weights.any(axis=0)).tolist())
    wanted = set(range(weights.shape[1])) if options.all_shapes else used
    names = baked_shape_keys.opened(made, live, wanted)
    key.animation_data_clear()
    live_block = meshes.live_block(made)
    if live_block is not None:
        made.shape_key_remove(live_block)
    for channel in set(names) - wanted:
        made.shape_key_remove(key.key_blocks[names.pop(channel)])
    if len(key.key_blocks) < 2:
        return  # a lone basis needs no animation; removing it would leave the Key in the file
    others = samples.others.get(parts.keys_there(item))
    _play(key, samples.frames, baked_tracks.key_tracks(key, names, weights, others))


def _play(
    owner: bpy.types.Object | bpy.types.Key,
    frames: NDArray[np.float64],
    tracks: Sequence[actions.Track],
) -> None:
    action, slot = actions.write(owner.name, owner, frames, tracks, 0.0, actions.Counts())
    compat.assign_action(owner.animation_data_create(), action, slot)


def _show(item: bpy.types.Object) -> None:
    item.hide_viewport = item.hide_render = item.hide_select = False
    item.lock_location = item.lock_rotation = item.lock_scale = (False, False, False)


def _forget(item: bpy.types.Object) -> None:
    """Remove the custom properties of Risorius from an object."""
    for name in list(item.keys()):
        if name.startswith(("risorius_", "dna_")) or name in (parts.MAPS, parts.CHANNELS):
            del item[name]


def _everything() -> dict[str, set[bpy.types.ID]]:
    """Name of a collection in bpy.data -> its datablocks, for all collections but shape_keys."""
    return {
        kind.identifier: set(getattr(bpy.data, kind.identifier))
        for kind in bpy.data.bl_rna.properties
        if kind.type == "COLLECTION" and kind.identifier not in ("all_ids", "shape_keys")
    }


def _remove_all_but(before: Mapping[str, set[bpy.types.ID]]) -> None:
    """Remove all datablocks that are not in `before`, even if a failed exporter left them."""
    new = [
        item
        for kind, there in before.items()
        for item in getattr(bpy.data, kind)
        if isinstance(item, bpy.types.ID) and item not in there
    ]
    if new:
        bpy.data.batch_remove(new)


def clip(
    rig: ArmatureObject,
    level: int,
    samples: sampling.Samples,
    rate: float,
    origin: float,
    maps: bool = False,
) -> native.Clip:
    """A clip with the raw controls and the rotations of neck and head in a range of frames.

    Args:
        rig: deforming armature.
        level: level of detail, for the maps.
        samples: inputs of the character from `sampled`.
        rate: frames per second of the scene.
        origin: frame of the scene at second 0 of the clip.
        maps: add the values of the animated maps, by their names in the DNA.

    Returns:
        A clip with names of the DNA file for controls and maps, and names such as "head.yaw". A
        control whose name occurred before in the file has Blender's name.
    """
    live, names = runtime.there(rig), []
    for label, name in zip(live.labels, live.dna.raw_control_names, strict=True):
        names.append(label if name in names else name)
    rows = samples.raw.T
    for bone in ("neck", "head"):
        if any(bone in turns for turns in samples.turns):
            names += clip_units.TURNS[bone]
            turned = np.array([turns.get(bone, Quaternion()) for turns in samples.turns])
            rows = np.concatenate([rows, clip_units.angles_of(turned).T])
    if maps:
        labels = unique_labels(live.dna.animated_map_names, names)
        names += labels
        rows = np.concatenate([rows, baked_tracks.evaluate(live, samples, level).animated_maps.T])
    frames = samples.frames
    step = float(frames[1] - frames[0]) if len(frames) > 1 else 1.0
    start = (float(frames[0]) - origin) / rate
    return native.module().Clip(
        names, rows, rate / step, start=start, metadata={"source": rig.name}
    )
