# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Operators that correct the sounds, words and markers of a voice."""

import sys
from collections.abc import Sequence

import bpy

from ... import native
from ...logic.animation import spoken
from ...logic.animation.spoken import Sound, SpokenError
from ...logic.base.sentences import told
from ...scene.animation import speech_task
from ...scene.frame import evaluate
from ...scene.speech import spoken_keys, spoken_markers, voices
from .. import words
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_controls, face_rig

_MOVED = "The markers were changed: choose Update Speech first."


def voice_of(context: Context) -> bpy.types.Action | None:
    """The action with the voice that the panel shows, or None."""
    return next(iter(voices.all_of(face_controls(context))), None)


def are_moved(context: Context, action: bpy.types.Action) -> bool:
    """Whether the markers of a voice were changed and not yet applied.

    Args:
        context: context with the face and the scene.
        action: action with the voice.
    """
    return spoken_markers.are_changed(context.scene, action)


class _Corrects(FaceOperator):
    """Base of operators that correct a voice; they update keys and markers, and report errors."""

    reads_markers = False  # True: available while changed markers are not applied

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not super().poll(context):
            return False
        action = voice_of(context)
        if action is None:
            cls.poll_message_set(words.say("This face speaks no voice: use Speak from Audio."))
            return False
        if not cls.reads_markers and are_moved(context, action):
            cls.poll_message_set(words.say(_MOVED))
            return False
        return True

    def execute(self, context: Context) -> Result:
        action = voice_of(context)
        assert action is not None
        try:
            self._correct(context, action)
        except native.user_errors() as error:
            self.report({"ERROR"}, words.of_error(error))
            return {"CANCELLED"}
        evaluate.bring_up(context, face_rig(context))
        return {"FINISHED"}

    def _correct(self, context: Context, action: bpy.types.Action) -> None:
        """Correct the voice.

        Raises:
            native.user_errors(): any of these errors is reported to the user.
        """
        raise NotImplementedError


class _CorrectsSound(_Corrects):
    """Base of operators that correct one sound of the list in the panel Speech."""

    place: bpy.props.IntProperty(
        name="Place",
        description="Number of the sound in the list, from 0; -1: the chosen sound",
        default=-1,
        min=-1,
        options={"SKIP_SAVE"},
    )

    def _correct(self, context: Context, action: bpy.types.Action) -> None:
        said, sounds = spoken_keys.of(action), spoken_keys.sounds_of(action)
        place = said.active if self.place < 0 else self.place
        if not 0 <= place < len(sounds):
            raise SpokenError(
                told(
                    "a sound from 0 to {last} was expected, found {place}",
                    last=len(sounds) - 1,
                    place=place,
                )
            )
        new, chosen = self._corrected(sounds, place, said.end)
        spoken_keys.change(action, new)
        if chosen != said.active:
            said.active = chosen
        spoken_markers.follow(action)

    def _corrected(
        self, sounds: Sequence[Sound], place: int, end: float
    ) -> tuple[list[Sound], int]:
        """Correct one sound.

        Args:
            sounds: all sounds of the voice.
            place: index of the sound to correct.
            end: frame at which the last sound ends.

        Returns:
            All sounds after the correction, and the index of the sound to select.

        Raises:
            SpokenError: the correction is not possible.
        """
        raise NotImplementedError


def _phoneme(text: str) -> str:
    """The phoneme that a typed name means.

    Args:
        text: a mouth shape such as "M B P", or a phoneme such as "AA".

    Raises:
        SpokenError: no mouth shape or phoneme has this name.
    """
    name = spoken_markers.named(text)
    if name is None:
        raise SpokenError(
            told(
                "a mouth such as M B P or a phoneme such as AA was expected, found {found}",
                found=text.strip()[:40],
            )
        )
    return name


class RISORIUS_OT_sound_set(_CorrectsSound, Operator):
    """Replace the chosen sound of the voice by another one; the keys of the mouth follow"""

    bl_idname = "risorius.sound_set"
    bl_label = "Replace Sound"

    sound: bpy.props.StringProperty(
        name="Phoneme",
        description="A mouth shape such as M B P, or a phoneme such as AA",
        options={"SKIP_SAVE"},
    )

    def _corrected(
        self, sounds: Sequence[Sound], place: int, end: float
    ) -> tuple[list[Sound], int]:
        return spoken.replaced(sounds, place, _phoneme(self.sound)), place


