# SPDX-License-Identifier: MIT
"""Tests making a rig from a head without expressions: landmarks, cancel by Esc, the rig."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

from common import IN_VIEW, Check, clear, look_at_face
from file_tasks import FACES
from hand import Hand, difference
from menus import save_as, search

LONG = 1800.0  # longest wait in seconds, because the machine may be busy


def plain_head(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Test Find Landmarks, Make Rig from Head and Conform Face to Head on a decimated head."""
    clear(hand)
    look_at_face(hand)
    hand.ask("run", code=PLAIN)
    hand.move(*IN_VIEW)
    hand.key("KP_Decimal")
    bare = hand.still()
    search(hand, "Find Landmarks")
    hand.wait("landmarks", lambda: hand.see(MARKS), LONG)
    shown = hand.still()
    hand.picture("landmarks")
    left, top, width, height = hand.ask("layout")["view"]
    around = [left, top, left + width, top + height]
    yield (
        f"F3 Find Landmarks: {hand.see(MARKS)} are seen on the head",
        (hand.see(MARKS) > 20 and difference(bare, shown, around) > 0.001),
    )
    hand.ask("run", code=CHIN)
    hand.move(*IN_VIEW)
    for key in ("g", "z"):
        hand.key(key)
    hand.type("-0.002")
    hand.key("Return")
    hand.wait("a landmark is moved", lambda: hand.see(MOVED) == ["chin"])
    yield "a landmark is moved by hand", True
    yield from _make(hand)
    yield from _conform(hand)
    hand.ask("run", code=GONE)
    clear(hand)


def _make(hand: Hand) -> Iterator[Check]:
    before, path = len(hand.see(FACES)), hand.user / "from_head.dna"
    search(hand, "Make Rig from Head")
    save_as(hand, path)
    time.sleep(3.0)
    hand.move(*IN_VIEW)
    hand.key("Escape")
    hand.wait("Esc ends it", lambda: not hand.ask("is_modal"), LONG)
    yield "Esc ends it and leaves nothing", len(hand.see(FACES)) == before and not path.exists()
    search(hand, "Make Rig from Head")
    save_as(hand, path)
    time.sleep(2.0)
    hand.picture("status-from-head")
    hand.wait("a face is made", lambda: len(hand.see(FACES)) > before, LONG)
    hand.still()
    hand.ask("run", code=SMILE_OF_NEW)
    hand.still()
    hand.picture("from-head")
    yield "Make Rig from Head: it smiles beside the head", path.exists()
    hand.ask("run", code=REMOVE_NEW)


def _conform(hand: Hand) -> Iterator[Check]:
    before, path = len(hand.see(FACES)), hand.user / "conformed.dna"
    hand.ask("run", code=ONLY_HEAD)
    search(hand, "Conform Face to Head")
    save_as(hand, path)
    hand.wait("a face is conformed", lambda: len(hand.see(FACES)) > before, LONG)
    hand.still()
    hand.picture("conformed")
    yield "Conform Face to Head: a second man, of the head's form", path.exists()
    hand.ask("run", code=REMOVE_NEW)


# Adds the man's head with fewer polygons and without shape keys, as the object "Plain Head".
PLAIN = """
source = next(o for o in bpy.data.objects if o.get("dna_mesh") == 0)
mesh = source.data.copy()
item = bpy.data.objects.new("Plain Head", mesh)
bpy.context.scene.collection.objects.link(item)
item.shape_key_clear()
item.modifiers.new("Fewer", "DECIMATE").ratio = 0.4
few = bpy.data.meshes.new_from_object(item.evaluated_get(bpy.context.evaluated_depsgraph_get()))
item.modifiers.clear()
item.data = few
item.location.x = 0.5
for one in bpy.context.view_layer.objects:
    one.select_set(one == item)
bpy.context.view_layer.objects.active = item
bpy.app.driver_namespace["faces"] = {o.name for o in bpy.data.objects if "risorius_controls" in o}
"""
MARKS = "len([o for o in bpy.data.objects if 'risorius_landmark' in o])"
MOVED = """[point.name for point in
module("scene.anyhead.points").of(bpy.data.objects["Plain Head"]).values()
if point.state == "MOVED"]"""
CHIN = """
chin = next(o for o in bpy.data.objects if o.get("risorius_landmark") == "chin")
for one in bpy.context.view_layer.objects:
    one.select_set(one == chin)
bpy.context.view_layer.objects.active = chin
"""
ONLY_HEAD = """
item = bpy.data.objects["Plain Head"]
for one in bpy.context.view_layer.objects:
    one.select_set(one == item)
bpy.context.view_layer.objects.active = item
"""
SMILE_OF_NEW = """
new = next(o for o in bpy.data.objects if "risorius_controls" in o
           and o.name not in bpy.app.driver_namespace["faces"])
bone = new["risorius_controls"].pose.bones["face"]
for side in "LR":
    bone[f"CTRL_expressions.mouthCornerPull{side}"] = 1.0
new["risorius_controls"].update_tag()
"""
REMOVE_NEW = """
for new in [o for o in bpy.data.objects if "risorius_controls" in o
            and o.name not in bpy.app.driver_namespace["faces"]]:
    module("scene.character.build").remove(new)
bpy.context.view_layer.update()
"""
GONE = """
head = bpy.data.objects["Plain Head"]
module("scene.anyhead.points").remove(head)
bpy.data.objects.remove(head)
bpy.context.view_layer.objects.active = rig()["risorius_controls"]
bpy.context.view_layer.update()
"""
