# SPDX-License-Identifier: MIT
"""Renders one performance on two people inside Blender.

A voice becomes a clip, and the clip plays on both faces. A layer adds a smile. A flash of light
makes both react.

performance.py -- --extension ZIP --man DNA --woman DNA --voice WAV --text TEXT --out FOLDER
                  [--only FRAME ...]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "check" / "blender")]

import bpy  # noqa: E402
import install_extension  # noqa: E402
import scene as stage  # noqa: E402
from demo import timed  # noqa: E402
from mathutils import Vector  # noqa: E402
from progress import Progress  # noqa: E402

FRAME_RATE = 24
APART = 0.25  # metres between the two faces
SMILE = 1.9  # time in seconds at which the smile begins
FLASH = 4.75  # time of the flash in seconds


def parse():
    parser = argparse.ArgumentParser()
    for name in ("extension", "man", "woman", "voice", "out"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    parser.add_argument("--text", required=True)
    parser.add_argument("--only", type=int, nargs="*", help="render these frames as a still each")
    return parser.parse_args(install_extension.arguments())


def frame_at(seconds):
    return 1 + round(seconds * FRAME_RATE)


def choose(controls):
    """Select a character and make it active."""
    for thing in bpy.context.selected_objects:
        thing.select_set(False)
    controls.select_set(True)
    bpy.context.view_layer.objects.active = controls


def import_face(path, lod):
    """Import one level of detail of a face. Returns its control armature.

    Args:
        path: the DNA file.
        lod: index of the level of detail.
    """
    must(bpy.ops.risorius.import_dna(filepath=str(path), lods=[i == lod for i in range(8)]))
    return bpy.context.view_layer.objects.active


def must(result):
    if result != {"FINISHED"}:
        raise RuntimeError(f"an operator gave {result}")


def add_acting(controls, seed):
    """Add layers with idle life and a smile, and the reaction to the flash.

    Args:
        controls: control armature of the face.
        seed: seed of the idle life.
    """
    choose(controls)
    must(bpy.ops.risorius.layer_add(kind="IDLE"))
    layers = controls.risorius_layers
    layers[-1].seed = seed
    layers[-1].start = 1
    must(bpy.ops.risorius.layer_add(kind="EXPRESSION", source="joy"))
    smile = layers[-1]
    smile.blend = "ADD"
    smile.regions = {"MOUTH", "CHEEKS", "EYES"} & {
        r.identifier for r in smile.bl_rna.properties["regions"].enum_items
    }
    path = f"risorius_layers[{len(layers) - 1}].weight"
    for seconds, weight in (
        (SMILE, 0.0),
        (SMILE + 0.9, 0.55),
        (FLASH, 0.5),
        (FLASH + 0.5, 0.15),
        (FLASH + 1.6, 0.6),
    ):
        smile.weight = weight
        controls.keyframe_insert(path, frame=frame_at(seconds))
    bpy.context.scene.frame_set(frame_at(FLASH))
    must(bpy.ops.risorius.fire(reaction="flash"))


def add_flash(target, unit):
    """Add the light of the flash: it reaches its peak in 0.05 s, and is out 0.45 s later.

    Args:
        target: point between the faces.
        unit: height of the face's bounds, metres.
    """
    stage.add_light("Flash", target + Vector((0.1, -2.6, 0.9)) * unit, target, 0.0, unit, (1, 1, 1))
    data = bpy.data.lights["Flash"]
    peak = 1.3 * unit * unit * 100
    for seconds, energy in ((FLASH - 0.05, 0.0), (FLASH, peak), (FLASH + 0.45, 0.0)):
        data.energy = energy
        data.keyframe_insert("energy", frame=frame_at(seconds))


def stand_side_by_side(man, woman):
    """Move the control armatures beside each other, and the top of the woman to 1 cm below the
    man's top."""
    man.location.x, woman.location.x = -APART / 2, APART / 2
    tops = [stage.bounds(c.users_collection[0])[1].z for c in (man, woman)]
    woman.location.z += tops[0] - tops[1] - 0.01
    bpy.context.view_layer.update()


def build_stage(man, woman):
    """Add the man's studio, move it to the middle between both people, move the camera back, and
    add the flash."""
    collection = man.users_collection[0]
    choose(woman)
    must(bpy.ops.risorius.set_strands())
    studio = stage.build(collection)
    for thing in studio.objects:
        thing.location.x += (woman.location.x - man.location.x) / 2
    low, high = stage.bounds(collection)
    unit = high.z - low.z
    camera = bpy.context.scene.camera
    middle = (low + high) / 2
    middle.x = (man.location.x + woman.location.x) / 2
    middle.z = low.z + 0.615 * unit  # so that the picture shows the hair above and the shirts below
    camera.location = middle + Vector((0.0, -3.45, 0.06)) * unit
    stage.aim(camera, middle)
    add_flash(middle, unit)


def perform(args, man, woman):
    """Make speech on the man, export it as a clip, and import the clip on the woman."""
    clip = args.out / "performance.rzc"
    choose(man)
    must(bpy.ops.risorius.speak(filepath=str(args.voice), transcript=args.text))
    bpy.context.scene.frame_end = round(man.animation_data.action.frame_range[1])
    must(bpy.ops.risorius.export_animation(filepath=str(clip), format="RZC"))
    choose(woman)
    must(bpy.ops.risorius.import_animation(filepath=str(clip)))
    for controls, seed in ((man, 3), (woman, 8)):
        add_acting(controls, seed)


def render(args):
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 800, 450
    if scene.cycles.use_denoising:
        scene.cycles.samples = 6
    if args.only:
        for frame in args.only:
            scene.frame_set(frame)
            scene.render.filepath = str(args.out / f"still_{frame:04d}.png")
            bpy.ops.render.render(write_still=True)
        return
    frames = stage.empty_folder(args.out / "frames")
    scene.render.filepath = str(frames / "frame_####.png")
    stage.render_animation(Progress(scene.frame_end - scene.frame_start + 1, "frame"))


def main():
    args = parse()
    args.out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    timed("install the extension", lambda: install_extension.install(args.extension))
    bpy.context.scene.render.fps = FRAME_RATE
    man = timed("import the man", lambda: import_face(args.man, lod=0))
    woman = timed("import the woman", lambda: import_face(args.woman, lod=1))
    stand_side_by_side(man, woman)
    build_stage(man, woman)
    timed("listen, speak, layer, react", lambda: perform(args, man, woman))
    bpy.context.scene.frame_set(1)
    bpy.ops.wm.save_as_mainfile(filepath=str(args.out / "performance.blend"))
    timed("render", lambda: render(args))


if __name__ == "__main__":
    stage.end_with(main)
