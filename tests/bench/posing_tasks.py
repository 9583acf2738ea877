# SPDX-License-Identifier: MIT
"""Counts the mouse events and pixels that set 30 poses by sliders, face boards and skin drags.

    python tests/bench/posing_tasks.py man.dna

The simulated user knows which sliders or handles a pose needs. When dragging, the user tries the
vertices furthest from their targets and takes the drag that reduces the error most.

Events: presses and releases of the mouse button, two for a click and two for a drag. The number
after a + counts events of keys (Ctrl for a single slider, Tab for the next slider). Opening the
tool or the sidebar tab is not counted. Regions of sliders are closed at the beginning of a pose
and opened by a click; the line "all regions open" gives the ratio without these clicks.

Pixels: the path of the pointer. Sliders are 75 or 150 pixels wide, in rows of 22 pixels below the
headings of their regions. The head has 1.25 pixels per mm, the complete board is 285 pixels high,
and the primary board has 41 pixels per unit, as in a window of 1366 x 768. A slider or handle is
set to a whole pixel; the handles of a board go where the add-on puts them for the pose.

Drags: either the sparse solver of the add-on, in both screen axes and with free depth, or with
Ctrl a single slider; both are symmetric if the pose is. Dragging ends when a tenth of the initial
error is left, after as many drags as the pose has active controls, or when no drag removes a
twentieth of the initial error.

Error: root mean square distance in mm of the vertices that the pose moves by more than 0.1 mm;
*way* is this distance of the neutral face. The last number of a cell is the number of sliders that
end away from their neutral value; left and right count as one.
"""

from __future__ import annotations

import argparse
import importlib
import statistics
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import risorius
from risorius.anim.reactions import load_exclusives
from risorius.controls import regions
from risorius.controls.sides import mirrored_name

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "logic"))
import test_addon_logic  # noqa: F401  registers the package of the logic

board_table = importlib.import_module("risorius_addon_logic.character.board_table")
board_fit = importlib.import_module("risorius_addon_logic.character.board_fit")
board_layout = importlib.import_module("risorius_addon_logic.character.board_layout")
primary_layout = importlib.import_module("risorius_addon_logic.character.primary_layout")
primary_table = importlib.import_module("risorius_addon_logic.character.primary_table")

HEADING, ROW, WIDTH = 24, 22, 150.0  # pixels
BOARD_HEIGHT, PIXELS_A_MM = 285.0, 1.25
# Pixels per unit of the primary board, and pixels from the face to the board's centre.
PRIMARY_UNIT, PRIMARY_AWAY = 41.0, 340.0
AWAY = 420.0  # pixels from the face to the sidebar
ENOUGH, WORTH, CANDIDATES = 0.1, 0.05, 10
TASKS: dict[str, dict[str, float]] = {
    "left eye half closed": {"eyeBlinkL": 0.5},
    "both eyes closed": {"eyeBlink": 1.0},
    "wink": {"eyeBlinkR": 1.0, "eyeCheekRaiseR": 0.6, "mouthCornerPullR": 0.3},
    "eyes wide": {"eyeWiden": 0.9},
    "squint": {"eyeSquintInner": 0.8, "eyeCheekRaise": 0.3},
    "brows up": {"browRaiseIn": 0.9, "browRaiseOuter": 0.9},
    "one brow up": {"browRaiseInL": 0.7, "browRaiseOuterL": 1.0},
    "frown": {"browDown": 0.9, "browLateral": 0.6},
    "worried brows": {"browRaiseIn": 0.9, "browLateral": 0.5},
    "smirk": {"mouthCornerPullL": 0.6, "mouthDimpleL": 0.3},
    "smile": {"mouthCornerPull": 0.7, "eyeCheekRaise": 0.3},
    "broad smile": {"mouthCornerPull": 1.0, "eyeCheekRaise": 0.6, "mouthUpperLipRaise": 0.3},
    "sad mouth": {"mouthCornerDepress": 0.7, "jawChinRaiseD": 0.4},
    "mouth to the left": {"mouthLeft": 0.7},
    "jaw open": {"jawOpen": 0.6},
    "jaw to the right": {"jawRight": 0.8},
    "jaw forward, a little open": {"jawFwd": 0.7, "jawOpen": 0.2},
    "kiss": {"mouthLipsPurseU": 0.8, "mouthLipsPurseD": 0.8},
    "oh": {"jawOpen": 0.35, "mouthFunnelU": 0.7, "mouthFunnelD": 0.7},
    "ee": {"jawOpen": 0.15, "mouthStretch": 0.6, "mouthCornerPull": 0.3},
    "lips pressed": {"mouthPressU": 0.8, "mouthPressD": 0.8},
    "upper lip up": {"mouthUpperLipRaise": 0.8},
    "lower lip down": {"mouthLowerLipDepress": 0.8},
    "sneer": {"noseWrinkleL": 0.9, "mouthUpperLipRaiseL": 0.6},
    "disgust": {"noseWrinkle": 0.8, "mouthUpperLipRaise": 0.5, "browDown": 0.5},
    "cheeks blown": {"mouthCheekBlow": 0.8},
    "anger": {"browDown": 1.0, "eyeSquintInner": 0.5, "noseWrinkle": 0.4, "mouthPressU": 0.4},
    "fear": {"browRaiseIn": 0.8, "browLateral": 0.4, "eyeWiden": 0.7, "mouthStretch": 0.5},
    "surprise": {"browRaiseIn": 0.9, "browRaiseOuter": 0.9, "eyeWiden": 0.6, "jawOpen": 0.5},
    "shout": {"jawOpen": 0.9, "mouthStretch": 0.5, "browDown": 0.6, "noseWrinkle": 0.4},
}


