# SPDX-License-Identifier: MIT
"""Lids that lie on the eye: at rest, in each expression, closed and half closed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..polygons import Floats, Ints
from . import eyeball
from .eyeball import IRIS, MM
from .rings import COLUMNS, LOWER, ROOT, TEMPLE, UPPER, smoothed

# Heights above the eye of the rings from the lashes' roots to the inner rim, mm: the skin's edge,
# the middle of the rim, the contact with the eye, and the ring hidden in the ball.
_HEIGHTS = np.array([1.35, 0.75, 0.22, -0.55])
_EDGE = slice(ROOT, ROOT + len(_HEIGHTS))
# weights of the rings outside the rim.
_FADE = np.array([0.85, 0.65, 0.45, 0.25, 0.1, 0.0, 0.0, 0.0])
_STEPS = 10
_LIFT = 0.38  # mm that lids rise in a full look: half a look does not carry them round the ball
# Degrees that a look at 1 turns an eye, and the factor on the data's lid motion. The data's eyes
# turn by a third of that and leave the lower lids still.
LOOKS = {"Up": (25.0, 1.9), "Down": (30.0, 1.5), "Left": (30.0, 1.8), "Right": (30.0, 1.8)}
_LOWER_LOOKS = {"Up": 1.2, "Down": -2.4}  # mm
_SKIN = 0.9  # mm, smallest height of the skin around the rim above the eye
# Pairs of controls that together push the lids into the eye.
_TOGETHER = (
    ("eyeCheekRaise", "eyeSquintInner"),
    ("eyeCheekRaise", "eyeLookDown"),
    ("eyeCheekRaise", "eyeLookUp"),
    ("eyeSquintInner", "eyeLookDown"),
)
# Expressions that do not move the lids of a closed eye.
_NOT_CLOSED = [
    *(f"eyeLook{way}" for way in LOOKS),
    "eyeSquintInner",
    "eyeCheekRaise",
    "eyeUpperLidUp",
]
WIDER = 0.75  # factor on the data's displacement, which starts from half-shut lids
_FORWARD, _ASIDE = 1.5, 1.2  # mm: offset from the data's ball, and its largest offset up or down
_RADIUS = 14.0  # mm, radius of the man's ball; the sizes above refer to it
_MOVES = 0.03 * MM  # decimetres: displacements below this leave the lids alone


def rotation(degrees: float, axis: int) -> Floats:
    """float64[3, 3]: a rotation.

    Args:
        degrees: the angle.
        axis: rotation axis: x (0), y (1) or z (2).
    """
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    out = np.eye(3)
    a, b = [(1, 2), (2, 0), (0, 1)][axis]
    out[a, a] = out[b, b] = c
    out[b, a], out[a, b] = s, -s
    return out


def look_rotation(way: str) -> Floats:
    """Rotation of an eye by a look at 1, float64[3, 3].

    Args:
        way: "Up", "Down", "Left" or "Right", from the character's point of view.
    """
    sign = 1 if way in ("Down", "Left") else -1
    return rotation(sign * LOOKS[way][0], 0 if way in ("Up", "Down") else 1)


@dataclass
class Lids:
    """The lids of one eye and its ball.

    Attributes:
        side: "l" or "r".
        rings: int64[13, COLUMNS], see find_rings.
        openness: height of the upper lid above the ball's middle, in radii of the iris.
        middle: float64[3], middle of the ball, decimetres.
        radius: radius of the ball, decimetres.
        raw: float64[V, 3], the positions before the lids were opened.
        rest: float64[V, 3], the positions after it.
    """

    side: str
    rings: Ints
    openness: float
    middle: Floats
    radius: float
    raw: Floats
    rest: Floats

    def grid(self, values: Floats) -> Floats:
        """Values of the rings' vertices, float64[13, COLUMNS, 3]."""
        return np.asarray(values[self.rings])

    def seated(self, grid: Floats, turn: Floats | None = None, lift: float = 0.0) -> Floats:
        """A grid with its rim laid on the eye; the skin around the rim follows.

        Args:
            grid: float64[13, COLUMNS, 3].
            turn: float64[3, 3], rotation of the eye; None: the eye is at rest.
            lift: mm above the rest height.
        """
        gaze = eyeball.gaze(self.side)[:, 2]
        gaze = gaze if turn is None else turn @ gaze
        out = grid.copy()
        heights = ((_HEIGHTS + lift) * self.radius / _RADIUS)[:, None]
        for _ in range(_STEPS):
            arm = smoothed(out) - self.middle
            length = np.linalg.norm(arm, axis=2)
            ray = arm / length[:, :, None]
            angle = np.arccos(np.clip(ray @ gaze, -1, 1))[_EDGE]
            lack = self.radius * eyeball.surface(angle) + heights - length[_EDGE]
            out[_EDGE] += lack[:, :, None] * ray[_EDGE]
            drawn = _FADE[::-1, None] * lack[0]
            out[:ROOT] += drawn[:, :, None] * ray[:ROOT]
        # Skin below the rim that is pushed up must lie over the eye too.
        arm = out[:ROOT] - self.middle
        length = np.linalg.norm(arm, axis=2)
        angle = np.arccos(np.clip(arm @ gaze / length, -1, 1))
        least = self.radius * (eyeball.surface(angle) + _SKIN / _RADIUS)
        out[:ROOT] += (np.maximum(least - length, 0) / length)[:, :, None] * arm
        return out

    def heights(self, grid: Floats, turn: Floats | None = None) -> Floats:
        """Heights of the rim's rings above the eye, float64[4, COLUMNS], decimetres.

        Args:
            grid: float64[13, COLUMNS, 3].
            turn: float64[3, 3], rotation of the eye; None: the eye is at rest.
        """
        gaze = eyeball.gaze(self.side)[:, 2]
        gaze = gaze if turn is None else turn @ gaze
        arm = smoothed(grid)[_EDGE] - self.middle
        length = np.linalg.norm(arm, axis=2)
        angle = np.arccos(np.clip(arm @ gaze / length, -1, 1))
        return np.asarray(length - self.radius * eyeball.surface(angle))


