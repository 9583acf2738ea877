# SPDX-License-Identifier: GPL-3.0-or-later
"""The layers of a character, compiled to native curves and mixed over its sliders.

What is compiled is kept by the character and compared with what it was made of: a frame costs one
look at the settings and one native call, and nothing at all without layers. No Blender object is
kept.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import bpy
import numpy as np
from mathutils import Quaternion
from numpy.typing import NDArray

from ... import native
from ...logic.animation import clip_units as clip_logic
from ...logic.animation import layer_rules as logic
from ...logic.base.errors import FaceError
from ..base import compat, parts
from ..base.blender_types import ArmatureObject, Depsgraph
from ..character import runtime
from . import clip_actions
from .layer_properties import REACTIONS, RISORIUS_PG_layer, RISORIUS_PG_reaction

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
_KEY_SETTINGS = (
    "co",
    "interpolation",
    "easing",
    "handle_left_type",
    "handle_right_type",
    "handle_left",
    "handle_right",
)
_BLENDS = {"OVERRIDE": "override", "ADD": "additive", "MAXIMUM": "max"}
_MOST_FIRED = 4096
_IDLE_LOOP = 120.0  # seconds before idle life without a length comes again


@dataclass
class Stack:
    """Compiled layers of a character.

    Attributes:
        made_of: what they were compiled from.
        mixer: risorius.Mixer of the character's labels, then the head's three angles.
        layers: risorius.Layer, bottom to top, at full weight.
        places: of each the place among the settings.
        weights: of all settings by place, as the mixer has them now.
        problems: sentences on layers that cannot be played, by their place.
        kept: sources and masks, by what they were made of.
    """

    made_of: tuple[Any, ...]
    mixer: native.Mixer
    layers: list[native.Layer] = field(default_factory=list)
    places: list[int] = field(default_factory=list)
    weights: tuple[float, ...] = ()
    problems: dict[int | str, str] = field(default_factory=dict)
    kept: Kept = field(default_factory=dict)


Times = dict[str, Any]  # keyword arguments of risorius.Layer that say when it plays
Source = tuple[Any, Times]  # a risorius.Clip, or a pose as a dict
Kept = dict[tuple[object, ...], Any]  # sources and masks by what they were made of

_stacks: dict[int, Stack] = {}  # session uid of a control armature -> Stack
_versions: dict[int, int] = {}  # session uid of an action -> how often it was edited


def places(controls: bpy.types.Object) -> bpy.types.bpy_prop_collection_idprop[RISORIUS_PG_layer]:
    """The settings of all layers of a character by their places, which never change.

    Args:
        controls: its control armature.
    """
    return getattr(controls, logic.COLLECTION)


def of(controls: bpy.types.Object) -> list[RISORIUS_PG_layer]:
    """The layers that are there, bottom to top. Args: controls  the control armature."""
    return [layer for _place, layer in _ordered(controls)]


def _ordered(controls: bpy.types.Object) -> list[tuple[int, RISORIUS_PG_layer]]:
    """Place and layer of those that are there, bottom to top."""
    there = ((i, layer) for i, layer in enumerate(places(controls)) if not layer.removed)
    return sorted(there, key=lambda pair: pair[1].rank)


def reactions_of(
    controls: bpy.types.Object,
) -> bpy.types.bpy_prop_collection_idprop[RISORIUS_PG_reaction]:
    """The reactions that were fired."""
    return getattr(controls, REACTIONS)


def has_any(controls: ArmatureObject) -> bool:
    """Whether anything is played above the sliders."""
    return len(reactions_of(controls)) > 0 or any(not layer.mute for layer in of(controls))


def forget() -> None:
    """Drop all that is compiled: after load and undo, session uids may mean others."""
    _stacks.clear()


def forget_unused(there: Iterable[ArmatureObject | None]) -> None:
    """Drop what is compiled of characters that are gone. Args: there  control armatures."""
    kept = {controls.session_uid for controls in there if controls is not None}
    for uid in [uid for uid in _stacks if uid not in kept]:
        del _stacks[uid]


def note_edits(actions: Iterable[bpy.types.Action]) -> None:
    """Note that actions were edited: what is made of them is made anew."""
    for action in actions:
        _versions[action.session_uid] = _versions.get(action.session_uid, 0) + 1


def plays(controls: ArmatureObject, actions: Collection[bpy.types.Action]) -> bool:
    """Whether a layer of a character plays one of the actions."""
    return any(layer.action in actions for layer in of(controls) if layer.action is not None)


def mix(
    seen: ArmatureObject,
    live: runtime.Runtime,
    raw: NDArray[np.float32],
    head: Quaternion | None,
    depsgraph: Depsgraph,
    maximum: float,
) -> tuple[NDArray[np.float32], Quaternion | None]:
    """Mix the layers of a character over its sliders and its head bone.

    Args:
        seen: the evaluated control armature; its layers have the weights of this frame.
        live: the character's Runtime.
        raw: float32[R], the sliders.
        head: Quaternion in the armature's axes by which the head bone is turned, or None.
        depsgraph: its scene gives the time.
        maximum: of the sliders.

    Returns:
        float32[R], and the head's turn.
    """
    controls = seen.original
    if not has_any(controls) or parts.BAKED in controls:
        return raw, head  # baked controls have them in their action
    scene = depsgraph.scene
    stack = compiled(controls, live, scene, maximum)
    # Where there are not as many, one was added and not evaluated since.
    there = len(places(seen)) == len(places(controls))
    weights = tuple(layer.weight for layer in places(seen if there else controls))
    if stack.weights != weights:
        _set_weights(stack, weights)
    base = np.zeros(len(raw) + 3, np.float32)
    base[: len(raw)] = raw
    if head is not None:
        base[len(raw) :] = clip_logic.angles_of(np.array(head))
    out = stack.mixer.evaluate(scene.frame_current_final / clip_actions.frame_rate(scene), base)
    angles = out[len(raw) :]
    if not np.array_equal(angles, base[len(raw) :]):
        head = Quaternion(clip_logic.quaternions(angles[None].astype(np.float64))[0])
    return np.ascontiguousarray(out[: len(raw)]), head


def compiled(
    controls: ArmatureObject, live: runtime.Runtime, scene: bpy.types.Scene, maximum: float = 1.0
) -> Stack:
    """The Stack of a character, compiled anew only where something changed."""
    rate = clip_actions.frame_rate(scene)
    made_of = (
        (id(live), maximum, controls.risorius_layer_rules),
        tuple((r.name, r.frame / rate, r.strength) for r in reactions_of(controls)),
        tuple((i, *_key(y, rate), *_get(y, _OF_PLAYING)) for i, y in _ordered(controls)),
    )
    stack = _stacks.get(controls.session_uid)
    if stack is None or stack.made_of != made_of:
        stack = _compile(controls, live, rate, maximum, made_of, stack)
        _stacks[controls.session_uid] = stack
    return stack


def _get(layer: RISORIUS_PG_layer, names: Iterable[str]) -> Iterator[object]:
    return (getattr(layer, name) for name in names)


def _key(layer: RISORIUS_PG_layer, rate: float) -> tuple[tuple[object, ...], tuple[object, ...]]:
    """What a layer's curves depend on, and what its mask does."""
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
    """A new Stack. Args: old  the one before it, whose curves serve where they are the same."""
    same_face = old is not None and old.made_of[0] == made_of[0]
    stack = Stack(made_of, _mixer(controls, live, maximum) if not same_face else old.mixer)
    kept = old.kept if same_face else {}
    for place, layer in _ordered(controls):
        try:
            stack.layers.append(native_layer(controls, live, layer, rate, kept, stack.kept))
            stack.places.append(place)
        except (ValueError, LookupError, RuntimeError) as error:
            stack.problems[place] = str(error).rstrip(".")
    _fire(stack, controls, rate)
    stack.mixer.layers = stack.layers
    return stack


