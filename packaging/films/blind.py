# SPDX-License-Identifier: MIT
"""Puts old and new pictures on one sheet in random order, for a blind comparison.

    blind.py SHEET.jpg KEY.json --old FOLDER --new FOLDER [--size 512] [--columns 4] [--seed N]

Only file names that both folders contain are used. The sheet labels pictures with numbers. KEY.json
maps each number to "old" or "new" and to the file name; the judge must not open it.
"""

from __future__ import annotations

import argparse
import json
import random
from collections.abc import Sequence
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

LABEL = 28


def pairs(old: Path, new: Path) -> list[tuple[str, Path]]:
    """("old" or "new", path) for both pictures of every file name that both folders contain.

    Raises:
        ValueError: the folders share no file name.
    """
    names = sorted({p.name for p in old.iterdir()} & {p.name for p in new.iterdir()})
    names = [name for name in names if name.lower().endswith((".png", ".jpg"))]
    if not names:
        raise ValueError(f"{new}: pictures of the same names as in {old} were expected, found none")
    return [
        (which, folder / name) for name in names for which, folder in (("old", old), ("new", new))
    ]


def sheet(pictures: Sequence[Path], size: int, columns: int) -> Image.Image:
    """Returns one image with all pictures, each `size` pixels wide and high, numbered from 1."""
    rows = -(-len(pictures) // columns)
    out = Image.new("RGB", (columns * size, rows * (size + LABEL)), (24, 26, 30))
    draw, font = ImageDraw.Draw(out), ImageFont.load_default(size=18)
    for place, path in enumerate(pictures):
        x, y = place % columns * size, place // columns * (size + LABEL)
        with Image.open(path) as picture:
            out.paste(picture.convert("RGB").resize((size, size)), (x, y + LABEL))
        draw.text((x + 8, y + 3), str(place + 1), fill=(215, 218, 222), font=font)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("sheet", type=Path)
    parser.add_argument("key", type=Path)
    parser.add_argument("--old", type=Path, required=True)
    parser.add_argument("--new", type=Path, required=True)
    parser.add_argument("--size", type=int, default=512)
    parser.add_argument("--columns", type=int, default=4)
    parser.add_argument("--seed", type=int, help="repeats an order; by default nobody knows it")
    args = parser.parse_args()
    found = pairs(args.old, args.new)
    random.Random(args.seed).shuffle(found)
    sheet([path for _, path in found], args.size, args.columns).save(args.sheet, quality=92)
    key = {
        str(n): {"which": which, "picture": path.name} for n, (which, path) in enumerate(found, 1)
    }
    args.key.write_text(json.dumps(key, indent=1) + "\n")


if __name__ == "__main__":
    main()
