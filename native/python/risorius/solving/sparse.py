# SPDX-License-Identifier: MIT
"""Finds the cheapest sparse change for a task: which controls a drag moves, and which stay.

Basis pursuit with bounds, by the path of the lasso: M. R. Osborne, B. Presnell and B. A. Turlach,
"A new approach to variable selection in least squares problems", IMA Journal of Numerical Analysis
20 (3), 2000. The cheapest change is a continuous function of the target, so that a stroke does not
jump from one set of sliders to another, and it has at most about as many sliders as rows.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from .surface import Doubles

_REST, _MOVES, _BOUND = 0, 1, 2
_MOST_STEPS = 600
_MOST_MORE = 60  # steps of a path to a given distance; the result of a longer path is not cheap
_END = 1e-6  # of the first price: the path ends here
_FAR = 0.1  # of the whole way: a target that stays farther away is out of reach
_LITTLE = 0.1  # of the possible gain: may be given up there to use fewer controls
_CALM = 0.12  # of the first price: below it controls hardly help with such a target
_LEVEL = 1e-9  # a smaller difference of slopes counts as none


@dataclass
class _Path:
    """The path from no change to the nearest point, by a falling price per unit of change.

    All values are scaled so that each price is 1.
    """

    a: Doubles  # [m, n]
    missing: Doubles  # [m]
    low: Doubles  # [n], at most 0
    high: Doubles  # [n], at least 0
    x: Doubles = field(init=False)
    state: npt.NDArray[np.int64] = field(init=False)
    sign: Doubles = field(init=False)
    pull: Doubles = field(init=False)
    price: float = field(init=False)
    left: int = -1  # came to rest in the last step

    def __post_init__(self) -> None:
        count = self.a.shape[1]
        self.x, self.sign = np.zeros(count), np.zeros(count)
        self.state = np.zeros(count, np.int64)
        self.pull = self.a.T @ self.missing
        self.price = float(self._wish().max(initial=0.0))

    def _wish(self) -> Doubles:
        """float64[n]: the pull on each resting unknown that has room in that direction."""
        room = np.where(self.pull > 0, self.high > 0, self.low < 0) & (self.state == _REST)
        return np.where(room, np.abs(self.pull), 0.0)

    def step(self, end: float) -> int:
        """Follow the path until an unknown begins to move, stops, or leaves a bound.

        Args:
            end: the price at which to end.

        Returns:
            The unknown that began to move from rest, or -1.
        """
        if not (self.state == _MOVES).any():
            wish = self._wish()
            self.price = min(self.price, float(wish.max(initial=0.0)))
            if self.price > end:
                self._begin(int(np.argmax(wish)))
            return int(np.argmax(wish)) if self.price > end else -1
        moving = np.flatnonzero(self.state == _MOVES)
        columns = self.a[:, moving]
        rate = np.zeros(len(self.x))
        rate[moving] = np.linalg.lstsq(columns.T @ columns, self.sign[moving], rcond=1e-12)[0]
        way = columns @ rate[moving]
        slope = self.a.T @ way
        stop, when = self._stops(rate)
        begin, sign = self._begins(slope)
        when = np.minimum(np.minimum(when, begin), self._moves_again(slope))
        which = int(np.argmin(when))
        share = max(0.0, min(float(when[which]), self.price - end))
        self.x += share * rate
        self.missing = self.missing - share * way
        self.pull = self.pull - share * slope
        self.price -= share
        self.left = -1
        if when[which] > share:
            return -1
        return self._turn(which, stop, sign)

    def _turn(self, which: int, stop: Doubles, sign: Doubles) -> int:
        was = self.state[which]
        if was == _MOVES:
            self.x[which] = stop[which]
            self.state[which] = _REST if stop[which] == 0 else _BOUND
            self.left = which
            return -1
        self.state[which] = _MOVES
        if was == _REST:
            self.sign[which] = sign[which]
        return which if was == _REST else -1

    def _begin(self, which: int) -> None:
        self.state[which], self.sign[which] = _MOVES, np.sign(self.pull[which])

    def _stops(self, rate: Doubles) -> tuple[Doubles, Doubles]:
        """Where each moving unknown stops, and after which decrease of the price."""
        stop = np.where(rate > 0, self.high, self.low)
        back = (self.x * rate < 0) | ((self.x == 0) & (rate * self.sign < 0))
        stop = np.where(back, 0.0, stop)
        there = (self.state == _MOVES) & (rate != 0)
        when = np.divide(stop - self.x, rate, out=np.full(len(rate), np.inf), where=there)
        return stop, when

    def _begins(self, slope: Doubles) -> tuple[Doubles, Doubles]:
        """The decrease of the price after which each resting unknown begins to move, and its
        direction."""
        rests = self.state == _REST
        if self.left >= 0:
            rests[self.left] = False
        up, down = (
            np.divide(
                self.price - side * self.pull, 1 - side * slope, out=np.full(len(slope), np.inf),
                where=rests & room & (1 - side * slope > _LEVEL),
            )
            for side, room in ((1, self.high > 0), (-1, self.low < 0))
        )  # fmt: skip
        return np.minimum(up, down), np.where(up <= down, 1.0, -1.0)

    def _moves_again(self, slope: Doubles) -> Doubles:
        """The decrease of the price after which each unknown at a bound leaves it."""
        falls = self.sign * slope - 1
        there = (self.state == _BOUND) & (falls > _LEVEL)
        if self.left >= 0:
            there[self.left] = False
        over = self.sign * self.pull - self.price
        return np.divide(over, falls, out=np.full(len(slope), np.inf), where=there)


def cheapest_change(
    a: Doubles,
    b: Doubles,
    low: Doubles,
    high: Doubles,
    price: Doubles,
    elsewhere: npt.NDArray[np.bool_],
    tolerance: float,
    worth: float,
) -> Doubles:
    """The cheapest x that brings a x near to b: float64[n], mostly 0.

    Args:
        a: float64[m, n].
        b: float64[m].
        low, high: float64[n]; low is at most 0, high at least 0.
        price: float64[n] above 0, price per unit.
        elsewhere: bool[n], unknowns with a price so high that the others come first.
        tolerance: allowed distance beyond the nearest possible one.
        worth: improvement that unknowns elsewhere must bring.
    """
    path = _Path(a / price, b.copy(), low * price, high * price)
    nodes, end, alone = [(path.x.copy(), path.missing)], _END * path.price, -1.0
    calm, prices = _CALM * path.price, [path.price]
    for _ in range(_MOST_STEPS):
        if path.price <= end:
            break
        began = path.step(end)
        if began >= 0 and elsewhere[began] and alone < 0:
            alone = float(np.linalg.norm(path.missing))
        nodes.append((path.x.copy(), path.missing))
        prices.append(path.price)
    nearest = aim = float(np.linalg.norm(path.missing))
    aim = aim + tolerance if alone < 0 else min(alone + tolerance, aim + max(worth, tolerance))
    way, near = float(np.linalg.norm(b)), nearest if alone < 0 else alone
    if nearest > _FAR * way and near - nearest <= _FAR * way:
        # Out of reach: controls that hardly help are left out.
        there = _at_price(nodes, prices, calm)
        aim = max(aim, there) if there - near <= _LITTLE * (way - near) else aim
    return np.clip(_where(nodes, aim) / price, low, high)  # rounding must not exceed the bounds


def cheapest_to(
    a: Doubles, b: Doubles, low: Doubles, high: Doubles, price: Doubles, aim: float
) -> Doubles:
    """The cheapest x that brings a x within a distance of b, or as near as possible: float64[n].

    Args:
        a: float64[m, n].
        b: float64[m].
        low, high: float64[n]; low is at most 0, high at least 0.
        price: float64[n] above 0, price per unit.
        aim: the distance.
    """
    path = _Path(a / price, b.copy(), low * price, high * price)
    nodes, end = [(path.x.copy(), path.missing)], _END * path.price
    for _ in range(_MOST_MORE):
        if path.price <= end or np.linalg.norm(path.missing) <= aim:
            break
        path.step(end)
        nodes.append((path.x.copy(), path.missing))
    return np.clip(_where(nodes, aim) / price, low, high)


def _at_price(nodes: list[tuple[Doubles, Doubles]], prices: list[float], price: float) -> float:
    """The residual at the point of the path with this price."""
    for (_, long), (_, short), before, after in zip(
        nodes, nodes[1:], prices, prices[1:], strict=False
    ):
        if after <= price:
            share = (before - price) / (before - after) if before > after else 1.0
            return float(np.linalg.norm(long + min(max(share, 0.0), 1.0) * (short - long)))
    return float(np.linalg.norm(nodes[-1][1]))


def _where(nodes: list[tuple[Doubles, Doubles]], aim: float) -> Doubles:
    """The first point of a path whose residual is at most `aim`."""
    for (x, long), (then, short) in pairwise(nodes):
        if np.linalg.norm(short) <= aim:
            by = short - long
            if not by @ by > 0 or np.linalg.norm(long) <= aim:
                return x
            half = long @ by
            root = np.sqrt(max(0.0, half**2 - (by @ by) * (long @ long - aim**2)))
            return np.asarray(x + np.clip((-half - root) / (by @ by), 0.0, 1.0) * (then - x))
    return nodes[-1][0]