class RISORIUS_OT_sound_insert(_CorrectsSound, Operator):
    """Insert a sound in the second half of the chosen sound; the keys of the mouth follow"""

    bl_idname = "risorius.sound_insert"
    bl_label = "Insert Sound"

    sound: bpy.props.StringProperty(
        name="Phoneme",
        description="A mouth shape such as M B P, or a phoneme such as AA",
        default="AH",
        options={"SKIP_SAVE"},
    )

    def _corrected(
        self, sounds: Sequence[Sound], place: int, end: float
    ) -> tuple[list[Sound], int]:
        middle = 0.5 * (sounds[place].begin + spoken.end_of(sounds, place, end))
        return spoken.inserted(sounds, middle, _phoneme(self.sound), end), place + 1


class RISORIUS_OT_sound_remove(_CorrectsSound, Operator):
    """Remove the chosen sound and extend the sound before it, or else after it; keys follow"""

    bl_idname = "risorius.sound_remove"
    bl_label = "Remove Sound"

    def _corrected(
        self, sounds: Sequence[Sound], place: int, end: float
    ) -> tuple[list[Sound], int]:
        return spoken.removed(sounds, [place]), max(place - 1, 0)


class RISORIUS_OT_word_set(_CorrectsSound, Operator):
    """Replace the chosen word; its sounds are found again within the time of the word"""

    bl_idname = "risorius.word_set"
    bl_label = "Replace Word"

    text: bpy.props.StringProperty(
        name="Word", description="One English word or several", options={"SKIP_SAVE"}
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        action = voice_of(context)
        if action is not None and not self.text:
            sounds, place = spoken_keys.sounds_of(action), spoken_keys.of(action).active
            where = spoken.word_of(sounds, place) if place < len(sounds) else None
            self.text = sounds[where[0]].word if where is not None else ""
        return context.window_manager.invoke_props_dialog(self)

    def _corrected(
        self, sounds: Sequence[Sound], place: int, end: float
    ) -> tuple[list[Sound], int]:
        places = [*sys.path, str(speech_task.packages_folder())]
        said = native.part("speech.spelling").spell(self.text, places)
        where = spoken.word_of(sounds, place)
        return spoken.respelled(sounds, place, said, end), where[0] if where else place


class RISORIUS_OT_speech_markers(_Corrects, Operator):
    """Show the sounds of the voice as markers of the timeline, or remove the markers"""

    bl_idname = "risorius.speech_markers"
    bl_label = "Markers"
    reads_markers = True

    def _correct(self, context: Context, action: bpy.types.Action) -> None:
        if spoken_markers.are_shown(context.scene, action):
            spoken_markers.hide(context.scene)
            return
        placing = voices.placing(face_controls(context), action)
        spoken_markers.show(context.scene, action, placing)


class RISORIUS_OT_speech_update(_Corrects, Operator):
    """Update the sounds of the voice from its moved, renamed, copied and deleted markers"""

    bl_idname = "risorius.speech_update"
    bl_label = "Update Speech"
    reads_markers = True

    def _correct(self, context: Context, action: bpy.types.Action) -> None:
        scene, placing = context.scene, voices.placing(face_controls(context), action)
        if not spoken_markers.are_shown(scene, action):
            spoken_keys.rebuild(action)  # a script may have changed the list
            return
        for name in spoken_markers.take(scene, action, placing):
            text = (
                "The marker {name} was moved past its neighbour and stays "
                "beside this neighbour: sounds keep their order."
            )
            self.report({"WARNING"}, words.say(text, name=name))


CLASSES = (
    RISORIUS_OT_sound_set,
    RISORIUS_OT_sound_insert,
    RISORIUS_OT_sound_remove,
    RISORIUS_OT_word_set,
    RISORIUS_OT_speech_markers,
    RISORIUS_OT_speech_update,
)
