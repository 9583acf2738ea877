# SPDX-License-Identifier: MIT
"""Checks random acting of a sample person: lids in eyes, lips in teeth, hair in skin.

    python tests/bench/acting_check.py SAMPLE.dna [--seed 1] [--frames 10000] [--clip SPEECH.rzc]
        [--worst 6] [--json FILE] [--render SHEET.jpg]

acting_random.py makes the frames; acting_bodies.py measures depths. Exit code 1 if a depth exceeds
LIMITS. Needs a Python with `risorius`; --render needs `bpy` and Pillow.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import sys
import time
from pathlib import Path
from typing import Any

import acting_bodies as bodies
import numpy as np
import numpy.typing as npt
import risorius
from acting_bodies import Floats, Ints
from acting_random import PREFIX, Acting, random_acting

LIMITS = {"lid in eye": 0.5, "lip in teeth": 0.5, "hair in skin": 0.5, "root in skin": 2.0}  # mm
_HAIR = ("hair", "brow", "beard")
_LONG = 15.0  # mm; hair farther from the skin hangs freely and is not checked
_ROOT = 0.5  # mm; hair vertices nearer to the skin in the neutral pose are roots


class Points:
    """The vertices that the checks need in each frame. A vertex is computed once for all checks."""

    def __init__(self, surface: Any) -> None:
        self._surface, self._rows, self._where = surface, [], {}

    def add(self, mesh: int, vertices: Ints) -> Ints:
        """Register vertices of a mesh.

        Args:
            mesh: index of the mesh.
            vertices: vertex indices, an array of any shape.

        Returns:
            For each vertex its row in the result of at(), in an array of the same shape.
        """
        unique, inverse = np.unique(vertices, return_inverse=True)
        place = []
        for vertex in unique:
            key = (mesh, int(vertex))
            if key not in self._where:
                self._where[key] = len(self._rows)
                self._rows.append(key)
            place.append(self._where[key])
        return np.array(place, np.int64)[inverse].reshape(np.shape(vertices))

    def ready(self) -> None:
        """Finish registration; call this after the last add()."""
        self._probe = self._surface.probe(np.array(self._rows, np.int64))

    def at(self, raw: npt.NDArray[np.float32]) -> Floats:
        """The registered vertices [points, 3] in a pose, in the unit of the DNA file."""
        self._raw = raw
        return self._probe.positions(raw)

    def whole(self, mesh: int) -> Floats:
        """All vertices [V, 3] of a mesh in the pose of the last at(), in the file's unit."""
        return np.asarray(self._surface.positions(self._raw, mesh), np.float64)


class Eye:
    """Checks the lids around an eyeball."""

    def __init__(self, face: Face, name: str) -> None:
        mesh = face.mesh(name)
        ball = face.rest[mesh]
        self.ball = bodies.Ball(np.concatenate([ball, *face.corneas(ball[:, 0].mean())]))
        skin = face.skin
        ray = skin.places - self.ball.middle
        ray /= np.linalg.norm(ray, axis=1, keepdims=True).clip(1e-9)
        deep = self.ball.depth(skin.places) * face.mm
        near = (deep > -6.0) & (deep < 0.1)  # deeper skin is the invisible lining of the socket
        outward = np.einsum("nd,nd->n", ray, skin.normals) > 0.0
        self.lids = skin.kept(near & outward & (ray[:, 2] > 0.2))
        some = np.linspace(0, len(ball) - 1, 60).astype(np.int64)
        self._rest = ball[some]
        self._some = face.points.add(mesh, some)
        self._corners = face.points.add(face.head, self.lids.corners)

    def depths(self, now: Floats) -> tuple[str, Floats, Floats]:
        """The name of the check, the depth of each lid sample, and the samples' places.

        Args:
            now: result of Points.at() for a frame. Depths and places are in its unit.
        """
        turn, shift = bodies.rigid_motion(self._rest, now[self._some])
        places = now[self._corners].mean(axis=1)
        return "lid in eye", self.ball.depth((places - shift) @ turn), places


