# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts layers to tracks of Blender's NLA."""

from __future__ import annotations

from collections.abc import Set

import bpy

from ...logic.animation import clip_units as clip_logic
from ...logic.animation import layer_rules as logic
from ..base import compat, parts
from ..base.blender_types import ArmatureObject
from ..character import runtime
from . import clip_actions, layer_mixing, layers
from .layer_properties import RISORIUS_PG_layer

_BLENDS = {"OVERRIDE": "REPLACE", "ADD": "ADD"}


def push(scene: bpy.types.Scene, rig: ArmatureObject) -> tuple[int, list[str]]:
    """Convert layers to strips, bottom to top, up to the first layer that no strip can represent.

    This layer and all layers above it stay, because Blender evaluates the NLA before all layers.
    Muted layers are skipped; if there are solo layers, all other layers are skipped too. Converted
    layers are muted. If at least one layer is converted, the active action becomes the lowest new
    strip.

    Args:
        scene: gives the frame rate.
        rig: the character.

    Returns:
        The number of converted layers, and sentences for the user.
    """
    controls, live = parts.controls_there(rig), runtime.there(rig)
    settings = layers.of(controls)
    playing = [layer for layer in settings if not layer.mute]
    if any(layer.solo for layer in playing):
        playing = [layer for layer in playing if layer.solo]
    # The active action is read here, because `_push_down` unassigns it.
    curves = [_weight_curve(controls, layer) for layer in playing]
    notes, count = [], 0
    for place, layer in enumerate(playing):
        trouble = obstacle(controls, layer, curves[place])
        if trouble:
            kept = "stays a layer" if layer == playing[-1] else "and those above it stay layers"
            notes.append(f"{layer.name} {kept}: {trouble}.")
            break
        if place == 0:
            _push_down(controls, rig)
        _add_strip(scene, rig, live, layer, curves[place])
        count += 1
    for layer in playing[:count]:
        layer.mute = True
    if len(layers.reactions_of(controls)):
        notes.append("Reactions stay: no strip mixes as they do.")
    if count and controls.risorius_layer_rules:
        notes.append("Controls that exclude each other do not give way in the NLA.")
    controls.update_tag()
    return count, notes


def obstacle(
    controls: ArmatureObject, layer: RISORIUS_PG_layer, curve: bpy.types.FCurve | None = None
) -> str:
    """The reason why no strip can represent a layer; "" if a strip can.

    Args:
        controls: control armature.
        layer: settings of a layer.
        curve: the F-curve of the layer's weight, or None.
    """
    fades = layer.fade_in or layer.fade_out
    reasons = (
        (layer.blend == "MAXIMUM", "the NLA has no maximum"),
        (layer.kind == "IDLE" and not layer.length, "idle life without a length never ends"),
        (layer.extend == "REPEAT", "a strip does not repeat for ever"),
        (len(layer.warp) > 1, "a strip has no warp points"),
        (_weight_driver(controls, layer) is not None, "its weight has a driver"),
        (curve is not None and fades, "a strip either fades or has keys of its influence"),
        (layer.kind == "ACTION" and layer.action is None, "it has no action"),
    )
    return next((words for holds, words in reasons if holds), "")


def _weight_path(controls: ArmatureObject, layer: RISORIUS_PG_layer) -> str:
    return f"{logic.COLLECTION}[{layers.place_of(controls, layer)}].weight"


def _weight_driver(controls: ArmatureObject, layer: RISORIUS_PG_layer) -> bpy.types.FCurve | None:
    data = controls.animation_data
    return data.drivers.find(_weight_path(controls, layer)) if data is not None else None


def _weight_curve(controls: ArmatureObject, layer: RISORIUS_PG_layer) -> bpy.types.FCurve | None:
    data = controls.animation_data
    bag = compat.bag_for(data.action, controls) if data and data.action else None
    return bag.fcurves.find(_weight_path(controls, layer)) if bag is not None else None


def _push_down(controls: ArmatureObject, rig: ArmatureObject) -> None:
    """Convert the active action of a face to a strip, like Blender's operator Push Down Action.

    Args:
        controls: the control armature of the face.
        rig: the deforming armature of the face.
    """
    data = controls.animation_data
    if data is None or data.action is None:
        return
    action = data.action
    blend, extrapolation, influence = (
        data.action_blend_type,
        data.action_extrapolation,
        data.action_influence,
    )
    data.action = None
    strip = clip_actions.add_strip(rig, action)
    strip.blend_type, strip.extrapolation = blend, extrapolation
    if influence != 1.0:
        _set_influence(strip, influence)


