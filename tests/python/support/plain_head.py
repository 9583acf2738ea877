# SPDX-License-Identifier: MIT
"""Makes a simple face by formulas: a mask with two eyes and lids, a mouth and teeth, in cm.

Its expressions have the faults of a bad transfer: lids and lips that do not close completely.
"""

from dataclasses import dataclass, field

import numpy as np
from risorius.author.heads.parts import HeadPart
from risorius.author.input.obj import ObjMesh

EYE, RADIUS = np.array([3.2, 2.0, 7.2]), 1.2  # centre and radius of the left eye
MOUTH, HALF = -4.0, 2.4  # height of the mouth, and half of its width
STEP = 0.2
TOGETHER = tuple(f"mouthLipsTogether{lip}" for lip in ("UL", "UR", "DL", "DR"))


@dataclass
class PlainHead:
    points: np.ndarray
    faces: list
    ways: dict = field(default_factory=dict)  # control -> float64[V, 3]
    closed: np.ndarray | None = None  # motion of the open jaw with closed lips


def mask(short=0.3, apart=0.2, *, painted=False):
    """Make the skin and its expressions.

    Args:
        short: how much a blink falls short of closing the lids: it moves the upper lid by
            (1.9 - short) times half the height of the eye opening, whereas 2 would close it.
        apart: distance in cm between lips that should meet.
        painted: True: the skin has no eye openings.
    """
    x, y = np.arange(-8, 8 + STEP / 2, STEP), np.arange(-9, 8 + STEP / 2, STEP)
    grid_x, grid_y = (g.ravel().copy() for g in np.meshgrid(x, y, indexing="ij"))
    hole = np.ones(len(grid_x), bool)
    for side in (1, -1):
        away = np.hypot((grid_x - side * EYE[0]) / 1.05, (grid_y - EYE[1]) / 0.5)
        near = (away > 0.7) & (away < 1.35)  # the rim is at the edge of the opening
        scale = np.where(near, 1 / np.maximum(away, 1e-9), 1.0)
        grid_x = side * EYE[0] + (grid_x - side * EYE[0]) * scale
        grid_y = EYE[1] + (grid_y - EYE[1]) * scale
        hole &= painted | (away >= 0.7)
    points = np.stack([grid_x, grid_y, 9 - grid_x**2 / 14 - grid_y**2 / 40], axis=1)
    for side in (1, -1):
        points = _over_eye(points, side)
    rows = len(y)
    quads = [
        [i * rows + j, (i + 1) * rows + j, (i + 1) * rows + j + 1, i * rows + j + 1]
        for i in range(len(x) - 1)
        for j in range(rows - 1)
    ]
    faces = [quad for quad in quads if hole[quad].all()]
    points, faces, lower = _slit(points, faces)
    head = PlainHead(points, faces)
    _blinks(head, short)
    _mouth(head, lower, apart)
    return head


def _over_eye(points, side):
    """The points, of which those in front of an eye are moved to at least 0.6 mm outside of it."""
    middle = EYE * [side, 1, 1]
    flat = points[:, :2] - middle[:2]
    inside = np.maximum((1.05 * RADIUS) ** 2 - (flat**2).sum(axis=1), 0)
    out = points.copy()
    out[:, 2] = np.maximum(points[:, 2], np.where(inside > 0, middle[2] + np.sqrt(inside), -99))
    return out


def _slit(points, faces):
    """Cut the skin along the mouth: polygons below the cut get copies of the vertices on it."""
    line = np.flatnonzero(
        (np.abs(points[:, 1] - MOUTH) < STEP / 4) & (np.abs(points[:, 0]) < HALF - STEP / 2)
    )
    second = dict(zip(line.tolist(), range(len(points), len(points) + len(line)), strict=True))
    below = points[:, 1] < MOUTH + STEP / 4
    out = [[second.get(v, v) for v in face] if below[face].all() else face for face in faces]
    both = np.concatenate([points, points[line]])
    lower = np.concatenate([points[:, 1] < MOUTH - STEP / 4, np.ones(len(line), bool)])
    return both, out, lower


