# SPDX-License-Identifier: MIT
"""Tests tasks with a real pointer: the menu Face, two faces, a rig from a head, studio, bake."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from common import IN_VIEW, SMILE, Check, clear, has_face, look_at_face, ready_tab, scroll
from hand import Hand, difference
from menus import accept, in_menu, name_file, open_face_menu, save_as, search
from shot import go_to, key_all

FACES = "[o.name for o in bpy.data.objects if 'risorius_controls' in o]"


def face_menu(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Test the menu Face, Frame Face, the outlines, and the same operators by search (F3)."""
    clear(hand)
    look_at_face(hand)
    ready_tab(hand)
    hand.ask("center", zoom=0.15)
    hand.still()
    x, y = open_face_menu(hand)
    hand.still()
    hand.picture("face-menu")
    in_menu(hand, r"risorius\.frame_face", x, y)
    hand.still()
    box, view = hand.ask("face_box"), hand.ask("layout")["view"]
    share = (box[3] - box[1]) / view[3]
    yield f"Face > Frame Face: the head is {share:.0%} of the view's height", 0.5 < share < 1.0
    shown = hand.still()
    search(hand, "Hide Outlines", "RISORIUS_OT_hide_outlines")
    hidden = hand.still()
    around = [view[0], view[1], view[0] + view[2], view[1] + view[3]]
    yield "F3 Hide Outlines: they are drawn no more", difference(shown, hidden, around) > 0.0002
    hand.picture("outlines-hidden")
    search(hand, "Show Outlines", "RISORIUS_OT_hide_outlines")
    for words, operator in SEARCHED.items():
        search(hand, words, operator)
        yield f"F3 {words}", True
    clear(hand)
    hand.move(*IN_VIEW)
    hand.ask("center", zoom=0.15)
    hand.ask("run", code=CONTROLS_IN_HAND)
    hand.key("KP_Decimal")
    hand.still()
    box = hand.ask("face_box")
    share = (box[3] - box[1]) / view[3]
    yield f"the key of Frame Selected on the controls shows the face ({share:.0%})", share > 0.5


SEARCHED = {
    "Frame Face": "RISORIUS_OT_frame_face",
    "Key All": "RISORIUS_OT_key",
    "Blink": "RISORIUS_OT_blink",
    "Copy Face": "RISORIUS_OT_copy_pose",
}
CONTROLS_IN_HAND = """
c = rig()["risorius_controls"]
for item in bpy.context.view_layer.objects:
    item.select_set(item == c)
bpy.context.view_layer.objects.active = c
"""


def two_faces(hand: Hand, dna: Path) -> Iterator[Check]:
    """Duplicate a face, copy a pose to it, undo and redo, and append faces from another file."""
    clear(hand)
    look_at_face(hand)
    ready_tab(hand)
    hand.ask("run", code=f"face()[{SMILE[0]!r}] = 0.7; rig()['risorius_controls'].update_tag()")
    first = hand.see("rig()['risorius_controls'].name")
    hand.ask("run", code=CONTROLS_IN_HAND)
    search(hand, "Copy Face", "RISORIUS_OT_copy_pose")
    hand.move(*IN_VIEW)
    hand.key("a")
    hand.key("shift+d")
    hand.key("x")
    hand.type("0.4")
    hand.key("Return")
    hand.wait("a second face", lambda: len(hand.see(FACES)) == 2)
    names = hand.see(FACES)
    yield f"Shift-D of all makes a second face ({names})", len(set(names)) == 2
    hand.ask("run", code=SECOND.format(first))
    search(hand, "Reset Face", "RISORIUS_OT_reset")
    smiles = hand.see(SMILES)
    yield f"Reset on it leaves the first as it is ({smiles})", sorted(smiles) == [0.0, 0.7]
    search(hand, "Paste Face", "RISORIUS_OT_paste_pose")
    smiles = hand.see(SMILES)
    yield "Paste Face: both smile", min(smiles) > 0.69
    hand.ask("run", code=BOTH)
    hand.still()
    hand.picture("two-faces")
    yield from _undo(hand)
    yield from _append(hand, dna)
    hand.ask("run", code=ONE)
    clear(hand)


SMILES = f"""[round(float(o["risorius_controls"].pose.bones["face"].get({SMILE[0]!r}, 0)), 3)
for o in bpy.data.objects if "risorius_controls" in o]"""
SECOND = """
other = next(o["risorius_controls"] for o in bpy.data.objects if "risorius_controls" in o
             and o["risorius_controls"].name != {0!r})
for item in bpy.context.view_layer.objects:
    item.select_set(item == other)
bpy.context.view_layer.objects.active = other
"""
BOTH = """
area, drawing, _sidebar = view()
area.spaces.active.region_3d.view_distance *= 1.8
area.spaces.active.region_3d.view_location.x += 0.2
"""
ONE = """
for one in [o for o in bpy.data.objects if "risorius_controls" in o]:
    if one.name != "Sample_rig":
        module("scene.character.build").remove(one)
bpy.context.view_layer.objects.active = rig()["risorius_controls"]
bpy.context.view_layer.update()
"""


