# SPDX-License-Identifier: MIT
"""Tests the user interface in a real window with a real pointer; see real_window.sh.

    python drive.py OUT USER STEPS COMMAND...

OUT is the folder of pictures and logs. USER is Blender's user folder with inside.py and man.dna.
STEPS are names of steps, separated by commas; an empty string runs all. COMMAND starts Blender.
Prints rows `row<TAB>check<TAB>passed<TAB>failed`, and `say<TAB>text` for steps that cannot run.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import traceback
from collections.abc import Iterator
from pathlib import Path

from board_and_grid import board, grid
from common import (
    JAW,
    SMILE,
    Check,
    NotThereError,
    Step,
    add_idle_life,
    clear,
    has_face,
    look_at_face,
    need_section,
    open_section,
    open_tab,
    ready_tab,
    scroll,
    slider,
)
from file_tasks import face_menu, own_head, studio, two_faces
from german import german
from hand import HEIGHT, WIDTH, Hand, LateError, difference
from head_tasks import plain_head
from keyed import keyed
from menus import name_file
from posing_tasks import gaze, smirk, two_seconds
from shot import shot
from skin import drag_in_views, drag_skin
from take_tasks import capture
from voice import voice


def start(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Open the empty tab and click on its first button, which adds a face."""
    hand.ask("quiet")
    open_tab(hand)
    yield "N and a click open the tab", hand.see("view()[2].active_panel_category") == "Risorius"
    hand.picture("empty-tab")
    x, y = hand.find(r"risorius\.add_character")
    before = hand.still()
    hand.click(x, y)
    hand.wait("a face is there", lambda: has_face(hand))
    after = hand.still()
    yield "Add a Face: a click on the first button of the empty tab", has_face(hand)
    yield "and the view shows it", difference(before, after, hand.ask("face_box")) > 0.2
    hand.picture("first-face")


def import_file(hand: Hand, dna: Path) -> Iterator[Check]:
    """Import a file by File > Import > MetaHuman DNA and the file browser."""
    count = "len([o for o in bpy.data.objects if 'risorius_controls' in o])"
    hand.ask("run", code=f"bpy.app.driver_namespace['before'] = {count}")
    open_import(hand)
    name_file(hand, dna)
    hand.wait("the view is back", lambda: "VIEW_3D" in hand.ask("state")["areas"])
    hand.wait("the file is imported", lambda: has_face(hand))
    seen = hand.still()
    box = hand.ask("face_box")
    flat = seen[round(box[1]) : round(box[3]), round(box[0]) : round(box[2])]
    yield "File > Import > MetaHuman DNA: menus and the file browser", has_face(hand)
    yield "and the view has gone to the face", flat.size > 0 and float(flat.std()) > 8
    hand.ask("run", code=ONE_FACE)


ONE_FACE = """
from bl_ext.user_default.risorius.scene.character import build
for one in [o for o in bpy.data.objects if "risorius_controls" in o][1:]:
    build.remove(one)
bpy.context.view_layer.objects.active = rig()["risorius_controls"]
bpy.context.view_layer.update()
"""


def open_import(hand: Hand) -> None:
    """Open File > Import and click on the entry for DNA files."""
    for x in (42, 50, 60, 34):  # possible places of the menu File beside Blender's logo
        for y in range(38, 560, 15):  # possible places of the entry Import
            # The menu is opened again for each place, because it closes if the pointer leaves it
            # beside a submenu.
            hand.move(WIDTH / 2, HEIGHT / 2)
            hand.click(x, 13)
            hand.still()
            hand.move(x + 30, y)
            found = entry_beside(hand, y)
            if found:
                hand.click(*found)
                return
            hand.key("Escape")
    raise LateError("no entry for DNA files in File > Import")


def entry_beside(hand: Hand, y: int) -> tuple[float, float] | None:
    """Find the entry for DNA files in an open submenu.

    Args:
        hand: the pointer.
        y: y of the tried entry of the menu File on the screen, in pixels.

    Returns: place of the entry, or None if the submenu is not Import.
    """
    import time

    time.sleep(0.35)  # Blender opens a submenu after the pointer rests
    x, misses = 300, 0
    for below in range(y, HEIGHT - 30, 11):
        said = hand.under(x, below, "ctrl+c")
        if "risorius.import_dna" in said:
            return x, below
        misses = 0 if "import" in said else misses + 1
        if misses == 2:  # a single miss may be between two entries
            return None
    return None


