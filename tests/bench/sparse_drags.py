# SPDX-License-Identifier: MIT
"""Measures drags: number of moved sliders, distance from the pointer, and spikes of the skin.

    python tests/bench/sparse_drags.py man.dna [--seed N]

Each case is one drag of the neutral face. There are three sets: the poses of posing_tasks.py,
dragged at the vertex that moves furthest on the screen; 100 random vertices with a random pose of
three sliders that each move the vertex by more than 2 mm; and 100 random vertices pulled by 4 to 21
pixels in a random direction, often out of the face's reach. The add-on's two kinds of drags are
compared: *Exact* (least squares) and *Near* (sparse).

*sliders*: sliders that change by more than 0.0001, left and right as one; *extra*: this number
minus the number of sliders of the artist's pose. *px off*: distance from the target at 1.25 pixels
per mm. *needle*: the largest displacement within 12 mm that eight rounds of averaging over
neighbours remove, relative to the vertex's displacement, divided by the same ratio of the artist's
pose (for a pull, of the best single slider). *ms*: CPU time. Each cell is the median and the
largest value.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import posing_tasks as posing
import risorius

SEED, COUNT = 52, 100
PATCH_MM, ROUNDS, TOUCHED = 12.0, 8, 1e-4
METHODS = {
    "Exact": {"method": "least_squares"},
    "Near": {"method": "sparse", "ease": True},
}


@dataclass
class Case:
    """A drag of the neutral face.

    Attributes:
        vertices: dragged vertices of the largest mesh: one, or one on each side.
        targets: target of each vertex, float64[3] in the file's unit.
        pose: raw controls of the artist's pose that gives the targets; None for a random pull.
        mirrored: True: both sides of the face move symmetrically.
    """

    vertices: list[int]
    targets: list[np.ndarray]
    pose: np.ndarray | None
    mirrored: bool = False


class Skin(posing.Face):
    """The face with the edges of its largest mesh."""

    def __init__(self, dna: risorius.Dna) -> None:
        super().__init__(dna)
        mesh = dna.meshes[self.mesh]
        corners = np.asarray(mesh.layout_positions)[np.asarray(mesh.face_layouts)]
        begins = np.asarray(mesh.face_offsets)
        faces = [corners[a:b] for a, b in pairwise(begins)]
        pairs = np.concatenate([np.stack([f, np.roll(f, 1)], axis=1) for f in faces])
        self.edges = np.unique(np.concatenate([pairs, pairs[:, ::-1]]), axis=0)
        self.degree = np.bincount(self.edges[:, 0], minlength=len(self.rest)).clip(1)[:, None]
        self.pixels = posing.PIXELS_A_MM * self.mm

    def needle(self, raw, vertex):
        """The largest spike of the skin near a vertex, divided by the vertex's displacement."""
        moved = self.at(raw) - self.rest
        smooth = moved
        for _ in range(ROUNDS):
            around = np.zeros_like(smooth)
            np.add.at(around, self.edges[:, 0], smooth[self.edges[:, 1]])
            smooth = (smooth + around / self.degree) / 2
        near = np.linalg.norm(self.rest - self.rest[vertex], axis=1) * self.mm < PATCH_MM
        rough = np.linalg.norm((moved - smooth)[near], axis=1).max()
        return rough / max(1e-9, float(np.linalg.norm(moved[vertex])))

    def pairs(self, raw):
        """The active sliders of a pose as a set of indices; left and right count as one."""
        return {min(int(i), int(self.partners[i])) for i in np.flatnonzero(np.abs(raw) > TOUCHED)}

    def reachable(self):
        """Visible vertices that a single slider moves by more than 3 mm on the screen."""
        far = np.zeros(len(self.rest))
        for control in range(len(self.names)):
            raw = np.eye(len(self.names))[control]
            moved = (self.at(raw) - self.rest) @ self.screen.T
            far = np.maximum(far, np.linalg.norm(moved, axis=1))
        return np.flatnonzero(self.shown & (far * self.mm > 3))


def tasks(face: Skin) -> Iterator[Case]:
    """A drag of the furthest moving vertex for each pose of posing_tasks.py."""
    for task in posing.TASKS.values():
        goal = face.raw_of(task)
        wanted, mirrored = face.at(goal), posing.is_mirrored(face, goal)
        off = np.linalg.norm((wanted - face.rest) @ face.screen.T, axis=1) * face.shown
        vertices = [int(off.argmax())]
        side = face.surface.side
        middle = face.middle[side]
        if mirrored and abs(face.rest[vertices[0], side] - middle) * face.mm > 3:
            flip = face.rest[vertices[0]].copy()
            flip[side] = 2 * middle - flip[side]
            vertices.append(int(np.linalg.norm(face.rest - flip, axis=1).argmin()))
        yield Case(vertices, [wanted[v] for v in vertices], goal, mirrored)


