# SPDX-License-Identifier: GPL-3.0-or-later
"""Tweaks a range of frames: edits go into an additive layer, and the keys below it stay.

While a tweak is on, the layer stores the difference between an edited slider and the keys below,
and the slider returns to the value of these keys. The same applies to the bones of head, neck and
eyes, to the gaze target, and to the handles of a face board that leads (moves the face).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field

import bpy
import numpy as np

from ...logic.animation import clip_units
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..base import compat, parts, stage
from ..base.blender_types import ArmatureObject
from ..character import board, runtime, sides
from . import clip_actions, curve_colours, layer_mixing, layer_properties, layers

_ON = "risorius_tweak"  # on the control armature: the active tweak as JSON
_LEAST = 1e-5  # smaller differences of values are ignored
_TARGET = "eyes"  # the bone of the gaze target
_REST = (0.0, 0.0, 0.0)  # rest location of the gaze target
_FARTHEST = (179.0, 89.0, 179.0)  # degrees of yaw, pitch and roll that a layer can hold


Curves = Mapping[tuple[str, int], bpy.types.FCurve]  # by data path and array index
Rows = dict[str, tuple[float, ...]]


@dataclass
class Tweak:
    """An active tweak.

    Attributes:
        first, last: its first and last frame, where its effect is 0.
        fade: length of the fade at each end in frames.
        layer: name of its layer; empty until something is tweaked.
        base: slider values when the tweak began, by name; used for sliders without keys.
        places: positions of handles when the tweak began, by bone; used for handles without keys.
        bare: whether the face played no action when the tweak began.
        bones: components of control bones when the tweak began, by the data paths of `paths_of`.
    """

    first: float
    last: float
    fade: float
    layer: str
    base: dict[str, float]
    places: dict[str, list[float]] = field(default_factory=dict)
    bare: bool = False
    bones: dict[str, list[float]] = field(default_factory=dict)

    def weight(self, frame: float) -> float:
        """The weight of the tweak's layer at a frame, 0 to 1."""
        ends = min(frame - self.first, self.last - frame)
        return min(max(ends / self.fade, 0.0), 1.0) if self.fade else float(ends > 0.0)


@dataclass
class Stand:
    """A pose of the controls.

    Attributes:
        sliders: values by name.
        places: positions of handles of the face board, by bone.
        bones: rotation or location components, by the data paths of `paths_of`.
    """

    sliders: dict[str, float] = field(default_factory=dict)
    places: Rows = field(default_factory=dict)
    bones: Rows = field(default_factory=dict)


def paths_of(controls: ArmatureObject) -> dict[str, str]:
    """Data path -> bone name, for the properties of control bones that a tweak can change."""
    bones, found = controls.pose.bones, {}
    for name in clip_units.TURNS:
        if name in bones:
            found[f'pose.bones["{name}"].{clip_actions.rotation_path(bones[name])}'] = name
    if _TARGET in bones:
        found[f'pose.bones["{_TARGET}"].location'] = _TARGET
    return found


def of(controls: ArmatureObject) -> Tweak | None:
    """The active tweak of a control armature; None if there is none or its data are damaged."""
    text = controls.get(_ON)
    if not isinstance(text, str):
        return None
    try:
        tweak = Tweak(**json.loads(text))
    except (ValueError, TypeError):
        return None
    return tweak if _is_sound(tweak) else None


def _is_sound(tweak: Tweak) -> bool:
    """Whether the stored data of a tweak have the expected types and finite numbers."""
    base, places, bones = tweak.base, tweak.places, tweak.bones
    if not all(isinstance(part, dict) for part in (base, places, bones)):
        return False
    rows = [*places.values(), *bones.values()]
    if not isinstance(tweak.layer, str) or any(type(r) is not list for r in rows):
        return False
    if any(len(r) != 3 for r in places.values()):
        return False
    numbers = [tweak.first, tweak.last, tweak.fade, *base.values(), *(n for r in rows for n in r)]
    return all(isinstance(n, (int, float)) and math.isfinite(n) for n in numbers)


def begin(controls: ArmatureObject, first: float, last: float, fade: float) -> None:
    """Turn a tweak on.

    Args:
        controls: the control armature.
        first, last: first and last frame of the tweak.
        fade: length of the fade at each end in frames; at most half the range is used.

    Raises:
        FaceError: the range is shorter than two frames, or the fade is negative.
    """
    if last - first < 2.0 or fade < 0.0:
        raise FaceError(told("A tweak needs a range of two frames or more."))
    face, rig = controls.pose.bones[parts.FACE], parts.rig_of(controls)
    base = {name: float(v) for name, v in face.items() if isinstance(v, float)}
    tweak = Tweak(first, last, min(fade, (last - first) / 2.0), "", base)
    if rig is not None:
        places = board.places_of(controls, runtime.there(rig))
        tweak.places = {bone: list(place) for bone, place in places.items()}
    for path in paths_of(controls):
        tweak.bones[path] = [*controls.path_resolve(path)]
    data = controls.animation_data
    tweak.bare = data is None or data.action is None
    controls[_ON] = json.dumps(asdict(tweak))