class Mouth:
    """Checks the lips around both rows of teeth."""

    def __init__(self, face: Face, name: str) -> None:
        mesh = face.mesh(name)
        teeth, triangles = face.rest[mesh], face.triangles(mesh)
        wide = np.abs(teeth[:, 0]).max()
        back = teeth[:, 2].max() - wide
        below = face.moved_by_jaw(mesh)
        self.rows = []
        for lower in (False, True):
            kept = triangles[(below[triangles] == lower).all(axis=1)]
            arch = bodies.Arch(teeth, kept, back)
            used = np.unique(kept)
            self.rows.append((lower, arch, teeth[used], face.points.add(mesh, used)))
        self.lips = self._lips(face.skin, teeth, back, wide)
        self._below = face.moved_by_jaw(face.head)[self.lips.corners].mean(axis=1) > 0.5
        self._corners = face.points.add(face.head, self.lips.corners)

    @staticmethod
    def _lips(skin: bodies.Skin, teeth: Floats, back: float, wide: float) -> bodies.Skin:
        """The outward facing skin samples in front of the teeth, in the neutral pose."""
        ray = skin.places * [1.0, 0.0, 1.0] - [0.0, 0.0, back]
        radius = np.linalg.norm(ray, axis=1).clip(1e-9)
        outward = np.einsum("nd,nd->n", ray / radius[:, None], skin.normals) > 0.0
        low, high = teeth[:, 1].min() - 0.8, teeth[:, 1].max() + 0.8
        tall = (skin.places[:, 1] > low) & (skin.places[:, 1] < high)
        ahead = ray[:, 2] > 0.25 * radius
        return skin.kept(outward & tall & ahead & (radius < wide + 2.0) & (radius > 0.85 * wide))

    def depths(self, now: Floats) -> tuple[str, Floats, Floats]:
        """The name of the check, the depth of each lip sample, and the samples' places.

        Args:
            now: result of Points.at() for a frame. Depths and places are in its unit.
        """
        places = now[self._corners].mean(axis=1)
        deep = np.zeros(len(places))
        for lower, arch, rest, points in self.rows:
            turn, shift = bodies.rigid_motion(rest, now[points])
            found = arch.depth((places - shift) @ turn, self._below != lower)
            deep = np.maximum(deep, found)
        return "lip in teeth", deep, places


class Hair:
    """Checks hair cards over the skin: either their roots, or their other vertices.

    At most `most` vertices, spread evenly over the mesh `name`, are checked.
    """

    def __init__(self, face: Face, name: str, roots: bool, most: int = 4000) -> None:
        mesh = face.mesh(name)
        hairs = face.rest[mesh]
        some = np.linspace(0, len(hairs) - 1, min(most, len(hairs))).astype(np.int64)
        cards = bodies.Cards(hairs[some], face.rest[face.head], face.triangles(face.head))
        short = np.abs(cards.rest) < _LONG / face.mm
        kept = short & ((cards.rest < _ROOT / face.mm) == roots)
        self.check = "root in skin" if roots else "hair in skin"
        self._hairs = face.points.add(mesh, some[kept])
        self._corners = face.points.add(face.head, cards.corners[kept])
        self._around = face.points.add(face.head, cards.around[kept, : cards.NEAR])
        self._far, self._points, self._head = cards.around[kept], face.points, face.head
        self._limit = LIMITS[self.check] / face.mm

    def depths(self, now: Floats) -> tuple[str, Floats, Floats]:
        """The name of the check, the depth of each hair vertex, and their places.

        The depth is first measured from the plane of one triangle. A plane continues beyond its
        triangle, which gives wrong depths if skin rolls in (lips). So doubtful vertices are
        measured again from the nearest of Cards.NEAR triangles. Vertices that are still too deep
        are measured from Cards.AROUND triangles, because folds bring distant triangles near.

        Args:
            now: result of Points.at() for a frame. Depths and places are in its unit.
        """
        places = now[self._hairs]
        deep = -bodies.Cards.height(places, now[self._corners])
        doubted = np.flatnonzero(deep > self._limit / 2)
        corners = now[self._around[doubted]]
        deep[doubted] = -bodies.Cards.height_over_nearest(places[doubted], corners)
        doubted = np.flatnonzero(deep > self._limit)
        if len(doubted):
            corners = self._points.whole(self._head)[self._far[doubted]]
            deep[doubted] = -bodies.Cards.height_over_nearest(places[doubted], corners)
        return self.check, deep, places


