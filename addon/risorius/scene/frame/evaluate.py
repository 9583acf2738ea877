# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluates faces: reads controls, computes the pose, and writes it to the scene.

The result of a frame depends only on the controls at that frame. Values are read from evaluated
objects, because the originals are outdated while an animation renders, and written to the
originals.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum, auto
from time import perf_counter
from typing import cast

import bpy
import numpy as np

from ... import native
from ..animation import layers
from ..base import drivers, last_written, parts, session
from ..base.blender_types import ArmatureObject, Context, Depsgraph
from ..character import rig_placement, runtime, values
from ..lod import lods
from ..skinning import bone_writer, conditions, direct, live_keys
from . import channel_preview, controls_ahead, inputs, joint_readings, lateness, look_masks, timing

_pauses = session.value("evaluate.pauses", 0, ("unregister",))
# Session uid of a deforming armature -> work done for it before Blender evaluates this frame.
_ahead: dict[int, _Ahead] = session.table("evaluate.ahead", ("frame",))
# Final vertex positions of several faces, to be written together at the end of `together`; None:
# outside `together`, so write positions immediately.
_gathered = session.value(
    "evaluate.gathered", cast("list[direct.Job] | None", None), ("unregister",)
)
# Session uid of a deforming armature -> inputs of its face when the file was opened.
_opened: dict[int, tuple[object, ...]] = session.table("evaluate.opened", ("load",))


class Moment(Enum):
    """The moment of an update of a character.

    Attributes:
        UPDATE: after Blender evaluated the inputs.
        ANEW: like UPDATE, but unchanged values are written too.
        FRAME: before Blender evaluates a frame.
        RENDER: before Blender evaluates a rendered frame.
        LOAD: after opening a file; faces keep their saved state until they move.
    """

    UPDATE = auto()
    ANEW = auto()
    FRAME = auto()
    RENDER = auto()
    LOAD = auto()


_BEFORE_FRAME = frozenset((Moment.FRAME, Moment.RENDER))


@dataclass(frozen=True)
class _Ahead:
    """The work done for a character before its frame.

    Attributes:
        glance: sliders, bones and settings of the evaluated control armature; None if other inputs
            move the face too.
        wrote: whether anything was written.
        rendering: whether the frame is rendered.
    """

    glance: tuple[object, ...] | None
    wrote: bool
    rendering: bool


@contextmanager
def paused() -> Iterator[None]:
    """Context manager: frames and updates do not evaluate faces."""
    _pauses.now += 1
    try:
        yield
    finally:
        _pauses.now = max(0, _pauses.now - 1)  # disabling the add-on resets the count


def is_paused() -> bool:
    return _pauses.now > 0


def evaluate_all(depsgraph: Depsgraph, moment: Moment = Moment.UPDATE) -> None:
    """Evaluate all characters of this file and write their poses; does nothing while `paused`.

    Args:
        depsgraph: the evaluated dependency graph to read from.
        moment: the moment of the update.
    """
    if native.problem() or is_paused():
        return
    with together():
        for rig in parts.rigs():
            evaluate(rig, depsgraph, moment)


def before_frame(scene: bpy.types.Scene, rendering: bool) -> None:
    """Evaluate the characters of a scene before Blender evaluates the frame.

    Args:
        scene: the scene, with its new frame set.
        rendering: whether the frame is rendered.
    """
    if native.problem() or is_paused():
        return
    # If joint rotations are read from bones with constraints, these constraints must see the neck
    # and head of this frame, so the face is evaluated before the frame.
    read = _look_at_joints(controls_ahead.is_edited())
    if not controls_ahead.is_needed() and not read:
        return
    found = [(rig, parts.controls_of(rig)) for rig in parts.rigs() if parts.BAKED not in rig]
    members = set(scene.objects)  # read once; users_scene would search all scenes for each face
    faces = [(r, c) for r, c in found if c in members]
    if not faces or not controls_ahead.is_safe(scene):
        return
    depsgraph, faces = controls_ahead.at(scene, faces)
    timing.animated()
    if depsgraph is None:
        return
    with together():
        for rig, controls in faces:
            seen = controls.evaluated_get(depsgraph)
            glance = _glance(seen) if _is_simple(rig, seen) else None
            wrote = evaluate(rig, depsgraph, Moment.RENDER if rendering else Moment.FRAME)
            _ahead[rig.session_uid] = _Ahead(glance, wrote, rendering)


def _look_at_joints(edited: bool) -> bool:
    """Update the Reading (sources of joint rotations) of all faces once per frame.

    Args:
        edited: whether the file may have been edited since the last frame.

    Returns:
        Whether a joint rotation of any face is read from its bone.
    """
    found = False
    for rig in parts.rigs():
        live = runtime.of(rig) if parts.BAKED not in rig else None
        if live is not None:
            reading = joint_readings.look(rig, live, edited)
            found |= bool(reading.places)
            if drivers.moves(rig) or any(reading.wiring):
                conditions.note_moved(rig)
    return found