def place_ball(
    positions: Floats, groups: dict[str, Ints], rings: Ints, side: str
) -> tuple[Floats, float]:
    """Middle and radius of the ball that fits the lids of the data.

    Args:
        positions: float64[V, 3] of a person, decimetres.
        groups: vertex indices by group of the base mesh.
        rings: the rings of this eye.
        side: "l" or "r".
    """
    ball = groups[f"helper-{side}-eye"]
    middle = positions[ball].mean(axis=0)
    touching = smoothed(positions[rings])[ROOT + 2]
    size = np.median(np.linalg.norm(touching - middle, axis=1)) / (15.4 * MM)
    middle = middle + np.array([0, 0, _FORWARD * MM * size])
    radius = float(np.median(np.linalg.norm(touching - middle, axis=1)))
    low = touching[LOWER, 1].min() - (middle[1] - 0.98 * IRIS * radius)
    middle[1] += np.clip(low / 2, -_ASIDE * MM, _ASIDE * MM)
    return middle, radius


def open_lids(lids: Lids, widen: Floats) -> Floats:
    """Open the lids of a person to their rest pose; changes `rest`.

    Args:
        lids: `rest` is as in the data.
        widen: float64[V, 3], displacement of the data that widens the eye.

    Returns:
        The applied share of `widen`, float64[V, 3].
    """
    iris = IRIS * lids.radius
    edge = smoothed(lids.grid(lids.rest))[ROOT + 2] - lids.middle
    travel = smoothed(lids.grid(widen))[ROOT + 2, UPPER, 1]
    top = int(edge[UPPER, 1].argmax())
    share = (lids.openness * iris - edge[UPPER, 1][top]) / travel[top]
    opened = max(share, -0.4) * widen
    lids.rest += opened
    grid = lids.grid(lids.rest)
    down = -0.98 * iris - edge[LOWER, 1].min()
    arm = grid - lids.middle
    turn = down / np.hypot(arm[:, :, 1], arm[:, :, 2]) * _lower_lid(grid)[:, :, 0]
    grid[:, :, 1] += turn * arm[:, :, 2]
    grid[:, :, 2] -= turn * arm[:, :, 1]
    lids.rest[lids.rings] = lids.seated(grid)
    return np.asarray(opened)


