# SPDX-License-Identifier: MIT
"""Renders a sheet of several faces in the same expressions, for example joints beside blend shapes.

compare.py -- --extension ZIP --out SHEET.jpg --face NAME=FILE.dna [...] [--size PIXELS]
    [--combined | --only EXPRESSION [...]] [--close]

The sheet has one row for each face and one column for each expression. --combined shows
combinations that look wrong without correctives; --only chooses single columns. Needs Pillow
beside bpy.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "check" / "blender")]

import bpy  # noqa: E402
import demo  # noqa: E402
import install_extension  # noqa: E402
import scene as stage  # noqa: E402
from PIL import Image, ImageDraw, ImageFont  # noqa: E402

LEFT_RIGHT = ("L", "R")
# Name of an expression -> (control -> value for controls of both sides, whose names lack L and R
# here; control -> value for controls without a side).
EXPRESSIONS = {
    "neutral": ({}, {}),
    "smile": ({"mouthCornerPull": 1, "eyeCheekRaise": 0.6, "eyeSquintInner": 0.4}, {}),
    "blink": ({"eyeBlink": 1}, {}),
    "oo": ({"mouthLipsPurseU": 0.8, "mouthLipsPurseD": 0.8, "mouthFunnelU": 0.4,
            "mouthFunnelD": 0.4}, {"jawOpen": 0.15}),
    "shout": ({"mouthStretch": 0.6, "mouthLowerLipDepress": 0.7, "mouthUpperLipRaise": 0.5,
               "neckStretch": 1, "browDown": 0.6, "noseWrinkle": 0.5}, {"jawOpen": 0.9}),
    "raised brows": ({"browRaiseIn": 1, "browRaiseOuter": 1, "eyeWiden": 0.4}, {}),
    "turned": ({"neckStretch": 0.5}, {}),
}  # fmt: skip
COMBINED = {
    "shout of seven": ({"mouthStretch": 1, "mouthUpperLipRaise": 1, "mouthLowerLipDepress": 1},
                       {"jawOpen": 1}),
    "smile, open jaw": ({"mouthCornerPull": 1}, {"jawOpen": 1}),
    "pressed lips, mouth down": ({"mouthPressD": 1}, {"mouthDown": 1}),
    "smile, stretched": ({"mouthCornerPull": 1, "mouthStretch": 1}, {}),
    "blink, squint": ({"eyeBlink": 1, "eyeSquintInner": 1}, {}),
    "blink, look down": ({"eyeBlink": 1, "eyeLookDown": 1}, {}),
}  # fmt: skip
ASLEEP = {"asleep": ({"eyeBlink": 1, "eyeLookDown": 0.3, "browDown": 0.1}, {})}
FOLDS = {
    "brows up": ({"browRaiseIn": 1, "browRaiseOuter": 1}, {}),
    "frown": ({"browDown": 1, "noseWrinkle": 0.8}, {}),
    "grin": ({"mouthCornerPull": 1, "eyeCheekRaise": 1, "eyeSquintInner": 0.6}, {}),
    "chin": ({"jawChinRaiseD": 1, "jawChinRaiseU": 0.5}, {}),
}
# Close-ups: (height of the camera's target as a fraction of the height of the face's bounds, 0 at
# the bottom; focal length divided by 100 mm).
MOUTH, EYES, FACE = (0.54, 2.4), (0.69, 2.8), (0.65, 1.8)
LOOKS = dict(zip(COMBINED, [(0.57, 1.6), MOUTH, MOUTH, MOUTH, EYES, EYES], strict=True))
TURNED = {"neck": 16.0, "head": 18.0}  # degrees about the vertical


def parse():
    parser = argparse.ArgumentParser()
    parser.add_argument("--extension", type=Path, required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--face", nargs="+", required=True, metavar="NAME=FILE")
    parser.add_argument("--combined", action="store_true", help="combinations of expressions")
    parser.add_argument("--only", nargs="+", choices=[*EXPRESSIONS, *COMBINED, *ASLEEP, *FOLDS])
    parser.add_argument("--close", action="store_true", help="the face alone, for folds of skin")
    parser.add_argument("--size", type=int, default=320)
    return parser.parse_args(install_extension.arguments())


def set_expression(controls, name, expressions):
    """Pose a face in one of the expressions.

    Args:
        controls: the face's control armature.
        name: key of `expressions`.
        expressions: controls and values of each expression, as EXPRESSIONS.
    """
    both, whole = expressions[name]
    values = {f"{control}{side}": v for control, v in both.items() for side in LEFT_RIGHT} | whole
    face = controls.pose.bones["face"]
    for key in list(face.keys()):
        if key.startswith("CTRL_expressions."):
            face[key] = float(values.get(key.removeprefix("CTRL_expressions."), 0.0))
    for bone_name, degrees in TURNED.items():
        demo.turn(controls.pose.bones[bone_name], (0, 0, degrees if name == "turned" else 0))
    controls.update_tag()


def look_at(collection, share, near):
    """Turn the camera to a part of a face.

    Args:
        collection: collection with the face's meshes.
        share: height of the target as a fraction of the height of the meshes, 0 at the lowest
            point and 1 at the highest.
        near: magnification relative to a focal length of 100 mm.
    """
    low, high = stage.bounds(collection)
    camera = bpy.context.scene.camera
    camera.data.lens = 100 * near
    middle = (low + high) / 2
    middle.z = low.z + share * (high.z - low.z)
    stage.aim(camera, middle)


def render_row(path, folder, size, expressions, close):
    """Render a face in all expressions. Returns expression -> path of the picture.

    Args:
        path: the DNA file.
        folder: folder of the pictures.
        size: width and height of a picture, pixels.
        expressions: controls and values of each expression, as EXPRESSIONS.
        close: show only the face (close-up FACE) in expressions for which LOOKS has no close-up.
    """
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    controls = demo.import_face(path)
    collection = controls.users_collection[0]
    stage.build(collection)
    stage.meet_eyes()
    out = {}
    for number, name in enumerate(expressions):
        set_expression(controls, name, expressions)
        if name in LOOKS or close:
            look_at(collection, *LOOKS.get(name, FACE))
        out[name] = folder / f"{path.stem}_{number}.png"
        demo.still(out[name], number + 1, size)
    return out


def sheet(rows, size):
    """Returns one image with all pictures and with labels for rows and columns.

    Args:
        rows: face -> expression -> path of the picture.
        size: width and height of a picture on the sheet, pixels.
    """
    label = max(22, size // 12)
    font = ImageFont.load_default(size=label * 0.62)
    height = label + len(rows) * (size + label)
    names = list(next(iter(rows.values())))
    out = Image.new("RGB", (len(names) * size, height), (24, 26, 30))
    draw = ImageDraw.Draw(out)
    for column, name in enumerate(names):
        draw.text((column * size + 8, 4), name, fill=(215, 218, 222), font=font)
    for row, (face, pictures) in enumerate(rows.items()):
        y = label + row * (size + label)
        draw.text((8, y + 2), face, fill=(160, 190, 220), font=font)
        for column, path in enumerate(pictures.values()):
            with Image.open(path) as picture:
                small = picture.convert("RGB").resize((size, size))
                out.paste(small, (column * size, y + label))
    return out


def main():
    args = parse()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    install_extension.install(args.extension)
    rows = {}
    expressions = COMBINED if args.combined else EXPRESSIONS
    if args.only:
        known = EXPRESSIONS | COMBINED | ASLEEP | FOLDS
        expressions = {name: known[name] for name in args.only}
    with tempfile.TemporaryDirectory() as folder:
        for face in args.face:
            name, _, path = face.partition("=")
            rows[name] = render_row(Path(path), Path(folder), args.size, expressions, args.close)
            print(f"    {name}: {len(expressions)} pictures", flush=True)
        sheet(rows, args.size).save(args.out, quality=88)
    print(args.out, flush=True)


if __name__ == "__main__":
    stage.end_with(main)
