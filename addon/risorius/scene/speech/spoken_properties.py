# SPDX-License-Identifier: GPL-3.0-or-later
"""Defines the words and sounds of a voice as properties of its action, so that Blender saves,
appends, copies and undoes them with the action."""

# Blender properties are declared as annotations that are not types:
# pyright: reportInvalidTypeForm=false

import bpy

from ...logic.animation import spoken
from ..base import parts
from ..base.blender_types import current_context
from . import spoken_keys, spoken_markers, voices


def _row(sound: "RISORIUS_PG_sound") -> tuple[bpy.types.Action, int]:
    """The action of a sound, and the index of the sound in the action's list."""
    action = sound.id_data
    assert isinstance(action, bpy.types.Action)
    return action, next(i for i, row in enumerate(spoken_keys.of(action).sounds) if row == sound)


def _start(self: "RISORIUS_PG_sound") -> float:
    return self.begin


def _set_start(self: "RISORIUS_PG_sound", frame: float) -> None:
    _move(*_row(self), frame)


def _length(self: "RISORIUS_PG_sound") -> float:
    action, place = _row(self)
    sounds = spoken_keys.of(action).sounds
    end = sounds[place + 1].begin if place + 1 < len(sounds) else spoken_keys.of(action).end
    return end - self.begin


def _set_length(self: "RISORIUS_PG_sound", frames: float) -> None:
    action, place = _row(self)
    if place + 1 < len(spoken_keys.of(action).sounds):  # the last sound ends with the voice
        _move(action, place + 1, self.begin + frames)


def _move(action: bpy.types.Action, place: int, frame: float) -> None:
    said = spoken_keys.of(action)
    if place == 0 or spoken_keys.trouble(action):
        return  # the first sound begins with the voice
    new, _held = spoken.moved(spoken_keys.sounds_of(action), {place: frame}, said.end)
    spoken_keys.change(action, new)
    spoken_markers.follow(action)


def _jump(self: "RISORIUS_PG_spoken", _context: bpy.types.Context) -> None:
    """Go to the frame at which the chosen sound begins."""
    context = current_context()
    rig = parts.active_rig(context)
    controls = parts.controls_of(rig) if rig is not None else None
    if controls is None or not 0 <= self.active < len(self.sounds):
        return
    action = self.id_data
    assert isinstance(action, bpy.types.Action)
    placing = voices.placing(controls, action)
    context.scene.frame_set(round(placing.shown(self.sounds[self.active].begin)))


class RISORIUS_PG_sound(bpy.types.PropertyGroup):
    """A sound; its name is the phoneme."""

    name: bpy.props.StringProperty(name="Phoneme", options=set())
    word: bpy.props.StringProperty(
        name="Word", description="The word that begins with this sound", options=set()
    )
    begin: bpy.props.FloatProperty(options={"HIDDEN"})
    start: bpy.props.FloatProperty(
        name="Start",
        description="Frame of the action at which the sound begins; the keys of the mouth follow",
        get=_start,
        set=_set_start,
        options=set(),
        precision=1,
        step=50,
    )
    length: bpy.props.FloatProperty(
        name="Length",
        description="Frames until the next sound begins; the keys of the mouth follow",
        get=_length,
        set=_set_length,
        options=set(),
        min=spoken.SHORTEST,
        precision=1,
        step=50,
    )


class RISORIUS_PG_spoken(bpy.types.PropertyGroup):
    """The sounds of a voice, and other data from which the keys of the mouth are made."""

    sounds: bpy.props.CollectionProperty(type=RISORIUS_PG_sound)
    active: bpy.props.IntProperty(name="Place", update=_jump, options=set(), min=0)
    start: bpy.props.FloatProperty(options={"HIDDEN"})
    end: bpy.props.FloatProperty(options={"HIDDEN"})
    fps: bpy.props.FloatProperty(options={"HIDDEN"})
    rate: bpy.props.FloatProperty(options={"HIDDEN"})
    samples: bpy.props.IntProperty(options={"HIDDEN"})
    whole: bpy.props.BoolProperty(options={"HIDDEN"})
    tolerance: bpy.props.FloatProperty(options={"HIDDEN"})
    intensity: bpy.props.FloatProperty(options={"HIDDEN"})
    openness: bpy.props.StringProperty(options={"HIDDEN"})
    built: bpy.props.StringProperty(options={"HIDDEN"})
    visemes: bpy.props.StringProperty(options={"HIDDEN"})
    mark: bpy.props.StringProperty(options={"HIDDEN"})


CLASSES = (RISORIUS_PG_sound, RISORIUS_PG_spoken)


def register() -> None:
    """Add the property to actions, after the registration of its classes."""
    setattr(
        bpy.types.Action,
        spoken_keys.PROPERTY,
        bpy.props.PointerProperty(type=RISORIUS_PG_spoken),
    )


def unregister() -> None:
    """Remove the property; its values in .blend files stay."""
    delattr(bpy.types.Action, spoken_keys.PROPERTY)