def poses(face: Skin, points: np.ndarray, seed: int) -> Iterator[Case]:
    """Drags of random vertices to their places in random poses of three sliders.

    Each slider moves the vertex.
    """
    random, made = np.random.default_rng(seed), 0
    zero = np.zeros(len(face.names))
    while made < COUNT:
        vertex = int(random.choice(points))
        reach = face.surface.jacobian(zero, face.mesh, np.array([vertex]))[0]
        strong = np.flatnonzero(np.linalg.norm(reach, axis=0) * face.mm > 2)
        if len(strong) < 3:
            continue
        goal = zero.copy()
        goal[random.choice(strong, 3, replace=False)] = random.uniform(0.2, 0.9, 3)
        target = face.at(goal)[vertex]
        if np.linalg.norm(face.screen @ (target - face.rest[vertex])) * face.pixels >= 3:
            made += 1
            yield Case([vertex], [target], goal)


def pulls(face: Skin, points: np.ndarray, seed: int) -> Iterator[Case]:
    """Drags of random vertices by 4 to 21 pixels in random directions."""
    random = np.random.default_rng(seed)
    for _ in range(COUNT):
        vertex, turn = int(random.choice(points)), random.uniform(0, 2 * np.pi)
        way = random.uniform(4, 21) / face.pixels * np.array([np.cos(turn), np.sin(turn)])
        yield Case([vertex], [face.rest[vertex] + face.screen.T @ way], None)


def drag(face: Skin, case: Case, method: str, ease: bool = False):
    """The raw controls of a solved drag, and the CPU seconds of solve_drag() alone.

    With `ease`, local_ease() makes it cheap to change controls that mainly move the vertex."""
    zero = np.zeros(len(face.names))
    reach = face.surface.jacobian(zero, face.mesh, np.array(case.vertices[:1]))
    free = np.ones(len(zero), bool)
    if case.mirrored:
        free[[c for a, b in face.opposites if face.partners[a] == b for c in (a, b)]] = False
    given = {
        "axes": np.tile(face.screen, (len(case.vertices), 1, 1)),
        "limits": risorius.ControlLimits(free),
        "sharing": risorius.ControlSharing(
            ease=risorius.local_ease(face.surface, reach) if ease else None,
            partners=face.partners if case.mirrored else None,
            opposites=face.opposites,
        ),
    }
    points = [(face.mesh, v) for v in case.vertices]
    begin = time.process_time()
    solved = risorius.solve_drag(face.surface, zero, points, case.targets, method=method, **given)
    return np.asarray(solved.raw, float), time.process_time() - begin


def measure(face: Skin, case: Case, how: dict) -> list[float]:
    """[sliders, extra, px off, needle, ms] of a drag, as in the module docstring."""
    raw, seconds = drag(face, case, **how)
    vertex = case.vertices[0]
    artist = case.pose
    if artist is None:
        artist = np.zeros(len(face.names))
        best = risorius.best_controls(
            face.surface, artist, (face.mesh, vertex), case.targets[0], axes=face.screen, count=1
        )
        for control, value, _left in best:
            artist[control] = value
    off = np.linalg.norm(face.screen @ (face.at(raw)[vertex] - case.targets[0])) * face.pixels
    still = not artist.any() or not raw.any()
    pointed = 1.0 if still else face.needle(raw, vertex) / face.needle(artist, vertex)
    touched = len(face.pairs(raw))
    extra = touched - len(face.pairs(case.pose)) if case.pose is not None else np.nan
    return [touched, extra, float(off), pointed, 1e3 * seconds]


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("face", type=Path)
    parser.add_argument("--seed", type=int, default=SEED, help="of the random targets")
    asked = parser.parse_args()
    face = Skin(risorius.load(asked.face))
    points = face.reachable()
    print("| targets | drag | sliders | extra | px off | px above Exact | needle | ms |")
    print("|---|---|---|---|---|---|---|---|")
    sets = (("30 poses", tasks(face)), ("100 random poses", poses(face, points, asked.seed)))
    for title, cases in (*sets, ("100 random pulls", pulls(face, points, asked.seed))):
        every, exact = list(cases), None
        for name, how in METHODS.items():
            rows = np.array([measure(face, case, how) for case in every])
            exact = rows[:, 2] if exact is None else exact
            table = np.insert(rows, 3, rows[:, 2] - exact, axis=1)
            cells = [
                "" if np.isnan(column).any() else f"{np.median(column):.{d}f}, {column.max():.{d}f}"
                for column, d in zip(table.T, (0, 0, 2, 2, 2, 1), strict=True)
            ]
            over = int((table[:, 3] > 2).sum())
            print(f"| {title} | {name} | {' | '.join(cells)} |", flush=True)
            if over:
                print(f"(of these {over} are over 2 px above Exact)", flush=True)


if __name__ == "__main__":
    main()