def _lower_lid(grid: Floats) -> Floats:
    """Weight of the lower lid, float64[13, COLUMNS, 1]: 1 at the rim's middle, 0 at corners and
    cheek."""
    rows = np.ones(len(grid))
    rows[:ROOT] = np.linspace(0, 1, ROOT) ** 2
    columns = np.zeros(COLUMNS)
    columns[LOWER] = np.sin(np.pi * np.arange(1, 14) / 14)
    return np.asarray((rows[:, None] * columns)[:, :, None])


def _lower_closed(lids: Lids) -> Floats:
    """The grid with the lower lid raised to where it meets the upper lid, float64[13, COLUMNS,
    3]."""
    grid = lids.grid(lids.rest)
    way = np.array([-0.7 * np.sign(lids.middle[0]), 0.7, 0.0]) * MM
    return np.asarray(grid + _lower_lid(grid) * way)


def following(lids: Lids, way: str, look: Floats) -> Floats:
    """Displacement of the lids when the eye looks further than in the data, float64[V, 3].

    Args:
        lids: at rest.
        way: "Up", "Down", "Left" or "Right".
        look: float64[V, 3], the data's look.
    """
    out = LOOKS[way][1] * look
    lower = _lower_lid(lids.rings)[:, :, 0] * _LOWER_LOOKS.get(way, 0.0) * MM
    out[lids.rings, 1] += lower * lids.radius / (_RADIUS * MM)
    return out


def closing(lids: Lids, blink: Floats) -> tuple[Floats, Floats]:
    """Displacement from rest that closes the lids to one line, and the same without the line.

    Both are float64[V, 3]. The data's displacement is shortened: whole, it moves the upper lid past
    the lower lid.

    Args:
        lids: at rest.
        blink: float64[V, 3], displacement of the data from the data's lids.
    """
    closed = _lower_closed(lids)
    before, way = lids.grid(lids.raw), lids.grid(blink)
    edge = np.append(np.arange(LOWER.start, LOWER.stop), [0, TEMPLE])
    share = np.zeros(COLUMNS)
    for column in range(UPPER.start, UPPER.stop):
        share[column] = _meeting(
            before[ROOT + 2, column], way[ROOT + 2, column], closed[ROOT + 2, edge]
        )
    share = _even(share, np.abs(way[ROOT + 2, :, 1]) > 2 * MM)
    whole = before + share[:, None] * way
    for row in range(ROOT, ROOT + 4):
        x = whole[row, UPPER, 0]
        line = closed[row, edge]
        line = line[line[:, 0].argsort()]
        for axis in (1, 2):
            closed[row, UPPER, axis] = np.interp(x, line[:, 0], line[:, axis])
        closed[row, UPPER, 0] = x
    off = closed[ROOT, UPPER] - whole[ROOT, UPPER]
    outer = whole[:ROOT, UPPER] + _FADE[::-1, None, None] * off
    closed[:ROOT, UPPER] = outer
    closed[ROOT + 4, UPPER] = whole[ROOT + 4, UPPER]
    closed = lids.seated(closed)
    plain = _scaled(lids, blink, share)
    out = plain.copy()
    out[lids.rings] = closed - lids.grid(lids.rest)
    return out, plain


def _meeting(start: Floats, way: Floats, line: Floats) -> float:
    """The share of a displacement at which a point is as low as a line at its x.

    Args:
        start: float64[3].
        way: float64[3].
        line: float64[n, 3].
    """
    line = line[line[:, 0].argsort()]
    if abs(way[1]) < 1e-6:
        return 0.0
    share = 0.6
    for _ in range(8):
        height = np.interp(start[0] + share * way[0], line[:, 0], line[:, 1])
        share = float((height - start[1]) / way[1])
    return share