def _mixer(controls: ArmatureObject, live: runtime.Runtime, maximum: float) -> native.Mixer:
    return native.module().Mixer(
        [*live.labels, *clip_logic.HEAD],
        ranges={n: (low, maximum) for n, low in zip(live.labels, live.lowest, strict=True)},
        exclusives="default" if controls.risorius_layer_rules else None,
        max_fired=_MOST_FIRED,
    )


def _fire(stack: Stack, controls: ArmatureObject, rate: float) -> None:
    """Fire all reactions, whenever they are: so each frame is the same in any order of frames."""
    stack.mixer.clear_fired()
    for reaction in reactions_of(controls):
        try:
            fired = stack.mixer.fire(reaction.name, reaction.frame / rate, reaction.strength)
        except KeyError:
            stack.problems[reaction.name] = "there is no such reaction"
            continue
        if not fired:
            stack.problems["Reactions"] = f"only the first {_MOST_FIRED} are shown"


def _set_weights(stack: Stack, weights: tuple[float, ...]) -> None:
    """Give the layers the weights of this frame: cheap, their curves stay."""
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
    """A layer as risorius.Layer, at full weight.

    Args:
        controls: control armature.
        live: the character's Runtime.
        layer: its settings.
        rate: frames per second.
        old: sources and masks made before, which serve again; the mixer knows them.
        kept: where those of this layer are put.

    Raises:
        ValueError: it has nothing to play, or something that does not fit; the sentence says what.
    """
    old, kept = old or {}, {} if kept is None else kept
    source_key, mask_key = _key(layer, rate)
    if source_key not in kept:
        made = old.get(source_key)
        kept[source_key] = made or _SOURCES[layer.kind](controls, live, layer, rate)
    if mask_key not in kept:
        made = old.get(mask_key)
        kept[mask_key] = _mask(live, layer) if made is None else made
    source, own = kept[source_key]
    return native.module().Layer(
        source,
        name=layer.name,
        blend=_BLENDS[layer.blend],
        mask=kept[mask_key],
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
    names = [*live.labels, *clip_logic.HEAD]
    return np.array([name in allowed for name in names], np.float32)


def allowed_names(live: runtime.Runtime, layer: RISORIUS_PG_layer) -> set[str]:
    """What a layer may move: sliders, and the head's angles, which belong to the neck's region."""
    chosen = {region.lower() for region in layer.regions}
    labels = [*live.labels, *clip_logic.HEAD]
    return set(logic.masked(labels, native.regions(), chosen, layer.controls))


def _still_times(layer: RISORIUS_PG_layer, rate: float) -> Times:
    """A pose stands always, or for its length from its start on."""
    if not layer.length:
        return {}
    return {"start": layer.start / rate, "end": (layer.start + layer.length) / rate}


def _expression_source(
    _controls: ArmatureObject, live: runtime.Runtime, layer: RISORIUS_PG_layer, rate: float
) -> Source:
    pose = native.part("expressions").get(layer.expression).weights
    return _for_face(live, pose), _still_times(layer, rate)


def _for_face(live: runtime.Runtime, pose: Mapping[str, float]) -> dict[str, float]:
    """A pose by the labels of this face's sliders; what it does not have is left out."""
    sliders = clip_actions.sliders_of(live)
    return {sliders[name]: value for name, value in pose.items() if name in sliders}


def _action_source(
    controls: ArmatureObject, live: runtime.Runtime, layer: RISORIUS_PG_layer, rate: float
) -> Source:
    action = layer.action
    if action is None:
        raise FaceError("choose an action")
    span = span_of(layer)
    curves = clip_actions.playing_curves(action, controls)
    keys = np.unique(np.concatenate([clip_actions.key_points(c)[0] for c in curves] or [[]]))
    frames = logic.sample_frames(span, keys, any(clip_actions.is_bent(c) for c in curves))
    clip = clip_actions.clip_of_action(controls, live, action, frames, rate)
    if not clip.names:
        raise FaceError(f"{action.name} has no keys of a control of this face")
    if clip.frame_count < 2:
        return clip, _still_times(layer, rate)
    return clip, _span_times(span, rate)


def span_of(layer: RISORIUS_PG_layer, action: bpy.types.Action | None = None) -> logic.Span:
    """When a layer plays its action, or another one instead."""
    first, last = (action or layer.action).frame_range
    points = sorted((point.frame, point.source) for point in layer.warp)
    warp = None
    if len(points) > 1:
        shown, own = (np.array(column, np.float64) for column in zip(*points, strict=True))
        warp = shown, own
    return logic.Span(
        layer.start,
        min(first + layer.trim_start, last),
        max(last - layer.trim_end, first + layer.trim_start),
        layer.scale,
        layer.repeat,
        layer.reverse,
        warp,
    )


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
    """Idle life of its length, or in a long loop that goes on for ever."""
    endless = not layer.length
    seconds = _IDLE_LOOP if endless else layer.length / rate
    clip = native.part("anim.idle").idle(layer.seed, seconds, loop=endless)
    sliders = clip_actions.sliders_of(live)
    clip = clip.selected([name for name in clip.names if name in sliders])
    times = {"start": layer.start / rate}
    if endless:  # its loop has no begin and no end to fade at
        times.update(extend="repeat", fade_in=0.0, fade_out=0.0)
    return clip.replaced(names=[sliders[name] for name in clip.names]), times


_SOURCES = {"ACTION": _action_source, "EXPRESSION": _expression_source, "IDLE": _idle_source}


def problems(controls: ArmatureObject, live: runtime.Runtime, scene: bpy.types.Scene) -> list[str]:
    """Sentences on layers that cannot be played, as last compiled."""
    stack = compiled(controls, live, scene, parts.maximum_of(controls))
    names: dict[int | str, str] = {
        place: layer.name for place, layer in enumerate(places(controls))
    }
    return [f"{names.get(place, place)}: {words}." for place, words in stack.problems.items()]


def known_reactions() -> dict[str, native.Reaction]:
    """Name -> what can be fired."""
    return native.part("anim.reactions").load_reactions()


def fits(controls: ArmatureObject, action: bpy.types.Action) -> bool:
    """Whether an action has keys of a slider of a character."""
    path = parts.property_path("")[:-3]
    return any(c.data_path.startswith(path) for c in compat.curves_for(action, controls))


def add_warp_point(layer: RISORIUS_PG_layer, frame: float) -> None:
    """Pin what a layer with an action shows at a frame of the scene to that frame.

    The first time its two ends are pinned too, so that nothing else changes.
    """
    span = span_of(layer)
    shown = float(span.source(np.array([frame]))[0])
    if not len(layer.warp):
        begin, end = span.start, span.start + span.period
        ends = (span.last, span.first) if span.reverse else (span.first, span.last)
        for at, source in zip((begin, end), ends, strict=True):
            _add_point(layer, at, source)
    if all(abs(point.frame - frame) > 1e-3 for point in layer.warp):
        _add_point(layer, frame, shown)


def _add_point(layer: RISORIUS_PG_layer, frame: float, source: float) -> None:
    point = layer.warp.add()
    point.frame, point.source = frame, source


def add(controls: ArmatureObject, kind: str, name: str, **settings: object) -> RISORIUS_PG_layer:
    """Put a new layer on top of the others and make it the active one.

    Args:
        controls: control armature.
        kind: see layer_props.KINDS.
        name: what the list shows; numbered where a layer has it already.
        settings: other properties of the layer.

    Returns:
        The layer.
    """
    there = of(controls)
    layer_name = _free_name(name, {layer.name for layer in there})
    rank = there[-1].rank + 1 if there else 0
    layer = places(controls).add()
    layer.name, layer.kind, layer.rank = layer_name, kind, rank
    for key, value in settings.items():
        setattr(layer, key, value)
    controls.risorius_layers_index = len(places(controls)) - 1
    controls.update_tag()
    return layer


def _free_name(name: str, taken: Collection[str]) -> str:
    if name not in taken:
        return name
    return next(n for n in (f"{name}.{i:03d}" for i in range(1, 10_000)) if n not in taken)


def add_action(
    controls: ArmatureObject, action: bpy.types.Action, **settings: object
) -> RISORIUS_PG_layer:
    """A layer that plays an action where its keys are. Returns: the layer."""
    first = action.frame_range[0]
    return add(controls, "ACTION", action.name, action=action, start=first, **settings)


def place_of(controls: ArmatureObject, layer: RISORIUS_PG_layer) -> int:
    """The place of a layer: what its keys and drivers call it by."""
    return list(places(controls)).index(layer)


def remove(controls: ArmatureObject, place: int) -> None:
    """Remove a layer, and the keys of its weight where no other character plays them.

    Its place stays empty while an action has keys for it, so that they move no other layer.
    """
    layer = places(controls)[place]
    below = of(controls).index(layer) - 1
    layer.removed, layer.action = True, None
    for curves in _own_curve_lists(controls):
        for curve in [c for c in curves if logic.place_of(c.data_path) == place]:
            curves.remove(curve)
    if not controls.override_library:
        _trim(controls)
    there = of(controls)
    if there:
        controls.risorius_layers_index = place_of(controls, there[max(below, 0)])
    controls.update_tag()


def _trim(controls: ArmatureObject) -> None:
    """Take empty places from the end that no action of the file has keys for."""
    curves = (c for action in bpy.data.actions for c in compat.curves_of(action))
    keyed = {logic.place_of(c.data_path) for c in curves}
    last = len(places(controls)) - 1
    while last >= 0 and places(controls)[last].removed and last not in keyed:
        places(controls).remove(last)
        last -= 1


def move(controls: ArmatureObject, place: int, up: bool) -> bool:
    """Put a layer one higher or lower; its place, and with it its keys, stay.

    Returns:
        Whether there was one to change with.
    """
    there = of(controls)
    at = there.index(places(controls)[place])
    to = at + 1 if up else at - 1
    if not 0 <= to < len(there):
        return False
    there.insert(to, there.pop(at))
    _rank(there)
    controls.update_tag()
    return True


def _rank(there: Sequence[RISORIUS_PG_layer]) -> None:
    for rank, layer in enumerate(there):
        if layer.rank != rank:
            layer.rank = rank


def duplicate(controls: ArmatureObject, place: int) -> RISORIUS_PG_layer:
    """Put a copy of a layer, with the keys of its weight, right above it. Returns: the copy."""
    source = places(controls)[place]
    name, kind = source.name, source.kind
    add(controls, kind, name)
    source, copy = places(controls)[place], places(controls)[-1]  # adding moved them in memory
    for prop in source.bl_rna.properties:
        if prop.identifier not in ("rna_type", "name", "kind", "warp", "rank"):
            setattr(copy, prop.identifier, getattr(source, prop.identifier))
    for point in source.warp:
        added = copy.warp.add()
        added.frame, added.source = point.frame, point.source
    there = [layer for layer in of(controls) if layer != copy]
    there.insert(there.index(source) + 1, copy)
    _rank(there)
    _copy_curves(controls, place, len(places(controls)) - 1)
    return copy


def _own_curve_lists(controls: ArmatureObject) -> Iterator[Any]:
    """The lists of F-curves that move a control armature and nothing else, its drivers too."""
    played = [action for action in compat.played_actions(controls) if action.library is None]
    users = bpy.data.user_map(subset=played) if played else {}
    for action in played:
        bag = compat.bag_for(action, controls) if users[action] == {controls} else None
        if bag is not None:
            yield bag.fcurves
    if controls.animation_data is not None:
        yield controls.animation_data.drivers


def _copy_curves(controls: ArmatureObject, place: int, to: int) -> None:
    for curves in _own_curve_lists(controls):
        if not hasattr(curves, "new") or curves == controls.animation_data.drivers:
            continue
        for curve in [c for c in curves if logic.place_of(c.data_path) == place]:
            path = curve.data_path.replace(f"[{place}]", f"[{to}]", 1)
            copy_keys(curve, curves.new(path, index=curve.array_index))


def copy_keys(source: bpy.types.FCurve, target: bpy.types.FCurve) -> None:
    """Give an F-curve without keys those of another."""
    target.keyframe_points.add(len(source.keyframe_points))
    for new, old in zip(target.keyframe_points, source.keyframe_points, strict=True):
        for name in _KEY_SETTINGS:
            setattr(new, name, getattr(old, name))
    target.update()


def keep_weights(controls: ArmatureObject, before: bpy.types.Action | None) -> None:
    """Give the action that now plays the keys of weights that were in another one.

    Args:
        controls: control armature.
        before: the action that it played until now, or None.
    """
    old = compat.bag_for(before, controls) if before is not None else None
    curves = [c for c in old.fcurves if c.data_path.startswith(logic.COLLECTION)] if old else []
    if not curves:
        return
    data = controls.animation_data_create()
    if data.action is None:
        action = bpy.data.actions.new(f"{controls.name} layers")
        compat.add_curves(action, controls)
        compat.assign_action(data, action, compat.slot_for(action, controls))
    assert data.action is not None
    bag = compat.bag_for(data.action, controls)
    assert bag is not None
    new = bag.fcurves
    for curve in curves:
        if new.find(curve.data_path) is None:
            copy_keys(curve, new.new(curve.data_path))


def fire(
    controls: ArmatureObject, name: str, frame: float, strength: float = 1.0
) -> RISORIUS_PG_reaction:
    """Fire a reaction at a frame. Returns: its entry in the list."""
    entry = reactions_of(controls).add()
    entry.name, entry.frame, entry.strength = name, frame, strength
    controls.risorius_reactions_index = len(reactions_of(controls)) - 1
    controls.update_tag()
    return entry


def unfire(controls: ArmatureObject, place: int) -> None:
    """Take a fired reaction out again."""
    reactions_of(controls).remove(place)
    controls.risorius_reactions_index = max(0, min(place, len(reactions_of(controls)) - 1))
    controls.update_tag()
