# SPDX-License-Identifier: MIT
"""Lids that lie on the eye: at rest, in each expression, closed, and on the way between."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..polygons import Floats, Ints
from . import eyeball
from .eyeball import IRIS, MM
from .rings import COLUMNS, LOWER, ROOT, TEMPLE, UPPER, smoothed

# How far the rings from the lashes' roots to the inner rim lie above the eye, in mm: the skin's
# edge, the middle of the rim, where it touches, and what is hidden in the ball.
_HEIGHTS = np.array([1.35, 0.75, 0.22, -0.55])
_EDGE = slice(ROOT, ROOT + len(_HEIGHTS))
_FADE = np.array([0.85, 0.65, 0.45, 0.25, 0.1, 0.0, 0.0, 0.0])  # of the rings outside of it
_STEPS = 10
_LIFT = 0.38  # mm: what lids are higher in a whole look, since they do not go round in half of one
# Degrees that a look at 1 turns an eye, and how much further its lids go than the data's, whose
# eyes turn by a third of that and leave the lower lids where they are.
LOOKS = {"Up": (25.0, 1.9), "Down": (30.0, 1.5), "Left": (30.0, 1.8), "Right": (30.0, 1.8)}
_LOWER_LOOKS = {"Up": 1.2, "Down": -2.4}  # mm
_SKIN = 0.9  # mm over the eye, what is around the rim at least
# What pushes the lids into the eye where both of a pair do it.
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
WIDER = 0.75  # of the data's, which starts from lids that are half shut
_FORWARD, _ASIDE = 1.5, 1.2  # mm: the ball from the data's, and how far at most up or down
_RADIUS = 14.0  # mm: of the man's ball; sizes above are meant on it
_MOVES = 0.03 * MM  # decimetres: what moves lids less leaves them alone


def rotation(degrees: float, axis: int) -> Floats:
    """float64[3, 3]: a rotation.

    Args:
        degrees: by how much.
        axis: about x (0), y (1) or z (2).
    """
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    out = np.eye(3)
    a, b = [(1, 2), (2, 0), (0, 1)][axis]
    out[a, a] = out[b, b] = c
    out[b, a], out[a, b] = s, -s
    return out


def look_rotation(way: str) -> Floats:
    """float64[3, 3]: what a look at 1 turns an eye by.

    Args:
        way: "Up", "Down", "Left" or "Right", as the character has them.
    """
    sign = 1 if way in ("Down", "Left") else -1
    return rotation(sign * LOOKS[way][0], 0 if way in ("Up", "Down") else 1)


@dataclass
class Lids:
    """The lids of one eye and the ball that they lie on.

    Attributes:
        side: "l" or "r".
        rings: int64[13, COLUMNS], see find_rings.
        openness: how far the upper lid is above the middle, 1: at the iris' rim.
        middle: float64[3] of the ball, decimetres.
        radius: of the ball, decimetres.
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
        """float64[13, COLUMNS, 3]: values of the rings' vertices."""
        return np.asarray(values[self.rings])

    def seated(self, grid: Floats, turn: Floats | None = None, lift: float = 0.0) -> Floats:
        """A grid whose rim lies on the eye, what is around it drawn along.

        Args:
            grid: float64[13, COLUMNS, 3].
            turn: float64[3, 3], what the eye is turned by; None: it rests.
            lift: mm, how much higher than at rest.
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
        # Skin that is pushed up below the rim lies over the eye as well.
        arm = out[:ROOT] - self.middle
        length = np.linalg.norm(arm, axis=2)
        angle = np.arccos(np.clip(arm @ gaze / length, -1, 1))
        least = self.radius * (eyeball.surface(angle) + _SKIN / _RADIUS)
        out[:ROOT] += (np.maximum(least - length, 0) / length)[:, :, None] * arm
        return out

    def heights(self, grid: Floats, turn: Floats | None = None) -> Floats:
        """float64[4, COLUMNS]: how far the rim's rings are above the eye, decimetres.

        Args:
            grid: float64[13, COLUMNS, 3].
            turn: float64[3, 3], what the eye is turned by; None: it rests.
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
    """Middle and radius of the ball that the lids of the data fit.

    Args:
        positions: float64[V, 3] of a person, decimetres.
        groups: vertex indices by group of the base mesh.
        rings: of this eye.
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
    """Bring the lids of a person to where they rest: `rest` of them is changed.

    Args:
        lids: `rest` as the data have it.
        widen: float64[V, 3], what opens the upper lid further, of the data.

    Returns:
        float64[V, 3], how much of it was taken.
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
    """float64[13, COLUMNS, 1]: 1 in the middle of the lower lid's rim, 0 at corners and cheek."""
    rows = np.ones(len(grid))
    rows[:ROOT] = np.linspace(0, 1, ROOT) ** 2
    columns = np.zeros(COLUMNS)
    columns[LOWER] = np.sin(np.pi * np.arange(1, 14) / 14)
    return np.asarray((rows[:, None] * columns)[:, :, None])