@dataclass
class Done:
    """The cost of a pose.

    Attributes:
        events: number of presses and releases of the mouse button.
        keys: number of key events.
        openings: how many of `events` opened a region of sliders.
        pixels: length of the pointer's path.
        error: remaining error in mm.
        at: place of the pointer in pixels.
    """

    events: int = 0
    keys: int = 0
    openings: int = 0
    pixels: float = 0.0
    error: float = 0.0
    at: tuple[float, float] = (0.0, 0.0)

    def go(self, x: float, y: float) -> None:
        self.pixels += float(np.hypot(x - self.at[0], y - self.at[1]))
        self.at = (x, y)

    def click(self, x: float, y: float) -> None:
        self.go(x, y)
        self.events += 2

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        self.go(*start)
        self.go(*end)
        self.events += 2


class Face:
    """The face with its largest mesh, its controls, and its projection on the screen."""

    def __init__(self, dna: risorius.Dna) -> None:
        self.dna = dna
        self.surface = risorius.Surface(dna, risorius.Rig(dna))
        self.names = [n.removeprefix("CTRL_expressions.") for n in dna.raw_control_names]
        self.mesh = max(range(len(dna.meshes)), key=lambda m: len(dna.meshes[m].positions))
        self.rest = self.at(np.zeros(len(self.names)))
        self.mm = {"cm": 10.0, "m": 1000.0}[dna.translation_unit]
        axes = [a for a in range(3) if not self.surface.front[a]]
        self.screen = np.eye(3)[axes]
        span = np.ptp(self.rest, axis=0)
        self.middle = (self.rest.min(axis=0) + self.rest.max(axis=0)) / 2
        self.shown = self.rest @ self.surface.front > (self.middle @ self.surface.front) - 0.1 * (
            span @ np.abs(self.surface.front)
        )
        columns = dna.gui_to_raw
        numbers = [columns.input_indices, columns.output_indices, columns.from_values]
        numbers += [columns.to_values, columns.slope_values, columns.cut_values]
        index = {name: i for i, name in enumerate(dna.raw_control_names)}
        self.partners = np.array([index.get(mirrored_name(n), i) for n, i in index.items()])
        self.opposites = load_exclusives().rules_of(index)[1]
        self.table = board_table.of_file(list(dna.gui_control_names), numbers, len(self.names))

    def at(self, raw):
        return self.surface.positions(raw, self.mesh).astype(float)

    def pixel(self, place):
        """Screen position of a point in pixels, relative to the centre of the face."""
        return tuple(self.screen @ (place - self.middle) * self.mm * PIXELS_A_MM)

    def pairs(self, raw):
        """The number of sliders away from their neutral value; left and right count as one."""
        away = np.flatnonzero(np.abs(raw) > 1e-3)
        return len({min(int(c), int(self.partners[c])) for c in away})

    def raw_of(self, task):
        """float64[R]: raw controls of a pose; a name without a side sets both sides."""
        out = np.zeros(len(self.names))
        for name, value in task.items():
            sides = [n for n in (name, name + "L", name + "R") if n in self.names]
            assert sides, name
            for side in sides:
                out[self.names.index(side)] = value
        return out


def apart(face, places, wanted, moving):
    """Root mean square distance in mm between places and wanted, over the moving vertices."""
    off = np.linalg.norm(places - wanted, axis=1)[moving] * face.mm
    return float(np.sqrt((off**2).mean()))


