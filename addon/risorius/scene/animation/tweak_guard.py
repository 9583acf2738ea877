# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's own buttons do to a face while a tweak is on goes into the tweak too.

Blender knows no tweaks: its keys land in the action that the face plays. A copy of that action is
kept in the file while a tweak is on, so that undo and redo have it; a key that landed in the action
at the current frame is taken out again, and its value goes into the tweak. Sliders and handles that
were moved without a key go into the tweak when the frame changes. Other edits of the action stay.
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
_KEPT = "risorius_tweak_kept"  # on the same: its copy, as it was before
_NEAR = 1e-5  # values that are the same
_AT = 1e-3  # frames that are the same
_ARRAYS = ("co", "handle_left", "handle_right")
_KINDS = ("type", "interpolation", "handle_left_type", "handle_right_type")

CurveName = tuple[str, int]  # data path and index
Curves = dict[CurveName, bpy.types.FCurve]


@dataclass
class _Hand:
    """Sliders that differ from the keys below and have no key.

    Attributes:
        frame: of the scene.
        sliders: values by their names.
        places: of handles of the face board, by their bones.
    """

    frame: float
    sliders: dict[str, float] = field(default_factory=dict)
    places: dict[str, tuple[float, ...]] = field(default_factory=dict)


# Session uid of a control armature -> what its user moved.
_hands: dict[int, _Hand] = session.table("tweak_guard.hands", ("undo", "load"))
# Session uids of those looked at since load or undo.
_known: set[int] = session.keep("tweak_guard.known", set, ("undo", "load"))
# Session uid of one -> why its last key went nowhere.
_troubles: dict[int, str] = session.table("tweak_guard.troubles", ("undo", "load"))


def trouble(controls: ArmatureObject) -> str:
    """Why the last key went nowhere, or "". Args: controls  a control armature."""
    return _troubles.get(controls.session_uid, "")


def begin(controls: ArmatureObject, first: float, last: float, fade: float) -> None:
    """Turn a tweak on.

    Args:
        controls: the control armature.
        first, last: frames.
        fade: frames at each end.

    Raises:
        FaceError: the range has no room.
    """
    tweaks.begin(controls, first, last, fade)
    _keep(controls)


def end(controls: ArmatureObject) -> None:
    """Turn the tweak off. What was moved at the current frame goes into it before; it stays."""
    settle(controls)
    tweaks.end(controls)
    _drop(controls)
    _troubles.pop(controls.session_uid, None)


def _keep(controls: ArmatureObject) -> None:
    """Keep a copy of the action that is played now."""
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
    """Take keys that landed below the tweak into it, and note moves without a key.

    Args:
        controls: a control armature that was edited.
        frame: of its scene.
        edited: whether its action was edited too.
    """
    tweak, uid = tweaks.of(controls), controls.session_uid
    if tweak is None:
        _hands.pop(uid, None)
        return
    if edited or uid not in _known:
        _known.add(uid)
        _take_keys(controls, tweak, frame)
    hand = _moved(controls, tweak, frame)
    if hand is None:
        _hands.pop(uid, None)
    else:
        _hands[uid] = hand


def settle(controls: ArmatureObject) -> None:
    """Take moves without a key into the tweak; outside of its range they are dropped.

    Args:
        controls: a control armature; its frame may have changed since.
    """
    hand = _hands.pop(controls.session_uid, None)
    if hand is not None and tweaks.of(controls) is not None:
        _take(controls, hand)


def _take(controls: ArmatureObject, hand: _Hand) -> None:
    face, rig = controls.pose.bones[parts.FACE], parts.rig_of(controls)
    for label, value in hand.sliders.items():
        face[label] = value
    if rig is not None and hand.places:
        board.put_places(controls, runtime.there(rig), hand.places)
    try:
        tweaks.take(controls, list(hand.sliders), hand.frame)
        _troubles.pop(controls.session_uid, None)
    except FaceError as error:
        _troubles[controls.session_uid] = str(error)


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
    else:  # another action is played since: it is what lies below from now on
        _keep(controls)
        return
    now, inserted, foreign = _curves(controls, action), [], False
    for name, curve in now.items():
        found = _inserted(curve, before.get(name), frame)
        if found is None:
            foreign = True
        elif found:
            inserted.append(name)
    hand = _Hand(frame)
    held = _hands.get(controls.session_uid)
    if inserted and held is not None and abs(held.frame - frame) < _AT:
        hand = held  # the key brought what had none back to the keys below
    for name in inserted:
        _note_key(controls, hand, now[name], frame)
    for name in inserted:
        _restore(controls, action, now[name], before.get(name), frame)
    if inserted:
        action.update_tag()
        _take(controls, hand)
    if foreign or before.keys() - now.keys() or (inserted and not before):
        _keep(controls)