def _lower_closed(lids: Lids) -> Floats:
    """float64[13, COLUMNS, 3]: the grid with its lower lid where it meets the upper one."""
    grid = lids.grid(lids.rest)
    way = np.array([-0.7 * np.sign(lids.middle[0]), 0.7, 0.0]) * MM
    return np.asarray(grid + _lower_lid(grid) * way)


def following(lids: Lids, way: str, look: Floats) -> Floats:
    """float64[V, 3]: what the lids do when the eye looks further than in the data.

    Args:
        lids: at rest.
        way: "Up", "Down", "Left" or "Right".
        look: float64[V, 3], of the data.
    """
    out = LOOKS[way][1] * look
    lower = _lower_lid(lids.rings)[:, :, 0] * _LOWER_LOOKS.get(way, 0.0) * MM
    out[lids.rings, 1] += lower * lids.radius / (_RADIUS * MM)
    return out


def closing(lids: Lids, blink: Floats) -> tuple[Floats, Floats]:
    """float64[V, 3]: what closes the lids to one line, from where they rest; and without the line.

    The data's way is kept, but shortened: it leads the upper lid past the lower one.

    Args:
        lids: at rest.
        blink: float64[V, 3], the way of the data from where their lids are.
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
    """The share of a way after which it is as low as a line at its x.

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
    """Shares by column: the unknown ones are those of the nearest known column, then smoothed.

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
    """float64[V, 3]: the way of the skin that is not of the grid, without what opened it.

    Args:
        lids: at rest.
        blink: float64[V, 3], of the data.
        share: float64[COLUMNS], how much of it.
    """
    out = np.zeros_like(blink)
    moved = np.flatnonzero(np.abs(blink).max(axis=1) > 1e-7)
    ring = lids.raw[lids.rings[0]]
    near = np.linalg.norm(lids.raw[moved][:, None] - ring[None], axis=2).argmin(axis=1)
    out[moved] = share[near][:, None] * blink[moved]
    same_side = np.sign(lids.raw[:, 0]) == np.sign(lids.middle[0])
    return out - np.where(same_side[:, None], lids.rest - lids.raw, 0.0)


def between(lids: Lids, way: Floats) -> Floats:
    """float64[V, 3]: what half-closed lids lack, who go straight and not round the ball.

    Args:
        lids: at rest.
        way: float64[V, 3], of lids that close.
    """
    half = lids.grid(lids.rest + way / 2)
    out = np.zeros_like(way)
    out[lids.rings] = lids.seated(half) - half
    return out


def on_the_ball(lids: Lids, way: Floats, turn: Floats | None = None) -> Floats:
    """float64[V, 3]: a way of the skin whose lids stay on the eye.

    Args:
        lids: at rest.
        way: float64[V, 3].
        turn: float64[3, 3], what the eye is turned by; None: it rests.
    """
    grid = lids.grid(way)
    if turn is None and np.linalg.norm(grid[_EDGE], axis=2).max() < _MOVES:
        return way
    out = way.copy()
    lift = 0.0 if turn is None else _LIFT
    out[lids.rings] = lids.seated(lids.grid(lids.rest) + grid, turn, lift) - lids.grid(lids.rest)
    return out


def stays_closed(lids: Lids, blink: Floats, other: Floats, turn: Floats | None) -> Floats:
    """float64[V, 3]: what to add where lids are closed and do something else too.

    Args:
        lids: at rest.
        blink: float64[V, 3], what closes them.
        other: float64[V, 3], what they do too.
        turn: float64[3, 3], what the eye is turned by meanwhile; None: it rests.
    """
    rows = np.ones(len(lids.rings))
    rows[:ROOT] = np.linspace(0, 1, ROOT)
    there = lids.grid(lids.rest + blink) + (1 - rows)[:, None, None] * lids.grid(other)
    out = np.zeros_like(blink)
    out[lids.rings] = lids.seated(there, turn, _LIFT) - lids.grid(lids.rest + blink + other)
    return out


def stays_on_the_ball(lids: Lids, one: Floats, other: Floats, turn: Floats | None) -> Floats:
    """float64[V, 3]: what to add where two controls push the lids at once, into the eye.

    Args:
        lids: at rest.
        one, other: float64[V, 3], what each does alone.
        turn: float64[3, 3], what the eye is turned by meanwhile; None: it rests.
    """
    both = one + other
    return on_the_ball(lids, both, turn) - both


def together(names: Mapping[str, object], side: str) -> list[tuple[str, str]]:
    """Pairs of raw controls that push the lids into the eye, of those that there are.

    Args:
        names: raw controls.
        side: "L" or "R".
    """
    pairs = [(one + side, other + side) for one, other in _TOGETHER]
    return [pair for pair in pairs if all(name in names for name in pair)]


def partners(names: Mapping[str, object], side: str) -> list[str]:
    """Raw controls that closed lids do not follow, of those that there are.

    Args:
        names: raw controls.
        side: "L" or "R".
    """
    return [name + side for name in _NOT_CLOSED if name + side in names]
