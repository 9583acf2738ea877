# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the animation of a face to actions, and restores the unbaked face.

There are two kinds of bakes. RESULT: only actions move the face. The evaluator skips it, so that no
property is driven twice and the face looks the same in a Blender without the add-on. CONTROLS: one
action moves the controls in place of their layers, NLA and drivers, and the evaluator still moves
the face. Armatures and shape keys store their earlier animation, which is restored when the bake is
removed.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...logic.animation import key_reduction
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..animation import actions
from ..base import last_written, parts, saved
from ..base.blender_types import Animated, ArmatureObject, Context, MeshObject
from ..character import runtime, values
from ..frame import channel_preview, controls_ahead, evaluate
from ..lod import lods
from ..skinning import ordinary
from . import baked_shape_keys, baked_tracks, sampling

RESULT, CONTROLS = "RESULT", "CONTROLS"
_CONSTRAINTS = "constraints"


class BakeError(FaceError, RuntimeError):
    """A face cannot be baked; the text gives the reason in one sentence."""


@dataclass(frozen=True)
class BakeOptions:
    """Options of a bake.

    Attributes:
        kind: RESULT: bake bones, shape keys and animated maps; CONTROLS: bake sliders and control
            bones.
        start, end, step: range and step in frames; the step may be a fraction.
        lod: level of detail of a RESULT; -1: the level in the viewport.
        wanted: parts of a RESULT to bake, from "BONES", "SHAPES", "MAPS"; the others get no
            animation.
        error: largest difference of a value after the key reduction, in the units of the values;
            0: keep every key of a curve that moves.
        strip: True: add the actions as strips of new NLA tracks; False: make them active.
    """

    kind: str = RESULT
    start: float = 1
    end: float = 250
    step: float = 1
    lod: int = -1
    wanted: frozenset[str] = frozenset(("BONES", "SHAPES", "MAPS"))
    error: float = 0.0
    strip: bool = False


def baked(rig: ArmatureObject) -> str:
    """The kind of bake of a character: RESULT, CONTROLS, or "" if it is not baked."""
    if parts.BAKED in rig:
        return RESULT
    controls = parts.controls_of(rig)
    return CONTROLS if controls is not None and parts.BAKED in controls else ""


def words(rig: ArmatureObject) -> str:
    """The sentence with which the panel describes a baked character; "" if it is not baked."""
    kind = baked(rig)
    if not kind:
        return ""
    state = _kept(rig if kind == RESULT else parts.controls_there(rig))
    what = told("Baked face: it plays its actions")
    if kind == CONTROLS:
        what = told("The controls are baked; layers, NLA and drivers rest")
    return told(
        "{what}, frames {start:g} to {end:g}.",
        what=what,
        start=saved.number(state, "start", 0.0),
        end=saved.number(state, "end", 0.0),
    )


def _kept(owner: ArmatureObject) -> Mapping[str, object]:
    """The frame range and settings that a bake stored on an armature; empty if they are damaged."""
    return saved.table(owner, parts.BAKED) or {}


def refusal(rig: ArmatureObject, kind: str) -> str:
    """The reason why a character cannot be baked now, in one sentence; empty if it can.

    Args:
        rig: the deforming armature.
        kind: kind of bake: CONTROLS or RESULT.
    """
    if baked(rig) in (RESULT, kind):
        return f"{rig.name} is baked already: choose Back to Live first."
    controls = parts.controls_there(rig)
    owners = [controls]
    if kind == RESULT:
        if rig.override_library:
            return f"{rig.name} is linked: bake its controls, or the face in its own file."
        items = parts.meshes_of(rig)
        if any(item.mode == "EDIT" for item in (rig, *items)):
            return f"{rig.name}: leave edit mode first."
        linked = next((i for i in items if i.data.library or i.data.override_library), None)
        if linked is not None:
            return f"{linked.name} has a linked mesh: bake the face in its own file."
        owners = [rig, *(i.data.shape_keys for i in items if i.data.shape_keys)]
    return next(filter(None, map(actions.busy, owners)), "")