def end(controls: ArmatureObject) -> None:
    """Turn the tweak off; its layer stays."""
    if _ON in controls:
        del controls[_ON]


def take(
    controls: ArmatureObject,
    labels: Iterable[str],
    frame: float,
    bones: Iterable[str] = (),
    held: bool = False,
    old: Curves | None = None,
) -> int:
    """Store edited sliders and bones in the tweak at a frame.

    The sliders and bones are then reset to the values of the keys below the tweak. If the face
    board leads, all sliders that moved handles change are stored too, and the handles are reset.

    Args:
        controls: control armature with an active tweak.
        labels: sliders to store.
        frame: frame of the scene.
        bones: data paths of bones to store; paths that `paths_of` does not contain are ignored.
        held: True: controls that were not edited get a key too if the tweak already has keys of
            them.
        old: curves to which the changes are added, from `curves_so_far`; None: the current curves.

    Returns:
        The number of tweaked sliders and bones.

    Raises:
        FaceError: the frame is outside the tweak, or the weight of the tweak at this frame is too
            small to store a large rotation.
    """
    tweak = of(controls)
    assert tweak is not None
    weight = tweak.weight(frame)
    if weight <= 0.0:
        raise FaceError(
            told(
                "The tweak lies between the frames {first:g} and {last:g}: go there first.",
                first=tweak.first,
                last=tweak.last,
            )
        )
    face, below = controls.pose.bones[parts.FACE], below_at(controls, tweak, frame)
    changes = {n: float(face[n]) - below.sliders[n] for n in labels if n in below.sliders}
    known = {path: name for path, name in paths_of(controls).items() if path in below.bones}
    asked = {path: known[path] for path in bones if path in known}
    old = _tweaked(controls, tweak) if old is None else old
    rows = _bone_rows(controls, asked, below, old, frame, weight, held)
    changes |= _given(controls, below)
    for follower, leader in sides.followers(controls).items():
        if leader in changes:  # its driver follows the slider but not the layer
            changes[follower] = changes[leader]
    for label, change in changes.items():
        path = parts.property_path(label)
        if abs(change) > _LEAST or (held and (path, 0) in old):
            there = old[path, 0].evaluate(frame) if (path, 0) in old else 0.0
            rows[path] = [there + change / weight]
    if rows:
        _insert(controls, tweak, rows, frame)
    for label in changes.keys() & below.sliders.keys():
        face[label] = below.sliders[label]
    put_bones(controls, {path: below.bones[path] for path in asked})
    controls.update_tag()
    return len(rows)


def put_bones(controls: ArmatureObject, values: Mapping[str, Sequence[float]]) -> None:
    """Set control bones to stored values.

    Args:
        controls: the control armature.
        values: components by data path.
    """
    for path, numbers in values.items():
        owner, _, name = path.rpartition(".")
        setattr(controls.path_resolve(owner), name, numbers)


@contextmanager
def curves_so_far(controls: ArmatureObject) -> Iterator[Curves]:
    """Context manager: a copy of the curves of the tweak's layer.

    Keys that are inserted later do not change the copy.

    Args:
        controls: the control armature; without a tweak or layer the result is empty.
    """
    tweak = of(controls)
    layer = _layer_of(controls, tweak) if tweak is not None else None
    if layer is None or layer.action is None:
        yield {}
        return
    copy = layer.action.copy()
    try:
        yield _curves_in(copy, controls)
    finally:
        bpy.data.actions.remove(copy)


def _tweaked(controls: ArmatureObject, tweak: Tweak) -> Curves:
    """The curves of a tweak's layer, by data path and index."""
    layer = _layer_of(controls, tweak)
    return {} if layer is None or layer.action is None else _curves_in(layer.action, controls)


def _curves_in(action: bpy.types.Action, controls: ArmatureObject) -> Curves:
    curves = compat.curves_for(action, controls)
    return {(c.data_path, c.array_index): c for c in curves if len(c.keyframe_points)}


def _layer_of(controls: ArmatureObject, tweak: Tweak) -> layer_properties.RISORIUS_PG_layer | None:
    return next((y for y in layers.of(controls) if y.name == tweak.layer), None)