def drag_slider(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Drag a slider with the pointer, release it, and undo by the keyboard."""
    look_at_face(hand)
    ready_tab(hand)
    need_section(hand, "RISORIUS_PT_controls")
    hand.ask("run", code="bpy.context.window_manager.risorius_search = 'jawOpen'")
    hand.still()
    place = hand.find(r'CTRL_expressions\.jawOpen"\]$', of_field=True, columns=(0.62, 0.8))
    before, chin = hand.still(), hand.ask("moved_by", control=JAW)
    hand.begin_drag(place)
    hand.go(place, (place[0] + 60, place[1]))
    during = hand.screen()
    value = slider(hand)
    hand.do("mouseup", 1)
    after = hand.still()
    box = hand.ask("face_box")
    low = [box[0], (box[1] + box[3]) / 2, box[2], box[3]]
    high = [box[0], box[1], box[2], box[1] + (box[3] - box[1]) * 0.25]
    yield "a slider is dragged and has another value", value > 0.1
    yield "the mouth moves while the button is down", difference(before, during, low) > 0.02
    yield "and stays so", difference(before, after, low) > 0.02
    yield "the forehead does not move", difference(before, after, high) < 0.01
    moved = hand.ask("vertex_at", vertex=chin["vertex"])
    down = moved["at"][1] - chin["at"][1]
    yield "the chin has gone down on the screen", down > 3
    hand.picture("slider")
    hand.move(WIDTH * 0.3, HEIGHT * 0.5)
    hand.key("ctrl+z")
    hand.wait("undone", lambda: slider(hand) == 0.0)
    yield "Ctrl-Z takes it back, in the view too", difference(before, hand.still(), low) < 0.01
    hand.ask("run", code="bpy.context.window_manager.risorius_search = ''")


def add_layer(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Add a layer of idle life by its menu, and check that it moves the face over time."""
    clear(hand)
    ready_tab(hand)
    add_idle_life(hand)
    yield "a layer is added by its menu", len(hand.ask("state")["layers"]) == 1
    look_at_face(hand)
    box, first = hand.ask("face_box"), hand.still()
    hand.move(WIDTH * 0.3, HEIGHT * 0.5)
    for _ in range(3):
        hand.key("Right")
    frame = hand.ask("state")["frame"]
    yield f"frames go on by the keyboard (to {frame})", frame == 4
    # The first blink is the first large movement of idle life.
    hand.ask("run", code=f"bpy.context.scene.frame_end = {FIRST_BLINK}")
    hand.key("shift+Right")
    seen = difference(first, hand.still(), box)
    yield f"and the layer moves the face (a blink, {seen:.1%} of it)", seen > 0.005
    hand.picture("blink")
    hand.ask("run", code="bpy.context.scene.frame_end = 250")
    clear(hand)


FIRST_BLINK = 72  # frame of the first blink of idle life at 24 frames per second, seed 0


def see_why(hand: Hand, _dna: Path) -> Iterator[Check]:
    """Use See Why by clicks: heat map, causes of a vertex, mute and show all."""
    clear(hand)
    hand.ask("run", code=POSE)
    look_at_face(hand)
    open_section(hand, "RISORIUS_PT_options", "RISORIUS_PT_why")
    before, box = hand.still(), hand.ask("face_box")
    button = hand.find(r"risorius\.heat\(.*POSE")
    hand.click(*button)
    hand.wait("a heat map", lambda: hand.ask("state")["heat"])
    after = hand.still()
    yield "Heat Map from Neutral colours the face", difference(before, after, box) > 0.3
    yield "and its button stays under the pointer", "POSE" in hand.under(*button, "ctrl+c")
    hand.picture("heat")
    hand.click(*hand.find(r"risorius\.why_vertex"))
    corner = hand.ask("moved_by", control=SMILE[0])
    hand.click(*corner["at"])
    found = hand.wait("a vertex is found", lambda: hand.ask("found_causes"))
    yield (
        "a click on the corner of the mouth lists what moves it",
        found["first"].startswith("mouth"),
    )
    hand.still()
    hand.picture("why")
    hand.click(*hand.find(r"risorius\.heat\(.*OFF", columns=(0.96, 0.92, 1.0)))
    hand.wait("no heat map", lambda: not hand.ask("state")["heat"])
    yield "one click takes the colours away", difference(before, hand.still(), box) < 0.02
    hand.click(*hand.find(r"risorius\.mute\(.*JOINTS", columns=(0.45, 0.55, 0.35)))
    hand.wait("muted", lambda: hand.ask("state")["look"])
    yield "joints that are muted rest in the view", difference(before, hand.still(), box) > 0.02
    scroll(hand, -40)
    hand.click(*hand.find(r"risorius\.show_all", columns=(0.85, 0.9, 0.8)))
    hand.wait("whole", lambda: not hand.ask("state")["look"])
    yield "and one click shows the whole face", difference(before, hand.still(), box) < 0.02
    clear(hand)


POSE = f"""
for name in {SMILE!r}:
    face()[name] = 0.8
face()["{JAW}"] = 0.35
rig()["risorius_controls"].update_tag()
bpy.context.view_layer.update()
view()[0].tag_redraw()
"""

STEPS: tuple[Step, ...] = (
    start,
    drag_slider,
    keyed,
    drag_skin,
    drag_in_views,
    grid,
    add_layer,
    see_why,
    smirk,
    two_seconds,
    gaze,
    capture,
    voice,
    face_menu,
    two_faces,
    own_head,
    plain_head,
    studio,
    shot,
    german,
    board,
    import_file,
)


def run(hand: Hand, dna: Path, wanted: list[str]) -> int:
    """Run the steps and print their rows. Returns the number of failed checks and steps.

    Args:
        hand: the pointer.
        dna: the DNA file to import.
        wanted: names of the steps; empty for all. An unknown name counts as a failed check.
    """
    strange = set(wanted) - {step.__name__ for step in STEPS}
    failed = len(strange)
    for name in sorted(strange):
        print(f"row\tno step is called {name}\t0\t1", flush=True)
    for step in STEPS:
        if wanted and step.__name__ not in wanted:
            continue
        try:
            for name, good in step(hand, dna):
                failed += not good
                print(f"row\t{name}\t{int(good)}\t{int(not good)}", flush=True)
        except NotThereError as lack:
            print(f"say\tNOT RUN: {lack}", flush=True)
        except (LateError, RuntimeError, subprocess.CalledProcessError) as error:
            failed += 1
            traceback.print_exc()
            print(f"row\t{step.__name__}: {str(error).splitlines()[-1]}\t0\t1", flush=True)
            hand_over(hand, step.__name__)
    return failed


def hand_over(hand: Hand, name: str) -> None:
    """After a failed step: save a picture of the screen, release the button and press Esc."""
    subprocess.run(["import", "-window", "root", str(hand.out / f"failed-{name}.png")], check=False)
    for keys in ("Escape", "Escape"):
        subprocess.run(["xdotool", "mouseup", "1", "key", keys], check=False)


def main() -> int:
    """Start Blender and run the steps. Exit code 0 only if no check failed."""
    out, user, wanted, *command = sys.argv[1:]
    folder = Path(out)
    with tempfile.TemporaryDirectory(prefix="talk", dir=user) as talk:
        log = (folder / "blender.log").open("wb")
        arguments = ["--window-geometry", "0", "0", str(WIDTH), str(HEIGHT), "-noaudio"]
        arguments += ["--python", str(Path(user) / "inside.py"), "--", talk]
        blender = subprocess.Popen([*command, *arguments], stdout=log, stderr=log)
        try:
            hand = Hand(Path(talk), folder, Path(user), blender)
            print(f"say\tBlender {hand.ask('ready')['blender']}", flush=True)
            return (
                1 if run(hand, Path(user) / "man.dna", [w for w in wanted.split(",") if w]) else 0
            )
        finally:
            blender.kill()
            blender.wait()


if __name__ == "__main__":
    sys.exit(main())
