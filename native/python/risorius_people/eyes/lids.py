# SPDX-License-Identifier: MIT
"""Moves lids so that they touch the eyeball: neutral, in expressions, closed and half closed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..polygons import Floats, Ints
from . import eyeball
from .eyeball import IRIS, MM
from .rings import COLUMNS, LOWER, ROOT, TEMPLE, UPPER, smoothed

# Distances in mm from the eye's surface, positive outside, of the four rings of a lid's rim. From
# the lashes' roots inwards they are the skin's edge, the middle of the rim, the contact with the
# eye, and a ring hidden in the ball.
_HEIGHTS = np.array([1.35, 0.75, 0.22, -0.55])
_EDGE = slice(ROOT, ROOT + len(_HEIGHTS))
# Fractions of the rim's displacement by which the eight rings (OUTER) outside the rim move, the
# nearest first.
_FADE = np.array([0.85, 0.65, 0.45, 0.25, 0.1, 0.0, 0.0, 0.0])
# Fraction of the data's blink by which the skin around the lids moves. The lids' own fraction
# depends on how far the data's lids are shut, which the rest pose does not show.
_AROUND = 0.6
_STEPS = 10  # iterations that lay the rim on the eye
# mm by which a full look lifts the lids off the ball. Blend shapes move the lids straight and not
# round the ball, so without this distance they would be inside the ball at half of the look.
_LIFT = 0.38
# Degrees by which a look at 1 turns an eye, and factor on the data's motion of the lids. The eyes
# of the data turn by a third of these angles, and their lower lids stay still.
LOOKS = {"Up": (25.0, 1.9), "Down": (30.0, 1.5), "Left": (30.0, 1.8), "Right": (30.0, 1.8)}
_LOWER_LOOKS = {"Up": 1.2, "Down": -2.4}  # mm by which the lower lid rises in a look
_SKIN = 0.9  # mm: smallest distance of the skin around the rim from the eye
# Pairs of controls that together would push the lids into the eye.
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
WIDER = 0.75  # factor on the data's eyeWiden displacement, which starts with half-shut lids
# mm: offset of the ball to the front from the data's ball, and largest offset up or down
_FORWARD, _ASIDE = 1.5, 1.2
_RADIUS = 14.0  # mm: radius of the man's ball, for which the lengths above are given
_MOVES = 0.03 * MM  # decimetres: smaller displacements do not move the lids


def rotation(degrees: float, axis: int) -> Floats:
    """float64[3, 3]: a right-handed rotation about an axis, for column vectors.

    Args:
        degrees: angle of the rotation.
        axis: index of the axis: x (0), y (1) or z (2).
    """
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    out = np.eye(3)
    a, b = [(1, 2), (2, 0), (0, 1)][axis]
    out[a, a] = out[b, b] = c
    out[b, a], out[a, b] = s, -s
    return out


def look_rotation(way: str) -> Floats:
    """float64[3, 3]: rotation of an eye by a look at 1.

    Args:
        way: "Up", "Down", "Left" or "Right", from the character's point of view.
    """
    sign = 1 if way in ("Down", "Left") else -1
    return rotation(sign * LOOKS[way][0], 0 if way in ("Up", "Down") else 1)


@dataclass
class Lids:
    """The lids of one eye, and its ball.

    Attributes:
        side: "l" or "r".
        rings: int64[13, COLUMNS], vertices of the rings of skin around the eye: OUTER (8) rings
            outside the lashes' roots, the ring of the roots, and INNER (4) rings inside.
        openness: height of the upper lid above the middle of the ball, in radii of the iris.
        middle: float64[3], middle of the ball in decimetres.
        radius: radius of the ball in decimetres.
        raw: float64[V, 3], positions before the lids are opened.
        rest: float64[V, 3], positions after the lids are opened.
    """

    side: str
    rings: Ints
    openness: float
    middle: Floats
    radius: float
    raw: Floats
    rest: Floats

    def grid(self, values: Floats) -> Floats:
        """float64[13, COLUMNS, 3]: `values` at the vertices of the rings."""
        return np.asarray(values[self.rings])

    def seated(self, grid: Floats, turn: Floats | None = None, lift: float = 0.0) -> Floats:
        """float64[13, COLUMNS, 3]: a grid with its rim at the distances _HEIGHTS from the eye. The
        skin around the rim follows, and stays at least 0.9 mm (on the man) outside of the eye.

        Args:
            grid: float64[13, COLUMNS, 3], positions of the rings.
            turn: float64[3, 3], rotation of the eye from its rest pose; None: no rotation.
            lift: mm that are added to the distances _HEIGHTS, for the man's ball.
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
        # Skin around the rim must stay outside of the eye, too.
        arm = out[:ROOT] - self.middle
        length = np.linalg.norm(arm, axis=2)
        angle = np.arccos(np.clip(arm @ gaze / length, -1, 1))
        least = self.radius * (eyeball.surface(angle) + _SKIN / _RADIUS)
        out[:ROOT] += (np.maximum(least - length, 0) / length)[:, :, None] * arm
        return out

    def heights(self, grid: Floats, turn: Floats | None = None) -> Floats:
        """float64[4, COLUMNS]: distances of the rim's rings from the eye's surface in decimetres.

        Args:
            grid: float64[13, COLUMNS, 3], positions of the rings.
            turn: float64[3, 3], rotation of the eye from its rest pose; None: no rotation.
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
    """The middle and radius, in decimetres, of the ball that fits the data's lids.

    Args:
        positions: float64[V, 3] of a person, in decimetres.
        groups: name of a group of the base mesh -> vertex indices.
        rings: int64[13, COLUMNS], the rings of this eye.
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
    """Opens the lids of a person to their rest pose; `lids.rest` is changed.

    Args:
        lids: the lids, with the data's positions in `rest`.
        widen: float64[V, 3], the data's displacement that widens the eye.

    Returns:
        The multiple of `widen` that was added, float64[V, 3]; negative if the lids were too open.
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
    """float64[13, COLUMNS, 1]: how much a grid point belongs to the lower lid: 1 at the middle of
    the lid's rim, 0 at the eye's corners and on the cheek."""
    rows = np.ones(len(grid))
    rows[:ROOT] = np.linspace(0, 1, ROOT) ** 2
    columns = np.zeros(COLUMNS)
    columns[LOWER] = np.sin(np.pi * np.arange(1, 14) / 14)
    return np.asarray((rows[:, None] * columns)[:, :, None])


def _lower_closed(lids: Lids) -> Floats:
    """float64[13, COLUMNS, 3]: the grid with the lower lid as in a blink: the middle of its rim is
    0.7 mm higher and 0.7 mm nearer to the nose than in the rest pose."""
    grid = lids.grid(lids.rest)
    way = np.array([-0.7 * np.sign(lids.middle[0]), 0.7, 0.0]) * MM
    return np.asarray(grid + _lower_lid(grid) * way)


def following(lids: Lids, way: str, look: Floats) -> Floats:
    """float64[V, 3]: displacement of the lids in a look, larger than in the data because the eye
    rotates further.

    Args:
        lids: the lids in their rest pose.
        way: "Up", "Down", "Left" or "Right".
        look: float64[V, 3], the data's displacement of the look.
    """
    out = LOOKS[way][1] * look
    lower = _lower_lid(lids.rings)[:, :, 0] * _LOWER_LOOKS.get(way, 0.0) * MM
    out[lids.rings, 1] += lower * lids.radius / (_RADIUS * MM)
    return out


def closing(lids: Lids, blink: Floats) -> tuple[Floats, Floats]:
    """Two displacements from the rest pose that close the lids, float64[V, 3] each.

    The first lays both lids on one line: in each column of the grid, the data's displacement of the
    upper lid is scaled so that this lid ends at the lower lid. The second is the data's
    displacement, scaled by _AROUND everywhere. Outside the grid both are equal.

    Args:
        lids: the lids in their rest pose.
        blink: float64[V, 3], the data's displacement of the blink.
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
    rows = np.ones((len(closed), 1))
    rows[:ROOT, 0] = np.linspace(0, 1, ROOT) ** 2
    whole = before + (_AROUND + rows * (share - _AROUND))[:, :, None] * way
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
    closed[:, edge] += (_AROUND * (1 - rows))[:, :, None] * way[:, edge]
    closed[ROOT + 4, UPPER] = whole[ROOT + 4, UPPER]
    closed = lids.seated(closed)
    plain = _scaled(lids, blink)
    out = plain.copy()
    out[lids.rings] = closed - lids.grid(lids.rest)
    return out, plain


