# SPDX-License-Identifier: GPL-3.0-or-later
"""A tweak over a range: edits go into a layer that is added to the keys below and touches none.

While a tweak is on, what would be keyed is taken as its difference from what the keys below show;
then the slider stands on these again, and the layer adds the difference. Where the face board
leads, the same holds for its handles.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field

import bpy

from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..base import compat, parts
from ..base.blender_types import ArmatureObject
from ..character import board, runtime, sides
from . import clip_actions, curve_colours, layer_mixing, layer_properties, layers

_ON = "risorius_tweak"  # on the control armature: the tweak that is on, as JSON
_LEAST = 1e-5  # a difference that counts


@dataclass
class Tweak:
    """A tweak that is on.

    Attributes:
        first, last: the frames at which it begins and ends, with nothing.
        fade: frames from nothing to all of it, at each end.
        layer: name of its layer; empty until something is tweaked.
        base: what the sliders without keys stand at, by their names.
        places: where handles of the face board without keys stand, by their bones.
        bare: whether the face played no action when the tweak began.
    """

    first: float
    last: float
    fade: float
    layer: str
    base: dict[str, float]
    places: dict[str, list[float]] = field(default_factory=dict)
    bare: bool = False

    def weight(self, frame: float) -> float:
        """How much of the layer a frame shows, 0 to 1."""
        ends = min(frame - self.first, self.last - frame)
        return min(max(ends / self.fade, 0.0), 1.0) if self.fade else float(ends > 0.0)


def of(controls: ArmatureObject) -> Tweak | None:
    """The tweak that is on, or None."""
    text = controls.get(_ON)
    if not isinstance(text, str):
        return None
    try:
        tweak = Tweak(**json.loads(text))
    except (ValueError, TypeError):
        return None
    return tweak if _is_sound(tweak) else None


def _is_sound(tweak: Tweak) -> bool:
    """Whether a tweak that a file says to be on holds what it must."""
    base, places = tweak.base, tweak.places
    if not isinstance(base, dict) or not isinstance(places, dict):
        return False
    rows = [*places.values()]
    if not isinstance(tweak.layer, str) or any(type(r) is not list or len(r) != 3 for r in rows):
        return False
    numbers = [tweak.first, tweak.last, tweak.fade, *base.values(), *(n for r in rows for n in r)]
    return all(isinstance(n, (int, float)) and math.isfinite(n) for n in numbers)


def begin(controls: ArmatureObject, first: float, last: float, fade: float) -> None:
    """Turn a tweak on.

    Args:
        controls: the control armature.
        first, last: frames.
        fade: frames at each end.

    Raises:
        FaceError: the range has no room.
    """
    if last - first < 2.0 or fade < 0.0:
        raise FaceError(told("A tweak needs a range of two frames or more."))
    face, rig = controls.pose.bones[parts.FACE], parts.rig_of(controls)
    base = {name: float(v) for name, v in face.items() if isinstance(v, float)}
    tweak = Tweak(first, last, min(fade, (last - first) / 2.0), "", base)
    if rig is not None:
        places = board.places_of(controls, runtime.there(rig))
        tweak.places = {bone: list(place) for bone, place in places.items()}
    data = controls.animation_data
    tweak.bare = data is None or data.action is None
    controls[_ON] = json.dumps(asdict(tweak))


def end(controls: ArmatureObject) -> None:
    """Turn the tweak off; its layer stays."""
    if _ON in controls:
        del controls[_ON]


def take(controls: ArmatureObject, labels: Iterable[str], frame: float) -> int:
    """Take what sliders show as the tweak of a frame; then they stand as the keys below say.

    Args:
        controls: its control armature, with a tweak that is on.
        labels: the sliders.
        frame: of the scene.

    Returns:
        How many sliders are tweaked by it.

    Raises:
        FaceError: the frame lies outside the tweak.
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
    face, below = controls.pose.bones[parts.FACE], sliders_below(controls, tweak, frame)
    changes = {n: float(face[n]) - below[n] for n in labels if n in below}
    changes |= _given(controls, tweak, frame)
    for follower, leader in sides.followers(controls).items():
        if leader in changes:  # a driver lets it follow the slider, and no layer
            changes[follower] = changes[leader]
    changes = {n: change for n, change in changes.items() if abs(change) > _LEAST}
    if not changes:
        return 0
    layer = _layer(controls, tweak)
    action = layer.action
    bag = compat.bag_for(action, controls)
    assert bag is not None
    for label, change in changes.items():
        path = parts.property_path(label)
        curve = bag.fcurves.find(path) or bag.fcurves.new(path)
        there = curve.evaluate(frame) if len(curve.keyframe_points) else 0.0
        curve.keyframe_points.insert(frame, there + change / weight)
        _hold_ends(curve, tweak)
        if label in below:
            face[label] = below[label]
    curve_colours.colour_action(controls, action)
    layer.start = action.frame_range[0]
    layer_mixing.note_edits([action])  # nothing plays it that Blender would tell of
    controls.update_tag()
    return len(changes)


def _curves(controls: ArmatureObject) -> list[bpy.types.FCurve]:
    """The curves that move the controls, without those that are muted."""
    data = controls.animation_data
    if data is None or data.action is None:
        return []
    return clip_actions.playing_curves(data.action, controls)


def sliders_below(controls: ArmatureObject, tweak: Tweak, frame: float) -> dict[str, float]:
    """Values of the sliders without the tweak, by name.

    Args:
        controls: the control armature.
        tweak: which is on.
        frame: of the scene.
    """
    found = dict(tweak.base)
    for curve in _curves(controls):
        label = curve_colours.label_of(curve.data_path)
        if label in found:
            found[label] = curve.evaluate(frame)
    return found


def places_below(
    controls: ArmatureObject, tweak: Tweak, frame: float
) -> dict[str, tuple[float, ...]]:
    """Where the handles of the face board stand without the tweak, by their bones.

    Args:
        controls: the control armature.
        tweak: which is on.
        frame: of the scene.
    """
    found = {bone: list(place) for bone, place in tweak.places.items()}
    bones = {board.path_of(bone): bone for bone in found}
    for curve in _curves(controls):
        if curve.data_path in bones:
            found[bones[curve.data_path]][curve.array_index] = curve.evaluate(frame)
    return {bone: tuple(place) for bone, place in found.items()}


def _given(controls: ArmatureObject, tweak: Tweak, frame: float) -> dict[str, float]:
    """By how much a board that leads gives more than without the tweak; its handles go back."""
    rig = parts.rig_of(controls)
    if rig is None or not board.leads_face(rig):
        return {}
    now = board.given(rig)
    board.put_places(controls, runtime.there(rig), places_below(controls, tweak, frame))
    return {label: now[label] - value for label, value in board.given(rig).items()}


def _layer(controls: ArmatureObject, tweak: Tweak) -> layer_properties.RISORIUS_PG_layer:
    """The layer of a tweak, made when first something is tweaked."""
    found = next((y for y in layers.of(controls) if y.name == tweak.layer), None)
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
    """Let a curve last from the first frame to the last, as its inner keys begin and end."""
    inner = [k for k in curve.keyframe_points if tweak.first + 1e-3 < k.co.x < tweak.last - 1e-3]
    for frame, value in ((tweak.first, inner[0].co.y), (tweak.last, inner[-1].co.y)):
        curve.keyframe_points.insert(frame, value)
    for point in curve.keyframe_points:
        point.handle_left_type = point.handle_right_type = "AUTO_CLAMPED"
    curve.update()
