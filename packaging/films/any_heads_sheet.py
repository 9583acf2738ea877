# SPDX-License-Identifier: MIT
"""Draws a sheet of faces for visual inspection, in clay and without Blender. Needs Pillow.

any_heads_sheet.py FACE.dna... [CLIP.rzc] OUT.png

One face: five expressions and sixteen single controls. Several faces: one row of the five
expressions for each face. With a clip: one row of seven frames of the clip for each face.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import risorius
from PIL import Image, ImageDraw, ImageFont
from risorius.plot.drawing import shade
from risorius.solving.surface import Surface

PREFIX = "CTRL_expressions."
BOTH = ("L", "R")
# Expression -> prefix of raw controls -> value; raw_of() adds the endings such as L, R, UL and DR.
EXPRESSIONS = {
    "neutral": {},
    "smile": {"mouthCornerPull": 1, "eyeCheekRaise": 0.6, "eyeSquintInner": 0.4},
    "blink": {"eyeBlink": 1},
    "oh": {"mouthLipsPurseU": 0.7, "mouthLipsPurseD": 0.7, "mouthFunnelU": 0.3, "mouthFunnelD": 0.3,
           "jawOpen": 0.4},
    "shout": {"mouthStretch": 0.6, "mouthLowerLipDepress": 0.7, "mouthUpperLipRaise": 0.5,
              "browDown": 0.6, "noseWrinkle": 0.5, "jawOpen": 0.9},
}  # fmt: skip
CONTROLS = (
    *("jawOpen", "mouthCornerPull", "mouthCornerDepress", "mouthStretch"),
    *("mouthLipsPurse", "mouthFunnel", "mouthUpperLipRaise", "mouthLowerLipDepress"),
    *("mouthPress", "mouthLipsTogether", "mouthCheekBlow", "noseWrinkle"),
    *("browRaiseIn", "browDown", "eyeSquintInner", "eyeLookDown"),
)
_COLUMNS = 7
_COLOURS = (  # (part of a mesh name, colour factor RGB); other meshes are clay
    ("teeth", (1.2, 1.15, 1.0)), ("tongue", (1.1, 0.6, 0.6)), ("gums", (1.1, 0.55, 0.55)),
    ("eyeleft", (1.3, 1.3, 1.3)), ("eyeright", (1.3, 1.3, 1.3)),
)  # fmt: skip
# A mesh whose name contains one of these words needs a texture with alpha, and is not drawn.
_CLEAR = ("cornea", "eyeshell", "eyeedge", "cartilage", "saliva", "lash", "hair", "brows")


def raw_of(dna: risorius.Dna, row: dict[str, float]) -> np.ndarray:
    """float32[R]: values of the raw controls.

    Args:
        dna: the face.
        row: name -> value. A name also sets the controls with up to two more letters, such as L,
            R, UL or DR.
    """
    names = [name.removeprefix(PREFIX) for name in dna.raw_control_names]
    out = np.zeros(len(names), np.float32)
    for wanted, value in row.items():
        wanted = wanted.removeprefix(PREFIX)  # noqa: PLW2901
        for number, name in enumerate(names):
            if name.startswith(wanted) and len(name) - len(wanted) <= 2:
                out[number] = value
    return out


class Face:
    """Draws the meshes of LOD 0 of a face."""

    def __init__(self, path: str) -> None:
        self.dna = risorius.load(path)
        self._seen = Surface(self.dna, risorius.Rig(self.dna), 0)
        self._meshes = [
            m for m in self._seen.mesh_indices
            if not any(word in self.dna.mesh_names[m].lower() for word in _CLEAR)
        ]  # fmt: skip
        self._triangles, self._paint, first = [], [], 0
        for m in self._meshes:
            self._triangles.append(shade.triangles_of(self.dna.meshes[m]) + first)
            count = len(self.dna.meshes[m].positions)
            self._paint.append(self._colour(m, count))
            first += count
        self._frame = self._face()

    def _face(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of the area that a picture shows, cm.

        The middles of the eye meshes determine this area, because expressions do not move them. A
        face without two eye meshes uses the mean and the width of all points. Also sets
        self._depth, z of the vertical axis about which the head is turned.
        """
        eyes = [
            np.asarray(self.dna.meshes[m].positions).mean(axis=0)
            for side in ("eyeleft", "eyeright")
            for m in [m for m in self._meshes if self._base(m) == side][:1]
        ]
        if len(eyes) == 2:
            middle, apart = (eyes[0] + eyes[1]) / 2, float(np.linalg.norm(eyes[0] - eyes[1]))
        else:
            points = self._points({})
            middle, apart = points.mean(axis=0), 0.3 * float(np.ptp(points[:, 0]))
        self._depth = float(middle[2]) - 0.4 * apart  # z of the axis about which the head is turned
        across = 1.45 * apart
        return middle[0] - across, middle[0] + across, middle[1] - 2.2 * apart, middle[1] + apart

    def _base(self, mesh: int) -> str:
        return self.dna.mesh_names[mesh].lower().partition("_lod")[0]

    def _colour(self, mesh: int, count: int) -> np.ndarray:
        name = self.dna.mesh_names[mesh].lower()
        colour = next((c for word, c in _COLOURS if word in name), (1.0, 0.92, 0.86))
        paint = np.tile(np.array(colour), (count, 1))
        if name.startswith(("eyeleft", "eyeright")):
            points = np.asarray(self.dna.meshes[mesh].positions)
            middle = (points.max(axis=0) + points.min(axis=0)) / 2
            way = points - middle
            ahead = way[:, 2] / np.maximum(np.linalg.norm(way, axis=1), 1e-9)
            paint[ahead > 0.87] = (0.35, 0.5, 0.7)
            paint[ahead > 0.975] = (0.05, 0.05, 0.05)
        return paint

    def _points(self, row: dict[str, float]) -> np.ndarray:
        raw = raw_of(self.dna, row)
        return np.concatenate([self._seen.positions(raw, m) for m in self._meshes]).astype(float)

    def picture(self, row: dict[str, float], size: int, turn: float = 0.3) -> Image.Image:
        """Draw the face, turned a little to the side.

        Args:
            row: name -> value of controls, as for raw_of().
            size: size of the picture, pixels.
            turn: rotation to the face's right about the vertical axis, radians.
        """
        points, triangles = self._points(row), np.concatenate(self._triangles)
        c, s = np.cos(turn), np.sin(turn)
        middle = np.array([(self._frame[0] + self._frame[1]) / 2, 0.0, self._depth])
        seen = (points - middle) @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) + middle
        normals = shade.vertex_normals(seen, triangles)
        whole = shade.Surface(seen, normals, triangles, np.concatenate(self._paint))
        pixels = np.asarray(shade.render(whole, self._frame, size))[::1]
        picture = Image.fromarray(pixels, "RGBA")
        out = Image.new("RGB", picture.size, (38, 41, 46))
        out.paste(picture, mask=picture)
        return out


