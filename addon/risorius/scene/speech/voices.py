# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the voices that a face plays, and maps their frames to frames of the scene.

A voice is the recorded speech from which an action was made.
"""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ...logic.animation.spoken import Placing
from ..animation import layers
from ..base import compat
from ..base.blender_types import ArmatureObject
from . import spoken_keys


def all_of(controls: ArmatureObject) -> list[bpy.types.Action]:
    """The actions with a voice that a face plays, in this order: action of the chosen layer, active
    action, NLA strips, other layers.

    Args:
        controls: its control armature.
    """
    found = [action for action in _played(controls) if len(spoken_keys.of(action).sounds)]
    return list(dict.fromkeys(found))


def _played(controls: ArmatureObject) -> Iterator[bpy.types.Action]:
    there, chosen = layers.of(controls), controls.risorius_layers_index
    places = layers.places(controls)
    if 0 <= chosen < len(places) and places[chosen] in there and places[chosen].action is not None:
        yield places[chosen].action
    yield from compat.played_actions(controls)
    yield from (layer.action for layer in there if layer.action is not None)


def placing(controls: ArmatureObject, action: bpy.types.Action) -> Placing:
    """The mapping from frames of an action to frames of the scene.

    Frames stay unchanged if the action is the active action, or if no layer or NLA strip plays it.
    Repeats of a layer are ignored. If a layer has warp points, the mapping is the line through the
    first and the last warp point.

    Args:
        controls: the face's control armature.
        action: an action that it plays.
    """
    data = controls.animation_data
    if data is not None and data.action == action:
        return Placing()
    for layer in layers.of(controls):
        if layer.action == action:
            span = layers.span_of(layer)
            scale = -span.scale if span.reverse else span.scale
            shown = span.last if span.reverse else span.first
            if span.warp is not None and span.warp[1][-1] != span.warp[1][0]:
                at, own = span.warp
                scale = float((at[-1] - at[0]) / (own[-1] - own[0]))
                return Placing(float(at[0]) - scale * float(own[0]), scale)
            return Placing(span.start - scale * shown, scale)
    for track in data.nla_tracks if data is not None else ():
        for strip in track.strips:
            if strip.action == action:
                scale = strip.scale
                return Placing(strip.frame_start - scale * strip.action_frame_start, scale)
    return Placing()
