# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts the current pose and the keys of an action between sliders and the face board.

Either the sliders or the board lead, that is, move the face. A leading board replaces only the
sliders that its handles can move.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, field

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ...logic.animation import key_reduction
from ...logic.base import names
from ...logic.base.sentences import Sentence, told
from ...logic.character import board_fit
from ..base import compat, parts
from ..base.blender_types import ArmatureObject, Context
from ..character import armatures, board, board_bones, runtime, shown_keys
from . import actions, clip_actions

TOLERANCE = 5e-4  # largest distance of the straight lines between keys from the converted values
_NAMED = 4  # number of controls that a sentence on a loss names


@dataclass
class Converted:
    """Result of a conversion between sliders and board.

    Attributes:
        loss: largest change of a raw control by the conversion, over the pose and all frames.
        kept: the unconverted action, kept with a fake user; None if no action was converted.
        curves: number of new F-curves.
        idle: names of played actions that have keys of the controls that no longer lead (sliders or
            handles); these keys have no effect. With unconverted keys, the active action is among
            them.
    """

    loss: board_fit.Loss = field(default_factory=board_fit.Loss)
    kept: bpy.types.Action | None = None
    curves: int = 0
    idle: list[str] = field(default_factory=list)


def lost(loss: board_fit.Loss) -> Sentence | None:
    """A sentence about the raw controls that a conversion changed most.

    None if it changed no raw control by more than board.SEEN.

    Args:
        loss: differences of raw controls before and after the conversion.
    """
    if loss.largest <= board.SEEN:
        return None
    worst = [f"{name.rpartition('.')[2]} {value:.2f}" for name, value in loss.worst]
    return told(
        ("The board cannot show the whole pose: largest difference {largest:.3f} of 1 ({worst})."),
        largest=loss.largest,
        worst=names.listed(worst, _NAMED),
    )


def switch(rig: ArmatureObject, by_board: bool, with_keys: bool) -> Converted:
    """Switch between sliders and board, and keep the pose.

    Args:
        rig: a character with a face board.
        by_board: True: the board leads; False: the sliders lead.
        with_keys: also convert the keys of the active action, in a copy of the action.

    Returns:
        The result of the conversion.
    """
    live, controls = runtime.there(rig), parts.controls_there(rig)
    done = Converted()
    data = controls.animation_data
    action = data.action if data is not None else None
    keyed = action is not None and any(
        True for _curve in _leading_curves(action, controls, live, not by_board)
    )
    losses = [_pose(rig, by_board)]
    if with_keys and data is not None and action is not None and keyed:
        copy = action.copy()
        copy.name = action.name
        action.use_fake_user = True
        compat.assign_action(data, copy, compat.slot_for(copy, controls))
        done.kept = action
        loss, done.curves = convert(rig, copy, by_board)
        losses.append(loss)
        shown_keys.show(controls, [c.data_path for c in compat.curves_for(copy, controls)])
    board.set_lead(controls, by_board)
    board_bones.show(controls, by_board)
    done.loss = max(losses, key=lambda loss: loss.largest)
    for other in compat.played_actions(controls):
        if any(True for _curve in _leading_curves(other, controls, live, not by_board)):
            done.idle.append(other.name)
    return done


def exchange(context: Context, rig: ArmatureObject, kind: str) -> Converted:
    """Replace the face board by a board of another kind, and convert the pose and the keys.

    Args:
        context: with a view layer.
        rig: a character with a face board; its control armature must not be linked.
        kind: kind of the new board, runtime.PRIMARY or runtime.COMPLETE.

    Returns:
        The result of the conversion to the new board; `kept` is the action with keys of the old
        board. If the sliders lead, nothing is converted and all attributes have their defaults.
    """
    controls, done = parts.controls_there(rig), Converted()
    led = board.leads_face(rig)
    if led:
        done = switch(rig, by_board=False, with_keys=True)
    board_bones.remove(context, rig)
    board.set_kind(controls, kind)
    board_bones.add(context, rig)
    if not led:
        board_bones.show(controls, False)
        return done
    before, done = done, switch(rig, by_board=True, with_keys=True)
    if done.kept is not None and before.kept is not None:  # done.kept has slider keys
        bpy.data.actions.remove(done.kept)
        done.kept = before.kept
    return done