def bake(
    context: Context, rigs: Sequence[ArmatureObject], options: BakeOptions
) -> Generator[float, None, list[str]]:
    """Bake characters; a generator that yields progress and can be cancelled without damage.

    Args:
        context: scene and view layer.
        rigs: deforming armatures.
        options: range, kind and parts of the bake.

    Yields:
        The progress, 0 to 1. Until the last value, only previews of channels are ended; the
            characters do not change otherwise.

    Returns:
        Sentences for a report, one for each character.

    Raises:
        BakeError: a character cannot be baked; none was baked.
        ValueError: the range ends before it starts, or the step is not above 0.
    """
    for rig in rigs:
        trouble = refusal(rig, options.kind) or controls_ahead.examine(
            context.scene, rig, parts.controls_there(rig)
        )
        if trouble:
            raise BakeError(trouble)
        channel_preview.clear(rig)
    frames = key_reduction.frame_list(options.start, options.end, options.step)
    levels = {rig: level_of(rig, options.lod) for rig in rigs}
    keys = []
    if options.kind == RESULT:
        keys = [k for rig in rigs for k in animated_keys(rig, levels[rig])]
    sampled = yield from sampling.sample(context, rigs, frames, keys)
    write = _write_result if options.kind == RESULT else _write_controls
    with evaluate.paused():
        try:
            done = [write(r, s, levels[r], options) for r, s in zip(rigs, sampled, strict=True)]
        except Exception:
            for rig in rigs:
                _take_back(rig, options.kind)
            raise
    last_written.forget()
    for rig in rigs:
        evaluate.bring_up(context, rig)
    return done


def level_of(rig: ArmatureObject, lod: int) -> int:
    """The level of detail that is baked.

    Args:
        rig: deforming armature of the character.
        lod: the wanted level; negative for the level in the viewport.

    Returns:
        The level, at most the coarsest level of the DNA file.

    Raises:
        BakeError: the meshes of this level were not built.
    """
    level = lods.viewport_level(rig) if lod < 0 else lod
    there = lods.built(rig)
    if there and level not in there:
        raise BakeError(told("Level {level} was not built for {face}.", level=level, face=rig.name))
    return min(level, max(runtime.there(rig).rig.lod_count - 1, 0))


def shown(rig: ArmatureObject, level: int) -> list[MeshObject]:
    """The meshes that a level of detail shows.

    Args:
        rig: deforming armature of the character.
        level: level of detail; 0 is the finest.
    """
    return [m for m in parts.meshes_of(rig) if lods.shows(m, level)]


def animated_keys(rig: ArmatureObject, level: int) -> list[tuple[MeshObject, list[str]]]:
    """The shape keys that the user's own actions move.

    Args:
        rig: deforming armature of the character.
        level: level of detail; only its meshes count.

    Returns:
        (mesh, data paths of the animated keys) of each mesh with such keys.
    """
    found = []
    for item in shown(rig, level):
        key = item.data.shape_keys
        paths = sampling.animated_paths(key, drivers=False) if key else []
        if paths:
            found.append((item, paths))
    return found


def _write_result(
    rig: ArmatureObject, samples: sampling.Samples, level: int, options: BakeOptions
) -> str:
    live, counts = runtime.there(rig), actions.Counts()
    ordinary.leave(rig)
    values.point_materials(rig, rig)
    pose = baked_tracks.evaluate(live, samples, level)
    name = rig.name.removesuffix("_rig")
    state = {
        "start": float(samples.frames[0]),
        "end": float(samples.frames[-1]),
        "levels": [saved.whole(rig, k, -1) for k in (parts.LOD, parts.LOD_RENDER)],
        "by_distance": int(lods.by_distance(rig)),
    }
    tracks = baked_tracks.rig_tracks(rig, live, samples, pose, options.wanted)
    _play(rig, f"{name}_baked", samples.times, tracks, options, counts)
    if "SHAPES" in options.wanted:
        for item in shown(rig, level):
            _write_keys(item, live, samples, pose.blend_shapes, options, counts)
    lods.follow_camera(rig, False)
    lods.show(rig, level, lods.SAME)
    rig[parts.BAKED] = state
    rig.update_tag(refresh={"OBJECT", "TIME"})
    return f"{name}: {len(samples.frames)} frames, {counts.sentence()}"


