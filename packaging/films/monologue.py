# SPDX-License-Identifier: MIT
"""Renders a film of twenty seconds in which one person reads a letter.

The acting has emotions, speech, gaze, blinks and idle life. The extension's operators make all of
the acting except the rotations of the head bone and the Empty of the gaze, which have keyframes.
monologue_acting.py contains the times.

monologue.py -- --extension ZIP --dna FILE --voices WAV ... --out FOLDER [--size N]
                [--only [FRAME ...]]      stills of these frames, by default of SHEET
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "check" / "blender")]

import bpy  # noqa: E402
import demo  # noqa: E402
import install_extension  # noqa: E402
import monologue_acting as acting  # noqa: E402
import numpy as np  # noqa: E402
import scene as stage  # noqa: E402
from mathutils import Vector  # noqa: E402
from performance import choose, frame_at, must  # noqa: E402
from progress import Progress  # noqa: E402


def parse():
    parser = argparse.ArgumentParser()
    for name in ("extension", "dna", "out"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    parser.add_argument("--voices", type=Path, nargs="+", required=True)
    parser.add_argument("--size", type=int, default=540)
    parser.add_argument("--only", type=int, nargs="*", help="render these frames as a still each")
    return parser.parse_args(install_extension.arguments())


def go_to(seconds):
    bpy.context.scene.frame_set(frame_at(seconds))


def add_moods(controls):
    """Insert keyframes of each mood's expression at the first and last second of the mood."""
    for begin, end, name, strength, flip in acting.MOODS:
        for seconds in (begin, end):
            go_to(seconds)
            must(bpy.ops.risorius.expression(expression=name, strength=strength, flip=flip))
            must(bpy.ops.risorius.key())
    print(f"    {len(acting.MOODS)} moods on {controls.name}", flush=True)


def add_smirk(path):
    """Drag the left corner of the mouth up, which moves a single control, and insert a keyframe."""
    go_to(17.4)
    must(bpy.ops.risorius.breakdown(kind="BREAKDOWN", factor=0.5))
    mesh, vertex, way = corner_of_mouth(path)
    must(bpy.ops.risorius.drag(mesh=mesh, vertex=vertex, offset=way * acting.SMIRK, single=True))
    must(bpy.ops.risorius.key())


def corner_of_mouth(path):
    """The vertex that the control mouthCornerPullL moves most.

    Args:
        path: the DNA file.

    Returns: mesh index, vertex index, and the vertex's displacement at 1.0 in metres with z up
        (converted, because the DNA file has centimetres and y up).
    """
    import risorius

    dna = risorius.load(path)
    surface = risorius.Surface(dna, risorius.Rig(dna))
    rest = np.zeros(len(dna.raw_control_names), np.float32)
    smile = rest.copy()
    smile[list(dna.raw_control_names).index("CTRL_expressions.mouthCornerPullL")] = 1.0
    mesh = max(range(len(dna.meshes)), key=lambda m: len(dna.meshes[m].positions))
    moves = surface.positions(smile, mesh) - surface.positions(rest, mesh)
    vertex = int(np.argmax(np.linalg.norm(moves, axis=1)))
    x, y, z = moves[vertex] / 100
    return mesh, vertex, Vector((x, -z, y))


def add_speech(controls, voices):
    """Add a layer for each spoken line. The blend mode ADD keeps the mood below visible."""
    for (seconds, _speed, text), voice in zip(acting.LINES, voices, strict=True):
        start = float(frame_at(seconds))
        must(
            bpy.ops.risorius.speak(
                filepath=str(voice),
                transcript=text,
                start=start,
                target="LAYER",
                use_blinks=False,
                intensity=acting.INTENSITY,
            )
        )
        layer = controls.risorius_layers[-1]
        layer.blend = "ADD"
        layer.name = text.split(".")[0]


