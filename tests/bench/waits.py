# SPDX-License-Identifier: MIT
"""Measures waiting times in Blender with the add-on, and without it in the same scene.

    python tests/bench/waits.py FULL.dna [--sample SAMPLE.dna] --extension ZIP [--faces 1 2 4 8]

Runs inside the bpy module or an executable (blender -b --python ... --), with the add-on's zip
installed. FULL.dna is a file of real size (tests/fullscale/generate.py); the .blend file for
opening and saving contains ten characters of SAMPLE.dna. The floor is the time in the same scene
with the add-on disabled; floor and add-on are measured alternately, three times each. For frames
and slider steps, a bare handler writes two poses alternately: vertex positions recorded from the
add-on, or with --mode LIVE its bones and shape keys. For undo, the same handler runs after a change
of a property. Files and edit mode need no handler. Times are medians in ms.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import frame_time  # isort: skip  before bpy: it gives Blender a user folder of its own
import bare_scene
import bpy
import install_extension
import numpy as np


def median_ms(action, rounds, before=None):
    """Median time of an action in ms; `before` runs before each action, outside its time."""
    times = []
    for _ in range(rounds):
        if before is not None:
            before()
        begin = time.perf_counter()
        action()
        times.append((time.perf_counter() - begin) * 1000)
    return statistics.median(times)


def in_turn(package, ours, floor, times=3):
    """[medians of ours, medians of floor]. They are called in turn.

    ours() is called while the add-on is enabled, floor() while it is disabled.

    Args:
        package: module name of the add-on.
        ours, floor: functions that return a number, or the same number of numbers each time.
        times: number of calls of each function.
    """
    found = ([], [])
    for _ in range(times):
        for switch, ask, kept in (
            (bpy.ops.preferences.addon_enable, ours, found[0]),
            (bpy.ops.preferences.addon_disable, floor, found[1]),
        ):
            switch(module=package)
            kept.append(ask())
    bpy.ops.preferences.addon_enable(module=package)
    return [np.median(kept, axis=0) for kept in found]


def row(name, ours, floor=None, note=""):
    """Print a table row: ms with the add-on, ms of the floor, and their ratio."""
    base = f"{floor:.1f}" if floor is not None else ""
    ratio = f"{ours / floor:.2f}" if floor else ""
    print(f"| {name} | {ours:.1f} | {base} | {ratio} | {note} |", flush=True)


def faces(path, count, mode, lods=(0,)):
    """Import `count` characters of a file: [(control armature, deforming armature)]."""
    found = [frame_time.import_face(path, mode, lods)[:2] for _ in range(count)]
    for number, (controls, _) in enumerate(found):
        controls.location.x = 0.4 * number
    bpy.context.view_layer.update()
    return found


def measure_frames(path, package, counts, frames, mode):
    """Measure a frame of playback, once for each number of full-scale faces in counts."""
    for count in counts:
        frame_time.empty_scene(package)
        found = faces(path, count, mode)
        for controls, _ in found:
            frame_time.animate(controls, frames)
        bare = bare_scene.Bare([rig for _, rig in found])
        for frame in (frames // 3, frames // 2):
            bpy.context.scene.frame_set(frame)
            bare.remember()

        def alone(bare=bare):
            bare.begin()
            bpy.app.handlers.frame_change_post.append(bare.write)
            times = statistics.median(frame_time.step(frames))
            bpy.app.handlers.frame_change_post.remove(bare.write)
            bare.end()
            return times

        ours, floor = in_turn(package, lambda: statistics.median(frame_time.step(frames)), alone)
        row(f"a frame, {count} full-scale", ours, floor, f"{1000 / ours:.0f} fps")


def slide(controls, value):
    """Set a slider's value as the sidebar does, and evaluate the scene."""
    face = controls.pose.bones["face"]
    name = next(n for n in list(face.keys()) if isinstance(face[n], float))
    face[name] = value
    controls.update_tag()
    bpy.context.view_layer.update()


class Slider:
    """Sets a slider to another value at each call, then calls `after`."""

    def __init__(self, controls, after=lambda: None):
        self.controls, self.after, self.step = controls.name, after, 0

    def __call__(self):
        self.step += 1
        slide(bpy.data.objects[self.controls], 0.1 + self.step % 7 / 10)
        self.after()