def _bone_rows(
    controls: ArmatureObject,
    asked: Mapping[str, str],
    below: Stand,
    old: Curves,
    frame: float,
    weight: float,
    held: bool,
) -> dict[str, list[float]]:
    """Data path -> key values with which the tweak's layer reproduces the current bone poses.

    Args:
        controls: the control armature.
        asked: data path -> name of the bone, for the properties to store.
        below: the pose without the tweak.
        old: curves of the tweak's layer, to which the changes are added.
        frame: frame of the scene.
        weight: weight of the layer at this frame.
        held: True: properties without a change get keys too if the layer has keys of them.
    """
    rows = {}
    for path, name in asked.items():
        bone = controls.pose.bones[name]
        pair = np.array([below.bones[path], controls.path_resolve(path)[:]], np.float64)
        if name == _TARGET:
            mode, way, angles = "", clip_actions.Turning("", path, _rows_of(old, path), _REST), pair
        else:
            mode = bone.rotation_mode
            angles = clip_actions.angles_in_armature(bone, mode, pair)
            way = clip_actions.turning(bone, old)
            way = way or clip_actions.turning_in(bone, mode, old)
        change = angles[1] - angles[0]
        if mode:
            change = (change + math.pi) % math.tau - math.pi
        if np.abs(change).max() <= _LEAST and not (held and any(way.curves)):
            continue
        there = way.values(np.array([frame]))
        if not mode:
            rows[path] = (there[0] + change / weight).tolist()
            continue
        row = clip_actions.angles_in_armature(bone, way.mode, there)[0] + change / weight
        if (np.abs(np.degrees(row)) > _FARTHEST).any():
            share = 100.0 * weight
            raise FaceError(
                told(
                    "The tweak has only {share:.0f} % strength here, too little for "
                    "such a large rotation: go nearer to the middle of the tweak.",
                    share=share,
                )
            )
        rows[way.path] = clip_actions.rotation_of(bone, way.mode, row[None])[0].tolist()
    return rows


def _rows_of(curves: Curves, path: str) -> list[bpy.types.FCurve | None]:
    """The curves of x, y and z of a location; None for an axis without a curve."""
    return [curves.get((path, axis)) for axis in range(3)]


def _insert(
    controls: ArmatureObject, tweak: Tweak, rows: Mapping[str, Sequence[float]], frame: float
) -> None:
    """Insert keys into the layer of a tweak.

    Args:
        controls: the control armature.
        tweak: the active tweak; its layer is made if it does not exist.
        rows: data path -> value of each component.
        frame: frame of the scene.
    """
    layer = _layer(controls, tweak)
    action = layer.action
    bag = compat.bag_for(action, controls)
    assert bag is not None
    for path, numbers in rows.items():
        for index, value in enumerate(numbers):
            curve = bag.fcurves.find(path, index=index) or bag.fcurves.new(path, index=index)
            curve.keyframe_points.insert(frame, value)
            _hold_ends(curve, tweak)
    curve_colours.colour_action(controls, action)
    layer.start = action.frame_range[0]
    layer_mixing.note_edits([action])  # no datablock plays it, so Blender reports no update


def is_mixed(controls: ArmatureObject) -> bool:
    """Whether the pose depends on NLA strips or on the blending of the active action."""
    data = controls.animation_data
    if data is None:
        return False
    strips = data.use_nla and any(len(t.strips) and not t.mute for t in data.nla_tracks)
    return strips or data.action_influence < 1.0 or data.action_blend_type != "REPLACE"


def now(controls: ArmatureObject) -> Stand:
    """The current pose of the controls.

    Args:
        controls: the original or evaluated armature.
    """
    face, rig = controls.pose.bones[parts.FACE], parts.rig_of(controls.original)
    found = Stand({n: float(v) for n, v in face.items() if isinstance(v, float)})
    if rig is not None:
        found.places = board.places_of(controls, runtime.there(rig))
    found.bones = {path: (*controls.path_resolve(path),) for path in paths_of(controls)}
    return found


def changed(stand: Stand, other: Stand) -> Stand:
    """The controls of a pose that differ from another pose.

    Args:
        stand: the pose.
        other: the pose to compare with; controls missing from it are left out.
    """

    def differing(rows: Rows, others: Rows) -> Rows:
        return {
            key: row
            for key, row in rows.items()
            if key in others
            and any(abs(a - b) > _LEAST for a, b in zip(row, others[key], strict=True))
        }

    return Stand(
        {n: v for n, v in stand.sliders.items() if abs(v - other.sliders.get(n, v)) > _LEAST},
        differing(stand.places, other.places),
        differing(stand.bones, other.bones),
    )


