# SPDX-License-Identifier: GPL-3.0-or-later
"""Moves edits by Blender's own buttons into the active tweak (additive layer, see tweaks.py).

Blender inserts its keys into the action of the face. While a tweak is on, the .blend file has a
copy of that action, so that undo and redo restore the copy too. New keys of the action are removed
again, and their values are stored in the tweak. If the user moves a slider, bone or handle without
a key, its value is stored in the tweak when the frame changes. Other edits of the action stay:
moved or deleted keys, and keys of properties that a tweak cannot store, such as the location of
the whole face.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np

from ...logic.base.errors import FaceError
from ..base import compat, parts, session
from ..base.blender_types import ArmatureObject
from ..character import board, runtime
from . import clip_actions, curve_colours, tweaks

_ACTION = "risorius_tweak_action"  # on the control armature: the action below the tweak
_KEPT = "risorius_tweak_kept"  # on the control armature: a copy of that action before edits
_NEAR = 1e-5  # values that differ by no more count as equal
_AT = 1e-3  # frames that differ by less count as equal
_ARRAYS = ("co", "handle_left", "handle_right")
_OF_STRIPS = (
    "name",
    "frame_start",
    "frame_end",
    "scale",
    "repeat",
    "influence",
    "blend_type",
    "extrapolation",
    "mute",
)
_CHANNELS = ("location", "rotation_", "scale")
_KINDS = ("type", "interpolation", "handle_left_type", "handle_right_type")

CurveName = tuple[str, int]  # data path and index
Curves = dict[CurveName, bpy.types.FCurve]


@dataclass
class _Hand:
    """Controls that the user moved at a frame, to be stored in the tweak.

    Attributes:
        frame: frame of the scene.
        stand: the moved controls and their values.
        held: True: the user inserted a key, so the tweak gets a key even if no value changed.
    """

    frame: float
    stand: tweaks.Stand = field(default_factory=tweaks.Stand)
    held: bool = False


@dataclass
class _Below:
    """Cached pose of the controls without the tweak, for a face with NLA strips or blending.

    Attributes:
        frame: frame of the scene.
        strips: settings of the NLA strips when `stand` was evaluated, from `_strips`.
        stand: the values of the controls.
    """

    frame: float
    strips: tuple[object, ...]
    stand: tweaks.Stand


# Session uid of a control armature -> controls that the user moved without a key.
_hands: dict[int, _Hand] = session.table("tweak_guard.hands", ("undo", "load"))
# Session uid of a control armature whose action was checked since load or undo -> its cached pose
# without the tweak, or None.
_known: dict[int, _Below | None] = session.table("tweak_guard.known", ("undo", "load"))
# Session uid of a control armature -> reason why the tweak could not store the last key or moved
# control.
_troubles: dict[int, str] = session.table("tweak_guard.troubles", ("undo", "load"))


def trouble(controls: ArmatureObject) -> str:
    """The reason why the tweak could not store the last key or moved control; "" if it could.

    Args:
        controls: a control armature.
    """
    return _troubles.get(controls.session_uid, "")


def begin(controls: ArmatureObject, first: float, last: float, fade: float) -> None:
    """Turn a tweak on, and keep a copy of the active action.

    Args:
        controls: the control armature.
        first, last: first and last frame of the tweak.
        fade: length of the fade at each end in frames.

    Raises:
        FaceError: the range is shorter than two frames, or the fade is negative.
    """
    tweaks.begin(controls, first, last, fade)
    _keep(controls)


def end(controls: ArmatureObject) -> None:
    """Store in the tweak the controls that were moved without a key, and end the tweak.

    The layer of the tweak stays.
    """
    settle(controls)
    tweaks.end(controls)
    _drop(controls)
    _troubles.pop(controls.session_uid, None)


def _keep(controls: ArmatureObject) -> None:
    """Store the active action and a copy of it on the control armature."""
    _drop(controls)
    data = controls.animation_data
    if data is None or data.action is None:
        return
    copy = data.action.copy()
    copy.name, copy.use_fake_user = f"{data.action.name} below", False
    parts.point(controls, _ACTION, data.action)
    parts.point(controls, _KEPT, copy)


def _drop(controls: ArmatureObject) -> None:
    kept = controls.get(_KEPT)
    for key in (_ACTION, _KEPT):
        if key in controls:
            del controls[key]
    if isinstance(kept, bpy.types.Action) and not kept.users:
        bpy.data.actions.remove(kept)


def note_edit(controls: ArmatureObject, frame: float, edited: bool) -> None:
    """Move new keys of the active action into the tweak; record controls moved without a key.

    Args:
        controls: an edited control armature.
        frame: current frame of the scene.
        edited: whether the active action was edited too.
    """
    tweak, uid = tweaks.of(controls), controls.session_uid
    if tweak is None:
        _hands.pop(uid, None)
        return
    if edited or uid not in _known:
        _known[uid] = None
        if _is_dragging():  # dragged keys must not be removed: check when the drag ends
            del _known[uid]
        else:
            _take_keys(controls, tweak, frame)
    hand = _moved(controls, tweak, frame)
    if hand is None:
        _hands.pop(uid, None)
    else:
        _hands[uid] = hand


def _below(controls: ArmatureObject, tweak: tweaks.Tweak, frame: float) -> tweaks.Stand:
    """The pose of the controls without the tweak.

    On a face with NLA strips or a blended active action the pose is cached, because Blender has to
    evaluate it.
    """
    if not tweaks.is_mixed(controls):
        return tweaks.below_at(controls, tweak, frame)
    uid, strips = controls.session_uid, _strips(controls)
    known = _known.get(uid)
    if known is None or (known.frame, known.strips) != (frame, strips):
        known = _Below(frame, strips, tweaks.below_at(controls, tweak, frame))
        if uid in _known:
            _known[uid] = known
    return known.stand


def _strips(controls: ArmatureObject) -> tuple[object, ...]:
    """The blending settings of the active action and the settings of all NLA strips of a face.

    `_below` compares them to notice changes.
    """
    data = controls.animation_data
    assert data is not None
    own = (data.use_nla, data.action_influence, data.action_blend_type)
    tracks = [(t.mute, t.is_solo, len(t.strips)) for t in data.nla_tracks]
    strips = [
        tuple(getattr(strip, name) for name in _OF_STRIPS)
        for track in data.nla_tracks
        for strip in track.strips
    ]
    return (*own, *tracks, *strips)


def settle(controls: ArmatureObject) -> None:
    """Store in the tweak the controls that were moved without a key.

    Nothing is stored if they were moved at a frame outside the tweak, or if the tweak is too weak
    there for a large rotation; `trouble` then gives the reason.

    Args:
        controls: a control armature. The scene may have changed its frame since the move.
    """
    hand = _hands.pop(controls.session_uid, None)
    if hand is not None and tweaks.of(controls) is not None:
        _take(controls, hand)


def _is_dragging() -> bool:
    """Whether a transform operator, such as a drag of keys or bones, runs in a window."""
    windows = bpy.data.window_managers[0].windows if len(bpy.data.window_managers) else ()
    running = (op.bl_idname for w in windows for op in getattr(w, "modal_operators", ()))
    return any(name.startswith("TRANSFORM_OT") for name in running)


def _take(controls: ArmatureObject, hand: _Hand, old: tweaks.Curves | None = None) -> None:
    tweak, stand = tweaks.of(controls), hand.stand
    assert tweak is not None
    tweaks.put(controls, stand)
    labels, bones = list(stand.sliders), list(stand.bones)
    try:
        tweaks.take(controls, labels, hand.frame, bones, hand.held, old)
        _troubles.pop(controls.session_uid, None)
    except FaceError as error:
        below = tweaks.below_at(controls, tweak, hand.frame)
        tweaks.put(controls, _of(below, stand))
        _troubles[controls.session_uid] = str(error)


def _of(whole: tweaks.Stand, part: tweaks.Stand) -> tweaks.Stand:
    """The values of the pose `whole` for the controls that the pose `part` contains."""
    return tweaks.Stand(
        {n: v for n, v in whole.sliders.items() if n in part.sliders},
        {n: v for n, v in whole.places.items() if n in part.places},
        {n: v for n, v in whole.bones.items() if n in part.bones},
    )


def _take_keys(controls: ArmatureObject, tweak: tweaks.Tweak, frame: float) -> None:
    data = controls.animation_data
    action = data.action if data is not None else None
    if action is None:
        return
    kept, below = controls.get(_KEPT), controls.get(_ACTION)
    if below == action and isinstance(kept, bpy.types.Action):
        before = _curves(controls, kept)
    elif below is None and tweak.bare:
        before = {}
    else:  # the user assigned another action, which is the action below from now on
        _keep(controls)
        return
    now, inserted, foreign = _curves(controls, action), {}, False
    for name, curve in now.items():
        found = _inserted(curve, before.get(name), frame)
        if found is None:
            foreign = True
        elif found:
            inserted[name] = found
    if inserted:
        hands = _hands_of(controls, tweak, now, inserted, frame)
        for name, frames in inserted.items():
            _restore(controls, action, now[name], before.get(name), frames)
        action.update_tag()
        _take_all(controls, tweak, hands, frame)
    if foreign or before.keys() - now.keys() or (inserted and not before):
        _keep(controls)


def _hands_of(
    controls: ArmatureObject,
    tweak: tweaks.Tweak,
    curves: Curves,
    inserted: dict[CurveName, list[float]],
    frame: float,
) -> list[_Hand]:
    """A _Hand for each frame with new keys, ascending, but the current frame last.

    If the current frame has no new key but controls that the user moved there without a key, the
    _Hand of these controls is the first.

    Args:
        controls: the control armature.
        tweak: the active tweak.
        curves: the curves of the active action, by data path and index.
        inserted: curve's data path and index -> frames of its new keys.
        frame: current frame of the scene.
    """
    held = _hands.get(controls.session_uid)
    by_frame: dict[float, list[bpy.types.FCurve]] = {}
    for name, frames in inserted.items():
        for at in frames:
            by_frame.setdefault(frame if abs(at - frame) < _AT else at, []).append(curves[name])
    is_held = held is not None and abs(held.frame - frame) < _AT
    hands = [held] if held is not None and is_held and frame not in by_frame else []
    for at in sorted(by_frame, key=lambda at: (at == frame, at)):
        hand = _Hand(at)
        if held is not None and is_held and at == frame:
            hand = held  # Blender reset moves without a key when it inserted this key
        hand.held = True
        shown = tweaks.below_at(controls, tweak, at)  # includes the new keys
        for curve in by_frame[at]:
            _note_key(hand.stand, shown, curve)
        hands.append(hand)
    return hands


def _note_key(stand: tweaks.Stand, shown: tweaks.Stand, curve: bpy.types.FCurve) -> None:
    path, label = curve.data_path, curve_colours.label_of(curve.data_path)
    bone = path.split('"')[1]
    if label in shown.sliders:
        stand.sliders[label] = shown.sliders[label]
    elif path in shown.bones:
        stand.bones[path] = shown.bones[path]
    elif path == board.path_of(bone) and bone in shown.places:
        stand.places[bone] = shown.places[bone]


def _take_all(
    controls: ArmatureObject, tweak: tweaks.Tweak, hands: list[_Hand], frame: float
) -> None:
    """Store the moved controls of several frames in the tweak.

    Then reset controls that were keyed at other frames: they get the values that they have at the
    current frame without the tweak.

    Args:
        controls: the control armature.
        tweak: the active tweak.
        hands: the moved controls, one _Hand for each frame, from `_hands_of`.
        frame: current frame of the scene.
    """
    with tweaks.curves_so_far(controls) as old:
        for hand in hands:
            _take(controls, hand, old)
    below = tweaks.below_at(controls, tweak, frame)
    for hand in hands:
        if hand.frame != frame:
            tweaks.put(controls, _of(below, hand.stand))


def _curves(controls: ArmatureObject, action: bpy.types.Action) -> Curves:
    """The curves of sliders, handles and control bones in an action, by data path and index.

    F-curves of location, rotation and scale of these bones are included, because Blender also keys
    properties that the face does not use.
    """
    rig = parts.rig_of(controls)
    handles = board.places_of(controls, runtime.there(rig)) if rig is not None else {}
    own = (bone.name for bone in controls.data.bones if parts.PART in bone)
    starts = tuple(
        f'pose.bones["{bpy.utils.escape_identifier(name)}"].{channel}'
        for name in dict.fromkeys([*handles, *own])
        for channel in _CHANNELS
    )
    return {
        (c.data_path, c.array_index): c
        for c in compat.curves_for(action, controls)
        if c.data_path.startswith(starts) or curve_colours.label_of(c.data_path)
    }


def _inserted(
    curve: bpy.types.FCurve, before: bpy.types.FCurve | None, frame: float
) -> list[float] | None:
    """The frames of keys of `curve` that its earlier copy `before` lacks or has with other values.

    None if the keys differ in another way: keys were deleted or moved in time, or without a new
    key, the value of a key at a frame other than `frame` was changed.
    """
    frames, values = clip_actions.key_points(curve)
    if before is None:
        return frames.tolist()
    old_frames, old_values = clip_actions.key_points(before)
    if not len(frames) or not len(old_frames):
        return None if len(old_frames) else frames.tolist()
    places = np.abs(frames[:, None] - old_frames).argmin(axis=1)
    same = np.abs(frames - old_frames[places]) < _AT
    if len(frames) - (~same).sum() != len(old_frames) or len({*places[same]}) != len(old_frames):
        return None  # keys were moved, deleted or doubled
    changed = same & (np.abs(values - old_values[places]) > _NEAR)
    if same.all() and (changed & (np.abs(frames - frame) >= _AT)).any():
        return None  # the user edited values of existing keys
    return frames[~same | changed].tolist()


def _restore(
    controls: ArmatureObject,
    action: bpy.types.Action,
    curve: bpy.types.FCurve,
    before: bpy.types.FCurve | None,
    frames: list[float],
) -> None:
    """Restore the keys that a curve had in `before`; remove the curve if `before` is None.

    Interpolation and types of keys are restored only at `frames`, the frames of inserted keys.
    """
    if before is None:
        bag = compat.bag_for(action, controls)
        if bag is not None:
            bag.fcurves.remove(curve)
        return
    points, old = curve.keyframe_points, before.keyframe_points
    there = clip_actions.key_points(before)[0]
    new = [i for i, point in enumerate(points) if np.abs(there - point.co.x).min() >= _AT]
    for index in reversed(new):  # from the end, because a removal shifts the later keys
        points.remove(points[index], fast=True)
    for point, kept in zip(points, old, strict=True):
        if any(abs(point.co.x - f) < _AT for f in frames):
            for name in _KINDS:
                setattr(point, name, getattr(kept, name))
    for name in _ARRAYS:
        values = np.empty(len(old) * 2, np.float32)
        old.foreach_get(name, values)
        points.foreach_set(name, values)
    curve.update()


def _moved(controls: ArmatureObject, tweak: tweaks.Tweak, frame: float) -> _Hand | None:
    """The controls that differ from the pose without the tweak; None if none does.

    Sliders with drivers are left out. If the face board leads, its handles are compared instead of
    the sliders.
    """
    rig = parts.rig_of(controls)
    if rig is None:
        return None
    now, below = tweaks.now(controls), _below(controls, tweak, frame)
    hand = _Hand(frame)
    differ = tweaks.changed(_of(now, below), below)
    if board.leads_face(rig):
        hand.stand.places = differ.places
    else:
        data = controls.animation_data
        drivers = data.drivers if data is not None else ()
        led = {curve_colours.label_of(c.data_path) for c in drivers}
        hand.stand.sliders = {n: v for n, v in differ.sliders.items() if n not in led}
    hand.stand.bones = differ.bones
    return hand if hand.stand != tweaks.Stand() else None
