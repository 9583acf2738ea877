# SPDX-License-Identifier: MIT
"""Time per frame of a face in Blender, against writing every value from Python.

    python tests/bench/frame_time.py FILE.dna [FILE.dna ...] [--frames N]

Runs inside the bpy module with the add-on's zip installed:  --extension build/dist/risorius-*.zip
For each file a character is imported at LOD 0, 60 of its controls are animated, and the scene is
stepped frame by frame. "add-on" is frame_set with the add-on's handler; "originals" writes the same
pose to every bone and every real shape key by a Python loop after frame_set, without drivers, as a
script would; "curves only" is frame_set with nothing following the controls. Drawing is not in it.
"""

from __future__ import annotations

import argparse
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(PROJECT / "packaging"))
os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="risorius-bench-"))

import bpy  # noqa: E402 isort: skip
import addon_utils  # noqa: E402 isort: skip
import install_extension  # noqa: E402

ANIMATED = 60


def machine():
    """CPU, Blender and commit, for the head of the table."""
    cpu = platform.processor()
    info = Path("/proc/cpuinfo")
    if info.exists():
        lines = [x for x in info.read_text().splitlines() if x.startswith("model name")]
        cpu = f"{len(lines)} x {lines[0].split(':')[1].strip()}" if lines else cpu
    commit = subprocess.run(
        ["git", "-C", str(PROJECT), "rev-parse", "--short", "HEAD"],
        capture_output=True,
        text=True,
        check=False,
    ).stdout.strip()
    return f"{cpu}; Blender {bpy.app.version_string}; Python {platform.python_version()}; {commit}"


def import_face(path, mode, package):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_utils.enable(package, default_set=True)
    begin = time.perf_counter()
    bpy.ops.risorius.import_dna(filepath=str(path), shape_mode=mode)
    seconds = time.perf_counter() - begin
    controls = next(o for o in bpy.data.objects if o.name.endswith("_controls"))
    return controls, controls["risorius_rig"], seconds


def animate(controls, frames):
    """Key every n-th control so that ANIMATED of them change at every frame."""
    face = controls.pose.bones["face"]
    names = [n for n in list(face.keys()) if isinstance(face[n], float)]
    for number, name in enumerate(names[:: max(1, len(names) // ANIMATED)][:ANIMATED]):
        path = f'["{bpy.utils.escape_identifier(name)}"]'
        for frame, value in ((1, 0.1), (frames // 2, 0.2 + number / 100), (frames + 1, 0.1)):
            face[name] = value
            face.keyframe_insert(path, frame=frame)


def step(frames, then=lambda: None):
    """Median and fastest time in ms of one frame."""
    scene = bpy.context.scene
    for frame in (1, 2, 3):
        scene.frame_set(frame)
    times = []
    for frame in range(2, frames + 1):
        begin = time.perf_counter()
        scene.frame_set(frame)
        then()
        times.append((time.perf_counter() - begin) * 1000)
    return statistics.median(times), min(times)


def write_originals(rig):
    """What a script without the add-on does each frame: every bone, every key, in a loop."""
    bones = list(rig.pose.bones)
    keys = [
        block
        for item in bpy.data.objects
        if item.type == "MESH" and item.data.shape_keys
        for block in item.data.shape_keys.key_blocks[1:]
    ]
    for item in bpy.data.objects:
        if item.type == "MESH" and item.data.shape_keys:
            item.data.shape_keys.animation_data_clear()
    state = {"frame": 0}

    def write():
        state["frame"] += 1
        shift = (state["frame"] % 7) * 1e-4
        for bone in bones:
            place = bone.location
            bone.location = (place[0] + shift, place[1], place[2])
            bone.rotation_quaternion = (1, shift, 0, 0)
            bone.scale = (1, 1, 1)
        for number, block in enumerate(keys):
            block.value = shift * 100 if number % 10 == 0 else 0.0
        bpy.context.view_layer.update()

    return write, len(bones), len(keys)


def measure(path, package, frames):
    """One row of the table per way, for one file."""
    rows = []
    for mode in ("LIVE", "KEYS"):
        controls, _, seconds = import_face(path, mode, package)
        animate(controls, frames)
        rows.append((f"add-on, {mode}", *step(frames), f"import {seconds:.1f} s"))
    bpy.ops.preferences.addon_disable(module=package)
    rig = controls["risorius_rig"]
    write, bones, keys = write_originals(rig)
    rows.append(("curves only", *step(frames), ""))
    rows.append(("originals", *step(frames, write), f"{bones} bones, {keys} keys"))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--frames", type=int, default=60)
    args = parser.parse_args(install_extension.arguments())
    package = install_extension.install(args.extension)
    print(machine())
    print("| file | way | median ms | min ms | |\n|---|---|---|---|---|")
    for path in args.files:
        for way, median, best, note in measure(path, package, args.frames):
            print(f"| {path.stem} | {way} | {median:.1f} | {best:.1f} | {note} |", flush=True)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # bpy sometimes hangs at exit