def by_sliders(face, goal):
    """(cost, raw controls) of setting each control by its slider, in regions opened by clicks."""
    done, raw, opened = Done(), np.zeros_like(goal), {}
    headings = list(regions.TITLES)
    rows = {r: [] for r in headings}
    for name in face.names:
        stem = name[:-1] if name[-1:] in "LR" and name[:-1] + "L" in face.names else name
        region = regions.region_of("CTRL_expressions." + name)
        if region in rows and stem not in rows[region]:
            rows[region].append(stem)
    done.at = (-AWAY, 0.0)
    for control in sorted(np.flatnonzero(goal), key=lambda c: headings.index(
            regions.region_of("CTRL_expressions." + face.names[c]))):  # fmt: skip
        name = face.names[control]
        region = regions.region_of("CTRL_expressions." + name)
        above = sum(
            len(rows[r]) * ROW for r in opened if headings.index(r) < headings.index(region)
        )
        top = headings.index(region) * HEADING + above
        if region not in opened:
            done.click(20.0, top)
            done.openings += 2
            opened[region] = True
        paired = name[-1:] in "LR" and name[:-1] in rows[region]
        row = rows[region].index(name[:-1] if paired else name)
        wide = WIDTH / 2 if paired else WIDTH
        left = 60.0 + (wide if paired and name.endswith("L") else 0.0)
        way = round(goal[control] * wide)
        y = top + HEADING + row * ROW
        done.drag((left, y), (left + way, y))
        raw[control] = way / wide
    return done, raw


def by_complete(face, goal):
    """(cost, raw controls) of setting the pose by the complete board."""
    table = face.table
    ways = board_layout.ways_of(table, list(face.dna.raw_control_names), {})
    handles = board_layout.handles_of(table, ways, regions.region_of)
    board = board_layout.lay_out(handles, regions.TITLES)
    return by_board(table, board, BOARD_HEIGHT / board.height, 250.0, goal)


def by_primary(face, goal):
    """(cost, raw controls) of setting the pose by the primary board."""
    table = primary_table.table_of(list(face.dna.raw_control_names))
    board = primary_layout.lay_out(table, primary_table.handles_of(table, {}))
    return by_board(table, board, PRIMARY_UNIT, PRIMARY_AWAY, goal)


def by_board(table, board, unit, away, goal):
    """(cost, raw controls) of setting a pose by handles; a drag sets both axes of a handle.

    Args:
        table: GUI controls of the board.
        board: layout of its handles.
        unit: pixels per unit of the board.
        away: pixels from the face to the board's centre.
        goal: float64[R], raw controls of the pose.
    """
    gui = board_fit.fit(table, goal[None], np.zeros((1, len(table.names))))[0]
    done, used = Done(), np.zeros_like(gui)
    for handle in board.handles:
        way = [0.0, 0.0]
        for number, axis in enumerate((handle.x, handle.y)):
            if axis is not None and abs(gui[axis.gui]) > 1e-3:
                pixels = round(gui[axis.gui] / axis.unit * unit)
                way[number] = float(pixels)
                used[axis.gui] = np.clip(pixels / unit, axis.low, axis.high) * axis.unit
        if any(way):
            x, y = handle.place[0] * unit + away, handle.place[1] * unit
            done.drag((x, y), (x + way[0], y + way[1]))
    return done, np.asarray(table.raw(used[None]))[0]


def by_drags(face, goal, moving, most):
    """(cost, raw controls) of setting a pose by skin drags; each is the drag with the best result.

    Args:
        face: the face.
        goal: float64[R], raw controls of the pose.
        moving: bool[V], vertices that the pose moves by more than 0.1 mm.
        most: largest number of drags.
    """
    done, raw = Done(), np.zeros_like(goal)
    wanted = face.at(goal)
    mirrored = is_mirrored(face, goal)
    way = left = apart(face, face.rest, wanted, moving)
    for _ in range(most):
        if left <= ENOUGH * way:
            break
        found = best_drag(face, raw, wanted, moving, mirrored)
        if found is None or found[0] > left - WORTH * way:
            break
        left, raw, start, end, held = found
        done.drag(face.pixel(start), face.pixel(end))
        done.keys += held
    return done, raw


def is_mirrored(face, goal):
    """Whether each control of a pose equals its partner on the other side."""
    return bool((goal == goal[face.partners]).all())


def best_drag(face, raw, wanted, moving, mirrored):
    """(error in mm, raw controls, start, target, key events) of the drag that leaves the least
    error.

    Start and target are places of the dragged vertex. Returns None if every visible vertex that the
    pose moves is already at its target.
    """
    here = face.at(raw)
    off = np.linalg.norm((wanted - here) @ face.screen.T, axis=1) * (moving & face.shown)
    picked, order = [], np.argsort(-off)
    for vertex in order:  # choose vertices at least 6 mm apart
        near = [v for v in picked if np.linalg.norm(face.rest[v] - face.rest[vertex]) * face.mm < 6]
        if not near and off[vertex] > 0:
            picked.append(int(vertex))
        if len(picked) == CANDIDATES:
            break
    out = None
    for vertex in picked:
        for solved, keys in solutions(face, raw, vertex, wanted, mirrored):
            left = apart(face, face.at(solved), wanted, moving)
            if out is None or left < out[0]:
                out = (left, solved, here[vertex], wanted[vertex], keys)
    return out