def _even(share: Floats, known: Floats) -> Floats:
    """Shares by column: unknown columns get the nearest known share, then all are smoothed.

    Args:
        share: float64[COLUMNS].
        known: bool[COLUMNS].
    """
    columns = np.arange(COLUMNS)
    held = known & (columns >= UPPER.start) & (columns < UPPER.stop)
    gaps = np.abs(columns[:, None] - columns[held])
    nearest = np.minimum(gaps, COLUMNS - gaps).argmin(axis=1)
    out = np.clip(share[held][nearest], 0.2, 1.2)
    return np.asarray((np.roll(out, 1) + 2 * out + np.roll(out, -1)) / 4)


def _scaled(lids: Lids, blink: Floats, share: Floats) -> Floats:
    """Displacement of the skin outside the grid, without the part that opened it, float64[V, 3].

    Args:
        lids: at rest.
        blink: float64[V, 3], displacement of the data.
        share: float64[COLUMNS], the share of `blink` to use.
    """
    out = np.zeros_like(blink)
    moved = np.flatnonzero(np.abs(blink).max(axis=1) > 1e-7)
    ring = lids.raw[lids.rings[0]]
    near = np.linalg.norm(lids.raw[moved][:, None] - ring[None], axis=2).argmin(axis=1)
    out[moved] = share[near][:, None] * blink[moved]
    same_side = np.sign(lids.raw[:, 0]) == np.sign(lids.middle[0])
    return out - np.where(same_side[:, None], lids.rest - lids.raw, 0.0)


def between(lids: Lids, way: Floats) -> Floats:
    """Displacement for half-closed lids, which move straight instead of round the ball, float64[V,
    3].

    Args:
        lids: at rest.
        way: float64[V, 3], displacement that closes the lids.
    """
    half = lids.grid(lids.rest + way / 2)
    out = np.zeros_like(way)
    out[lids.rings] = lids.seated(half) - half
    return out


def on_the_ball(lids: Lids, way: Floats, turn: Floats | None = None) -> Floats:
    """A displacement of the skin with its lids laid on the eye, float64[V, 3].

    Args:
        lids: at rest.
        way: float64[V, 3].
        turn: float64[3, 3], rotation of the eye; None: the eye is at rest.
    """
    grid = lids.grid(way)
    if turn is None and np.linalg.norm(grid[_EDGE], axis=2).max() < _MOVES:
        return way
    out = way.copy()
    lift = 0.0 if turn is None else _LIFT
    out[lids.rings] = lids.seated(lids.grid(lids.rest) + grid, turn, lift) - lids.grid(lids.rest)
    return out


def stays_closed(lids: Lids, blink: Floats, other: Floats, turn: Floats | None) -> Floats:
    """Displacement to add when closed lids get a second expression, float64[V, 3].

    Args:
        lids: at rest.
        blink: float64[V, 3], displacement that closes the lids.
        other: float64[V, 3], displacement of the second expression.
        turn: float64[3, 3], rotation of the eye by the second expression; None: the eye is at rest.
    """
    rows = np.ones(len(lids.rings))
    rows[:ROOT] = np.linspace(0, 1, ROOT)
    there = lids.grid(lids.rest + blink) + (1 - rows)[:, None, None] * lids.grid(other)
    out = np.zeros_like(blink)
    out[lids.rings] = lids.seated(there, turn, _LIFT) - lids.grid(lids.rest + blink + other)
    return out


def stays_on_the_ball(lids: Lids, one: Floats, other: Floats, turn: Floats | None) -> Floats:
    """Displacement to add when two controls together push the lids into the eye, float64[V, 3].

    Args:
        lids: at rest.
        one, other: float64[V, 3], displacement of each control.
        turn: float64[3, 3], rotation of the eye; None: the eye is at rest.
    """
    both = one + other
    return on_the_ball(lids, both, turn) - both


def together(names: Mapping[str, object], side: str) -> list[tuple[str, str]]:
    """Pairs of existing raw controls that together push the lids into the eye.

    Args:
        names: raw controls.
        side: "L" or "R".
    """
    pairs = [(one + side, other + side) for one, other in _TOGETHER]
    return [pair for pair in pairs if all(name in names for name in pair)]


def partners(names: Mapping[str, object], side: str) -> list[str]:
    """Existing raw controls that must leave closed lids still.

    Args:
        names: raw controls.
        side: "L" or "R".
    """
    return [name + side for name in _NOT_CLOSED if name + side in names]
