# SPDX-License-Identifier: MIT
"""Measures the time per frame of faces in Blender with the add-on and with plain handlers.

    python tests/bench/frame_time.py FULL.dna [--sample SAMPLE.dna] --extension ZIP [--frames N]
                                     [--clip CLIP.rzc]

Runs inside the bpy module or an executable (blender -b --python ... --), with the add-on's zip
installed. FULL.dna is a file of real size (tests/fullscale/generate.py): 60 of its controls change
at every frame, by an NLA strip with a second strip in Add mode above it. Each row times
`scene.frame_set` with the whole dependency graph, without drawing.

    add-on, AUTO / LIVE / KEYS   the add-on in the shape modes Direct, Live, Shape Keys
    floor of AUTO / LIVE         without the add-on, a handler writes two recorded poses in turn
    plain way                    a handler evaluates the same rig natively and writes all bones and
                                 all shape key values to the original (not evaluated) objects, in
                                 bulk; no drivers
    plain way, loops             the same, with one assignment per bone and shape key
    curves only                  no handler follows the controls

With --clip, a clip (tests/bench/real_frames.py) is imported and plays instead of the strips.

With --sample, also measures ten characters of SAMPLE.dna in one scene at their lowest LOD.
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
sys.path[:0] = [str(PROJECT / "packaging" / "check" / "blender"), str(PROJECT / "tests" / "bench")]
os.environ.setdefault("BLENDER_USER_RESOURCES", tempfile.mkdtemp(prefix="risorius-bench-"))

import bpy  # noqa: E402 isort: skip
import addon_utils  # noqa: E402 isort: skip
import bare_scene  # noqa: E402
import install_extension  # noqa: E402

ANIMATED = 60  # default of --active: captured performances move 60 to 100 controls
ROUNDS = 3


def machine():
    """Line of text above the table: CPU, versions of Blender and Python, and commit."""
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


def empty_scene(package):
    """Open an empty file with the add-on enabled."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_utils.enable(package, default_set=True)


def import_face(path, mode, lods=(0,)):
    """(control armature, deforming armature, import time in seconds) of an imported face.

    Args:
        path: path of the DNA file.
        mode: shape mode: AUTO (Direct), LIVE or KEYS.
        lods: indices of the LODs to import, below 8.
    """
    before = set(bpy.data.objects)
    begin = time.perf_counter()
    chosen = tuple(i in lods for i in range(8))
    bpy.ops.risorius.import_dna(filepath=str(path), shape_mode=mode, lods=chosen)
    seconds = time.perf_counter() - begin
    rig = next(o for o in bpy.data.objects if o not in before and "risorius_controls" in o)
    return rig["risorius_controls"], rig, seconds


