# SPDX-License-Identifier: MIT
"""Renders one action on several faces, each at several levels of detail, in one scene.

cast.py -- --extension ZIP --out FOLDER --face FILE ... [--lods 0 2 5] [--only FRAME ...]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "check" / "blender")]

import acting  # noqa: E402
import bpy  # noqa: E402
import demo  # noqa: E402
import install_extension  # noqa: E402
import scene as stage  # noqa: E402
from mathutils import Vector  # noqa: E402
from performance import must  # noqa: E402

# Width (x) and height (z) of a cell in metres; one face stands in each cell. Shirts are wider and
# longer than a cell, so neighbours would intersect. Lower rows therefore stand nearer to the
# camera, and every second face of a row stands farther away. The orthographic camera does not show
# these depths.
CELL = Vector((0.38, 0.0, 0.36))
NEARER, FARTHER = 0.7, 0.35
RAISED = 0.035  # metres by which the camera is raised, to leave room for hair
RESOLUTION = 168, 160  # pixels of a cell; both even, because H.264 needs even sides
STEP = 2  # frames of the acting per frame of the film


def parse():
    parser = argparse.ArgumentParser()
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--face", type=Path, nargs="+", required=True)
    parser.add_argument("--lods", type=int, nargs="+", default=[0, 2, 5])
    parser.add_argument("--only", type=int, nargs="*", help="render these frames as a still each")
    return parser.parse_args(install_extension.arguments())


def import_face(path, lod):
    """Import a face with one level of detail and simple materials. Returns its control armature.

    Args:
        path: the DNA file.
        lod: index of the level of detail.
    """
    levels = [i == lod for i in range(8)]
    must(
        bpy.ops.risorius.import_dna(
            filepath=str(path), lods=levels, use_simple_materials=True, shape_mode="LIVE"
        )
    )
    return bpy.context.view_layer.objects.active


def place(controls, column, row):
    """Move a face so that the middle of its bounds is in the middle of a cell.

    Args:
        controls: the face's control armature.
        column: column of the cell, 0 at the left.
        row: row of the cell, 0 at the top.
    """
    low, high = stage.bounds(controls.users_collection[0])
    cell = Vector((column * CELL.x, column % 2 * FARTHER - row * NEARER, -row * CELL.z))
    controls.location += cell - (low + high) / 2
    bpy.context.view_layer.update()


def share_action(controls, first):
    """Assign the action of one face to another face, unchanged.

    Args:
        controls: control armature of the face that gets the action.
        first: control armature of the face that has the action.
    """
    data = controls.animation_data_create()
    data.action = first.animation_data.action
    if hasattr(data, "action_slot"):
        data.action_slot = first.animation_data.action_slot
    for name in acting.BONES:
        controls.pose.bones[name].rotation_mode = "XYZ"


def build_stage(columns, rows):
    """Add an orthographic camera and sun lights. Both show faces in all places alike.

    Args:
        columns: number of columns of faces.
        rows: number of rows of faces.
    """
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type = "ORTHO"
    camera.data.ortho_scale = max(columns * CELL.x, rows * CELL.z)
    middle = Vector(((columns - 1) * CELL.x / 2, 0.0, RAISED - (rows - 1) * CELL.z / 2))
    camera.location = middle + Vector((0.0, -5.0, 0.0))
    stage.aim(camera, middle)
    scene.collection.objects.link(camera)
    scene.camera = camera
    for name, way, strength, colour in (
        ("Key", (1.9, 2.2, -1.4), 2.6, (1.0, 0.93, 0.86)),
        ("Fill", (-2.4, 1.8, -0.1), 0.9, (0.85, 0.92, 1.0)),
        ("Rim", (-1.5, -2.0, -1.4), 1.6, (0.9, 0.95, 1.0)),
    ):
        sun = bpy.data.objects.new(name, bpy.data.lights.new(name, "SUN"))
        sun.data.energy, sun.data.color, sun.data.angle = strength, colour, 0.3
        sun.rotation_euler = Vector(way).to_track_quat("-Z", "Y").to_euler()
        scene.collection.objects.link(sun)
    stage.background(scene)
    stage.render_settings(scene)
    scene.render.resolution_x = columns * RESOLUTION[0]
    scene.render.resolution_y = rows * RESOLUTION[1]


def render(args):
    if args.only:
        for frame in args.only:
            demo.still(args.out / f"still_{frame:04d}.png", frame)
        return
    frames = range(1, acting.LAST_FRAME + 1, STEP)
    # At this resolution, more samples make no visible difference.
    stage.render_frames(stage.empty_folder(args.out / "frames"), frames, samples=4)


def main():
    args = parse()
    args.out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    demo.timed("install the extension", lambda: install_extension.install(args.extension))
    bpy.context.scene.render.fps = acting.FRAME_RATE
    first = None
    for column, path in enumerate(args.face):
        for row, lod in enumerate(args.lods):
            controls = import_face(path, lod)
            place(controls, column, row)
            if first is None:
                first = controls
                demo.act(first)
            else:
                share_action(controls, first)
        print(f"    {path.stem}: {len(args.lods)} levels", flush=True)
    users = first.animation_data.action.users
    print(f"    one action, {users} users", flush=True)
    build_stage(len(args.face), len(args.lods))
    bpy.context.scene.frame_set(1)
    bpy.ops.wm.save_as_mainfile(filepath=str(args.out / "cast.blend"))
    demo.timed("render", lambda: render(args))


if __name__ == "__main__":
    stage.end_with(main)