def onto_leader(rig: ArmatureObject, action: bpy.types.Action) -> list[Sentence]:
    """Convert slider keys of a new action to keys of board handles if the face board leads.

    Args:
        rig: the character that will play the action.
        action: a new action, which is changed in place; no datablock plays it yet.

    Returns:
        Sentences for a report; empty if the sliders lead.
    """
    if not board.leads_face(rig):
        return []
    loss = lost(convert(rig, action, by_board=True)[0])
    note = told("The board leads this face: {action} moves the board.", action=action.name)
    return [note, *([loss] if loss is not None else [])]


def animates_sliders(rig: ArmatureObject) -> bool:
    """Whether a played action of a face has keys of sliders that the face board can move.

    Args:
        rig: the character.
    """
    live, controls = runtime.there(rig), parts.controls_there(rig)
    return any(
        True
        for action in compat.played_actions(controls)
        for _curve in _leading_curves(action, controls, live, of_board=False)
    )


def _pose(rig: ArmatureObject, by_board: bool) -> board_fit.Loss:
    """Convert the current pose to the board or to the sliders.

    Args:
        rig: the character.
        by_board: True: convert to the board; False: convert to the sliders.

    Returns:
        The changes of raw controls by the conversion; no changes if `by_board` is False.
    """
    live, controls = runtime.there(rig), parts.controls_there(rig)
    face = parts.face_bone(rig)
    assert face is not None
    if not by_board:
        for label, value in board.raw_now(rig).items():
            face[label] = value
        return board_fit.Loss()
    raw = np.array([[float(face.get(n, 0.0)) for n in live.labels]])
    gui = board.fit(live, raw)
    board.write(controls, live, gui[0])
    return board_fit.loss(live.labels, raw, live.table.raw(gui), live.table.reached, board.SEEN)


def _leading_curves(
    action: bpy.types.Action, controls: ArmatureObject, live: runtime.Runtime, of_board: bool
) -> Iterable[bpy.types.FCurve]:
    """The F-curves of an action that move the board's handles if `of_board` is True, or else the
    F-curves of the sliders that the board moves.
    """
    if of_board:
        paths = {board.path_of(handle.bone) for handle in live.handles}
    else:
        led = zip(live.labels, live.table.reached, strict=True)
        paths = {parts.property_path(label) for label, reached in led if reached}
    return (c for c in compat.curves_for(action, controls) if c.data_path in paths)


def convert(
    rig: ArmatureObject, action: bpy.types.Action, by_board: bool
) -> tuple[board_fit.Loss, int]:
    """Convert the keys of an action in place between sliders and handles of the face board.

    The new keys are linear; the lines between them are within TOLERANCE of the converted
    values. Controls without keys keep their current value.

    Args:
        rig: the character.
        action: with keys of the sliders or of the handles.
        by_board: True: from sliders to handles; False: from handles to sliders.

    Returns:
        The largest changes of raw controls at whole frames and at keys, and the number of new
        curves. From handles to sliders, only the key reduction changes raw controls.
    """
    live, controls = runtime.there(rig), parts.controls_there(rig)
    curves = list(_leading_curves(action, controls, live, not by_board))
    bag = compat.bag_for(action, controls)
    if not curves or bag is None:
        return board_fit.Loss(), 0
    frames = _frames(curves)
    counts = actions.Counts()
    if by_board:
        tracks, loss = _to_handles(rig, curves, frames)
    else:
        tracks, loss = _to_sliders(rig, curves, frames)
    for curve in curves:
        bag.fcurves.remove(curve)
    new = {(track.path, track.first) for track in tracks}
    stale = [c for c in bag.fcurves if (c.data_path, c.array_index) in new]
    for curve in stale:  # had no effect until now; the converted curve replaces it
        bag.fcurves.remove(curve)
    actions.add_tracks(bag, frames, tracks, TOLERANCE, counts)
    for group in [group for group in bag.groups if not len(group.channels)]:
        bag.groups.remove(group)
    return loss, counts.curves