def animate(controls, frames, active=ANIMATED):
    """Key `active` evenly spaced controls in two NLA strips, so that they change at every frame."""
    face = controls.pose.bones["face"]
    names = [n for n in list(face.keys()) if isinstance(face[n], float)]
    data = controls.animation_data_create()
    for blend, scale in (("REPLACE", 1.0), ("ADD", 0.05)):
        for number, name in enumerate(names[:: max(1, len(names) // active)][:active]):
            path = f'["{bpy.utils.escape_identifier(name)}"]'
            keys = ((1, 0.1), (frames // 2, 0.2 + number / 100), (frames + 1, 0.1))
            for frame, value in keys:
                face[name] = value * scale
                face.keyframe_insert(path, frame=frame)
        action = data.action
        slot = getattr(data, "action_slot", None)
        strip = data.nla_tracks.new().strips.new(blend, 1, action)
        if slot is not None:
            strip.action_slot = slot
        strip.blend_type = blend
        data.action = None


def play(controls, clip, frames, active):
    """Animate the controls by an imported clip, or by keyframes from `animate`.

    Args:
        controls: the control armature.
        clip: path of a clip file, or None for keyframes.
        frames: length of the keyed animation in frames.
        active: number of keyed controls.
    """
    if clip is None:
        animate(controls, frames, active)
        return
    bpy.context.view_layer.objects.active = controls
    bpy.ops.risorius.import_animation(filepath=str(clip))


def step(frames):
    """The time in ms of each frame from 2 to `frames`; all are played ROUNDS (3) times."""
    scene = bpy.context.scene
    for frame in (1, 2, 3):
        scene.frame_set(frame)
    times = []
    for _ in range(ROUNDS):
        for frame in range(2, frames + 1):
            begin = time.perf_counter()
            scene.frame_set(frame)
            times.append((time.perf_counter() - begin) * 1000)
    return times


def own_time(package, frames):
    """The add-on's own time on a frame, in the stages that its overlay shows.

    Returns: stage -> median of the frames 2 to `frames` in ms.
    """
    timing = sys.modules[f"{package}.scene.frame.timing"]
    stages = []
    for frame in range(2, frames + 1):
        bpy.context.scene.frame_set(frame)
        stages.append(dict(timing.frames[-1].stages))
    return {name: statistics.median(s[name] for s in stages) for name in stages[0]}


def plain_way(controls, rig, path, loops):
    """Replace the add-on by a handler of bones and shape keys. Returns the number of bones.

    Args:
        controls: the control armature.
        rig: the deforming armature.
        path: path of the DNA file.
        loops: True: one assignment per bone and shape key; False: in bulk.
    """
    import numpy as np
    import risorius

    dna = risorius.load(str(path))
    compiled = risorius.Rig(dna)
    live = sys.modules["bl_ext.user_default.risorius.scene.character.runtime"].of(rig)
    bones = live.bone_space([b.bone["dna_joint"] for b in rig.pose.bones])
    labels = list(live.labels)
    bpy.ops.preferences.addon_disable(module="bl_ext.user_default.risorius")
    keys = []
    for item in bpy.data.objects:
        if item.type == "MESH" and item.data.shape_keys:
            key = item.data.shape_keys
            order = [c.driver.variables[0].targets[0].data_path for c in key.animation_data.drivers]
            channel = [int(p.rsplit("[", 1)[1][:-1]) for p in order]
            key.animation_data_clear()
            keys.append((key, channel, np.zeros(len(key.key_blocks), np.float32)))
    channels = ("location", "rotation_quaternion", "scale")

    def write(_scene, depsgraph):
        face = controls.evaluated_get(depsgraph).pose.bones["face"]
        values = dict(face.items())
        pose = compiled.evaluate(np.array([values[n] for n in labels], np.float32))
        for name, flat in zip(channels, bones.evaluate(pose.joints), strict=True):
            if loops:
                for bone, value in zip(rig.pose.bones, flat.tolist(), strict=True):
                    setattr(bone, name, value)
            else:
                rig.pose.bones.foreach_set(name, flat.ravel())
        rig.update_tag(refresh={"OBJECT"})
        for key, channel, flat in keys:
            flat[1:] = pose.blend_shapes[channel]
            if loops:
                for block, value in zip(key.key_blocks, flat.tolist(), strict=True):
                    block.value = value
            else:
                key.key_blocks.foreach_set("value", flat)
            key.update_tag()

    bpy.app.handlers.frame_change_post.append(write)
    return len(rig.pose.bones)


def floor(package, rig, frames):
    """Times in ms of frames, if the add-on is disabled and a handler writes two recorded poses."""
    bare = bare_scene.Bare([rig])
    for frame in (frames // 3, frames // 2):
        bpy.context.scene.frame_set(frame)
        bare.remember()
    bpy.ops.preferences.addon_disable(module=package)
    bare.begin()
    bpy.app.handlers.frame_change_post.append(bare.write)
    times = step(frames)
    bpy.app.handlers.frame_change_post.remove(bare.write)
    return times


def row(way, times, note, base=None):
    """Print a row of the table: median and minimum in ms, fps, base / median, and the note.

    Args:
        way: name of the row.
        times: times of frames in ms.
        note: text in the last column.
        base: median time of the plain way in ms; None: the ratio is left out.

    Returns: the median in ms.
    """
    middle = statistics.median(times)
    ratio = f"{base / middle:.1f}" if base else ""
    print(
        f"| {way} | {middle:.1f} | {min(times):.1f} | {1000 / middle:.0f} | {ratio} | {note} |",
        flush=True,
    )
    return middle


def measure_full(path, package, frames, clip, active):
    """Measure all rows of the full-scale face. The other rows are compared with the plain way."""
    print("| way | median ms | min ms | fps | times the plain way | |\n|---|---|---|---|---|---|")
    base = None
    for loops in (False, True):
        empty_scene(package)
        controls, rig, _ = import_face(path, "KEYS")
        play(controls, clip, frames, active)
        count = plain_way(controls, rig, path, loops)
        times = step(frames)
        base = base or statistics.median(times)
        row("plain way" + (", loops" if loops else ""), times, f"{count} bones", base)
    for mode in ("KEYS", "LIVE", "AUTO"):
        empty_scene(package)
        controls, rig, seconds = import_face(path, mode)
        play(controls, clip, frames, active)
        times = step(frames)
        stages = own_time(package, frames)
        words = ", ".join(f"{name} {ms:.2f}" for name, ms in stages.items())
        note = f"import {seconds:.1f} s; own {sum(stages.values()):.2f} ms: {words}"
        row(f"add-on, {mode}", times, note, base)
        if mode != "KEYS":
            row(f"floor of {mode}", floor(package, rig, frames), "", base)
    row("curves only", step(frames), "", base)


def measure_crowd(path, package, frames, count=10):
    """Measure several characters in one scene at their lowest LOD."""
    empty_scene(package)
    for _ in range(count):
        controls, rig, _ = import_face(path, "AUTO", lods=range(8))
        animate(controls, frames)
        lowest = max(max(m["dna_lods"]) for m in rig.children if "dna_lods" in m)
        bpy.context.view_layer.objects.active = controls
        bpy.ops.risorius.set_lod(lod=lowest)
    times = step(frames)
    stages = own_time(package, frames)
    row(f"{count} x {path.stem}, LOD {lowest}", times, f"own {sum(stages.values()):.2f} ms")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("full", type=Path)
    parser.add_argument("--sample", type=Path)
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--clip", type=Path)
    parser.add_argument("--active", type=int, default=ANIMATED, help="controls that change")
    args = parser.parse_args(install_extension.arguments())
    package = install_extension.install(args.extension)
    print(machine())
    measure_full(args.full, package, args.frames, args.clip, args.active)
    if args.sample:
        measure_crowd(args.sample, package, args.frames)


if __name__ == "__main__":
    main()
    sys.stdout.flush()
    os._exit(0)  # bpy sometimes hangs at exit
