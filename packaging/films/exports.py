# SPDX-License-Identifier: MIT
"""Renders a sheet that compares the face in Blender with its exports to glTF, FBX, USD and Alembic.

Each export is imported and rendered by a fresh Blender process.

exports.py -- --extension ZIP --dna FILE --out FOLDER [--size PIXELS]
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "check" / "blender")]

import acting  # noqa: E402
import bpy  # noqa: E402
import install_extension  # noqa: E402
import scene as stage  # noqa: E402

ENDINGS = {"GLTF": "glb", "FBX": "fbx", "USD": "usdc", "ALEMBIC": "abc"}
STUDIO = "studio.blend"  # the studio of the original, reused to render the imported files
FRAMES = (37, 51)  # a smile; an open mouth that shows the teeth


def parse():
    parser = argparse.ArgumentParser()
    parser.add_argument("--extension", type=Path)
    parser.add_argument("--dna", type=Path)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--size", type=int, default=320)
    parser.add_argument("--read", help="a format that was written: import it and render")
    return parser.parse_args(install_extension.arguments())


def original(args):
    """Import and animate the face, export it to the four formats, and render it."""
    import demo

    install_extension.install(args.extension)
    controls = demo.import_face(args.dna)
    bpy.context.scene.render.fps = acting.FRAME_RATE
    demo.act(controls)
    bpy.context.view_layer.objects.active = controls
    for kind, ending in ENDINGS.items():
        path = args.out / f"face.{ending}"
        done = bpy.ops.risorius.export_animation(
            filepath=str(path), format=kind, range="CUSTOM", start=FRAMES[0] - 1, end=FRAMES[-1]
        )
        if done != {"FINISHED"}:
            raise RuntimeError(f"the export gave {done}")
    bpy.context.scene.frame_set(FRAMES[0])
    studio = stage.build(controls.users_collection[0], strands=False)
    bpy.data.libraries.write(str(args.out / STUDIO), {studio})
    pictures(args, "ORIGINAL")


def read(args):
    """Import the file of one format into an empty scene, and render it."""
    path = args.out / f"face.{ENDINGS[args.read]}"
    bpy.context.scene.render.fps = acting.FRAME_RATE
    if args.read == "GLTF":
        bpy.ops.import_scene.gltf(filepath=str(path), disable_bone_shape=True)
    elif args.read == "FBX":
        bpy.ops.import_scene.fbx(filepath=str(path), anim_offset=0.0)
    elif args.read == "USD":
        bpy.ops.wm.usd_import(filepath=str(path))
    else:
        bpy.ops.wm.alembic_import(filepath=str(path), as_background_job=False)
        clothe(path.with_name(path.stem + "_textures"))
    with bpy.data.libraries.load(str(args.out / STUDIO)) as (there, wanted):
        wanted.collections = there.collections
    scene = bpy.context.scene
    scene.collection.children.link(wanted.collections[0])
    scene.camera = next(o for o in wanted.collections[0].objects if o.type == "CAMERA")
    stage.darken(scene)
    stage.render_settings(scene)
    pictures(args, args.read)


def clothe(folder):
    """Give the materials of an Alembic import the exported images.

    Alembic files contain only material names, so the images are read from a folder beside the file.

    Args:
        folder: images named <material>_color and <material>_roughness.
    """
    for material in bpy.data.materials:
        material.use_nodes = True
        tree = material.node_tree
        shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
        colours = list(folder.glob(f"{material.name}_color.*"))
        if not colours:  # corneas and tears: clear
            shader.inputs["Alpha"].default_value = 0.0
        for path in colours:
            node = tree.nodes.new("ShaderNodeTexImage")
            node.image = bpy.data.images.load(str(path))
            tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
            if path.with_name(f"{material.name}_color.png").exists():
                tree.links.new(node.outputs["Alpha"], shader.inputs["Alpha"])
        for path in folder.glob(f"{material.name}_roughness.*"):
            node = tree.nodes.new("ShaderNodeTexImage")
            node.image = bpy.data.images.load(str(path))
            node.image.colorspace_settings.is_data = True
            tree.links.new(node.outputs["Color"], shader.inputs["Roughness"])
        if "shirt" in material.name:
            shader.inputs["Roughness"].default_value = 0.9


def pictures(args, name):
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = args.size
    for frame in FRAMES:
        scene.frame_set(frame)
        scene.render.filepath = str(args.out / f"{name}_{frame}.png")
        bpy.ops.render.render(write_still=True)


def sheet(folder, size):
    from PIL import Image, ImageDraw, ImageFont

    names = ("ORIGINAL", *ENDINGS)
    picture = Image.new("RGB", (len(names) * size, len(FRAMES) * size + 30), (24, 26, 30))
    draw = ImageDraw.Draw(picture)
    for column, name in enumerate(names):
        for row, frame in enumerate(FRAMES):
            with Image.open(folder / f"{name}_{frame}.png") as part:
                picture.paste(part.convert("RGB"), (column * size, 30 + row * size))
        label = {"ORIGINAL": "in Blender", "GLTF": "glTF", "ALEMBIC": "Alembic"}.get(name, name)
        draw.text((column * size + 10, 5), label, (215, 218, 222), ImageFont.load_default(size=16))
    picture.save(folder / "exports.jpg", quality=88)


def main():
    args = parse()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if args.read:
        read(args)
        return
    args.out.mkdir(parents=True, exist_ok=True)
    original(args)
    for kind in ENDINGS:
        command = [sys.executable, __file__, "--", "--out", str(args.out), "--read", kind]
        subprocess.run([*command, "--size", str(args.size)], check=True, timeout=600)
    sheet(args.out, args.size)


if __name__ == "__main__":
    stage.end_with(main)