def _blinks(head, short):
    for side, letter in ((1, "L"), (-1, "R")):
        middle = EYE * [side, 1, 1]
        arm = head.points - middle
        flat = np.hypot(arm[:, 1], arm[:, 2])
        angle = np.arctan2(arm[:, 1], arm[:, 2])
        opened = 0.5 / RADIUS * np.sqrt(np.maximum(1 - (arm[:, 0] / 1.05) ** 2, 0))
        share = np.clip(1 - (np.abs(arm[:, 1]) - 0.5) / 1.2, 0, 1)
        near = (np.linalg.norm(arm, axis=1) < 2.4) & (np.abs(arm[:, 0]) < 1.05)
        up = (arm[:, 1] > 0) & near
        turned = angle - np.where(up, (1.9 - short) * opened * share, 0)
        moved = np.stack([arm[:, 0], flat * np.sin(turned), flat * np.cos(turned)], axis=1)
        head.ways[f"eyeBlink{letter}"] = np.where(up[:, None], moved - arm, 0.0)


def _mouth(head, lower, apart):
    points = head.points
    away = np.abs(points[:, 1] - MOUTH)
    wide = np.clip(1 - (np.abs(points[:, 0]) / HALF) ** 2, 0, 1)
    near = np.clip(1 - away / 1.4, 0, 1) * wide
    down = np.where(lower, np.clip(1.2 - 0.05 * away, 0, 1) * np.sqrt(wide), 0.0)
    down = np.where(lower & (np.abs(points[:, 0]) >= HALF - STEP), 0.0, down)
    head.ways["jawOpen"] = np.outer(down, [0.0, -2.0, -0.5])
    for name, own in (("UL", ~lower), ("DL", lower)):
        head.ways[f"mouthFunnel{name}"] = np.outer(np.where(own, near, 0), [0.0, 0.0, 0.4])
    closed = head.ways["jawOpen"].copy()
    lip = np.clip(1 - away / 1.4, 0, 1)
    closed += np.outer(np.where(lower, lip * down, 0), [0.0, 2.0 - apart, 0.5])
    head.closed = closed


def part(name, points, faces):
    return HeadPart(
        name, ObjMesh(np.asarray(points, float), np.zeros((0, 2)), faces, [[] for _ in faces]),
        {}, None, name,
    )  # fmt: skip


def ball(middle, radius, rings=14, around=18):
    """Points and polygons of a sphere whose poles are in front and behind."""
    t = np.linspace(0, np.pi, rings + 1)[1:-1]
    a = np.linspace(0, 2 * np.pi, around, endpoint=False)
    ring = np.stack(
        [np.outer(np.sin(t), np.cos(a)), np.outer(np.sin(t), np.sin(a)),
         np.outer(np.cos(t), np.ones(around))], axis=2,
    ).reshape(-1, 3)  # fmt: skip
    points = np.concatenate([ring, [[0, 0, 1], [0, 0, -1]]])
    faces = []
    for k in range(around):
        n = (k + 1) % around
        faces.append([len(ring), k, n])
        faces.append([len(ring) + 1, (rings - 2) * around + n, (rings - 2) * around + k])
        faces += [
            [i * around + k, (i + 1) * around + k, (i + 1) * around + n, i * around + n]
            for i in range(rings - 2)
        ]
    return np.asarray(middle) + radius * points, faces


def arch(height, sign, depth=7.0):
    """A row of teeth as a closed, bent box; it extends from `height` up (sign 1) or down (-1)."""
    a = np.linspace(-1.2, 1.2, 13)
    rows = []
    for radius, y in ((2.2, 0), (2.2, 0.8), (1.7, 0.8), (1.7, 0)):
        rows.append(
            np.stack([radius * np.sin(a), np.full(13, height + sign * y), depth - 2.2
                      + radius * np.cos(a)], axis=1)
        )  # fmt: skip
    points = np.concatenate(rows)
    order = 1 if sign > 0 else -1
    faces = [
        [r * 13 + k, r * 13 + k + 1, s * 13 + k + 1, s * 13 + k][::order]
        for r, s in ((0, 1), (1, 2), (2, 3), (3, 0))
        for k in range(12)
    ]
    faces += [[0, 13, 26, 39][::order], [12, 51, 38, 25][::order]]
    return points, faces


def eyes_and_teeth(named=True):
    """HeadParts of two eyeballs and two rows of teeth; names tell their kind only if `named`."""
    out = []
    for side, word in ((1, "Left"), (-1, "Right")):
        out.append(
            part(f"eye{word}" if named else f"mesh{word}", *ball(EYE * [side, 1, 1], RADIUS))
        )
    out.append(part("teethUpper" if named else "a1", *arch(MOUTH + 0.05, 1)))
    out.append(part("teethLower" if named else "a2", *arch(MOUTH - 0.05, -1)))
    return out