def _curves(controls: ArmatureObject, action: bpy.types.Action) -> Curves:
    """The curves of an action that a tweak takes the place of: of sliders and of handles."""
    rig = parts.rig_of(controls)
    handles = board.places_of(controls, runtime.there(rig)) if rig is not None else {}
    paths = {board.path_of(bone) for bone in handles}
    return {
        (c.data_path, c.array_index): c
        for c in compat.curves_for(action, controls)
        if c.data_path in paths or curve_colours.label_of(c.data_path)
    }


def _inserted(
    curve: bpy.types.FCurve, before: bpy.types.FCurve | None, frame: float
) -> bool | None:
    """Whether a key was set at a frame since, and nothing else; None after any other edit."""
    frames, values = clip_actions.key_points(curve)
    there = np.abs(frames - frame) < _AT
    if before is None:
        return True if len(frames) == 1 and there.all() else None
    old_frames, old_values = clip_actions.key_points(before)
    if len(frames) == len(old_frames) + 1 and there.sum() == 1:
        same = np.allclose(frames[~there], old_frames) and np.allclose(values[~there], old_values)
        return True if same else None
    if len(frames) != len(old_frames) or not np.allclose(frames, old_frames):
        return None
    differ = np.abs(values - old_values) > _NEAR
    if not differ.any():
        return False
    return True if (differ == (differ & there)).all() else None


def _note_key(controls: ArmatureObject, hand: _Hand, curve: bpy.types.FCurve, frame: float) -> None:
    value = curve.evaluate(frame)
    label = curve_colours.label_of(curve.data_path)
    if label:
        hand.sliders[label] = value
        return
    bone = curve.data_path.split('"')[1]
    place = list(hand.places.get(bone, controls.pose.bones[bone].location[:]))
    place[curve.array_index] = value
    hand.places[bone] = tuple(place)


def _restore(
    controls: ArmatureObject,
    action: bpy.types.Action,
    curve: bpy.types.FCurve,
    before: bpy.types.FCurve | None,
    frame: float,
) -> None:
    """Give a curve the keys that it had; one that was not there goes."""
    if before is None:
        bag = compat.bag_for(action, controls)
        if bag is not None:
            bag.fcurves.remove(curve)
        return
    points, old = curve.keyframe_points, before.keyframe_points
    for index, point in enumerate(points):
        if abs(point.co.x - frame) > _AT:
            continue
        if len(points) > len(old):
            points.remove(point, fast=True)
        else:
            for name in _KINDS:
                setattr(point, name, getattr(old[index], name))
        break
    for name in _ARRAYS:
        values = np.empty(len(old) * 2, np.float32)
        old.foreach_get(name, values)
        points.foreach_set(name, values)
    curve.update()


def _moved(controls: ArmatureObject, tweak: tweaks.Tweak, frame: float) -> _Hand | None:
    """Sliders that differ from the keys below; None for none, and beside NLA strips."""
    data, rig = controls.animation_data, parts.rig_of(controls)
    if rig is None or (data is not None and _is_mixed(data)):
        return None
    face, hand = controls.pose.bones[parts.FACE], _Hand(frame)
    if board.leads_face(rig):
        places = board.places_of(controls, runtime.there(rig))
        for bone, place in tweaks.places_below(controls, tweak, frame).items():
            now = places.get(bone, place)
            if any(abs(a - b) > _NEAR for a, b in zip(now, place, strict=True)):
                hand.places[bone] = now
        return hand if hand.places else None
    led = {curve_colours.label_of(c.data_path) for c in (data.drivers if data is not None else ())}
    for label, value in tweaks.sliders_below(controls, tweak, frame).items():
        if label in face and label not in led and abs(float(face[label]) - value) > _NEAR:
            hand.sliders[label] = float(face[label])
    return hand if hand.sliders else None


def _is_mixed(data: bpy.types.AnimData) -> bool:
    """Whether strips move the face too, and its action does not say alone what is shown."""
    strips = data.use_nla and any(len(t.strips) and not t.mute for t in data.nla_tracks)
    return strips or data.action_influence < 1.0 or data.action_blend_type != "REPLACE"