def after_frame(depsgraph: Depsgraph) -> None:
    """Evaluate the faces that were not evaluated, or got a wrong pose, before the frame.

    Faces whose pose changes by this second evaluation are counted as late.

    Args:
        depsgraph: the evaluated graph.
    """
    if native.problem() or is_paused():
        return
    with together():
        for rig in parts.rigs():
            done = _ahead.pop(rig.session_uid, None)
            again = done is not None and done.wrote and drivers.moves(rig)
            if done is not None and not again and _is_as_before(rig, done, depsgraph):
                continue
            was = last_written.inputs.get(rig.session_uid)
            if again:
                # Write the pose again, because animation of the rig's bones has overwritten it.
                last_written.inputs.pop(rig.session_uid, None)
            if evaluate(rig, depsgraph) and (done is not None or lateness.circle(rig)):
                now = last_written.inputs.get(rig.session_uid)
                lateness.count(rig, was, now, runtime.there(rig).labels)
    live_keys.reach(depsgraph)


def _glance(seen: ArmatureObject) -> tuple[object, ...]:
    """Values of the control armature to compare: sliders, bone matrices, position and settings.

    If only the control armature moves a character, these are all inputs of the character.

    Args:
        seen: the evaluated control armature.
    """
    bones = seen.pose.bones
    matrices = np.empty(16 * len(bones), np.float32)
    bones.foreach_get("matrix", matrices)
    place = np.array(seen.matrix_world).tobytes()
    follow = seen.risorius_converge, seen.risorius_lids, seen.risorius_body_turn
    shown = (*follow, seen.risorius_neck_poses)
    return tuple(bones[parts.FACE].values()), matrices.tobytes(), place, shown


def _is_simple(rig: ArmatureObject, seen: ArmatureObject) -> bool:
    """Whether only the control armature moves a character, without layers, body or other inputs.

    Args:
        rig: the deforming armature.
        seen: the evaluated control armature.
    """
    more = lods.by_distance(rig) or parts.TEST in rig or layers.has_any(seen.original)
    more = more or joint_readings.reads(rig)
    return not more and not rig_placement.body_of(seen.original) and parts.FACE in seen.pose.bones


def _is_as_before(rig: ArmatureObject, done: _Ahead, depsgraph: Depsgraph) -> bool:
    """Whether a character's controls are equal before and after the evaluation of the frame.

    False also if other inputs move the face, or if only one of both evaluations is for a render.

    Args:
        rig: deforming armature.
        done: the work done before the frame.
        depsgraph: graph after the evaluation of the frame.
    """
    controls = parts.controls_of(rig)
    if done.glance is None or controls is None:
        return False
    if done.rendering != (depsgraph.mode == "RENDER"):
        return False
    seen = controls.evaluated_get(depsgraph)
    return parts.FACE in seen.pose.bones and done.glance == _glance(seen)


def evaluate(rig: ArmatureObject, depsgraph: Depsgraph, moment: Moment = Moment.UPDATE) -> bool:
    """Evaluate one character and write its pose.

    Args:
        rig: the original (not evaluated) deforming armature.
        depsgraph: the evaluated dependency graph to read from; before a frame it contains only the
            controls.
        moment: the moment of the update.

    Returns:
        Whether the pose was written; False if its inputs are unchanged and the moment is not ANEW,
        if Blender refused the bones, or if the character cannot be evaluated: it is baked, has no
        controls or Runtime, is not in this scene, or lacks the bone with the sliders.
    """
    times = [perf_counter()]
    controls = None if parts.BAKED in rig else parts.controls_of(rig)  # baked: its actions move it
    live = runtime.of(rig) if controls is not None else None
    if controls is None or live is None:
        return False
    seen = controls.evaluated_get(depsgraph)
    if not seen.is_evaluated and not rig.evaluated_get(depsgraph).is_evaluated:
        return False  # the character is not in this scene
    if parts.FACE not in seen.pose.bones:
        return False  # the bone was renamed and the copy not evaluated since
    raw, turns = inputs.read_inputs(seen, live, depsgraph, parts.maximum_of(controls))
    rig_placement.follow(rig, seen)
    lod = min(max(_lod(rig, seen, depsgraph, moment), 0), max(live.rig.lod_count - 1, 0))
    test = channel_preview.override(rig, raw, depsgraph.scene)
    rendering = moment is Moment.RENDER or depsgraph.mode == "RENDER"
    look = look_masks.for_frame(rig, rendering)
    asked = (raw.tobytes(), lod, (test, look), *((name, *turn) for name, turn in turns.items()))
    plan = _plan(rig, live, asked, moment, rendering)
    changed = not rendering and direct.settle(rig, plan)
    state = (*asked, plan)
    anew = moment is Moment.ANEW or changed
    if not last_written.is_new(last_written.inputs, rig, state) and not anew:
        timing.looked(times[0])
        return False
    times.append(perf_counter())
    pose = live.rig.evaluate(look_masks.raw_of(look, raw, live), lod)
    look_masks.apply(look, pose, live, lod)
    channel_preview.apply(test, pose.blend_shapes)
    times.append(perf_counter())
    if plan.posed:
        keyed = joint_readings.of(rig, live).keyed
        taken = bone_writer.write(rig, live, pose.joints, turns, depsgraph, keyed)
        last_written.note_refusal(rig, taken)
        if not taken:
            return False  # channels and maps must not move without the bones
        rig.update_tag(refresh={"OBJECT"})
    values.write(rig, pose.animated_maps, pose.blend_shapes, live_keys.bears_simulation)
    times.append(perf_counter())
    shape = direct.Shape(pose.joints, pose.blend_shapes, turns)
    _write_meshes(rig, live, shape, plan, lod, anew, moment in _BEFORE_FRAME)
    times.append(perf_counter())
    timing.add(times)
    return True