def _frames(curves: Iterable[bpy.types.FCurve]) -> NDArray[np.float64]:
    """The frames of all keys of F-curves, and all whole frames from the first to the last key."""
    keys = np.concatenate([clip_actions.key_points(curve)[0] for curve in curves])
    whole = np.arange(np.floor(keys.min()), np.ceil(keys.max()) + 1.0)
    inside = whole[(whole >= keys.min()) & (whole <= keys.max())]
    return np.unique(np.concatenate([keys, inside]).round(4)).astype(np.float64)


def _to_handles(
    rig: ArmatureObject, curves: Collection[bpy.types.FCurve], frames: NDArray[np.float64]
) -> tuple[list[actions.Track], board_fit.Loss]:
    live, face = runtime.there(rig), parts.face_bone(rig)
    assert face is not None
    by_path = {curve.data_path: curve for curve in curves}
    raw = np.empty((len(frames), len(live.labels)))
    keyed = np.zeros(len(live.labels), bool)
    for i, label in enumerate(live.labels):
        curve = by_path.get(parts.property_path(label))
        keyed[i] = curve is not None
        raw[:, i] = face.get(label, 0.0) if curve is None else clip_actions.sampled(curve, frames)
    gui = board.fit(live, np.clip(raw, 0.0, 1.0))
    loss = board_fit.loss(
        live.labels, raw, live.table.raw(gui), live.table.reached & keyed, board.SEEN
    )
    titles, tracks = native.regions().titles, []
    for handle in live.handles:
        moving = any(keyed[live.table.outputs_of(way.gui)].any() for way in handle.axes)
        for axis, way in enumerate((handle.x, handle.y)):
            if moving and way is not None:
                values = (gui[:, [way.gui]] / way.unit).astype(np.float32)
                path = board.path_of(handle.bone)
                tracks.append(actions.Track(path, titles[handle.region], values, None, axis, True))
    return tracks, loss


def _to_sliders(
    rig: ArmatureObject, curves: Collection[bpy.types.FCurve], frames: NDArray[np.float64]
) -> tuple[list[actions.Track], board_fit.Loss]:
    live, controls = runtime.there(rig), parts.controls_there(rig)
    by_path = {(curve.data_path, curve.array_index): curve for curve in curves}
    gui = np.repeat(board.read(controls, live)[None].astype(np.float64), len(frames), axis=0)
    outputs: set[int] = set()
    for handle in live.handles:
        for axis, way in enumerate((handle.x, handle.y)):
            curve = by_path.get((board.path_of(handle.bone), axis))
            if way is not None and curve is not None:
                values = np.clip(clip_actions.sampled(curve, frames), way.low, way.high)
                gui[:, way.gui] = values * way.unit
                outputs.update(live.table.outputs_of(way.gui))
    raw = live.table.raw(gui)
    tracks = [
        actions.Track(
            parts.property_path(live.labels[i]),
            armatures.key_group(live.labels[i]),
            raw[:, [i]].astype(np.float32),
            indexed=False,
        )
        for i in sorted(outputs)
    ]
    off = 0.0
    for track in tracks:
        kept = key_reduction.reduce_keys(frames, track.values, TOLERANCE)
        rebuilt = key_reduction.rebuilt(frames, track.values, kept)
        off = max(off, float(np.abs(rebuilt - track.values).max(initial=0.0)))
    return tracks, board_fit.Loss(off)