def _add_strip(
    scene: bpy.types.Scene,
    rig: ArmatureObject,
    live: runtime.Runtime,
    layer: RISORIUS_PG_layer,
    curve: bpy.types.FCurve | None,
) -> None:
    action, still = _action_of(scene, rig, live, layer)
    strip = clip_actions.add_strip(rig, action, layer.name)
    strip.use_auto_blend = False
    strip.blend_type = _BLENDS[layer.blend]  # pyright: ignore[reportAttributeAccessIssue]
    if still:
        endless = "HOLD" if layer.extend == "HOLD" else "HOLD_FORWARD"
        strip.extrapolation = "NOTHING" if layer.length else endless
        strip.frame_start = layer.start
        strip.frame_end = layer.start + (layer.length or 1.0)
    else:
        _place_strip(strip, layers.span_of(layer, action))
        strip.extrapolation = layer.extend
    strip.use_reverse = layer.reverse
    if curve is not None:
        strip.use_animated_influence = True
        own = strip.fcurves.find("influence")
        own.keyframe_points.clear()
        layers.copy_keys(curve, own)
    elif layer.weight != 1.0:
        _set_influence(strip, layer.weight, layer.fade_in, layer.fade_out)
    else:
        strip.blend_in, strip.blend_out = layer.fade_in, layer.fade_out


def _place_strip(strip: bpy.types.NlaStrip, span: logic.Span) -> None:
    strip.action_frame_start, strip.action_frame_end = span.first, span.last
    strip.scale, strip.repeat = span.scale, span.repeat
    strip.frame_start = span.start
    strip.frame_end = span.scene_range()[1]


def _set_influence(
    strip: bpy.types.NlaStrip, value: float, fade_in: float = 0.0, fade_out: float = 0.0
) -> None:
    """Key the influence of a strip: a constant value, with a fade at each end.

    The lengths of the fades are in frames; 0 means no fade. A strip with animated influence
    ignores blend_in and blend_out.
    """
    strip.use_animated_influence = True
    strip.influence = value
    start, end = strip.frame_start, strip.frame_end
    # If the fades overlap, the peak is at frame t where the lines (t - start) / fade_in and
    # (end - t) / fade_out cross.
    top = min(1.0, (end - start) / max(fade_in + fade_out, 1e-9))
    keys = {start + fade_in * top: value * top, end - fade_out * top: value * top}
    if fade_in:
        keys[start] = 0.0
    if fade_out:
        keys[end] = 0.0
    points = strip.fcurves.find("influence").keyframe_points
    points.clear()
    for frame, height in sorted(keys.items()):
        points.insert(frame, height, options={"FAST"}).interpolation = "LINEAR"
    strip.fcurves.find("influence").update()


def _action_of(
    scene: bpy.types.Scene, rig: ArmatureObject, live: runtime.Runtime, layer: RISORIUS_PG_layer
) -> tuple[bpy.types.Action, bool]:
    """The action that a strip plays for a layer: only the curves that the layer's mask allows.

    Returns:
        The action, and whether it is a constant pose. For a layer of kind ACTION whose mask allows
        all curves, the action is the layer's own action; otherwise it is a new action.
    """
    controls = parts.controls_there(rig)
    if layer.kind == "ACTION":
        first, last = layer.action.frame_range
        names = layer_mixing.allowed_names(live, layer)
        allowed = {n if n in clip_logic.BONES else parts.property_path(n) for n in names}
        return _masked(controls, layer, allowed), not last > first
    made = layer_mixing.native_layer(controls, live, layer, clip_actions.frame_rate(scene))
    clip = made.clip()
    kept = [n for n in clip.names if n in layer_mixing.allowed_names(live, layer)]
    timing = clip_logic.Timing(clip_actions.frame_rate(scene), layer.start, float(clip.start))
    made = clip_actions.make_action(rig, clip.selected(kept), timing, layer.name)
    return made.action, clip.frame_count < 2


def _masked(
    controls: ArmatureObject, layer: RISORIUS_PG_layer, allowed: Set[str]
) -> bpy.types.Action:
    curves = compat.curves_for(layer.action, controls)
    others = [c for c in curves if _is_left_out(c.data_path, allowed)]
    if not others:
        return layer.action
    copy = layer.action.copy()
    copy.name = f"{layer.action.name} {layer.name}"
    bag = compat.bag_for(copy, controls)
    assert bag is not None
    gone = {(c.data_path, c.array_index) for c in others}
    for curve in list(bag.fcurves):
        if (curve.data_path, curve.array_index) in gone:
            bag.fcurves.remove(curve)
    return copy


def _is_left_out(path: str, allowed: Set[str]) -> bool:
    """Whether the mask of a layer excludes an F-curve.

    A rotation of a bone is excluded only if the mask excludes all its angles.

    Args:
        path: data path of the F-curve.
        allowed: allowed data paths of sliders, and allowed names from `clip_units.BONES`.
    """
    for bone, names in clip_logic.TURNS.items():
        if path.startswith(f'pose.bones["{bone}"].rotation_'):
            return not allowed & set(names)
    if path == 'pose.bones["eyes"].location':
        return not allowed & set(clip_logic.TARGET)
    return path not in allowed
