# SPDX-License-Identifier: GPL-3.0-or-later
"""Defines handlers that update characters at frames, edits, load, undo, save and render."""

from __future__ import annotations

import threading
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Any, cast

import bpy
from bpy.app.handlers import persistent

from ... import native
from ..animation import layer_mixing, layers, tweak_guard
from ..base import compat, console, last_written, parts, session, sharing
from ..base.blender_types import ArmatureObject, Depsgraph, current_context
from ..character import board, outlines, rig_placement, runtime, shown_keys
from ..frame import (
    channel_preview,
    controls_ahead,
    evaluate,
    joint_readings,
    lateness,
    look_masks,
    timing,
)
from ..lod import lods
from ..see_why import heat
from ..skinning import caches, conditions, ordinary, skins
from ..upkeep import applied_transforms, bone_edits, duplicates, migrations, repair


@dataclass
class _Work:
    """State of the handlers.

    Attributes:
        busy: whether an update is being handled.
        rendering: whether a render runs.
    """

    busy: bool = False
    rendering: bool = False


_work = session.keep("handlers.work", _Work, ("unregister",))
# Three sets of session uids. _objects: known objects of the file; empty after load and undo.
# _faces: known control armatures. _mended: deforming armatures repaired since the last update.
_objects = session.value("handlers.objects", frozenset[int](), ("undo", "load"))
_faces = session.value("handlers.faces", frozenset[int](), ("unregister",))
_mended: set[int] = session.keep("handlers.mended", set, ("load",))


@persistent
def _frame_changes(scene: bpy.types.Scene, *_arguments: object) -> None:
    session.end("frame")
    timing.begin()
    caches.look()
    if not _work.rendering and not native.problem():
        for controls in filter(None, map(parts.controls_of, parts.rigs())):
            tweak_guard.settle(controls)
        if controls_ahead.is_edited():
            conditions.look_at_tagged(scene)
    evaluate.before_frame(scene, _is_rendered())


@persistent
def _frame_changed(scene: bpy.types.Scene, depsgraph: Depsgraph | None = None) -> None:
    controls_ahead.note_evaluated(scene)
    if depsgraph is not None:
        timing.evaluated()
        evaluate.after_frame(depsgraph)
    conditions.forget_written()


def _is_rendered() -> bool:
    """Whether a render changed the frame.

    During a render job the interface may change the frame too, but only in the main thread.
    """
    if not _work.rendering or not bpy.app.is_job_running("RENDER"):
        return bool(_work.rendering)
    return threading.current_thread() is not threading.main_thread()


@persistent
def _render_begins(*_arguments: object) -> None:
    conditions.look_quickly()
    refresh(evaluate.Moment.ANEW)  # shape modes must not change during the render
    _work.rendering = True


@persistent
def _render_ended(*_arguments: object) -> None:
    """Update faces whose render differs from the viewport in level of detail, solo or mute."""
    _work.rendering = False
    for rig in parts.rigs():
        controls = parts.controls_of(rig)
        apart = lods.by_distance(rig) or lods.render_level(rig) != lods.viewport_level(rig)
        apart = apart or not look_masks.of(rig).is_whole
        if apart and controls is not None:
            last_written.forget()
            controls.update_tag()


@persistent
def _updated(scene: bpy.types.Scene, depsgraph: Depsgraph) -> None:
    """React to edits: evaluate the faces that an edit changes, and repair damaged faces.

    Only after a repair is the control armature tagged for an update, because a tag makes Blender
    call this function again.
    """
    controls_ahead.note_evaluated(scene)
    controls_ahead.note_edit()
    joint_readings.note_edit()
    board.note_edit()
    # During a render job only the handlers of its frames may write, not the handlers of edits.
    if _work.busy or bpy.app.is_job_running("RENDER") or native.problem():
        return
    if evaluate.is_paused():
        return
    _work.busy = True
    try:
        known = _objects.now
        _notice_copies(depsgraph.updates)
        # Blender reports a change of an image's colour space as an update, so only then are colour
        # spaces compared. It reports no change of pixels, so the other checks always run.
        console.say(*sharing.separate(spaces=depsgraph.id_type_updated("IMAGE")))
        skins.forget(conditions.note_updates(depsgraph) & known)
        waiting = set(_mended)
        _mended.clear()
        edited = _edited(depsgraph)
        edited += [
            rig
            for rig in parts.rigs()
            if rig not in edited and (rig.session_uid in waiting or conditions.stale(rig))
        ]
        if edited:
            timing.begin()
        with evaluate.together():
            for rig in edited:
                if _mend(rig):
                    continue  # the evaluated copy has the repair only after the next update
                evaluate.evaluate(rig, depsgraph)
    finally:
        conditions.end_updates(depsgraph)
        _work.busy = False


