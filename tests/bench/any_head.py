# SPDX-License-Identifier: MIT
"""Measures the accuracy of registering a template to heads with known correspondences.

    python tests/bench/any_head.py [--heads 6] [--first 100] [--marks 2.5] [--kind plain]

Draws random people from the sample's generator, whose vertices all correspond, remeshes them, and
registers the man's skin to them. Kinds of heads: `plain`; `noise` (0.12 mm of noise, and holes at
the back of the head); `fine` (four times the triangles of the original); `dressed` (with hair and a
collar). Landmarks and the initial position are found automatically. With --marks MM, eleven
vertices are instead paired with their true places plus a random error of MM millimetres, without an
initial position. Prints a row for each head (errors in mm along the surface and away from it,
seconds) and the means of all heads.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "python" / "support"))
sys.path.insert(0, str(Path(__file__).parents[1] / "python"))

import any_heads
from risorius.anyhead.landmarks.find import find_form
from risorius.anyhead.landmarks.start import pairs_of, start_of
from risorius.anyhead.registration import register
from risorius.anyhead.surface import Surface
from risorius_people.people import MAN

MM = 10.0  # mm per cm
KINDS = ("plain", "noise", "fine", "dressed")
COLUMNS = ("along", "95 %", "face", "away", "trusted", "marks", "seconds")


def noisy(skin: Surface, random: np.random.Generator) -> Surface:
    """The surface with noise of 0.12 mm and five holes in its back, like a scan."""
    points = skin.points + random.normal(0, 0.012, skin.points.shape)
    middles = points[skin.triangles].mean(axis=1)
    back = middles[middles[:, 2] < np.median(middles[:, 2])]
    kept = np.ones(len(middles), bool)
    for middle in back[random.integers(len(back), size=5)]:
        kept &= np.linalg.norm(middles - middle, axis=1) > random.uniform(0.3, 1.2)
    return Surface(points, skin.triangles[kept])


def dressed(skin: Surface, true: np.ndarray) -> Surface:
    """The surface plus layers for hair 12 mm over the skull and a collar 8 mm over the neck."""
    top, front = true[:, 1].max(), true[:, 2].max()
    normals = skin.normals()
    middles = skin.points[skin.triangles].mean(axis=1)
    hair = (middles[:, 1] > top - 9) & (middles[:, 2] < front - 7)
    collar = middles[:, 1] < true[:, 1].min() + 3
    points, triangles = [skin.points], [skin.triangles]
    for chosen, thickness in ((hair, 1.2), (collar, 0.8)):
        triangles.append(skin.triangles[chosen] + len(skin.points) * len(points))
        points.append(skin.points + thickness * normals)
    return Surface(np.concatenate(points), np.concatenate(triangles))


def target_of(kind: str, true: Surface, seed: int) -> Surface:
    """A remeshed head of one of KINDS; its vertices do not correspond to the template's."""
    skin = any_heads.remeshed(true, 4.0 if kind == "fine" else 0.5, seed)
    if kind == "noise":
        return noisy(skin, np.random.default_rng(seed))
    return dressed(skin, true.points) if kind == "dressed" else skin


def marks_of(skin: Surface) -> list[int]:
    """Vertices of the man's skin at eleven places that are easy to mark on a face."""
    points = skin.points
    tip = points[points[:, 2].argmax()]
    places = [(0, 0, 0), (0, -7, -1.5), (0, 14, -10), (0, -2.5, -1), (0, -1.5, -0.5)]
    for side in (-1, 1):
        places += [(side * 4.6, 4, -4), (side * 1.7, 3.6, -3), (side * 2.6, -3.2, -2.2)]
    wanted = tip + np.array(places, float)
    return [int(np.linalg.norm(points - p, axis=1).argmin()) for p in wanted]


def measured(
    template: Surface, true: Surface, target: Surface, marks: float | None, seed: int
) -> list[float]:
    """The table row of one head, in the order of COLUMNS.

    Args:
        marks: random error in mm that is added to the true places of the paired vertices; None:
            landmarks are found instead.
    """
    random = np.random.default_rng(seed)
    chosen = marks_of(template)
    begin = time.perf_counter()
    if marks is None:
        one, other = find_form(template), find_form(target)
        start = start_of(template, target, one, other)
        found = register(template, target, pairs_of(template, one, other), start=start)
    else:
        wrong = random.normal(0, marks / MM / np.sqrt(3), (len(chosen), 3))
        found = register(
            template, target, list(zip(chosen, true.points[chosen] + wrong, strict=True))
        )
    seconds = time.perf_counter() - begin
    along = MM * any_heads.errors(template, found.points, true.points)
    on = found.trusted
    face = on & (template.points[:, 2] > template.points[:, 2].max() - 8)
    at_marks = MM * np.linalg.norm(found.points - true.points, axis=1)[chosen].mean()
    away = MM * found.distance[on].mean()
    return [
        along[on].mean(), np.percentile(along[on], 95), along[face].mean(), away,
        on.mean(), at_marks, seconds,
    ]  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--heads", type=int, default=6)
    parser.add_argument("--first", type=int, default=100, help="seed of the first head")
    parser.add_argument("--marks", type=float, help="error of pairs at true places, mm")
    parser.add_argument("--kind", choices=KINDS, help="of all heads")
    args = parser.parse_args()
    source = any_heads.generator()
    template = any_heads.skin_of(MAN, source)
    print(f"template: {len(template.points)} vertices")
    print("seed  kind     vertices", *(f"{name:>8}" for name in COLUMNS))
    rows = []
    for i in range(args.heads):
        seed, kind = args.first + i, args.kind or KINDS[i % len(KINDS)]
        true = any_heads.skin_of(any_heads.random_person(seed, source), source)
        target = target_of(kind, true, seed)
        rows.append(measured(template, true, target, args.marks, seed))
        print(f"{seed:4}  {kind:8} {len(target.points):8}", *(f"{x:8.3f}" for x in rows[-1]))
        sys.stdout.flush()
    print("mean" + " " * 18, *(f"{x:8.3f}" for x in np.mean(rows, axis=0)))


if __name__ == "__main__":
    main()