def _undo(hand: Hand) -> Iterator[Check]:
    """Undo and redo ten steps by the keyboard."""
    go_to(hand, 1)
    for step in range(10):
        go_to(hand, 2 + step)
        search(hand, "Key All", "RISORIUS_OT_key")
    full = hand.ask("keyed_frames_of_active")
    hand.move(*IN_VIEW)
    for _ in range(10):
        hand.key("ctrl+z")
    none = hand.ask("keyed_frames_of_active")
    for _ in range(10):
        hand.key("ctrl+shift+z")
    again = hand.ask("keyed_frames_of_active")
    told = f"ten keys, ten steps back ({len(none)} left) and forth ({len(again)})"
    yield told, len(full) == len(again) == 10 and len(none) < 10
    hand.ask("run", code=NO_KEYS)


NO_KEYS = """
for one in [o for o in bpy.data.objects if "risorius_controls" in o]:
    one["risorius_controls"].animation_data_clear()
"""


def _append(hand: Hand, dna: Path) -> Iterator[Check]:
    """Append the faces of another file by File > Append."""
    path = dna.parent / "other.blend"
    hand.ask("run", code=f"bpy.ops.wm.save_as_mainfile(filepath={str(path)!r}, copy=True)")
    before = hand.see("len(bpy.data.objects)")
    search(hand, "Append")
    hand.wait("the file browser", lambda: "FILE_BROWSER" in hand.ask("state")["areas"])
    hand.still()
    name_file(hand, path / "Object", ending="")
    hand.still()
    hand.picture("append-browser")
    area = hand.ask("ready")["areas"]["FILE_BROWSER"]
    # Click on the list, because Blender 5.2 otherwise keeps editing the folder's field.
    hand.click(area[0] + area[2] * 0.5, area[1] + area[3] * 0.5)
    hand.key("a")
    hand.key("Return")
    hand.wait("the view is back", lambda: "VIEW_3D" in hand.ask("state")["areas"])
    hand.wait("objects came", lambda: hand.see("len(bpy.data.objects)") > before)
    hand.still()
    seen = hand.see("[o.name for o in bpy.context.view_layer.objects if '_shape_' in o.name]")
    yield f"Append of all: no outline lies in the scene ({seen})", seen == []
    yield "and the faces that came are faces", len(hand.see(FACES)) >= 3
    hand.picture("appended")


