# SPDX-License-Identifier: MIT
"""Puts the demo's eight pictures on one sheet with captions: sheet.py FOLDER OUT."""

import sys
from pathlib import Path

from acting import SHEET
from PIL import Image, ImageDraw, ImageFont

SIZE, LABEL = 512, 44


def main(folder: Path, out: Path) -> None:
    sheet = Image.new("RGB", (4 * SIZE, 2 * (SIZE + LABEL)), (24, 26, 30))
    draw = ImageDraw.Draw(sheet)
    font = ImageFont.load_default(size=22)
    for number, (frame, text) in enumerate(SHEET):
        x, y = number % 4 * SIZE, number // 4 * (SIZE + LABEL)
        with Image.open(folder / f"{number}.png") as picture:
            sheet.paste(picture.convert("RGB"), (x, y))
        draw.text(
            (x + 14, y + SIZE + 7), f"{text}  (frame {frame})", fill=(215, 218, 222), font=font
        )
    sheet.save(out)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
