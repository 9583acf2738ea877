# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Speech: the list of sounds of a face's voice, for correction."""

from ... import native
from ...scene.speech import spoken_keys, spoken_markers, spoken_properties, voices
from .. import words
from ..blender_types import Context, Menu, Panel, UILayout, UIList
from ..common import FaceOnlyPanel, active_controls
from .correcting import (
    RISORIUS_OT_sound_insert,
    RISORIUS_OT_sound_remove,
    RISORIUS_OT_sound_set,
    RISORIUS_OT_speech_markers,
    RISORIUS_OT_speech_update,
    RISORIUS_OT_word_set,
    are_moved,
    voice_of,
)


class RISORIUS_UL_sounds(UIList):
    """One line per sound: word, mouth shape, start and length in frames.

    The word is shown only on the line of its first sound.
    """

    def draw_item(
        self,
        context: Context,
        layout: UILayout,
        data: spoken_properties.RISORIUS_PG_spoken,
        item: spoken_properties.RISORIUS_PG_sound,
        icon: int,
        active_data: spoken_properties.RISORIUS_PG_spoken,
        active_property: str,
    ) -> None:
        split = layout.split(factor=0.5, align=True)
        names = split.split(factor=0.55, align=True)
        words.show(names, item.word)
        words.show(names, words.say(spoken_markers.label(item.name)))
        row = split.row(align=True)
        row.prop(item, "start", text="", emboss=False)
        row.prop(item, "length", text="", emboss=False)


class RISORIUS_MT_phonemes(Menu):
    """All phonemes of English, each with the mouth shape that it looks like."""

    bl_idname = "RISORIUS_MT_phonemes"
    bl_label = "Phonemes"

    def draw(self, context: Context) -> None:
        for name in native.part("speech.phones").CLASS_OF:
            text = f"{words.say(spoken_markers.label(name))} ({name})"
            button = self.layout.operator(
                RISORIUS_OT_sound_set.bl_idname, text=text, translate=False
            )
            button.sound = name


class RISORIUS_MT_mouths(Menu):
    """The mouth shapes by which a sound can be replaced."""

    bl_idname = "RISORIUS_MT_mouths"
    bl_label = "Replace Sound"

    def draw(self, context: Context) -> None:
        layout = self.layout
        for viseme in native.part("speech.phones").VISEMES:
            label = words.say(spoken_markers.label(spoken_markers.named(viseme) or ""))
            button = layout.operator(RISORIUS_OT_sound_set.bl_idname, text=label, translate=False)
            button.sound = viseme
        layout.separator()
        layout.menu(RISORIUS_MT_phonemes.bl_idname)


class RISORIUS_PT_speech(FaceOnlyPanel, Panel):
    bl_idname = "RISORIUS_PT_speech"
    bl_label = "Speech"
    bl_order = 1
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: Context) -> bool:
        controls = active_controls(context)
        return controls is not None and bool(voices.all_of(controls))

    def draw(self, context: Context) -> None:
        layout, action = self.layout, voice_of(context)
        if action is None:
            return
        said, changed = spoken_keys.of(action), are_moved(context, action)
        words.show(layout, action.name, "SPEAKER")
        row = layout.row()
        row.enabled = not changed
        row.template_list("RISORIUS_UL_sounds", "", said, "sounds", said, "active", rows=6)
        side = row.column(align=True)
        side.operator(RISORIUS_OT_sound_insert.bl_idname, text="", icon="ADD")
        side.operator(RISORIUS_OT_sound_remove.bl_idname, text="", icon="REMOVE")
        column = layout.column(align=True)
        column.menu(RISORIUS_MT_mouths.bl_idname)
        column.operator(RISORIUS_OT_word_set.bl_idname)
        row = layout.row(align=True)
        shown = spoken_markers.are_shown(context.scene, action)
        row.operator(RISORIUS_OT_speech_markers.bl_idname, icon="MARKER_HLT", depress=shown)
        row.operator(RISORIUS_OT_speech_update.bl_idname, icon="FILE_REFRESH")
        trouble = spoken_keys.trouble(action)
        if trouble:
            words.write(layout, trouble, "ERROR")


CLASSES = (RISORIUS_UL_sounds, RISORIUS_MT_phonemes, RISORIUS_MT_mouths, RISORIUS_PT_speech)