def own_head(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Test Make Rig from Shape Keys on a head with few vertices, and its studio."""
    clear(hand)
    look_at_face(hand)
    hand.ask("run", code=HEAD)
    hand.still()
    before = len(hand.see(FACES))
    search(hand, "Make Rig from Shape Keys")
    path = hand.user / "own.dna"
    save_as(hand, path)
    hand.wait("a rig is made", lambda: len(hand.see(FACES)) > before)
    hand.still()
    hand.picture("own-head")
    yield "Make Rig from Shape Keys: a face of one's own", path.exists()
    hand.ask(
        "run", code=NOT_THE_FIRST + "bpy.app.driver_namespace['before'] = set(bpy.data.objects)"
    )
    search(hand, "Studio", "RISORIUS_OT_add_studio")
    low, high = hand.see(OWN_IN_CAMERA)
    yield (
        f"its studio shows all of a head without a neck ({low:.2f} to {high:.2f})",
        0 < low < high < 1,
    )
    hand.ask("run", code=NO_STUDIO + ONE + "bpy.data.objects.remove(bpy.data.objects['Own Head'])")
    clear(hand)


NOT_THE_FIRST = """
own = next(o["risorius_controls"] for o in bpy.data.objects
           if "risorius_controls" in o and o.name != "Sample_rig")
for item in bpy.context.view_layer.objects:
    item.select_set(item == own)
bpy.context.view_layer.objects.active = own
"""
OWN_IN_CAMERA = """(lambda ys: [min(ys), max(ys)])([world_to_camera_view(bpy.context.scene,
next(o for o in bpy.data.objects if o.type == "CAMERA" and "studio" in o.name),
m.matrix_world @ Vector(c))[1] for m in bpy.data.objects if m.type == "MESH" and "dna_mesh" in m
and m["risorius_rig"]["risorius_controls"] == bpy.context.active_object for c in m.bound_box])"""
HEAD = """
mesh = bpy.data.meshes.new("Own Head")
turns, rows = 24, 16
spots = [(0.09 * np.sin(np.pi * (r + 1) / (rows + 1)) * np.cos(2 * np.pi * t / turns),
          0.1 * np.sin(np.pi * (r + 1) / (rows + 1)) * np.sin(2 * np.pi * t / turns),
          0.12 * np.cos(np.pi * (r + 1) / (rows + 1))) for r in range(rows) for t in range(turns)]
faces = [(r * turns + t, (r + 1) * turns + t, (r + 1) * turns + (t + 1) % turns,
          r * turns + (t + 1) % turns) for r in range(rows - 1) for t in range(turns)]
mesh.from_pydata(spots, [], faces)
own = bpy.data.objects.new("Own Head", mesh)
bpy.context.scene.collection.objects.link(own)
own.shape_key_add(name="Basis")
places = np.array(spots)
for name, middle, way in (("jawOpen", (0, -0.1, -0.06), (0, 0.01, -0.03)),
                          ("mouthSmileLeft", (0.04, -0.09, -0.04), (0.01, 0, 0.02)),
                          ("mouthSmileRight", (-0.04, -0.09, -0.04), (-0.01, 0, 0.02)),
                          ("eyeBlinkLeft", (0.04, -0.09, 0.03), (0, 0, -0.01)),
                          ("eyeBlinkRight", (-0.04, -0.09, 0.03), (0, 0, -0.01))):
    key = own.shape_key_add(name=name)
    near = np.exp(-(((places - middle) / 0.03) ** 2).sum(axis=1))
    key.data.foreach_set("co", (places + near[:, None] * way).ravel())
own.location.x = 0.5
for item in bpy.context.view_layer.objects:
    item.select_set(item == own)
bpy.context.view_layer.objects.active = own
"""


def studio(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Test the studio with a rendering (F12), Bake Face and its undoing, and an export."""
    clear(hand)
    look_at_face(hand)
    ready_tab(hand)
    hand.ask("run", code=CONTROLS_IN_HAND + SMALL)
    search(hand, "Studio", "RISORIUS_OT_add_studio")
    yield (
        "the studio's camera is the scene's",
        hand.see("bpy.context.scene.camera.name") != "Camera",
    )
    hand.move(*IN_VIEW)
    hand.key("F12")
    hand.wait("it is rendered", lambda: hand.see(RENDERED))
    path = hand.out / "studio-f12.png"
    hand.ask("run", code=f"bpy.data.images['Render Result'].save_render({str(path)!r})")
    inside = hand.see(IN_CAMERA)
    told = f"F12 shows the portrait: the head fills {inside[0]:.0%} of the height"
    yield told, path.exists() and 0.4 < inside[0] < 1.1 and inside[1]
    hand.key("Escape")
    hand.wait("the view is back", lambda: "VIEW_3D" in hand.ask("state")["areas"])
    yield from _bake(hand)
    hand.ask("run", code=NO_STUDIO)
    clear(hand)


SMALL = """
scene = bpy.context.scene
bpy.context.preferences.view.render_display_type = "SCREEN"
bpy.app.driver_namespace["before"] = set(bpy.data.objects)
bpy.app.driver_namespace["done"] = False
scene.render.resolution_percentage = 25
scene.render.engine = "BLENDER_WORKBENCH"
bpy.app.handlers.render_complete.append(
    lambda *_: bpy.app.driver_namespace.__setitem__("done", True))
"""
RENDERED = "bpy.app.driver_namespace['done']"
IN_CAMERA = """(lambda spots: [float(np.ptp(spots[:, 1])),
bool((abs(spots.mean(axis=0) - 0.5) < 0.25).all())])(np.array([world_to_camera_view(
bpy.context.scene, bpy.context.scene.camera, Vector(p))[:2] for p in points()[::9]]))"""
NO_STUDIO = """
for item in set(bpy.data.objects) - bpy.app.driver_namespace["before"]:
    bpy.data.objects.remove(item)
bpy.app.handlers.render_complete.clear()
"""


def _bake(hand: Hand) -> Iterator[Check]:
    """Insert two keyframes, bake the face by Blender's search, undo the bake by the button Done,
    and export glTF."""
    ready_tab(hand)
    go_to(hand, 1)
    key_all(hand)
    go_to(hand, 12)
    hand.ask("run", code=f"bpy.context.scene.frame_end = 12; face()[{SMILE[0]!r}] = 0.8")
    hand.ask("run", code="rig()['risorius_controls'].update_tag()")
    search(hand, "Key All", "RISORIUS_OT_key")
    search(hand, "Bake Face")
    hand.picture("bake-dialog")
    accept(hand, lambda: hand.see("'risorius_baked' in rig()"))
    hand.still()
    hand.picture("baked")
    scroll(hand, -40)
    hand.click(*hand.find(r"risorius\.unbake", columns=(0.85, 0.9, 0.8)))
    hand.wait("it is live", lambda: not hand.see("'risorius_baked' in rig()"))
    yield "Bake Face, and Done in the banner leads back", has_face(hand)
    path = hand.user / "face.glb"
    search(hand, "Export Animation")
    hand.picture("export-dialog")
    save_as(hand, path)
    hand.wait("it is written", lambda: any(hand.user.glob("face*.gl*")))
    written = next(hand.user.glob("face*.gl*"))
    count = hand.see("len(bpy.data.objects)")
    hand.ask("run", code=f"bpy.ops.import_scene.gltf(filepath={str(written)!r})")
    yield "glTF out and, by Blender's importer, back", hand.see("len(bpy.data.objects)") > count
    hand.ask("run", code="bpy.context.scene.frame_end = 250")
