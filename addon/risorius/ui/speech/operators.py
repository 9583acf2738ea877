# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""The operator Speak from Audio: animates the face from a sound file and adds its sound strip."""

from pathlib import Path

import bpy

from ... import native
from ...logic.animation.bezier_keys import TOLERANCE
from ...logic.animation.clip_units import ClipError, Timing
from ...logic.base.errors import FaceError
from ...scene.animation import clip_actions, speech_task
from ...scene.expressions import library, visemes
from ...scene.speech import spoken_keys
from .. import words
from ..animation.operators import SOUNDS
from ..animation.place_clip import PlacesClip
from ..background_work import RunsBeside
from ..blender_types import Context, ImportHelper, Operator, Result
from ..common import explain, face_rig, system_path
from . import install

_MISSING = (
    "Speech needs the package PocketSphinx: install it by the button in the panel Animation or in "
    "the add-on's preferences."
)

_FADE = 0.1  # seconds for fading in and fading out a voice's layer


class RISORIUS_OT_speak(RunsBeside, PlacesClip, Operator, ImportHelper):
    """Let the active face speak a sound file; typed words improve the mouth movement"""

    bl_idname = "risorius.speak"
    bl_label = "Speak from Audio"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    filter_glob: bpy.props.StringProperty(
        default=";".join(f"*{e}" for e in SOUNDS), options={"HIDDEN"}
    )
    transcript: bpy.props.StringProperty(
        name="Transcript",
        description="Spoken words in English; empty: recognise the sounds without the words",
    )
    transcript_text: bpy.props.StringProperty(
        name="Text",
        description="Text data-block of this .blend file that contains the spoken words",
    )
    intensity: bpy.props.FloatProperty(
        name="Intensity",
        description="Strength of the motion of mouth and brows",
        default=1.0,
        min=0.0,
        max=4.0,
    )
    seed: bpy.props.IntProperty(name="Seed", description="Seed of the random times of the blinks")
    use_blinks: bpy.props.BoolProperty(name="Blinks", default=True)
    use_accents: bpy.props.BoolProperty(
        name="Accents", description="Move brows and head with stressed words", default=True
    )
    use_own_visemes: bpy.props.BoolProperty(
        name="Visemes of the Face",
        description=(
            "Use visemes of the expressions beside the DNA file or of the "
            "library, if they exist; off: visemes of Risorius"
        ),
        default=True,
    )
    use_whole_frames: bpy.props.BoolProperty(
        name="Whole Frames",
        description="Insert keys only on frames of the scene; off: the voice is "
        "sampled 60 times per second, and keys lie between frames too",
        default=True,
    )
    use_every_frame: bpy.props.BoolProperty(
        name="Every Frame",
        description=(
            "Insert a key at each frame; off: insert as few keys with handles as the curves need"
        ),
    )
    tolerance: bpy.props.FloatProperty(
        name="Tolerance",
        description=(
            "Largest distance of a slider from the computed curve at any "
            "frame; the range of a slider is 1"
        ),
        default=TOLERANCE,
        min=0.0005,
        max=0.1,
        precision=4,
    )
    use_sound: bpy.props.BoolProperty(
        name="Sound Strip", description="Add the sound to the sequencer", default=True
    )

    def invoke(self, context: Context, event: bpy.types.Event) -> Result:
        if not speech_task.has_recogniser():  # before the user chooses a file
            install.offer(context)
            self.report({"WARNING"}, words.say(_MISSING))
            return {"CANCELLED"}
        self.wait_beside()
        self.start_with(context.scene)
        if self.properties.is_property_set("filepath"):
            return self.execute(context)
        return ImportHelper.invoke(self, context, event)

    def execute(self, context: Context) -> Result:
        if not speech_task.has_recogniser():
            self.report({"ERROR"}, words.say(_MISSING))
            return {"CANCELLED"}
        self.filepath = system_path(self.filepath)
        text = bpy.data.texts.get(self.transcript_text) if self.transcript_text else None
        if self.transcript_text and text is None:
            self.report(
                {"ERROR"}, words.say("There is no text block {name}.", name=self.transcript_text)
            )
            return {"CANCELLED"}
        rig = face_rig(context)
        found = visemes.of(rig, library.folder(context)) if self.use_own_visemes else None
        self._own = found.own if found is not None else {}
        for trouble in found.troubles[:3] if found is not None else ():
            self.report({"WARNING"}, words.local(trouble))
        self._task = speech_task.SpeechTask(
            self.filepath,
            text.as_string() if text is not None else self.transcript,
            intensity=self.intensity,
            seed=self.seed,
            blinks=self.use_blinks,
            accents=self.use_accents,
            correctable=True,
            library=self._own or None,
            # With whole frames, the voice is animated at the scene's frame rate. Resampled from
            # another rate, closed lips could fall between two frames.
            rate=clip_actions.frame_rate(context.scene) if self.use_whole_frames else 60.0,
        )
        self._face = rig.session_uid
        return self.begin(context, self._task)

    def shown(self, share: int) -> str:
        name = Path(self.filepath).name
        return words.say("Listening to {name}: {share} %, Esc cancels", name=name, share=share)

    def cancelled_text(self) -> str:
        return words.say("Speak from Audio was cancelled.")

    def finish(self, context: Context) -> Result:
        """Place the animation on the face, if the face for which it was made is still active."""
        task = self._task
        try:
            if task.result is None:
                raise task.error or FaceError("nothing was heard")
            if not type(self).poll(context) or face_rig(context).session_uid != self._face:
                text = (
                    "No speech was added, because the face is no longer active: "
                    "select the face, then use Speak from Audio again."
                )
                self.report({"ERROR"}, words.say(text))
                return {"CANCELLED"}
            told = task.result.metadata.get("notes", "").split("; ")
            notes = [words.local(note) for note in told if note]
            name = Path(self.filepath).stem
            few = 0.0 if self.use_every_frame else self.tolerance
            action = self.place(
                context, task.result, name, notes, whole=self.use_whole_frames, tolerance=few
            )
            timing = self._timing(context, task.result)
            spoken_keys.note(action, task.result, timing, few, self.intensity, self._own)
        except native.user_errors() as error:
            self.report({"ERROR"}, explain(self.filepath, error))
            return {"CANCELLED"}
        if self._own:
            text = "The face speaks with {count} visemes of its own."
            self.report({"INFO"}, words.say(text, count=len(self._own)))
        self._add_sound(context)
        return {"FINISHED"}

    def _timing(self, context: Context, clip: "native.Clip") -> Timing:
        whole = self.use_whole_frames
        return clip_actions.timing_of(clip, context.scene, self.start, keep_clock=True, whole=whole)

    def layer_settings(self, context: Context) -> dict[str, object]:
        """Properties of the layer that plays the voice; it moves the face only during the sound.

        Args:
            context: context with the scene, which has the frame rate.
        """
        fade = round(_FADE * clip_actions.frame_rate(context.scene))
        return {"extend": "NOTHING", "fade_in": float(fade), "fade_out": float(fade)}

    def _add_sound(self, context: Context) -> None:
        if not self.use_sound:
            return
        try:
            clip_actions.add_sound(context.scene, self.filepath, self.start)
        except ClipError as error:  # the face keeps the animation
            self.report({"WARNING"}, explain(self.filepath, error))

    def draw(self, context: Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        self.draw_place(layout)
        words.prop_or(layout, self, "transcript", "", "Empty: it is listened for")
        layout.prop_search(self, "transcript_text", bpy.data, "texts")
        for name in (
            "intensity",
            "seed",
            "use_blinks",
            "use_accents",
            "use_sound",
            "use_own_visemes",
            "use_whole_frames",
            "use_every_frame",
        ):
            layout.prop(self, name)
        row = layout.row()
        row.enabled = not self.use_every_frame
        row.prop(self, "tolerance")


CLASSES = (RISORIUS_OT_speak,)
