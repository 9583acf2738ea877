# SPDX-License-Identifier: MIT
"""Renders close-ups of faces in Cycles and EEVEE: eye, mouth, brow, ear, hairline, whole face.

closeups.py -- --extension ZIP --out FOLDER FILE.dna [...] [--engine cycles eevee]
    [--view eye mouth ...] [--size PIXELS] [--samples N] [--cards]

Writes FOLDER/<file>_<view>_<engine>.png, and FOLDER/<engine>.jpg with one row for each face.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "check" / "blender")]

import bpy  # noqa: E402
import demo  # noqa: E402
import install_extension  # noqa: E402
import scene as stage  # noqa: E402
from compare import sheet  # noqa: E402
from mathutils import Vector  # noqa: E402

GROWN = 0.063  # metres between the eyes of an adult head, to which VIEWS refers
# View -> (origin, target of the camera, place of the camera, focal length in mm). Target and place
# are in mm from the origin: x to the face's left, y to the back, z up. The origin "eyes" is the
# midpoint between the eyes; "teeth" is the point below it at the height of the teeth.
VIEWS = {
    "eye": ("eyes", (32, -5, 0), (32, -180, 4), 60),
    "mouth": ("teeth", (0, 0, 0), (0, -200, 8), 70),
    "brow": ("eyes", (20, 0, 22), (40, -200, 32), 60),
    "ear": ("eyes", (-74, 62, -12), (-300, -40, 0), 60),
    "hairline": ("eyes", (0, 0, 62), (35, -230, 84), 55),
    "face": ("eyes", (0, 0, -24), (190, -760, 0), 85),
}
ENGINES = {"cycles": ("CYCLES",), "eevee": ("BLENDER_EEVEE_NEXT", "BLENDER_EEVEE")}
SHEET = 320


def parse():
    parser = argparse.ArgumentParser()
    parser.add_argument("faces", type=Path, nargs="+")
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--engine", nargs="+", choices=ENGINES, default=[*ENGINES])
    parser.add_argument("--view", nargs="+", choices=VIEWS, default=[*VIEWS])
    parser.add_argument("--size", type=int, default=1024)
    parser.add_argument("--samples", type=int, default=8, help="in each pixel")
    parser.add_argument("--cards", action="store_true", help="hair as the viewport shows it")
    return parser.parse_args(install_extension.arguments())


def middle(collection, part):
    """The middle of a part of the face in world space.

    It is the mean of the bounding box corners of the meshes with `part` in their names.
    """
    meshes = [o for o in collection.all_objects if o.type == "MESH" and part in o.name]
    corners = [o.matrix_world @ Vector(corner) for o in meshes for corner in o.bound_box]
    return sum(corners, Vector()) / len(corners)


def look(collection, view):
    """Put the scene's camera in front of a part of a face.

    Args:
        collection: collection with the face's meshes.
        view: key of VIEWS.
    """
    eyes = [middle(collection, name) for name in ("eyeLeft", "eyeRight")]
    scale = (eyes[0] - eyes[1]).length / GROWN / 1000
    part, target, place, lens = VIEWS[view]
    origin = sum(eyes, Vector()) / 2
    if part == "teeth":
        origin = Vector((origin.x, origin.y, middle(collection, "teeth").z))
    camera = bpy.context.scene.camera
    camera.location = origin + Vector(place) * scale
    stage.aim(camera, origin + Vector(target) * scale)
    camera.data.lens = lens
    camera.data.dof.use_dof = False


def use_engine(name):
    """Choose the render engine.

    Args:
        name: key of ENGINES. Blender versions differ in the identifiers of engines, so the first
            identifier that this Blender has is taken.
    """
    scene = bpy.context.scene
    known = [item.identifier for item in scene.render.bl_rna.properties["engine"].enum_items]
    scene.render.engine = next((e for e in ENGINES[name] if e in known), ENGINES[name][0])


def pictures(path, args):
    """Render all views of a face. Returns engine -> view -> path of the picture.

    Args:
        path: the DNA file.
        args: parsed command line arguments, from parse().
    """
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    collection = demo.import_face(path).users_collection[0]
    stage.build(collection, strands=False)
    scene = bpy.context.scene
    scene.cycles.samples = scene.eevee.taa_render_samples = args.samples
    out = {engine: {} for engine in args.engine}
    for engine in args.engine:
        use_engine(engine)
        # Cycles renders hair as strands. EEVEE draws a strand at least one pixel wide, so brows
        # would look heavy; it renders hair as cards.
        bpy.ops.risorius.set_strands(enable=engine == "cycles" and not args.cards)
        for view in args.view:
            begin = time.monotonic()
            look(collection, view)
            out[engine][view] = args.out / f"{path.stem}_{view}_{engine}.png"
            demo.still(out[engine][view], 1, args.size)
            print(f"    {out[engine][view].name}: {time.monotonic() - begin:.1f} s", flush=True)
    return out


def main():
    args = parse()
    args.out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    install_extension.install(args.extension)
    made = {path.stem: pictures(path, args) for path in args.faces}
    for engine in args.engine:
        rows = {face: of[engine] for face, of in made.items()}
        sheet(rows, SHEET).save(args.out / f"{engine}.jpg", quality=88)


if __name__ == "__main__":
    stage.end_with(main)
