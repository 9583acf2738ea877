# SPDX-License-Identifier: MIT
"""Makes the demo in Blender: installs the extension, imports the face, adds the acting, renders.

demo.py -- --extension ZIP --dna FILE --out FOLDER [--only FRAME ...]
"""

from __future__ import annotations

import argparse
import sys
import time
from math import radians
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "check" / "blender")]

import acting  # noqa: E402
import bpy  # noqa: E402
import install_extension  # noqa: E402
import scene as stage  # noqa: E402
from progress import Progress  # noqa: E402

# Width and height of the film in pixels, and frames of the acting per frame of the film. With
# these values demo.sh takes ten minutes on two cores; three minutes of them are compilation.
FILM, STEP = 288, 2


def parse():
    parser = argparse.ArgumentParser()
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--dna", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", type=int, nargs="*", help="render these frames as a still each")
    return parser.parse_args(install_extension.arguments())


def timed(title, action):
    begin = time.monotonic()
    result = action()
    print(f"    {title}: {time.monotonic() - begin:.1f} s", flush=True)
    return result


def import_face(path):
    """Import a DNA file. Returns the control armature of the character."""
    before = set(bpy.data.objects)
    result = bpy.ops.risorius.import_dna(filepath=str(path))
    if result != {"FINISHED"}:
        raise RuntimeError(f"the import gave {result}")
    made = set(bpy.data.objects) - before
    return next(o for o in made if o.name.endswith("_controls"))


def curves(action):
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    bags = action.layers[0].strips[0].channelbags
    return [curve for bag in bags for curve in bag.fcurves]


def turn(bone, degrees):
    """Set the XYZ Euler angles of a pose bone, given about the armature's axes.

    Args:
        bone: the pose bone.
        degrees: angles about the armature's x, y and z; converted to the bone's axes.
    """
    bone.rotation_mode = "XYZ"
    to_bone = bone.bone.matrix_local.to_3x3().inverted()
    bone.rotation_euler = to_bone @ stage.Vector([radians(d) for d in degrees])


def act(controls):
    """Insert keyframes: the tracks of acting.py on the bone `face`, its BONES on the other bones.

    Returns the number of controls that have keyframes.
    """
    face = controls.pose.bones["face"]
    available = {name for name in list(face.keys()) if name.startswith("CTRL_expressions.")}
    tracks, missing = acting.tracks(available)
    if missing:
        print("    this face has no", ", ".join(missing), flush=True)
    for name, keys in tracks.items():
        path = f'["{bpy.utils.escape_identifier(name)}"]'
        for frame, value in keys:
            face[name] = float(value)
            face.keyframe_insert(path, frame=frame, group="Face")
    for bone_name, keys in acting.BONES.items():
        bone = controls.pose.bones.get(bone_name)
        if bone is None:
            print(f"    no bone {bone_name} to turn", flush=True)
            continue
        for frame, degrees in keys:
            turn(bone, degrees)
            bone.keyframe_insert("rotation_euler", frame=frame, group=bone_name)
    for curve in curves(controls.animation_data.action):
        for point in curve.keyframe_points:
            point.interpolation = "BEZIER"
            point.handle_left_type = point.handle_right_type = "AUTO_CLAMPED"
    return len(tracks)


def still(path, frame, size=None):
    """Render one frame to a file.

    Args:
        path: path of the picture.
        frame: frame of the scene.
        size: width and height in pixels; None keeps the scene's resolution.
    """
    scene = bpy.context.scene
    scene.frame_set(frame)
    if size is not None:
        scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def film(folder, frames):
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = FILM
    # 6 samples take 3.6 CPU seconds per frame at 480 px. 10 samples take 5 s and look alike.
    stage.render_frames(folder, frames, samples=6)


def main():
    args = parse()
    args.out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    timed("install the extension", lambda: install_extension.install(args.extension))
    controls = timed("import the face", lambda: import_face(args.dna))
    collection = controls.users_collection[0]
    scene = bpy.context.scene
    scene.render.fps = acting.FRAME_RATE
    count = timed("key the acting", lambda: act(controls))
    print(f"    {count} controls keyed", flush=True)
    stage.build(collection)
    stage.meet_eyes()
    scene.frame_start, scene.frame_end = 1, acting.LAST_FRAME
    scene.frame_set(1)
    blend = args.out / "demo.blend"
    timed("save the .blend", lambda: bpy.ops.wm.save_as_mainfile(filepath=str(blend)))
    if args.only:
        for frame in args.only:
            still(args.out / f"still_{frame:04d}.png", frame, 512)
        return
    stills = args.out / "sheet"
    stills.mkdir(exist_ok=True)

    def sheet():
        progress = Progress(len(acting.SHEET), "picture")
        for number, (frame, _) in enumerate(acting.SHEET):
            still(stills / f"{number}.png", frame, 512)
            progress.step()

    timed("render 8 pictures of 512 px", sheet)
    frames = stage.empty_folder(args.out / "frames")
    shown = range(1, acting.LAST_FRAME + 1, STEP)
    timed(f"render {len(shown)} frames of {FILM} px", lambda: film(frames, shown))


if __name__ == "__main__":
    stage.end_with(main)