def _mend(rig: ArmatureObject) -> bool:
    done = repair.heal(rig)
    console.say(*done)
    if done:
        _note_mended(rig)
    return rig.session_uid in _mended


def _note_mended(rig: ArmatureObject) -> None:
    _mended.add(rig.session_uid)
    rig[parts.CONTROLS].update_tag()


def _notice_copies(updates: Iterable[bpy.types.DepsgraphUpdate]) -> None:
    # Compare the objects and not their number: one step may remove as many objects as it adds.
    known = _objects.now
    seen = (u.id.original for u in updates if isinstance(u.id, bpy.types.Object))
    new = any(item is not None and item.session_uid not in known for item in seen)
    come = bool(known)  # `known` is empty after load and undo: nothing is new
    if new or len(bpy.data.objects) != len(known):
        _objects.now = frozenset(item.session_uid for item in bpy.data.objects)
        runtime.forget_unused(parts.rigs())
        _tidy_new()
        layer_mixing.forget_unused(map(parts.controls_of, parts.rigs()))
        console.say(*migrations.bring_up_all())
        console.say(*duplicates.separate_all())
        for controls in filter(None, map(parts.controls_of, parts.rigs() if come else ())):
            if controls.session_uid not in known:
                shown_keys.show_some(controls)
        sharing.keep()
        lateness.forget()


@persistent
def _imported(*_arguments: object) -> None:
    """Called after Append and before its undo step, in Blender 4.3 and later."""
    if not native.problem():
        _tidy_new()


def _tidy_new() -> None:
    """Remove the bone outlines of newly appended faces from the collections of the scene.

    This is done only once, because the user may link outlines to a collection later.
    """
    there = {c.session_uid: c for c in map(parts.controls_of, parts.rigs()) if c is not None}
    for uid in there.keys() - _faces.now:
        outlines.tidy(there[uid])
    _faces.now = frozenset(there)


def _edited(depsgraph: Depsgraph) -> list[ArmatureObject]:
    """The characters to evaluate after an update; edits are also recorded for layers and tweaks.

    Of such a character, the control armature, the body (the armature to which the face is attached)
    or an action of a layer was updated; or the deforming armature was updated, and was moved or has
    joints that something reads; or the camera was updated, and chooses the level of detail.
    """
    armatures, actions, bones_edited, camera_moved = set(), set(), False, False
    camera = depsgraph.scene.camera
    found = (u.id.original for u in depsgraph.updates if u.id is not None)
    touched = {item for item in found if item is not None}
    for rig in applied_transforms.take_back(parts.rigs(), touched):
        console.say(str(applied_transforms.last_said(rig)))
        _note_mended(rig)
    for item in touched:
        if isinstance(item, bpy.types.Armature):
            bones_edited |= bone_edits.is_edited(item)
        elif isinstance(item, bpy.types.Action):
            actions.add(item)
        elif isinstance(item, bpy.types.Object):
            if item.type == "ARMATURE":
                armatures.add(item)
            camera_moved |= camera is not None and item == camera.original
    if bones_edited:
        last_written.forget()  # this also forgets the cached rest pose of the bones
        for rig in repair.heal_all():
            _note_mended(rig)
    layer_mixing.note_edits(actions)
    _note_keys(depsgraph.scene.frame_current_final, armatures, actions)
    return [rig for rig in parts.rigs() if _concerned(rig, armatures, actions, camera_moved)]


def _note_keys(
    frame: float, armatures: Collection[bpy.types.Object], actions: Collection[bpy.types.Action]
) -> None:
    """Handle new keys that Blender's operators may have inserted into the actions of faces.

    New slider keys are made visible in the animation editors. While a tweak is active, new keys are
    moved into it.

    Args:
        frame: current frame of the scene.
        armatures: edited armature objects.
        actions: edited actions.
    """
    for rig in parts.rigs():
        controls = parts.controls_of(rig)
        data = controls.animation_data if controls is not None else None
        action = data.action if data is not None else None
        if controls is not None and (
            action in actions or (action is None and controls in armatures)
        ):
            shown_keys.note_edit(controls)
        if controls is not None and (actions or controls in armatures):
            played = compat.played_actions(controls)
            tweak_guard.note_edit(controls, frame, any(item in actions for item in played))


def _concerned(
    rig: ArmatureObject,
    armatures: Collection[bpy.types.Object],
    actions: Collection[bpy.types.Action],
    camera_moved: bool,
) -> bool:
    controls = parts.controls_of(rig)
    hold = rig_placement.body_of(controls) if controls is not None else None
    return (
        controls in armatures
        or (rig in armatures and (rig_placement.has_strayed(rig) or joint_readings.reads(rig)))
        or (hold is not None and hold.target in armatures)
        or (camera_moved and lods.by_distance(rig))
        or (bool(actions) and controls is not None and layers.plays(controls, actions))
    )