def measure_slider(path, package, rounds, mode):
    """Measure a change of a slider, and its undo and redo."""
    frame_time.empty_scene(package)
    (controls, rig), *_ = faces(path, 1, mode)
    bare, drag = bare_scene.Bare([rig]), Slider(controls)
    for _ in range(2):
        drag()
        bpy.context.view_layer.update()
        bare.remember()

    def written():
        bare.begin()
        bare.write()
        bpy.context.view_layer.update()

    bare_drag = Slider(controls, written)

    def floors():
        found = (median_ms(bare_drag, rounds), *measure_undo(bare_drag))
        bare.end()
        return found

    ours, floor = in_turn(package, lambda: (median_ms(drag, rounds), *measure_undo(drag)), floors)
    waits = ("a slider's step to the evaluated mesh", "undo of a slider's step", "redo of it")
    for wait, own, bare_own in zip(waits, ours, floor, strict=True):
        row(wait, own, bare_own)


def measure_undo(drag, steps=8):
    """Median time in ms of an undo and of a redo, each with the evaluation of the scene.

    Args:
        drag: function that makes the change that is undone.
        steps: number of changes; steps - 1 of them are undone, then redone.
    """
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="start")
    for step in range(steps):
        drag()
        bpy.ops.ed.undo_push(message=str(step))

    def evaluated(operator):
        operator()
        bpy.context.view_layer.update()

    undo = median_ms(lambda: evaluated(bpy.ops.ed.undo), steps - 1)
    redo = median_ms(lambda: evaluated(bpy.ops.ed.redo), steps - 1)
    return undo, redo


def measure_switches(path, package, rounds, mode):
    """Measure switches of the LOD, of shape modes and of edit mode, in both directions."""
    frame_time.empty_scene(package)
    (controls, rig), *_ = faces(path, 1, mode, lods=range(8))
    bpy.context.view_layer.objects.active = controls
    levels = iter([1, 0] * rounds)
    ours = median_ms(lambda: bpy.ops.risorius.set_lod(lod=next(levels)), 2 * rounds)
    row("level of detail, 0 and 1", ours)
    modes = iter(["KEYS", mode] * rounds)
    for name in (f"{mode} to KEYS", f"KEYS to {mode}"):
        row(name, median_ms(lambda: bpy.ops.risorius.set_shape_mode(mode=next(modes)), 1))
    head = max((m for m in rig.children_recursive if m.type == "MESH"),
               key=lambda m: len(m.data.vertices))  # fmt: skip

    def edit():
        bpy.context.view_layer.objects.active = head
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.context.view_layer.update()
        bpy.ops.object.mode_set(mode="OBJECT")
        bpy.context.view_layer.update()

    edited = lambda: median_ms(edit, rounds)  # noqa: E731
    row("edit mode, in and out", *in_turn(package, edited, edited))


def measure_files(path, package, rounds, mode, count=10):
    """Measure the import of a face, and saving and opening a .blend with `count` faces."""
    frame_time.empty_scene(package)
    seconds = []
    for _ in range(rounds):
        frame_time.empty_scene(package)
        seconds.append(frame_time.import_face(path, mode)[2])
    row(f"import of {path.stem}", 1000 * statistics.median(seconds))
    frame_time.empty_scene(package)
    faces(path, count, mode, lods=range(8))
    with tempfile.TemporaryDirectory() as folder:
        blend = str(Path(folder) / "faces.blend")
        save = lambda: bpy.ops.wm.save_as_mainfile(filepath=blend, copy=True)  # noqa: E731

        def load():
            bpy.ops.wm.open_mainfile(filepath=blend)
            bpy.context.view_layer.update()

        save()
        size = Path(blend).stat().st_size / 1e6
        both = lambda: (median_ms(load, rounds), median_ms(save, rounds))  # noqa: E731
        ours, floor = in_turn(package, both, both)
        row(f"opening {count} of {path.stem}", ours[0], floor[0], f"{size:.1f} MB")
        row(f"saving {count} of {path.stem}", ours[1], floor[1])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("full", type=Path)
    parser.add_argument("--sample", type=Path)
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--faces", type=int, nargs="+", default=[1, 2, 4, 8])
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--mode", choices=("AUTO", "LIVE"), default="AUTO")
    args = parser.parse_args(install_extension.arguments())
    package = install_extension.install(args.extension)
    print(frame_time.machine())
    print("| wait | ms | floor | times the floor | |\n|---|---|---|---|---|")
    measure_frames(args.full, package, args.faces, args.frames, args.mode)
    measure_slider(args.full, package, 5 * args.rounds, args.mode)
    measure_switches(args.full, package, args.rounds, args.mode)
    measure_files(args.full, package, 3, args.mode, count=1)
    if args.sample:
        measure_files(args.sample, package, args.rounds, args.mode)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # bpy sometimes hangs at exit
