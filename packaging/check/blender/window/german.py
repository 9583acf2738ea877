# SPDX-License-Identifier: MIT
"""The tab in another language: a picture of each panel, for people to look at."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from common import IN_VIEW, SMILE, Check, NotThereError, clear, look_at_face, ready_tab
from hand import Hand


def german(hand: Hand, _dna: Path) -> Iterator[Check]:
    """The whole interface in German, each panel called by itself, and the menu Face."""
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
    for name in hand.see(THERE):
        hand.move(*IN_VIEW)
        hand.ask("run", code=CALL.format(name))
        hand.picture("german-" + name.removeprefix("RISORIUS_"))
        hand.key("Escape")
        hand.move(20, 500)
        hand.move(*IN_VIEW)
        hand.key("Escape")
    yield "the panels in German have their pictures", True
    hand.ask("run", code=LANGUAGE.format("en_US"))
    clear(hand)


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
