# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads, orders and changes the animation layers and the reactions of a character.

A reaction is a short animation from Risorius' files that starts (is fired) at a frame.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Any

import bpy
import numpy as np

from ... import native
from ...logic.animation import layer_rules as logic
from ..base import compat, parts
from ..base.blender_types import ArmatureObject
from ..character import shown_keys
from .layer_properties import REACTIONS, RISORIUS_PG_layer, RISORIUS_PG_reaction

_KEY_SETTINGS = (
    "co",
    "interpolation",
    "easing",
    "handle_left_type",
    "handle_right_type",
    "handle_left",
    "handle_right",
)


def places(controls: bpy.types.Object) -> bpy.types.bpy_prop_collection_idprop[RISORIUS_PG_layer]:
    """The collection of a character's layers. The index (place) of a layer never changes.

    Args:
        controls: control armature of the character.
    """
    return getattr(controls, logic.COLLECTION)


def of(controls: bpy.types.Object) -> list[RISORIUS_PG_layer]:
    """The layers that are not removed, bottom to top.

    Args:
        controls: the control armature.
    """
    return [layer for _place, layer in ordered(controls)]


def ordered(controls: bpy.types.Object) -> list[tuple[int, RISORIUS_PG_layer]]:
    """(place, layer) of each layer that is not removed, bottom to top."""
    there = ((i, layer) for i, layer in enumerate(places(controls)) if not layer.removed)
    return sorted(there, key=lambda pair: pair[1].rank)


def reactions_of(
    controls: bpy.types.Object,
) -> bpy.types.bpy_prop_collection_idprop[RISORIUS_PG_reaction]:
    """The collection of fired reactions, stored on the control armature."""
    return getattr(controls, REACTIONS)


def has_any(controls: ArmatureObject) -> bool:
    """Whether a character has a fired reaction or a layer that is not muted."""
    return len(reactions_of(controls)) > 0 or any(not layer.mute for layer in of(controls))


def plays(controls: ArmatureObject, actions: Collection[bpy.types.Action]) -> bool:
    """Whether a layer of a character plays one of the actions.

    Args:
        controls: control armature of the character.
        actions: actions to look for.
    """
    return any(layer.action in actions for layer in of(controls) if layer.action is not None)


def span_of(layer: RISORIUS_PG_layer, action: bpy.types.Action | None = None) -> logic.Span:
    """The timing of an action in a layer: start, played frames, speed and warp points.

    Without `action`, the action of the layer is used. A single warp point has no effect; two or
    more replace the speed.
    """
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


def known_reactions() -> dict[str, native.Reaction]:
    """Name -> definition, for all reactions that can be fired."""
    return native.part("anim.reactions").load_reactions()


def fits(controls: ArmatureObject, action: bpy.types.Action) -> bool:
    """Whether an action has keys of a slider of a character.

    Args:
        controls: control armature of the character.
        action: any action; of an action with slots, the slot for these controls is read.
    """
    path = parts.property_path("")[:-3]
    return any(c.data_path.startswith(path) for c in compat.curves_for(action, controls))


def add_warp_point(layer: RISORIUS_PG_layer, frame: float) -> None:
    """Add a warp point at a scene frame, with the frame of the animation that the layer shows then.

    The first warp point also adds one at each end of the layer, so that the timing does not change.
    A frame that has a warp point gets no second one.
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
    """Add a layer on top and make it active.

    Args:
        controls: control armature.
        kind: source of the layer: "ACTION", "EXPRESSION" or "IDLE".
        name: name in the list; a number is added if another layer has it.
        settings: other properties of the layer by name.

    Returns:
        The new layer.
    """
    there = of(controls)
    layer_name = _free_name(name, {layer.name for layer in there})
    rank = there[-1].rank + 1 if there else 0
    layer = places(controls).add()
    layer.name, layer.kind, layer.rank = layer_name, kind, rank
    if kind == "EXPRESSION":
        layer.edition = native.part("expressions").EDITION
    for key, value in settings.items():
        setattr(layer, key, value)
    controls.risorius_layers_index = len(places(controls)) - 1
    shown_keys.show_some(controls)
    controls.update_tag()
    return layer


def _free_name(name: str, taken: Collection[str]) -> str:
    if name not in taken:
        return name
    return next(n for n in (f"{name}.{i:03d}" for i in range(1, 10_000)) if n not in taken)


def add_action(
    controls: ArmatureObject, action: bpy.types.Action, **settings: object
) -> RISORIUS_PG_layer:
    """Add a layer that plays an action at the frames of the action.

    Args:
        controls: control armature of the character.
        action: action to play; the layer starts at the first frame of the action.
        settings: other properties of the layer by name.

    Returns:
        The new layer, on top of the others.
    """
    first = action.frame_range[0]
    return add(controls, "ACTION", action.name, action=action, start=first, **settings)


def place_of(controls: ArmatureObject, layer: RISORIUS_PG_layer) -> int:
    """The index of a layer in the collection; keys and drivers name the layer by this index.

    Args:
        controls: control armature of the character.
        layer: a layer of the character, also a removed one.
    """
    return list(places(controls)).index(layer)


def remove(controls: ArmatureObject, place: int) -> None:
    """Remove a layer, and the driver and the keys of its weight.

    The keys stay in linked actions and in actions that another datablock uses too. The collection
    entry stays, hidden, while an action has keys for its index or a later entry exists, so that
    keys move no other layer. In a library override it always stays.

    Args:
        controls: control armature of the character.
        place: index of the layer, from place_of.
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
    """Delete removed entries at the end of the collection for which no action has keys."""
    curves = (c for action in bpy.data.actions for c in compat.curves_of(action))
    keyed = {logic.place_of(c.data_path) for c in curves}
    last = len(places(controls)) - 1
    while last >= 0 and places(controls)[last].removed and last not in keyed:
        places(controls).remove(last)
        last -= 1


