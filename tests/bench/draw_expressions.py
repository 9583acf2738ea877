# SPDX-License-Identifier: MIT
"""Draw every expression on a face, on a sheet for visual inspection.

    python tests/bench/draw_expressions.py SAMPLE.dna SHEET.jpg [--size 160] [--samples 8]
        [--only NAME ...] [--columns 9] [--file EXPRESSIONS.toml]

Run by a Python that has `bpy`, `risorius` and Pillow. Pictures of visemes show only the mouth.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
LABEL = 18


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sample", type=Path)
    parser.add_argument("sheet", type=Path)
    parser.add_argument("--size", type=int, default=160)
    parser.add_argument("--samples", type=int, default=8)
    parser.add_argument("--columns", type=int, default=9)
    parser.add_argument("--only", nargs="*")
    parser.add_argument("--file", help="a file of expressions instead of Risorius' own")
    return parser.parse_args()


class Shot(NamedTuple):
    """A picture: its caption, the camera's view (key of LOOKS), and control -> value."""

    label: str
    look: str
    weights: Mapping[str, float]


MODULE = "bl_ext.user_default.risorius"
# (height of the picture's middle above the eyes, height of the picture), as multiples of the
# distance between the eyes.
LOOKS = {"face": (-0.42, 3.3), "mouth": (-1.05, 1.9), "eyes": (0.0, 1.9)}


def enable(user: Path) -> None:
    """Install and enable this tree's add-on in a temporary user folder."""
    import addon_utils
    import bpy

    target = user / "extensions" / "user_default" / "risorius"
    shutil.copytree(ROOT / "addon" / "risorius", target)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    repos = bpy.context.preferences.extensions.repos
    place = next((r for r in repos if r.module == "user_default"), None)
    place = place or repos.new(name="User Default", module="user_default")
    place.use_custom_directory, place.custom_directory = True, str(target.parent)
    addon_utils.extensions_refresh(ensure_wheels=False)
    if addon_utils.enable(MODULE) is None:
        raise SystemExit("The add-on cannot be enabled.")


class Face:
    """The imported character in the studio."""

    def __init__(self, sample: Path, size: int, samples: int):
        import bpy

        sys.path.insert(0, str(ROOT / "packaging" / "films"))
        import scene as demo

        before = set(bpy.data.objects)
        bpy.ops.risorius.import_dna(filepath=str(sample))
        made = set(bpy.data.objects) - before
        self.controls = next(o for o in made if o.name.endswith("_controls"))
        demo.build(self.controls.users_collection[0])
        self.scene, self.demo = bpy.context.scene, demo
        self.scene.render.resolution_x = self.scene.render.resolution_y = size
        self.scene.cycles.samples = samples
        bones, world = self.controls.data.bones, self.controls.matrix_world
        eyes = [world @ bones[f"eye_{side}"].head_local for side in "LR"]
        self.middle, self.apart = (eyes[0] + eyes[1]) / 2, (eyes[0] - eyes[1]).length

    def look(self, at: str) -> None:
        """Point the camera at a part of the face.

        Args:
            at: name of the part, a key of LOOKS.
        """
        from mathutils import Vector

        camera = self.scene.camera
        lift, height = (share * self.apart for share in LOOKS[at])
        away = height * camera.data.lens / camera.data.sensor_height
        aim = self.middle + Vector((0.0, 0.0, lift))
        camera.location = aim + Vector((0.12, -0.99, 0.03)) * away
        self.demo.aim(camera, aim)

    def show(self, weights: Mapping[str, float], path: Path) -> None:
        import bpy

        bone = self.controls.pose.bones["face"]
        for name in [k for k in bone.keys() if k.startswith("CTRL_")]:  # noqa: SIM118
            bone[name] = weights.get(name, 0.0)
        self.controls.update_tag()
        bpy.context.view_layer.update()
        self.scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)


def put_together(pictures: list[tuple[str, Path]], size: int, columns: int, out: Path) -> None:
    from PIL import Image, ImageDraw, ImageFont

    rows = -(-len(pictures) // columns)
    sheet = Image.new("RGB", (columns * size, rows * (size + LABEL)), (24, 26, 30))
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=13)
    for place, (label, path) in enumerate(pictures):
        x, y = place % columns * size, place // columns * (size + LABEL)
        with Image.open(path) as picture:
            sheet.paste(picture.convert("RGB"), (x, y))
        draw.text((x + 5, y + size + 1), label, fill=(215, 218, 222), font=font)
    sheet.save(out, quality=88)


def draw(
    sample: Path, shots: Sequence[Shot], out: Path, size: int, samples: int, columns: int
) -> None:
    """Render the shots and put them on a sheet.

    Args:
        sample: a DNA file.
        shots: the pictures to render, in the order of the sheet.
        out: path of the sheet.
        size: width and height of each picture in pixels.
        samples: samples of Cycles per pixel.
        columns: number of columns of the sheet.
    """
    with tempfile.TemporaryDirectory() as folder:
        os.environ["BLENDER_USER_RESOURCES"] = folder
        import bpy  # noqa: F401  brings addon_utils onto the path

        enable(Path(folder))
        face, pictures = Face(sample, size, samples), []
        for shot in shots:
            face.look(shot.look)
            pictures.append((shot.label, Path(folder) / f"{len(pictures)}.png"))
            face.show(shot.weights, pictures[-1][1])
        put_together(pictures, size, columns, out)


def main() -> None:
    args = parse()
    from risorius import expressions

    shots = [
        Shot(e.label, "mouth" if e.group == "viseme" else "face", e.weights)
        for name, e in expressions.load(args.file).items()
        if not args.only or name in args.only
    ]
    draw(args.sample, shots, args.sheet, args.size, args.samples, args.columns)
    sys.stdout.flush()
    os._exit(0)  # bpy sometimes hangs at exit


if __name__ == "__main__":
    main()