def _write_keys(
    item: MeshObject,
    live: runtime.Runtime,
    samples: sampling.Samples,
    weights: NDArray[np.float32],
    options: BakeOptions,
    counts: actions.Counts,
) -> None:
    key = item.data.shape_keys
    if key is None:
        return
    used = np.flatnonzero(weights.any(axis=0)).tolist()
    names = baked_shape_keys.opened(item, live, used)
    tracks = baked_tracks.key_tracks(key, names, weights, samples.others.get(key))
    if tracks:
        _play(key, f"{item.name}_baked", samples.times, tracks, options, counts)


def _play(
    owner: Animated,
    name: str,
    frames: NDArray[np.float64],
    tracks: Sequence[actions.Track],
    options: BakeOptions,
    counts: actions.Counts,
) -> None:
    action, slot = actions.write(name, owner, frames, tracks, options.error, counts)
    actions.play(owner, action, slot, {t.path for t in tracks}, options.strip)


def _write_controls(
    rig: ArmatureObject, samples: sampling.Samples, _level: int, options: BakeOptions
) -> str:
    controls, counts = parts.controls_there(rig), actions.Counts()
    tracks = baked_tracks.control_tracks(controls, runtime.there(rig), samples)
    name = rig.name.removesuffix("_rig")
    _play(controls, f"{name}_controls_baked", samples.times, tracks, options, counts)
    actions.note_values(controls, [t.path for t in tracks])
    held = []
    for bone_name in samples.basis:
        for constraint in controls.pose.bones[bone_name].constraints:
            if not constraint.mute:
                constraint.mute = True
                held.append(f"{bone_name}\n{constraint.name}")
    controls[parts.BAKED] = {
        "start": float(samples.frames[0]),
        "end": float(samples.frames[-1]),
        _CONSTRAINTS: held,
    }
    controls.update_tag(refresh={"OBJECT", "TIME"})
    return f"{name}: controls, {len(samples.frames)} frames, {counts.sentence()}"


def unbake(context: Context, rig: ArmatureObject) -> bool:
    """Restore the animation that a character had before its bake.

    Args:
        context: scene and view layer.
        rig: the deforming armature.

    Returns:
        Whether the character was baked.
    """
    kind = baked(rig)
    if not kind:
        return False
    if kind == CONTROLS:
        _restore_controls(parts.controls_there(rig))
    else:
        _restore_result(rig)
    last_written.forget()
    context.view_layer.update()
    evaluate.bring_up(context, rig)
    return True


def _take_back(rig: ArmatureObject, kind: str) -> None:
    """Restore a character after a failed bake, even if only a part of its actions was written."""
    controls = parts.controls_there(rig)
    if kind == CONTROLS and parts.BAKED in controls:
        _restore_controls(controls)
    elif kind == CONTROLS:
        actions.restore(controls)
    elif parts.BAKED in rig:
        _restore_result(rig)
    else:
        _restore_animation(rig)


def _restore_animation(rig: ArmatureObject) -> None:
    values.point_materials(rig, parts.carrier_of(rig))
    actions.restore(rig)
    for item in parts.meshes_of(rig):
        if item.data.shape_keys is not None:
            actions.restore(item.data.shape_keys)
            baked_shape_keys.close(item, rig, runtime.there(rig))


def _restore_result(rig: ArmatureObject) -> None:
    state = _kept(rig)
    _restore_animation(rig)
    levels = saved.wholes(state, "levels", lods.SAME, 255)
    viewport, render = levels if len(levels) == 2 else (0, lods.SAME)
    del rig[parts.BAKED]
    lods.follow_camera(rig, bool(saved.whole(state, "by_distance", 0)))
    lods.show(rig, max(viewport, 0), render)
    rig.update_tag(refresh={"OBJECT", "TIME"})


def _restore_controls(controls: ArmatureObject) -> None:
    state = _kept(controls)
    actions.restore(controls)
    for line in saved.texts(state, _CONSTRAINTS):
        bone_name, _end, name = line.partition("\n")
        bone = controls.pose.bones.get(bone_name)
        constraint = bone.constraints.get(name) if bone is not None else None
        if constraint is not None:
            constraint.mute = False
    del controls[parts.BAKED]
    controls.update_tag(refresh={"OBJECT", "TIME"})
