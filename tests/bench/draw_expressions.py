# SPDX-License-Identifier: MIT
"""Draw every expression on a face: a sheet to judge them by.

    python tests/bench/draw_expressions.py SAMPLE.dna SHEET.jpg [--size 160] [--samples 8]
        [--only NAME ...] [--columns 9] [--file EXPRESSIONS.toml]

Run by a Python that has `bpy`, `risorius` and Pillow. Visemes are seen from nearer.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

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


class Face:
    """The imported character under the demo's lights."""

    def __init__(self, sample: Path, size: int, samples: int):
        import bpy

        sys.path[:0] = [str(ROOT / "packaging" / "demo"), str(Path(__file__).parent)]
        import scene as demo

        before = set(bpy.data.objects)
        bpy.ops.risorius.import_dna(filepath=str(sample), use_simple_materials=True)
        made = set(bpy.data.objects) - before
        self.controls = next(o for o in made if o.name.endswith("_controls"))
        demo.build(self.controls.users_collection[0])
        self.scene, self.demo = bpy.context.scene, demo
        self.scene.render.resolution_x = self.scene.render.resolution_y = size
        self.scene.cycles.samples = samples
        low, high = demo.bounds(self.controls.users_collection[0])
        self.unit, self.low = high.z - low.z, low
        self.middle_x = (low.x + high.x) / 2

    def look(self, near: bool) -> None:
        """The camera on the whole face, or on its mouth."""
        from mathutils import Vector

        camera = self.scene.camera
        height, away, lens = (0.365, 1.5, 83) if near else (0.54, 2.6, 100)
        aim = Vector((self.middle_x, self.low.y + 0.1 * self.unit, 0))
        aim.z = self.low.z + height * self.unit
        camera.location = aim + Vector((0.15 * away, -away, 0.02)) * self.unit
        camera.data.lens = lens
        self.demo.aim(camera, aim)

    def show(self, weights: dict[str, float], path: Path) -> None:
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


def main() -> None:
    args = parse()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["BLENDER_USER_RESOURCES"] = folder
        import bpy  # noqa: F401  brings addon_utils onto the path

        sys.path.insert(0, str(Path(__file__).parent))
        from draw_engines import enable

        enable(Path(folder))
        from risorius import expressions

        face = Face(args.sample, args.size, args.samples)
        pictures = []
        for name, expression in expressions.load(args.file).items():
            if args.only and name not in args.only:
                continue
            face.look(near=expression.group == "viseme")
            path = Path(folder) / f"{len(pictures)}.png"
            face.show(dict(expression.weights), path)
            pictures.append((expression.label, path))
        put_together(pictures, args.size, args.columns, args.sheet)
    sys.stdout.flush()
    os._exit(0)  # bpy sometimes hangs at exit


if __name__ == "__main__":
    main()