def _write_meshes(
    rig: ArmatureObject,
    live: runtime.Runtime,
    shape: direct.Shape,
    plan: conditions.Plan,
    lod: int,
    anew: bool,
    ahead: bool,
) -> None:
    """Write the live keys of the meshes that a level of detail shows.

    Args:
        rig: deforming armature.
        live: Runtime of the character.
        shape: joint deltas, channel weights and rotations of the pose.
        plan: the Plan of the face, which names the meshes in Direct mode.
        lod: the level of detail.
        anew: write unchanged values too.
        ahead: whether Blender evaluates the frame only after this write.
    """
    finished = []
    for item in parts.meshes_of(rig):
        conditions.note_written(item)  # new maps of a material tag all meshes with this material
        if not lods.shows(item, lod):
            continue
        if item.session_uid in plan.direct:
            finished.append(item)
        else:
            live_keys.write(item, live, shape.weights, anew, ahead)
    if finished:
        _write_finished(direct.prepare(rig, live, shape, finished, anew))


def _write_finished(job: direct.Job) -> None:
    """Write final vertex positions of a face to its meshes.

    Inside the context manager `together` the positions are collected, and written at its end with
    the other faces on all cores.
    """
    if _gathered.now is None:
        direct.write([job])
    else:
        _gathered.now.append(job)


@contextmanager
def together() -> Iterator[None]:
    """Context manager: collect final vertex positions of faces, and write them all at the end."""
    if _gathered.now is not None:
        yield
        return
    _gathered.now = []
    try:
        yield
        jobs = _gathered.now
    finally:
        _gathered.now = None
    if jobs:
        begin = perf_counter()
        direct.write(jobs)
        timing.skinned(begin)


def _plan(
    rig: ArmatureObject,
    live: runtime.Runtime,
    asked: tuple[object, ...],
    moment: Moment,
    rendering: bool,
) -> conditions.Plan:
    """The Plan of a face: whether it is evaluated in Direct mode or by Blender's modifiers.

    Args:
        rig: deforming armature.
        live: Runtime of the character.
        asked: inputs of the face.
        moment: the moment of the update.
        rendering: whether the frame is rendered.
    """
    if rendering:  # a change of mode during a render would rebuild Blender's graph
        return conditions.known(rig) or conditions.ORDINARY
    if moment is Moment.LOAD:
        _opened[rig.session_uid] = asked
    # Read the skin weights of a face only when it moves, so that files open fast.
    if _opened.get(rig.session_uid) == asked and moment is not Moment.ANEW:
        return conditions.ORDINARY
    _opened.pop(rig.session_uid, None)
    return conditions.of(rig, live)


def _lod(rig: ArmatureObject, seen: ArmatureObject, depsgraph: Depsgraph, moment: Moment) -> int:
    """The level of detail to show.

    Args:
        rig: deforming armature.
        seen: the evaluated control armature.
        depsgraph: the evaluated dependency graph.
        moment: the moment of the update.
    """
    if moment not in _BEFORE_FRAME:
        return lods.choose(rig, seen, depsgraph)
    last = last_written.inputs.get(rig.session_uid)
    known = last[1] if isinstance(last, tuple) else None
    return lods.expected(rig, moment is Moment.RENDER, known)


def bring_up(context: Context, rig: ArmatureObject) -> None:
    """Show the change that an operator made: evaluate one character and the scene.

    Args:
        context: its view layer is evaluated before and after the character.
        rig: deforming armature of the character.
    """
    context.view_layer.update()
    evaluate(rig, context.evaluated_depsgraph_get(), Moment.ANEW)
    context.view_layer.update()
    # Blender 5.2 does not redraw views after an operator that leaves nothing to evaluate.
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def refused(rig: ArmatureObject) -> list[bpy.types.Object]:
    """Objects of a library override on which Blender ignored the last write."""
    return [item for item in (rig, *parts.meshes_of(rig)) if last_written.is_refused(item)]