def move(controls: ArmatureObject, place: int, up: bool) -> bool:
    """Move a layer up or down in the stack. Its index in the collection and its keys stay.

    Args:
        controls: control armature of the character.
        place: index of the layer, from place_of.
        up: True: up; False: down.

    Returns:
        Whether the layer was moved; False at the end of the stack.
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
    """Add a copy of a layer directly above this layer, and copy the keys of its weight.

    Keys in linked actions, keys in actions that another datablock uses too, and a driver of the
    weight are not copied.

    Args:
        controls: control armature of the character.
        place: index of the layer, from place_of.

    Returns:
        The copy.
    """
    source = places(controls)[place]
    name, kind = source.name, source.kind
    add(controls, kind, name)
    source, copy = places(controls)[place], places(controls)[-1]  # `add` invalidated `source`
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
    """Yields collections of F-curves that belong to this armature alone.

    Each action that only this armature uses gives its F-curves; the last collection has the
    drivers of the armature. Linked actions are left out.
    """
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
        data = controls.animation_data
        if not hasattr(curves, "new") or (data is not None and curves == data.drivers):
            continue
        for curve in [c for c in curves if logic.place_of(c.data_path) == place]:
            path = curve.data_path.replace(f"[{place}]", f"[{to}]", 1)
            copy_keys(curve, curves.new(path, index=curve.array_index))


def copy_keys(source: bpy.types.FCurve, target: bpy.types.FCurve) -> None:
    """Copy the keys of an F-curve, with handles and interpolation, to an F-curve without keys.

    Args:
        source: the F-curve with keys; unchanged.
        target: the F-curve without keys.
    """
    target.keyframe_points.add(len(source.keyframe_points))
    for new, old in zip(target.keyframe_points, source.keyframe_points, strict=True):
        for name in _KEY_SETTINGS:
            setattr(new, name, getattr(old, name))
    target.update()


def keep_weights(controls: ArmatureObject, before: bpy.types.Action | None) -> None:
    """Copy the keys of layer weights from the earlier action to the active action.

    If there are such keys but no active action, a new action is made. A weight that has keys in the
    active action keeps them.

    Args:
        controls: control armature.
        before: the earlier active action; None: nothing is copied.
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
    """Fire a reaction at a frame.

    Args:
        controls: control armature of the character.
        name: name of the reaction, a key of the dict known_reactions().
        frame: frame of the scene; need not be whole.
        strength: 0 to 1, factor on the reaction's values.

    Returns:
        The new entry of the list of fired reactions.
    """
    entry = reactions_of(controls).add()
    entry.name, entry.frame, entry.strength = name, frame, strength
    controls.risorius_reactions_index = len(reactions_of(controls)) - 1
    controls.update_tag()
    return entry


def unfire(controls: ArmatureObject, place: int) -> None:
    """Remove a fired reaction.

    Args:
        controls: control armature of the character.
        place: index of the reaction in `reactions_of`.
    """
    reactions_of(controls).remove(place)
    controls.risorius_reactions_index = max(0, min(place, len(reactions_of(controls)) - 1))
    controls.update_tag()
