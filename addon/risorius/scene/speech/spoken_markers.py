# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows the sounds of a voice as scene markers, and reads them back after the user moved them.

A voice is the recorded speech from which an action was made; its sounds are phonemes. Scene markers
are used instead of action markers, because timeline, dope sheet, graph editor and NLA all show
scene markers, even if a layer plays the action of the voice. The user's own markers are never
changed.
"""

from __future__ import annotations

import json

import bpy

from ... import native
from ...logic.animation import spoken
from ...logic.animation.spoken import Board, Mark, Placing
from ..base import parts, saved
from . import spoken_keys, voices

# Property of a scene, as JSON: the shown voice, its markers, and the user's own markers at the time
# when the markers of the voice were added. Markers have no tag of their own, because since Blender
# 5 a marker stores only a frame and a name.
_KEPT = "risorius_markers"


def label(name: str) -> str:
    """The animators' name of the mouth shape of a phoneme, such as "M B P" or "Oo"."""
    found: str = native.part("speech.phones").label_of(name)
    return found


def named(text: str) -> str | None:
    """The phoneme that a text names, or None."""
    found: str | None = native.part("speech.phones").phone_named(text)
    return found


def _board(scene: bpy.types.Scene) -> tuple[str, Board]:
    """The id of the voice whose markers a scene shows ("" for none), and the markers."""
    there = [Mark(m.frame, m.name) for m in scene.timeline_markers]
    try:
        kept = json.loads(saved.text(scene, _KEPT) or "{}")
        rows = ([Mark(int(f), str(n)) for f, n in kept.get(key, ())] for key in ("placed", "own"))
        placed, own = rows
        return str(kept.get("voice", "")), Board(placed, own, there)
    except (ValueError, TypeError, AttributeError):
        return "", Board([], [], there)  # the property was edited by hand


def are_shown(scene: bpy.types.Scene, action: bpy.types.Action) -> bool:
    """Whether the markers of a voice are shown in a scene.

    Args:
        scene: the scene.
        action: the action with the voice.
    """
    voice = _board(scene)[0]
    return bool(voice) and voice == spoken_keys.of(action).mark


def hide(scene: bpy.types.Scene) -> None:
    """Remove the markers of a voice from a scene; the user's own markers stay."""
    voice, board = _board(scene)
    if not voice:
        return
    found, more = board.paired(named)
    ours = [*found.values(), *more]
    for marker in list(scene.timeline_markers):
        mark = Mark(marker.frame, marker.name)
        if mark in ours:
            ours.remove(mark)
            scene.timeline_markers.remove(marker)
    del scene[_KEPT]


def show(scene: bpy.types.Scene, action: bpy.types.Action, placing: Placing) -> None:
    """Add a marker for each sound of a voice, and remove the markers shown before.

    Args:
        scene: scene for the markers.
        action: action with a voice.
        placing: maps frames of the action to frames of the scene.
    """
    hide(scene)
    own = [(m.frame, m.name) for m in scene.timeline_markers]
    placed = []
    for sound in spoken_keys.sounds_of(action):
        name = spoken.label_of(sound, label(sound.name))
        marker = scene.timeline_markers.new(name, frame=round(placing.shown(sound.begin)))
        marker.select = False
        placed.append((marker.frame, marker.name))  # Blender cuts long names
    kept = {"voice": spoken_keys.of(action).mark, "placed": placed, "own": own}
    scene[_KEPT] = json.dumps(kept)


def are_changed(scene: bpy.types.Scene, action: bpy.types.Action) -> bool:
    """Whether the shown markers of a voice were moved, renamed, copied or deleted.

    Args:
        scene: scene with the markers.
        action: action with a voice.
    """
    if not are_shown(scene, action):
        return False
    board = _board(scene)[1]
    found, more = board.paired(named)
    return bool(more) or [found.get(i) for i in range(len(board.placed))] != list(board.placed)


def take(scene: bpy.types.Scene, action: bpy.types.Action, placing: Placing) -> list[str]:
    """Update the list of sounds and the keys of the mouth from the markers of a voice.

    Args:
        scene: scene with the markers.
        action: action with a voice.
        placing: maps frames of the action to frames of the scene.

    Returns:
        The names of markers moved past a neighbour; their sounds stop next to the neighbour.

    Raises:
        SpokenError: no marker is left, or the name of a marker is no sound; nothing changes.
    """
    sounds = spoken_keys.sounds_of(action)
    end, board = spoken_keys.of(action).end, _board(scene)[1]
    new, held = spoken.from_marks(sounds, board, placing, end, label, named)
    spoken_keys.change(action, new)
    show(scene, action, placing)
    return [spoken.label_of(sounds[i], label(sounds[i].name)) for i in held]


def follow(action: bpy.types.Action) -> None:
    """Move the shown markers of a voice to the current frames of its sounds."""
    for scene in bpy.data.scenes:
        if not are_shown(scene, action):
            continue
        for controls in filter(None, map(parts.controls_of, parts.rigs())):
            if action in voices.all_of(controls):
                show(scene, action, voices.placing(controls, action))
                break