def put(controls: ArmatureObject, stand: Stand) -> None:
    """Set the controls to a pose; controls that the pose lacks keep their values.

    Args:
        controls: the control armature.
        stand: a pose from `now` or `below_at`, or a part of such a pose.
    """
    face, rig = controls.pose.bones[parts.FACE], parts.rig_of(controls)
    for label, value in stand.sliders.items():
        face[label] = value
    if rig is not None and stand.places:
        board.put_places(controls, runtime.there(rig), stand.places)
    put_bones(controls, stand.bones)


def below_at(controls: ArmatureObject, tweak: Tweak, frame: float) -> Stand:
    """The pose of the controls without the tweak.

    On a face with NLA strips or a blended active action, Blender evaluates the pose in a separate
    dependency graph.

    Args:
        controls: the control armature.
        tweak: the active tweak.
        frame: frame of the scene.
    """
    base = Stand(
        dict(tweak.base),
        {bone: (*place,) for bone, place in tweak.places.items()},
        {path: (*numbers,) for path, numbers in tweak.bones.items() if path in paths_of(controls)},
    )
    if is_mixed(controls):
        return _shown(controls, base, frame)
    by_place = {board.path_of(bone): bone for bone in base.places}
    for curve in _curves(controls):
        path, index, value = curve.data_path, curve.array_index, curve.evaluate(frame)
        label = curve_colours.label_of(path)
        if label in base.sliders:
            base.sliders[label] = value
        for rows, key in ((base.places, by_place.get(path, "")), (base.bones, path)):
            if key in rows and index < len(rows[key]):
                rows[key] = (*rows[key][:index], value, *rows[key][index + 1 :])
    return base


def _shown(controls: ArmatureObject, base: Stand, frame: float) -> Stand:
    """The evaluated pose at a frame; controls that no action moves keep the values of `base`."""
    data = controls.animation_data
    assert data is not None
    actions = compat.played_actions(controls) if data.use_nla else filter(None, [data.action])
    paths = {c.data_path for action in actions for c in compat.curves_of(action)}
    held = now(controls)
    with stage.shown_at(controls, frame) as seen:
        found = now(seen)
    put(controls, changed(held, now(controls)))
    for label in base.sliders.keys() & found.sliders.keys():
        if parts.property_path(label) in paths:
            base.sliders[label] = found.sliders[label]
    for bone in base.places.keys() & found.places.keys():
        if board.path_of(bone) in paths:
            base.places[bone] = found.places[bone]
    base.bones |= {path: v for path, v in found.bones.items() if path in paths & base.bones.keys()}
    return base


def _curves(controls: ArmatureObject) -> list[bpy.types.FCurve]:
    """The curves of the active action that move the controls, without muted curves."""
    data = controls.animation_data
    if data is None or data.action is None:
        return []
    return clip_actions.playing_curves(data.action, controls)


def _given(controls: ArmatureObject, below: Stand) -> dict[str, float]:
    """Reset the handles of a leading face board to the pose without the tweak.

    Returns:
        Slider -> its value before the reset minus its value after the reset. Empty if no face board
        leads.

    Args:
        controls: the control armature.
        below: the pose without the tweak.
    """
    rig = parts.rig_of(controls)
    if rig is None or not board.leads_face(rig):
        return {}
    shown = board.given(rig)
    board.put_places(controls, runtime.there(rig), below.places)
    return {label: shown[label] - value for label, value in board.given(rig).items()}


def _layer(controls: ArmatureObject, tweak: Tweak) -> layer_properties.RISORIUS_PG_layer:
    """The layer of a tweak; a new one is made if it does not exist or has lost its action."""
    found = _layer_of(controls, tweak)
    if found is not None and found.action is not None:
        return found
    name = f"{controls.name.removesuffix('_controls')} tweak {tweak.first:g}-{tweak.last:g}"
    action = bpy.data.actions.new(name)
    compat.add_curves(action, controls)
    layer = layers.add(controls, "ACTION", action.name, action=action, blend="ADD")
    layer.extend, layer.fade_in, layer.fade_out = "NOTHING", tweak.fade, tweak.fade
    tweak.layer = layer.name
    controls[_ON] = json.dumps(asdict(tweak))
    return layer


def _hold_ends(curve: bpy.types.FCurve, tweak: Tweak) -> None:
    """Add a key at each end of the tweak, with the value of the nearest key between the ends."""
    inner = [k for k in curve.keyframe_points if tweak.first + 1e-3 < k.co.x < tweak.last - 1e-3]
    for frame, value in ((tweak.first, inner[0].co.y), (tweak.last, inner[-1].co.y)):
        curve.keyframe_points.insert(frame, value)
    for point in curve.keyframe_points:
        point.handle_left_type = point.handle_right_type = "AUTO_CLAMPED"
    curve.update()