def solutions(face, raw, vertex, wanted, mirrored):
    """(raw controls, key events) of each of four drags of a vertex.

    The first is with all sliders. The others are each with one slider: the three that alone bring
    the vertex nearest to its target.
    """
    points, targets = [(face.mesh, vertex)], [wanted[vertex]]
    ease = risorius.local_ease(
        face.surface, face.surface.jacobian(raw, face.mesh, np.array([vertex]))
    )
    free = np.ones(len(raw), bool)
    partners = face.partners if mirrored else None
    if mirrored:
        free[[c for a, b in face.opposites if face.partners[a] == b for c in (a, b)]] = False
    side = face.surface.side
    if mirrored and abs(face.rest[vertex, side] - face.middle[side]) * face.mm > 3:
        flip = face.rest[vertex].copy()
        flip[side] = 2 * face.middle[side] - flip[side]
        twin = int(np.linalg.norm(face.rest - flip, axis=1).argmin())
        points.append((face.mesh, twin))
        targets.append(wanted[twin])
    axes = np.tile(face.screen, (len(points), 1, 1))
    limits = risorius.ControlLimits(free)
    sharing = risorius.ControlSharing(ease, partners, face.opposites)
    solved = risorius.solve_drag(
        face.surface, raw, points, targets, axes=axes, limits=limits, sharing=sharing,
        method="sparse",
    )  # fmt: skip
    yield np.asarray(solved.raw, float), 0  # no key held
    alone = risorius.best_controls(
        face.surface, raw, points[0], targets[0], axes=face.screen, limits=limits, count=3
    )
    for tab, (control, _value, _left) in enumerate(alone):
        only = np.zeros(len(raw), bool)
        only[control] = True
        if mirrored:
            only[face.partners[control]] = True
        solved = risorius.solve_drag(
            face.surface, raw, points, targets, axes=axes,
            limits=risorius.ControlLimits(only & free),
            sharing=risorius.ControlSharing(partners=partners, opposites=face.opposites),
        )  # fmt: skip
        yield np.asarray(solved.raw, float), 2 + 2 * tab  # Ctrl down and up, Tab


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("face", type=Path)
    args = parser.parse_args()
    face = Face(risorius.load(args.face))
    print("| pose | way mm | sliders: events, px, mm, sliders | complete | primary | drags |")
    print("|---|---|---|---|---|---|")
    events, openings, keys, ways = [], [], [], []
    for title, task in TASKS.items():
        goal = face.raw_of(task)
        wanted = face.at(goal)
        moving = np.linalg.norm(wanted - face.rest, axis=1) * face.mm > 0.1
        rows = [by_sliders(face, goal), by_complete(face, goal), by_primary(face, goal)]
        rows.append(by_drags(face, goal, moving, int((goal != 0).sum())))
        cells = []
        for done, raw in rows:
            done.error = apart(face, face.at(raw), wanted, moving)
            behind = f" + {done.keys}" if done.keys else ""
            count = face.pairs(raw)
            cells.append(f"{done.events}{behind}, {done.pixels:,.0f}, {done.error:.2f}, {count}")
        events.append([(d.events, d.pixels, d.error, face.pairs(raw)) for d, raw in rows])
        openings.append(rows[0][0].openings)
        keys.append(rows[3][0].keys)
        way = apart(face, face.rest, wanted, moving)
        ways.append(way)
        print(f"| {title} | {way:.2f} | {' | '.join(cells)} |", flush=True)
    table = np.array(events)
    middles = np.median(table, axis=0)
    middle = [f"{row[0]:.0f}, {row[1]:,.0f}, {row[2]:.2f}, {row[3]:.0f}" for row in middles]
    print(f"| **median** | | {' | '.join(middle)} |")
    tell(table, np.array(openings), np.array(keys), np.array(ways))


def tell(table, openings, keys, ways):
    """Print the median ratios of the cost of drags to the cost of sliders.

    Args:
        table: array [pose, method, (events, pixels, mm, sliders)].
        openings: for each pose, the number of events that opened regions of sliders.
        keys: for each pose, the number of key events of its drags.
        ways: for each pose, its root mean square distance from the neutral pose in mm.
    """
    sliders, drags = table[:, 0], table[:, 3]
    near = drags[:, 2] <= 0.2 * ways
    events = drags[:, 0] / sliders[:, 0]
    for words, share in (
        ("pixels", drags[:, 1] / sliders[:, 1]),
        ("events", events),
        (f"events of the {near.sum()} that end within a fifth", events[near]),
        ("events, all regions open", drags[:, 0] / (sliders[:, 0] - openings)),
        ("events and keys", (drags[:, 0] + keys) / sliders[:, 0]),
    ):
        print(f"{words}: drags take {statistics.median(share):.2f} of what sliders take")


if __name__ == "__main__":
    main()