class Face:
    """A person in the neutral pose, with all checked parts: eyes, rows of teeth, hair."""

    def __init__(self, path: Path) -> None:
        self.dna = risorius.load(str(path))
        self.rig = risorius.Rig(self.dna)
        surface = risorius.Surface(self.dna, self.rig)
        self.names, self.mm = list(self.dna.raw_control_names), surface.mm
        self._meshes = {self.dna.mesh_names[m]: m for m in surface.mesh_indices}
        raw = np.array(self.rig.initial_raw_controls, np.float32)
        self.rest = {m: surface.positions(raw, m).astype(float) for m in self._meshes.values()}
        raw = raw.copy()
        raw[self.names.index(PREFIX + "jawOpen")] = 1.0
        self._open = {m: surface.positions(raw, m).astype(float) for m in self._meshes.values()}
        self.head = self.mesh("head")
        self.points = Points(surface)
        self.skin = bodies.skin_samples(self.rest[self.head], self.faces(self.head))
        names = list(self._meshes)
        eyes = [n for n in names if n.startswith(("eyeLeft", "eyeRight"))]
        self.parts: list[Any] = [Eye(self, n) for n in eyes]
        self.parts += [Mouth(self, n) for n in names if n.startswith("teeth")]
        for name in names:
            if any(word in name.lower() for word in _HAIR):
                self.parts += [Hair(self, name, roots) for roots in (True, False)]
        self.points.ready()

    def mesh(self, name: str) -> int:
        """The index of the mesh whose name begins with `name`."""
        return next(m for n, m in self._meshes.items() if n.startswith(name))

    def corneas(self, side: float) -> list[Floats]:
        """Neutral vertices on one side of the face, for each mesh whose name begins with cornea.

        Args:
            side: any number with the sign that x has on this side.
        """
        found = [self.rest[m] for n, m in self._meshes.items() if n.startswith("cornea")]
        return [places[places[:, 0] * side > 0] for places in found]

    def faces(self, mesh: int) -> list[list[int]]:
        """The vertex indices of each polygon of a mesh."""
        held = self.dna.meshes[mesh]
        corners = np.asarray(held.layout_positions)[np.asarray(held.face_layouts)].tolist()
        ends = np.asarray(held.face_offsets).tolist()
        return [corners[a:b] for a, b in itertools.pairwise(ends)]

    def triangles(self, mesh: int) -> Ints:
        """int64[F, 3]: the vertices of the faces, divided into triangles."""
        fans = ((f[0], f[i], f[i + 1]) for f in self.faces(mesh) for i in range(1, len(f) - 1))
        return np.array(list(fans), np.int64)

    def moved_by_jaw(self, mesh: int) -> npt.NDArray[np.bool_]:
        """bool[V]: whether an open jaw moves a vertex by at least half of the teeth's motion."""
        way = np.linalg.norm(self._open[mesh] - self.rest[mesh], axis=1)
        teeth = self.mesh("teeth")
        return way > 0.5 * np.linalg.norm(self._open[teeth] - self.rest[teeth], axis=1).max()