def add_life(controls):
    """Add the blinks, a layer of idle life, a startle and a swallow."""
    for seconds in acting.BLINKS:
        go_to(seconds)
        must(bpy.ops.risorius.blink(kind="LAYER", close=2.0, hold=1.0, open=4.0))
    must(bpy.ops.risorius.layer_add(kind="IDLE"))
    layer = controls.risorius_layers[-1]
    layer.seed, layer.start, layer.weight = 5, 1, 0.5
    go_to(7.05)
    must(bpy.ops.risorius.fire(reaction="startle"))
    go_to(16.9)
    must(bpy.ops.risorius.fire(reaction="swallow"))


def eyes_of(controls):
    """The midpoint of the eyes in world space, and the head's height, in metres.

    The height is estimated as four times the distance between the eyes.
    """
    rig = next(
        thing
        for thing in controls.users_collection[0].objects
        if thing.type == "ARMATURE" and "FACIAL_L_Eye" in thing.pose.bones
    )
    left, right = (rig.matrix_world @ rig.pose.bones[f"FACIAL_{side}_Eye"].head for side in "LR")
    return (left + right) / 2, 4 * (left - right).length


def come_nearer(controls):
    """Move the camera nearer, so that the face fills the frame."""
    eyes, height = eyes_of(controls)
    middle = eyes + Vector((0, 0, -0.12 * height))
    camera = bpy.context.scene.camera
    camera.location = middle + (camera.location - middle) * acting.NEARER
    stage.aim(camera, middle)


def add_gaze(controls):
    """Let the eyes follow an Empty with keyframes at the letter and at a listener."""
    eyes, height = eyes_of(controls)
    letter = bpy.data.objects.new("Looked At", None)
    letter.empty_display_size = 0.04 * height
    bpy.context.scene.collection.objects.link(letter)
    for seconds, (aside, before, above) in acting.LOOKS:
        letter.location = eyes + Vector((aside, -before, above)) * height
        letter.keyframe_insert("location", frame=frame_at(seconds))
    bpy.context.view_layer.update()
    choose(controls)
    must(bpy.ops.risorius.gaze_target(mode="OBJECT", target=letter.name))


def turn_head(controls):
    """Insert keyframes of the head bone. The rig turns the neck by a part of the head's turn."""
    head = controls.pose.bones["head"]
    for seconds, degrees in acting.TURNS:
        demo.turn(head, degrees)
        head.keyframe_insert("rotation_euler", frame=frame_at(seconds))


def act(args, controls):
    choose(controls)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, acting.LAST_FRAME
    add_gaze(controls)
    add_moods(controls)
    add_smirk(args.dna)
    turn_head(controls)
    add_speech(controls, args.voices)
    add_life(controls)
    scene.frame_start, scene.frame_end = 1, acting.LAST_FRAME  # a voice may have moved the end
    names = [layer.name for layer in controls.risorius_layers]
    print(f"    layers: {', '.join(names)}", flush=True)


def render(args):
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = args.size
    if scene.cycles.use_denoising:
        scene.cycles.samples = 6
    if args.only is not None:
        for frame in args.only or acting.SHEET:
            scene.frame_set(frame)
            scene.render.filepath = str(args.out / f"still_{frame:04d}.png")
            bpy.ops.render.render(write_still=True)
        return
    frames = stage.empty_folder(args.out / "frames")
    scene.render.filepath = str(frames / "frame_####.png")
    stage.render_animation(Progress(acting.LAST_FRAME, "frame"))


def main():
    args = parse()
    args.out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    demo.timed("install the extension", lambda: install_extension.install(args.extension))
    bpy.context.scene.render.fps = acting.FRAME_RATE
    controls = demo.timed("import the face", lambda: demo.import_face(args.dna))
    collection = controls.users_collection[0]
    stage.build(collection)
    come_nearer(controls)
    demo.timed("act", lambda: act(args, controls))
    bpy.context.scene.frame_set(1)
    bpy.ops.wm.save_as_mainfile(filepath=str(args.out / "monologue.blend"))
    demo.timed("render", lambda: render(args))


if __name__ == "__main__":
    stage.end_with(main)