def _meeting(start: Floats, way: Floats, line: Floats) -> float:
    """The fraction of a displacement at which a point is as low as a line at the point's x.

    The fraction may exceed 1. It is 0 for a displacement without height.

    Args:
        start: float64[3], the point.
        way: float64[3], the displacement.
        line: float64[n, 3], points of the line.
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
    """float64[COLUMNS]: fractions by column, from 0.2 to 1.2 and smoothed.

    A column that is unknown, or not of the upper lid, gets the fraction of the nearest known column
    of the upper lid.

    Args:
        share: float64[COLUMNS], fractions.
        known: bool[COLUMNS], whether a fraction is known.
    """
    columns = np.arange(COLUMNS)
    held = known & (columns >= UPPER.start) & (columns < UPPER.stop)
    gaps = np.abs(columns[:, None] - columns[held])
    nearest = np.minimum(gaps, COLUMNS - gaps).argmin(axis=1)
    out = np.clip(share[held][nearest], 0.2, 1.2)
    return np.asarray((np.roll(out, 1) + 2 * out + np.roll(out, -1)) / 4)


def _scaled(lids: Lids, blink: Floats) -> Floats:
    """float64[V, 3]: the shortened blink from the rest pose, for skin outside the grid.

    The returned displacement also undoes the one that opened the lids to their rest pose.

    Args:
        lids: the lids in their rest pose.
        blink: float64[V, 3], the data's displacement.
    """
    same_side = np.sign(lids.raw[:, 0]) == np.sign(lids.middle[0])
    return _AROUND * blink - np.where(same_side[:, None], lids.rest - lids.raw, 0.0)


def between(lids: Lids, way: Floats) -> Floats:
    """float64[V, 3]: correction of half-closed lids, which would move straight through the ball.

    Args:
        lids: the lids in their rest pose.
        way: float64[V, 3], displacement that closes the lids.
    """
    half = lids.grid(lids.rest + way / 2)
    out = np.zeros_like(way)
    out[lids.rings] = lids.seated(half) - half
    return out


def on_the_ball(lids: Lids, way: Floats, turn: Floats | None = None) -> Floats:
    """float64[V, 3]: a displacement of the skin, corrected so that the lids touch the eye.

    A displacement that hardly moves the rims is returned unchanged if the eye does not rotate.

    Args:
        lids: the lids in their rest pose.
        way: float64[V, 3], the displacement.
        turn: float64[3, 3], rotation of the eye from its rest pose; None: no rotation.
    """
    grid = lids.grid(way)
    if turn is None and np.linalg.norm(grid[_EDGE], axis=2).max() < _MOVES:
        return way
    out = way.copy()
    lift = 0.0 if turn is None else _LIFT
    out[lids.rings] = lids.seated(lids.grid(lids.rest) + grid, turn, lift) - lids.grid(lids.rest)
    return out


def stays_closed(lids: Lids, blink: Floats, other: Floats, turn: Floats | None) -> Floats:
    """float64[V, 3]: displacement to add so that closed lids stay closed in a second expression.

    Args:
        lids: the lids in their rest pose.
        blink: float64[V, 3], displacement that closes the lids.
        other: float64[V, 3], displacement of the second expression.
        turn: float64[3, 3], rotation of the eye by the second expression; None: no rotation.
    """
    rows = np.ones(len(lids.rings))
    rows[:ROOT] = np.linspace(0, 1, ROOT)
    there = lids.grid(lids.rest + blink) + (1 - rows)[:, None, None] * lids.grid(other)
    out = np.zeros_like(blink)
    out[lids.rings] = lids.seated(there, turn, _LIFT) - lids.grid(lids.rest + blink + other)
    return out


def stays_on_the_ball(lids: Lids, one: Floats, other: Floats, turn: Floats | None) -> Floats:
    """float64[V, 3]: displacement to add if two controls together push the lids into the eye.

    Args:
        lids: the lids in their rest pose.
        one, other: float64[V, 3], displacement of each control.
        turn: float64[3, 3], rotation of the eye from its rest pose; None: no rotation.
    """
    both = one + other
    return on_the_ball(lids, both, turn) - both


def together(names: Mapping[str, object], side: str) -> list[tuple[str, str]]:
    """Pairs of raw controls that exist and together would push the lids into the eye.

    Args:
        names: mapping whose keys are raw controls.
        side: "L" or "R".
    """
    pairs = [(one + side, other + side) for one, other in _TOGETHER]
    return [pair for pair in pairs if all(name in names for name in pair)]


def partners(names: Mapping[str, object], side: str) -> list[str]:
    """Raw controls that exist and must not move closed lids.

    Args:
        names: mapping whose keys are raw controls.
        side: "L" or "R".
    """
    return [name + side for name in _NOT_CLOSED if name + side in names]
