# SPDX-License-Identifier: MIT
"""Takes a picture of each panel in German, for visual inspection."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from common import IN_VIEW, SMILE, Check, NotThereError, clear, look_at_face, ready_tab
from hand import Hand
from take_tasks import REMOVE_ACTION


def german(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Switch the interface to German, and take pictures of the tab, panels and menu Face."""
    clear(hand)
    look_at_face(hand)
    ready_tab(hand)
    hand.ask("run", code=LANGUAGE.format("de_DE"))
    if hand.see("bpy.app.translations.locale") != "de_DE":
        raise NotThereError("the German window, this Blender has no German words")
    hand.ask("run", code=POSED)
    hand.still()
    names = hand.ask("state")["layers"]
    yield f"a new layer has a German name ({names})", names == ["Leises Leben"]
    hand.picture("german-tab")
    voice = hand.user / "voice.wav"
    if voice.exists() and hand.see("module('scene.animation.speech_task').has_recogniser()"):
        hand.ask("run", code=SPEAK.format(str(voice)))
    for name in hand.see(THERE):
        _call(hand, name, "german-" + name.removeprefix("RISORIUS_"))
    hand.ask("run", code=REMOVE_ACTION + BOARD)
    hand.still()
    hand.picture("german-board")
    _call(hand, "RISORIUS_PT_board", "german-board-panel")
    hand.ask("run", code=NO_BOARD)
    yield "the panels in German have their pictures", True
    hand.ask("run", code=LANGUAGE.format("en_US"))
    clear(hand)


def _call(hand: Hand, name: str, picture: str) -> None:
    """Open a panel or menu under the pointer, take a picture, and close it.

    Args:
        hand: the pointer.
        name: class name of the panel or menu.
        picture: name of the picture.
    """
    hand.move(*IN_VIEW)
    hand.ask("run", code=CALL.format(name))
    hand.picture(picture)
    hand.key("Escape")
    hand.move(20, 500)
    hand.move(*IN_VIEW)
    hand.key("Escape")


SPEAK = """
bpy.context.view_layer.objects.active = rig()["risorius_controls"]
with over(*view()[:2]):
    bpy.ops.risorius.speak(filepath={!r})
"""
BOARD = """
with over(*view()[:2]):
    bpy.ops.risorius.add_board()
"""
NO_BOARD = """
with over(*view()[:2]):
    bpy.ops.risorius.remove_board()
    bpy.ops.object.mode_set(mode="OBJECT")
"""
LANGUAGE = """
view_settings = bpy.context.preferences.view
view_settings.language = {!r}
view_settings.use_translate_interface = True
view_settings.use_translate_new_dataname = True
"""
POSED = f"""
face()[{SMILE[0]!r}] = 0.8
rig()["risorius_controls"].update_tag()
with over(*view()[:2]):
    bpy.ops.risorius.layer_add(kind="IDLE")
"""
THERE = """sorted(n for n in dir(bpy.types) if n.startswith(("RISORIUS_PT_", "RISORIUS_MT_face"))
and "region" not in n)"""
CALL = """
with over(*view()[:2]):
    if "_MT_" in {0!r}:
        bpy.ops.wm.call_menu(name={0!r})
    else:
        bpy.ops.wm.call_panel(name={0!r}, keep_open=True)
"""
