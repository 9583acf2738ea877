# SPDX-License-Identifier: GPL-3.0-or-later
"""Compiles the animation layers of a character, and mixes them over sliders and bones.

Compiled layers are cached for each character together with the settings they were made from. A
frame of a character with layers costs one comparison of settings and one native call. The cache
holds no Blender object. Fired reactions (short animations that start at a frame) are mixed too.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeAlias

import bpy
import numpy as np
from mathutils import Quaternion, Vector
from numpy.typing import NDArray

from ... import native
from ...logic.animation import clip_units as clip_logic
from ...logic.animation import layer_rules as logic
from ...logic.base.errors import FaceError
from ...logic.base.sentences import Sentence, told
from ..base import parts, session
from ..base.blender_types import ArmatureObject, Depsgraph
from ..character import runtime
from . import clip_actions, layers
from .layer_properties import RISORIUS_PG_layer

TURNED = tuple(clip_logic.TURNS)  # names of the control bones whose rotations are mixed
_OF_SOURCE = (
    "kind",
    "expression",
    "seed",
    "start",
    "scale",
    "trim_start",
    "trim_end",
    "length",
    "repeat",
    "reverse",
)
_OF_PLAYING = ("name", "blend", "extend", "fade_in", "fade_out", "mute", "solo")
_BLENDS = {"OVERRIDE": "override", "ADD": "additive", "MAXIMUM": "max"}
_MOST_FIRED = 4096
_IDLE_LOOP = 120.0  # seconds after which idle life without a length repeats


Times = dict[str, object]  # keyword arguments of risorius.Layer that say when it plays
Source: TypeAlias = "tuple[native.Clip | dict[str, float], Times]"


@dataclass
class Bones:
    """Rotations and gaze target of the control bones.

    Attributes:
        turns: "head", "neck", "eye_L", "eye_R" -> Quaternion in the axes of the armature; bones
            that are not rotated are left out.
        target: offset of the gaze target from its rest location, in the axes of the target's
            bone; None without an offset.
    """

    turns: dict[str, Quaternion] = field(default_factory=dict)
    target: Vector | None = None


@dataclass
class Kept:
    """Cache of compiled layer sources (clips or poses) and of compiled masks.

    The keys are the settings of a layer that determine its source or its mask.
    """

    sources: dict[tuple[object, ...], Source] = field(default_factory=dict)
    masks: dict[tuple[object, ...], NDArray[np.float32]] = field(default_factory=dict)


@dataclass
class Stack:
    """Compiled layers of a character.

    Attributes:
        made_of: the settings that the layers were compiled from.
        mixer: mixes the values of the sliders and of the bone components `clip_units.BONES`, in
            this order.
        layers: risorius.Layer, bottom to top, at weight 1.
        places: index of each compiled layer in the collection of settings.
        weights: the weights in the mixer, by the index of the layer in that collection.
        problems: index of a layer, or name of a reaction -> reason why it cannot be played;
            "Reactions" -> a sentence if there are more reactions than can be played.
        kept: compiled sources and masks, which the next Stack can reuse.
    """

    made_of: tuple[object, ...]
    mixer: native.Mixer
    layers: list[native.Layer] = field(default_factory=list)
    places: list[int] = field(default_factory=list)
    weights: tuple[float, ...] = ()
    problems: dict[int | str, str] = field(default_factory=dict)
    kept: Kept = field(default_factory=Kept)


# Session uid of a control armature -> Stack.
_stacks: dict[int, Stack] = session.table("layer_mixing.stacks", ("undo", "load"))
# Session uid of an action -> number of its edits.
_versions: dict[int, int] = session.table("layer_mixing.versions", ("undo", "load"))


def forget_unused(there: Iterable[ArmatureObject | None]) -> None:
    """Drop compiled layers of deleted characters and edit counts of deleted actions.

    Args:
        there: the existing control armatures.
    """
    kept = {controls.session_uid for controls in there if controls is not None}
    for uid in [uid for uid in _stacks if uid not in kept]:
        del _stacks[uid]
    kept = {action.session_uid for action in bpy.data.actions} if _versions else set()
    for uid in [uid for uid in _versions if uid not in kept]:
        del _versions[uid]


def note_edits(actions: Iterable[bpy.types.Action]) -> None:
    """Count an edit of each action, so that layers that play it are compiled again."""
    for action in actions:
        _versions[action.session_uid] = _versions.get(action.session_uid, 0) + 1


def mix(
    seen: ArmatureObject,
    live: runtime.Runtime,
    raw: NDArray[np.float32],
    bones: Bones,
    depsgraph: Depsgraph,
    maximum: float,
) -> tuple[NDArray[np.float32], Bones]:
    """Mix the layers of a character over its sliders and its control bones.

    Args:
        seen: the evaluated control armature; its layers have the weights of this frame.
        live: the character's Runtime.
        raw: float32[R], slider values.
        bones: rotations and gaze target of the control bones.
        depsgraph: its scene gives the time.
        maximum: largest value of a slider.

    Returns:
        float32[R] slider values and control bones with the layers applied; `raw` and `bones`
        themselves if the character has no layer or its controls are baked.
    """
    controls = seen.original
    if not layers.has_any(controls) or parts.BAKED in controls:
        return raw, bones  # the action of baked controls contains the layers
    scene = depsgraph.scene
    stack = compiled(controls, live, scene, maximum)
    # If a layer was added after the last evaluation, the evaluated armature lacks it. All weights
    # then come from the original armature.
    there = len(layers.places(seen)) == len(layers.places(controls))
    weights = tuple(layer.weight for layer in layers.places(seen if there else controls))
    if stack.weights != weights:
        _set_weights(stack, weights)
    base = np.concatenate([raw, _numbers(bones)])
    out = stack.mixer.evaluate(scene.frame_current_final / clip_actions.frame_rate(scene), base)
    return np.ascontiguousarray(out[: len(raw)]), _changed(bones, base[len(raw) :], out[len(raw) :])


def _numbers(bones: Bones) -> NDArray[np.float32]:
    """float32[n] in the order of clip_units.BONES: angles in radians, then the gaze target."""
    found: list[float] = []
    for name, group in clip_logic.TURNS.items():
        turn = bones.turns.get(name)
        angles = clip_logic.angles_of(np.array(turn)).tolist() if turn is not None else [0.0] * 3
        found += angles[: len(group)]
    found += [0.0] * 3 if bones.target is None else bones.target[:]
    return np.array(found, np.float32)


def _changed(bones: Bones, before: NDArray[np.float32], after: NDArray[np.float32]) -> Bones:
    """The control bones after mixing. Bones that no layer moves keep their exact values.

    Args:
        bones: the control bones before mixing.
        before, after: float32[n], values of the bones before and after mixing, in the order of
            `clip_units.BONES`.
    """
    if np.array_equal(before, after):
        return bones
    turns, target, at = dict(bones.turns), bones.target, 0
    for name, group in clip_logic.TURNS.items():
        rows = slice(at, at + len(group))
        at += len(group)
        if not np.array_equal(before[rows], after[rows]):
            turns[name] = Quaternion(
                clip_logic.quaternions(after[None, rows].astype(np.float64))[0]
            )
    if not np.array_equal(before[at:], after[at:]):
        target = Vector(after[at:].tolist())
    return Bones(turns, target)


def compiled(
    controls: ArmatureObject, live: runtime.Runtime, scene: bpy.types.Scene, maximum: float = 1.0
) -> Stack:
    """The Stack of a character. Only changed layers are compiled again.

    Args:
        controls: the original (not evaluated) control armature.
        live: the character's Runtime.
        scene: gives the frame rate.
        maximum: largest value of a slider.
    """
    rate = clip_actions.frame_rate(scene)
    made_of = (
        (id(live), maximum, controls.risorius_layer_rules),
        tuple((r.name, r.frame / rate, r.strength) for r in layers.reactions_of(controls)),
        tuple((i, *_key(y, rate), *_get(y, _OF_PLAYING)) for i, y in layers.ordered(controls)),
    )
    stack = _stacks.get(controls.session_uid)
    if stack is None or stack.made_of != made_of:
        stack = _compile(controls, live, rate, maximum, made_of, stack)
        _stacks[controls.session_uid] = stack
    return stack


def _get(layer: RISORIUS_PG_layer, names: Iterable[str]) -> Iterator[object]:
    return (getattr(layer, name) for name in names)


def _key(layer: RISORIUS_PG_layer, rate: float) -> tuple[tuple[object, ...], tuple[object, ...]]:
    """Two keys of the cache for a layer: all settings that determine the layer's curves, and all
    settings that determine its mask.
    """
    action = layer.action
    uid = action.session_uid if action is not None else 0
    warp = tuple((point.frame, point.source) for point in layer.warp)
    source = (rate, uid, _versions.get(uid, 0), warp, *_get(layer, _OF_SOURCE))
    return source, (tuple(sorted(layer.regions)), layer.controls)


def _compile(
    controls: ArmatureObject,
    live: runtime.Runtime,
    rate: float,
    maximum: float,
    made_of: tuple[object, ...],
    old: Stack | None,
) -> Stack:
    """Compile a new Stack.

    Args:
        controls: the original control armature.
        live: the character's Runtime.
        rate: frames per second.
        maximum: largest value of a slider.
        made_of: the settings from which the Stack is made, for a later comparison.
        old: the earlier Stack, whose unchanged curves are reused; None: there is none.
    """
    same = old if old is not None and old.made_of[0] == made_of[0] else None
    stack = Stack(made_of, _mixer(controls, live, maximum) if same is None else same.mixer)
    kept = Kept() if same is None else same.kept
    for place, layer in layers.ordered(controls):
        try:
            stack.layers.append(native_layer(controls, live, layer, rate, kept, stack.kept))
            stack.places.append(place)
        except (ValueError, LookupError, RuntimeError) as error:
            reason = error.args[0] if error.args else ""
            is_told = isinstance(reason, Sentence)
            stack.problems[place] = reason if is_told else str(error).rstrip(".")
    _fire(stack, controls, rate)
    stack.mixer.layers = stack.layers
    return stack


def _mixer(controls: ArmatureObject, live: runtime.Runtime, maximum: float) -> native.Mixer:
    ranges = {n: (low, maximum) for n, low in zip(live.labels, live.lowest, strict=True)}
    # The gaze target and rotations have no limits.
    ranges |= dict.fromkeys(clip_logic.TARGET, (-np.inf, np.inf))
    return native.module().Mixer(
        [*live.labels, *clip_logic.BONES],
        ranges=ranges,
        exclusives="default" if controls.risorius_layer_rules else None,
        max_fired=_MOST_FIRED,
    )


def _fire(stack: Stack, controls: ArmatureObject, rate: float) -> None:
    """Fire all reactions of the character, so that frames can be evaluated in any order.

    Args:
        stack: the compiled layers; reactions that cannot be fired are added to its problems.
        controls: control armature of the character.
        rate: frames per second.
    """
    stack.mixer.clear_fired()
    for reaction in layers.reactions_of(controls):
        try:
            fired = stack.mixer.fire(reaction.name, reaction.frame / rate, reaction.strength)
        except KeyError:
            stack.problems[reaction.name] = told("there is no such reaction")
            continue
        if not fired:
            stack.problems["Reactions"] = told(
                "only the first {count} reactions move the face", count=_MOST_FIRED
            )


def _set_weights(stack: Stack, weights: tuple[float, ...]) -> None:
    """Set the weights of compiled layers, whose curves are not compiled again.

    Args:
        stack: the compiled layers of a character.
        weights: weight of each layer in the collection of the character's layers.
    """
    stack.mixer.layers = tuple(
        replace(layer, weight=min(max(weights[place], 0.0), 1.0))
        for layer, place in zip(stack.layers, stack.places, strict=True)
    )
    stack.weights = weights


def native_layer(
    controls: ArmatureObject,
    live: runtime.Runtime,
    layer: RISORIUS_PG_layer,
    rate: float,
    old: Kept | None = None,
    kept: Kept | None = None,
) -> native.Layer:
    """A layer as risorius.Layer, at weight 1.

    Args:
        controls: control armature.
        live: the character's Runtime.
        layer: settings of the layer.
        rate: frames per second.
        old: earlier sources and masks to reuse.
        kept: receives the source and the mask of this layer.

    Raises:
        ValueError: the layer has nothing to play, or its source cannot be used on this face; the
            text gives the reason.
    """
    old, kept = old or Kept(), kept or Kept()
    source_key, mask_key = _key(layer, rate)
    if source_key not in kept.sources:
        made = old.sources.get(source_key)
        kept.sources[source_key] = made or _SOURCES[layer.kind](controls, live, layer, rate)
    if mask_key not in kept.masks:
        mask = old.masks.get(mask_key)
        kept.masks[mask_key] = _mask(live, layer) if mask is None else mask
    source, own = kept.sources[source_key]
    return native.module().Layer(
        source,
        name=layer.name,
        blend=_BLENDS[layer.blend],
        mask=kept.masks[mask_key],
        mute=layer.mute,
        solo=layer.solo,
        **{
            "extend": layer.extend.lower(),
            "fade_in": layer.fade_in / rate,
            "fade_out": layer.fade_out / rate,
            **own,
        },
    )


def _mask(live: runtime.Runtime, layer: RISORIUS_PG_layer) -> NDArray[np.float32]:
    allowed = allowed_names(live, layer)
    names = [*live.labels, *clip_logic.BONES]
    return np.array([name in allowed for name in names], np.float32)


def allowed_names(live: runtime.Runtime, layer: RISORIUS_PG_layer) -> set[str]:
    """The names of sliders and of control bone components that a layer may move.

    The components have names from `clip_units.BONES`.

    Args:
        live: Runtime of the character, for the names of its sliders.
        layer: settings with the regions and the patterns of names.
    """
    chosen = {region.lower() for region in layer.regions}
    labels = [*live.labels, *clip_logic.BONES]
    return set(logic.masked(labels, native.regions(), chosen, layer.controls))


def _still_times(layer: RISORIUS_PG_layer, rate: float) -> Times:
    """The times in seconds, "start" and "end", between which a layer plays a constant pose.

    If the result has no "end", the pose plays from "start" for ever. If the result is empty, the
    pose plays at all times.
    """
    if not layer.length:
        return {} if layer.extend == "HOLD" else {"start": layer.start / rate}
    return {"start": layer.start / rate, "end": (layer.start + layer.length) / rate}


def _expression_source(
    _controls: ArmatureObject, live: runtime.Runtime, layer: RISORIUS_PG_layer, rate: float
) -> Source:
    pose = native.part("expressions").get(layer.expression, layer.edition).weights
    return _for_face(live, pose), _still_times(layer, rate)


def _for_face(live: runtime.Runtime, pose: Mapping[str, float]) -> dict[str, float]:
    """Convert a pose from control names to slider labels, without controls that the face lacks."""
    sliders = clip_actions.sliders_of(live)
    return {sliders[name]: value for name, value in pose.items() if name in sliders}


def _action_source(
    controls: ArmatureObject, live: runtime.Runtime, layer: RISORIUS_PG_layer, rate: float
) -> Source:
    action = layer.action
    if action is None:
        raise FaceError(told("choose an action"))
    span = layers.span_of(layer)
    curves = clip_actions.playing_curves(action, controls)
    keys = np.unique(np.concatenate([clip_actions.key_points(c)[0] for c in curves] or [[]]))
    frames = logic.sample_frames(span, keys, any(clip_actions.is_bent(c) for c in curves))
    clip = clip_actions.clip_of_action(controls, live, action, frames, rate)
    if not clip.names:
        raise FaceError(told("{action} has no keys for controls of this face", action=action.name))
    if clip.frame_count < 2:
        return clip, _still_times(layer, rate)
    return clip, _span_times(span, rate)


def _span_times(span: logic.Span, rate: float) -> Times:
    if span.warp is not None:
        return {"warp": (span.warp[0] / rate, span.warp[1] / rate)}
    return {
        "start": span.start / rate,
        "clip_range": (span.first / rate, span.last / rate),
        "scale": span.scale,
        "repeat": span.repeat,
        "reverse": span.reverse,
    }


def _idle_source(
    _controls: ArmatureObject, live: runtime.Runtime, layer: RISORIUS_PG_layer, rate: float
) -> Source:
    """A generated clip of idle motion, such as blinks, with the length of the layer.

    If the layer has no length, the clip is an endless loop.
    """
    endless = not layer.length
    seconds = _IDLE_LOOP if endless else layer.length / rate
    clip = native.part("anim.idle").idle(layer.seed, seconds, loop=endless)
    sliders = clip_actions.sliders_of(live)
    clip = clip.selected([name for name in clip.names if name in sliders])
    times: Times = {"start": layer.start / rate}
    if endless:  # a loop has no start and no end to fade at
        times.update(extend="repeat", fade_in=0.0, fade_out=0.0)
    return clip.replaced(names=[sliders[name] for name in clip.names]), times


_SOURCES = {"ACTION": _action_source, "EXPRESSION": _expression_source, "IDLE": _idle_source}


def problems(controls: ArmatureObject, live: runtime.Runtime, scene: bpy.types.Scene) -> list[str]:
    """Sentences on layers and reactions that cannot be played.

    Args:
        controls: the original (not evaluated) control armature of the character.
        live: the character's Runtime.
        scene: gives the frame rate.
    """
    stack = compiled(controls, live, scene, parts.maximum_of(controls))
    names: dict[int | str, str] = {
        place: layer.name for place, layer in enumerate(layers.places(controls))
    }
    return [
        told("{layer}: {reason}.", layer=names.get(place, place), reason=reason)
        for place, reason in stack.problems.items()
    ]