def put(rows: list[list[tuple[str, Image.Image]]], out: str) -> None:
    """Write a sheet of pictures with captions.

    Args:
        rows: rows of the sheet, with (caption, picture) for each cell.
        out: path of the sheet.
    """
    first = rows[0][0][1]
    wide, high = first.width, first.height + 22
    whole = Image.new("RGB", (wide * max(map(len, rows)), high * len(rows)), (38, 41, 46))
    draw, font = ImageDraw.Draw(whole), ImageFont.load_default(size=14)
    for line, row in enumerate(rows):
        for column, (name, picture) in enumerate(row):
            whole.paste(picture, (column * wide, line * high))
            place = (column * wide + 6, line * high + first.height + 3)
            draw.text(place, name, fill=(215, 218, 222), font=font)
    Path(out).parent.mkdir(parents=True, exist_ok=True)
    whole.save(out)


def sheet(path: str, out: str, size: int = 260) -> None:
    """Write a sheet of one face in all expressions and controls.

    Args:
        path: the DNA file.
        out: path of the sheet.
        size: size of a picture, pixels.
    """
    face = Face(path)
    shown = {**EXPRESSIONS, **{name: {name: 1.0} for name in CONTROLS}}
    pictures = [(name, face.picture(row, size)) for name, row in shown.items()]
    put([pictures[n : n + _COLUMNS] for n in range(0, len(pictures), _COLUMNS)], out)


def beside(paths: list[str], out: str, size: int = 260) -> None:
    """Write a sheet with a row of expressions for each face.

    Args:
        paths: the DNA files.
        out: path of the sheet.
        size: size of a picture, pixels.
    """
    rows = []
    for path in paths:
        face, stem = Face(path), Path(path).stem
        rows.append([(f"{stem}: {n}", face.picture(row, size)) for n, row in EXPRESSIONS.items()])
    put(rows, out)


def speaking(paths: list[str], clip: str, out: str, size: int = 200) -> None:
    """Write a sheet with a row of seven frames of a clip for each face.

    Args:
        paths: the DNA files.
        clip: path of the clip.
        out: path of the sheet.
        size: size of a picture, pixels.
    """
    take, rows = risorius.Clip.load(clip), []
    for path in paths:
        face, row = Face(path), []
        for share in np.linspace(0.1, 0.9, _COLUMNS):
            at = float(take.start + share * take.duration)
            values = np.asarray(take.sample(np.array([at])))[0]
            said = dict(zip(take.names, values.tolist(), strict=True))
            row.append((f"{Path(path).stem}: {at:.2f} s", face.picture(said, size)))
        rows.append(row)
    put(rows, out)


if __name__ == "__main__":
    *given, target = sys.argv[1:]
    faces = [path for path in given if path.endswith(".dna")]
    if len(faces) < len(given):
        speaking(faces, given[-1], target)
    elif len(faces) == 1:
        sheet(faces[0], target)
    else:
        beside(faces, target)
