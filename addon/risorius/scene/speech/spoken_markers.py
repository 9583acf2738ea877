# SPDX-License-Identifier: GPL-3.0-or-later
"""Sounds as markers of the scene: put up to be seen in every timeline, moved, and read again.

Markers of the scene, not of the action: timeline, dope sheet, graph editor and NLA all show them,
also where the voice is a layer and not the active action. They only stand for the list that the
action keeps; the user's own markers are never touched.
"""

from __future__ import annotations

import bpy

from ... import native
from ...logic.animation import spoken
from ...logic.animation.spoken import Mark, Placing
from ..base import parts, saved
from . import spoken_keys, voices

_PLACE = "risorius_sound"  # on a marker: the place of its sound in the list
_VOICE = "risorius_voice"  # on the same: the mark of the voice


def label(name: str) -> str:
    """What animators call the mouth of a phoneme: M B P, Oo."""
    found: str = native.part("speech.phones").label_of(name)
    return found


def named(text: str) -> str | None:
    """The phoneme that somebody means, or None."""
    found: str | None = native.part("speech.phones").phone_named(text)
    return found


def _ours(
    scene: bpy.types.Scene, action: bpy.types.Action | None
) -> list[bpy.types.TimelineMarker]:
    """The markers of a voice. Args: action  None for those of all voices."""
    voice = spoken_keys.of(action).mark if action is not None else None
    there = [(m, saved.text(m, _VOICE)) for m in scene.timeline_markers]
    return [m for m, has in there if has and voice in (None, has)]


def are_shown(scene: bpy.types.Scene, action: bpy.types.Action) -> bool:
    """Whether a voice has markers in a scene. Args: action  with the voice."""
    return bool(_ours(scene, action))


def hide(scene: bpy.types.Scene) -> None:
    """Take the markers of all voices out of a scene; the user's own stay."""
    for marker in _ours(scene, None):
        scene.timeline_markers.remove(marker)


def show(scene: bpy.types.Scene, action: bpy.types.Action, placing: Placing) -> None:
    """Put up a marker for each sound of a voice, instead of those of any other voice.

    Args:
        scene: gets them.
        action: with a voice.
        placing: where it lies in the scene.
    """
    hide(scene)
    for place, (name, frame) in enumerate(_wanted(action, placing)):
        marker = scene.timeline_markers.new(name, frame=frame)
        marker[_PLACE], marker[_VOICE] = place, spoken_keys.of(action).mark
        marker.select = False


def _wanted(action: bpy.types.Action, placing: Placing) -> list[tuple[str, int]]:
    return [
        (spoken.label_of(sound, label(sound.name))[:63], round(placing.shown(sound.begin)))
        for sound in spoken_keys.sounds_of(action)
    ]


def are_changed(scene: bpy.types.Scene, action: bpy.types.Action, placing: Placing) -> bool:
    """Whether somebody moved, renamed, copied or deleted markers of a voice that are shown.

    Args:
        scene: has the markers.
        action: with a voice.
        placing: where it lies in the scene.
    """
    wanted = [(i, *row) for i, row in enumerate(_wanted(action, placing))]
    there = [(mark.place, mark.name, mark.frame) for mark in _marks(scene, action)]
    return bool(there) and sorted(there) != wanted


def _marks(scene: bpy.types.Scene, action: bpy.types.Action) -> list[Mark]:
    return [Mark(saved.whole(m, _PLACE, -1), m.frame, m.name.strip()) for m in _ours(scene, action)]


def take(scene: bpy.types.Scene, action: bpy.types.Action, placing: Placing) -> list[str]:
    """Let the list, and the mouth's keys, follow the markers of a voice.

    Args:
        scene: has the markers.
        action: with a voice.
        placing: where it lies in the scene.

    Returns:
        The names of markers that were moved past a neighbour: their sounds stay beside it.

    Raises:
        SpokenError: no marker is left, or one is called what stands for no sound; nothing changes.
    """
    sounds = spoken_keys.sounds_of(action)
    end = spoken_keys.of(action).end
    found = _marks(scene, action)
    new, held = spoken.from_marks(sounds, found, placing, end, label, named)
    spoken_keys.change(action, new)
    show(scene, action, placing)
    return [spoken.label_of(sounds[i], label(sounds[i].name)) for i in held]


def follow(action: bpy.types.Action) -> None:
    """Put markers that are shown where the list of a voice has its sounds now."""
    for scene in bpy.data.scenes:
        if not are_shown(scene, action):
            continue
        for controls in filter(None, map(parts.controls_of, parts.rigs())):
            if action in voices.all_of(controls):
                show(scene, action, voices.placing(controls, action))
                break
