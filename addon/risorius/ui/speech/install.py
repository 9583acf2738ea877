# SPDX-License-Identifier: GPL-3.0-or-later
"""Installs the speech recognition package, and shows whether it is present."""

import bpy

from ... import native
from ...scene.animation import speech_task
from .. import words
from ..blender_types import Context, Menu, Operator, Result, UILayout
from ..common import usable

_OFFLINE = "Allow online access first: Preferences, System, Network."


class RISORIUS_OT_install_speech(Operator):
    """Download PocketSphinx (28 MB, with its model of English) for Speak from Audio"""

    bl_idname = "risorius.install_speech"
    bl_label = "Install PocketSphinx"

    @classmethod
    def poll(cls, context: Context) -> bool:
        if not usable(cls):
            return False
        if not bpy.app.online_access:
            cls.poll_message_set(words.say(_OFFLINE))
            return False
        return True

    def execute(self, context: Context) -> Result:
        try:
            speech_task.install_recogniser()
        except native.user_errors() as error:
            self.report({"ERROR"}, words.of_error(error))
            return {"CANCELLED"}
        self.report({"INFO"}, words.say("PocketSphinx is installed: Speak from Audio is ready."))
        return {"FINISHED"}


def offer(context: Context) -> None:
    """Show a menu at the cursor with a button that installs the speech recognition package."""

    def draw(menu: Menu, _context: Context) -> None:
        _draw_button(menu.layout)

    if not bpy.app.background:
        title = words.say("Speak from Audio")
        context.window_manager.popup_menu(draw, title=title, icon="INFO")  # pyright: ignore  ours


def draw_preferences(layout: UILayout) -> None:
    """Draw whether speech recognition is installed, or the button that installs it."""
    if speech_task.has_recogniser():
        layout.label(text="Speak from Audio is ready.", text_ctxt=words.CONTEXT, icon="CHECKMARK")
        return
    _draw_button(layout)


def _draw_button(layout: UILayout) -> None:
    words.show(
        layout, words.say("Speak from Audio needs the package PocketSphinx (28 MB)."), "INFO"
    )
    if not bpy.app.online_access:
        words.show(layout, words.say(_OFFLINE), "ERROR")
    layout.operator(RISORIUS_OT_install_speech.bl_idname, icon="IMPORT")


CLASSES = (RISORIUS_OT_install_speech,)