def measure(face: Face, acting: Acting) -> dict[str, npt.NDArray[np.float64]]:
    """Name of a check -> float64[frames, 4]: the largest depth in each frame, and its place.

    The depth is in mm; the place (x, y, z) is in the unit of the DNA file.
    """
    checks = {name: np.zeros((len(acting.raw), 4)) for name in LIMITS}
    for frame, raw in enumerate(acting.raw):
        now = face.points.at(raw)
        for part in face.parts:
            check, deep, places = part.depths(now)
            worst = int(deep.argmax()) if len(deep) else 0
            if len(deep) and deep[worst] * face.mm > checks[check][frame, 0]:
                checks[check][frame] = (deep[worst] * face.mm, *places[worst])
    return checks


def report(
    face: Face, acting: Acting, checks: dict[str, npt.NDArray[np.float64]], worst: int
) -> list[dict[str, Any]]:
    """The results of the checks as rows, with the worst frames of each.

    Args:
        face: the person.
        acting: the frames.
        checks: result of measure().
        worst: number of frames to list for each check.
    """
    rest = measure(face, Acting(np.array([face.rig.initial_raw_controls], np.float32), ["rest"]))
    rows = []
    for check, found in checks.items():
        order = np.argsort(-found[:, 0])[:worst]
        rows.append(
            {
                "check": check,
                "limit_mm": LIMITS[check],
                "rest_mm": round(float(rest[check][0, 0]), 3),
                "beyond": int((found[:, 0] > LIMITS[check]).sum()),
                "frames": len(found),
                "worst": [
                    {
                        "frame": int(frame),
                        "mm": round(float(found[frame, 0]), 3),
                        "at": [round(float(x), 2) for x in found[frame, 1:]],
                        "acting": acting.words[frame],
                    }
                    for frame in order
                    if found[frame, 0] > 0
                ],
            }
        )
    return rows


def show(rows: list[dict[str, Any]]) -> None:
    """Print the rows as a table."""
    for row in rows:
        print(
            f"{row['check']:14} limit {row['limit_mm']} mm, at rest {row['rest_mm']:.2f} mm, "
            f"beyond it in {row['beyond']} of {row['frames']} frames"
        )
        for one in row["worst"]:
            place = f"frame {one['frame']:6}  at {one['at']}"
            print(f"    {one['mm']:6.2f} mm  {place}  {one['acting']}")


def render(args: argparse.Namespace, acting: Acting, names: list[str], rows: list[Any]) -> None:
    """Render the worst frames of each check on a sheet."""
    import draw_expressions

    shots = []
    for row in rows:
        for one in row["worst"]:
            weights = dict(zip(names, acting.raw[one["frame"]].tolist(), strict=True))
            look = "mouth" if row["check"] == "lip in teeth" else "eyes"
            label = f"{row['check']} {one['mm']:.2f} mm, {one['frame']}"
            shots.append(draw_expressions.Shot(label, look, weights))
    draw_expressions.draw(args.sample, shots, args.render, size=256, samples=16, columns=args.worst)


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sample", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--frames", type=int, default=10000)
    parser.add_argument("--clip", type=Path, help="a .rzc of speech")
    parser.add_argument("--worst", type=int, default=6)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--render", type=Path)
    return parser.parse_args()


def main() -> int:
    args = parse()
    begin = time.monotonic()
    face = Face(args.sample)
    clip = None if args.clip is None else risorius.Clip.load(str(args.clip))
    acting = random_acting(face.names, args.seed, args.frames, clip)
    rows = report(face, acting, measure(face, acting), args.worst)
    show(rows)
    print(f"{args.frames} frames by seed {args.seed} in {time.monotonic() - begin:.0f} s")
    if args.json is not None:
        args.json.write_text(json.dumps({"seed": args.seed, "checks": rows}, indent=1) + "\n")
    if args.render is not None:
        render(args, acting, face.names, rows)
        sys.stdout.flush()
        os._exit(int(any(row["beyond"] for row in rows)))  # bpy sometimes hangs at exit
    return int(any(row["beyond"] for row in rows))


if __name__ == "__main__":
    sys.exit(main())
