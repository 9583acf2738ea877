# SPDX-License-Identifier: MIT
"""Finds the cheapest sparse solution of least squares: which controls a drag changes.

Basis pursuit with bounds, by following the path of the lasso: M. R. Osborne, B. Presnell and B. A.
Turlach, "A new approach to variable selection in least squares problems", IMA Journal of Numerical
Analysis 20 (3), 2000. The solution is a continuous function of the target, so that a drag does not
jump from one set of controls to another, and it changes at most about as many controls as the
equations have rows.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from .surface import Doubles

_REST, _MOVES, _BOUND = 0, 1, 2  # states of an unknown: at the value 0, moving, at a bound
_MOST_STEPS = 600  # largest number of steps of a path
# largest number of path steps in cheapest_to(); the result of a longer path is not sparse
_MOST_MORE = 60
_END = 1e-6  # fraction of the first price at which a path ends
_FAR = 0.1  # fraction of the first residual: a target that stays farther away is out of reach
# fraction of the possible decrease of the distance that may be given up to use fewer controls, if
# the target is out of reach
_LITTLE = 0.1
# If the target is out of reach, controls that the path adds below this fraction of the first price
# hardly help.
_CALM = 0.12
_LEVEL = 1e-9  # smaller differences of slopes count as none


@dataclass
class _Path:
    """The lasso path from x = 0 to the nearest point to the target, with a falling price.

    Columns and bounds are scaled so that the price per unit is equal for all unknowns.
    """

    a: Doubles  # [m, n], the matrix
    missing: Doubles  # [m], the residual
    low: Doubles  # [n], lower bounds, at most 0
    high: Doubles  # [n], upper bounds, at least 0
    x: Doubles = field(init=False)  # [n], the unknowns
    state: npt.NDArray[np.int64] = field(init=False)  # [n], _REST, _MOVES or _BOUND
    sign: Doubles = field(init=False)  # [n], direction of each unknown from 0
    pull: Doubles = field(init=False)  # [n], negative gradient of the squared residual / 2
    price: float = field(init=False)
    left: int = -1  # unknown that came to rest or to a bound in the last step, or -1

    def __post_init__(self) -> None:
        count = self.a.shape[1]
        self.x, self.sign = np.zeros(count), np.zeros(count)
        self.state = np.zeros(count, np.int64)
        self.pull = self.a.T @ self.missing
        self.price = float(self._wish().max(initial=0.0))

    def _wish(self) -> Doubles:
        """float64[n]: size of the gradient; 0 for unknowns that move or cannot follow the
        gradient."""
        room = np.where(self.pull > 0, self.high > 0, self.low < 0) & (self.state == _REST)
        return np.where(room, np.abs(self.pull), 0.0)

    def step(self, end: float) -> int:
        """Follows the path until an unknown begins to move, stops, or leaves a bound.

        Args:
            end: price at which the path ends.

        Returns:
            The unknown that began to move from 0, or -1.
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
        """float64[n] each: the value at which each moving unknown stops, and the price's decrease
        until then (infinite for an unknown that does not move).

        Args:
            rate: float64[n], change of each unknown per decrease of the price.
        """
        stop = np.where(rate > 0, self.high, self.low)
        back = (self.x * rate < 0) | ((self.x == 0) & (rate * self.sign < 0))
        stop = np.where(back, 0.0, stop)
        there = (self.state == _MOVES) & (rate != 0)
        when = np.divide(stop - self.x, rate, out=np.full(len(rate), np.inf), where=there)
        return stop, when

    def _begins(self, slope: Doubles) -> tuple[Doubles, Doubles]:
        """float64[n] each: for each unknown that stays at 0, the price's decrease until the unknown
        begins to move, and the direction of its motion (1 or -1).

        Args:
            slope: float64[n], decrease of the attribute `pull` (the negative gradient of half the
                squared residual) per decrease of the price.
        """
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
        """float64[n]: the decrease of the price until each unknown at a bound leaves this bound.

        Args:
            slope: float64[n], decrease of the attribute `pull` (the negative gradient of half the
                squared residual) per decrease of the price.
        """
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
    """float64[n]: the cheapest x with a @ x near b; most elements are 0.

    Args:
        a: float64[m, n], the matrix.
        b: float64[m], the target.
        low, high: float64[n], bounds of x; low is at most 0, high at least 0.
        price: float64[n] above 0, price per unit of x.
        elsewhere: bool[n], unknowns that should be used only if they help enough.
        tolerance: allowed distance beyond the smallest possible one.
        worth: decrease of the distance that must result from using the unknowns `elsewhere`.
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
        # The target is out of reach, so controls that hardly bring the point nearer are left out.
        there = _at_price(nodes, prices, calm)
        aim = max(aim, there) if there - near <= _LITTLE * (way - near) else aim
    # Rounding errors could leave the bounds.
    return np.clip(_where(nodes, aim) / price, low, high)


def cheapest_to(
    a: Doubles, b: Doubles, low: Doubles, high: Doubles, price: Doubles, aim: float
) -> Doubles:
    """float64[n]: the cheapest x with a @ x within `aim` of b, or as near as possible.

    Args:
        a: float64[m, n], the matrix.
        b: float64[m], the target.
        low, high: float64[n], bounds of x; low is at most 0, high at least 0.
        price: float64[n] above 0, price per unit of x.
        aim: wanted distance of a @ x from b.
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
    """The length of the residual at the point of the path with the price `price`.

    Args:
        nodes: (x, residual) at each corner of the path.
        prices: price at each corner, falling.
        price: price of the wanted point; a lower price than all corners have means the last corner.
    """
    for (_, long), (_, short), before, after in zip(
        nodes, nodes[1:], prices, prices[1:], strict=False
    ):
        if after <= price:
            share = (before - price) / (before - after) if before > after else 1.0
            return float(np.linalg.norm(long + min(max(share, 0.0), 1.0) * (short - long)))
    return float(np.linalg.norm(nodes[-1][1]))


def _where(nodes: list[tuple[Doubles, Doubles]], aim: float) -> Doubles:
    """float64[n]: x at the first point of a path at which the residual is at most `aim` long, or at
    the end of the path.

    Args:
        nodes: (x, residual) at each corner of the path.
        aim: length of the residual.
    """
    for (x, long), (then, short) in pairwise(nodes):
        if np.linalg.norm(short) <= aim:
            by = short - long
            if not by @ by > 0 or np.linalg.norm(long) <= aim:
                return x
            half = long @ by
            root = np.sqrt(max(0.0, half**2 - (by @ by) * (long @ long - aim**2)))
            return np.asarray(x + np.clip((-half - root) / (by @ by), 0.0, 1.0) * (then - x))
    return nodes[-1][0]