@persistent
def _loaded(*_arguments: object) -> None:
    """After load: evaluate the faces, because Blender calls no update handler for a new file."""
    context = current_context()
    layer = context.view_layer
    session.end("load")
    if not native.problem():
        console.say(*migrations.bring_up_all())
    if layer is not None and not native.problem() and parts.rigs():
        layer.update()
        if context.scene is not None:
            controls_ahead.note_evaluated(context.scene)
        repair.heal_all()
        for controls in filter(None, map(parts.controls_of, parts.rigs())):
            shown_keys.show_some(controls)
        last_written.forget()
        look_masks.take_away()  # a file from auto-save may contain the setting
        heat.end_all()
        refresh(evaluate.Moment.LOAD)
    _restored()


@persistent
def _restored(*_arguments: object) -> None:
    """After load, undo and redo: forget the last written values, which may differ from the data.

    Pose bones must not be read here: until the next update, pose bones of restored objects point to
    freed bones, and Blender would crash.
    """
    session.end("undo")
    joint_readings.note_edit()
    heat.follow_undo()
    if native.problem():
        return
    there = [c for c in map(parts.controls_of, parts.rigs()) if c is not None]
    _faces.now = frozenset(controls.session_uid for controls in there)
    for controls in there:
        controls.update_tag()


@persistent
def _undone(*_arguments: object) -> None:
    conditions.note_restored()
    _restored()


@persistent
def _before_restoring(*_arguments: object) -> None:
    """Before load, undo and redo: release references to data that Blender frees."""
    session.end("free")


@persistent
def _before_save(*_arguments: object) -> None:
    if native.problem():
        return
    console.say(*duplicates.separate_all())
    console.say(*migrations.bring_up_all())  # retry migrations that waited for freed caches
    _end_tests()
    heat.take_away()
    if look_masks.take_away():
        refresh()
    repair.remove_dead()
    console.say(*sharing.share())
    layer = current_context().view_layer
    if layer is not None and ordinary.is_unknown(parts.rigs()):
        layer.update()
    if ordinary.is_unknown(parts.rigs()):
        refresh(evaluate.Moment.ANEW)
    ordinary.take_on(parts.rigs())


@persistent
def _saved(*_arguments: object) -> None:
    """After a save: restore Direct mode, solo, mute and heat maps, which files do not contain."""
    if native.problem():
        return
    ordinary.take_off(parts.rigs())
    if look_masks.give_back():
        refresh()
    layer = current_context().view_layer
    if layer is not None and layer.depsgraph is not None:
        heat.give_back(cast("Depsgraph", layer.depsgraph))


@persistent
def _end_tests(*_arguments: object) -> None:
    if not native.problem() and channel_preview.clear_all():
        refresh()


def refresh(moment: evaluate.Moment = evaluate.Moment.UPDATE) -> None:
    """Evaluate all characters now, in every scene and view layer.

    Args:
        moment: the reason for this evaluation, such as an edit, a frame or a loaded file.
    """
    if native.problem() or not parts.rigs():
        return
    for scene in bpy.data.scenes:
        for layer in scene.view_layers:
            if layer.depsgraph is not None:
                evaluate.evaluate_all(cast("Depsgraph", layer.depsgraph), moment)


_HANDLERS = (
    ("frame_change_pre", _frame_changes),
    ("frame_change_post", _frame_changed),
    ("depsgraph_update_post", _updated),
    ("load_pre", _before_restoring),
    ("undo_pre", _before_restoring),
    ("redo_pre", _before_restoring),
    ("load_post", _loaded),
    ("undo_post", _undone),
    ("redo_post", _undone),
    ("blend_import_post", _imported),
    ("save_pre", _before_save),
    ("save_post", _saved),
    ("save_post_fail", _saved),
    ("render_init", _end_tests),
    ("render_init", _render_begins),
    ("render_complete", _render_ended),
    ("render_cancel", _render_ended),
)


def _there() -> list[tuple[str, Any]]:
    """The rows of _HANDLERS that this Blender version supports."""
    return [row for row in _HANDLERS if hasattr(bpy.app.handlers, row[0])]


def register() -> None:
    """Add the handlers to Blender's lists."""
    for name, handler in _there():
        present = getattr(bpy.app.handlers, name)
        if handler not in present:
            present.append(handler)


def unregister() -> None:
    """Remove the handlers, heat maps, and solo and mute settings; faces leave Direct mode."""
    heat.end_all()
    if look_masks.take_away():
        refresh()
    for rig in parts.rigs():
        ordinary.leave(rig)
        rig.update_tag(refresh={"OBJECT"})
    for name, handler in reversed(_there()):
        present = getattr(bpy.app.handlers, name)
        if handler in present:
            present.remove(handler)
