# SPDX-License-Identifier: MIT
"""Makes idle movement from a random seed: blinks, saccades that the lids follow, and subtle motion.

Randomness comes from the raw bits of PCG64, which NumPy keeps stable; all other arithmetic is sums,
products, quotients and square roots, which every machine rounds in the same way. So every machine
makes the same blinks at the same times.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..base.easing import smooth_step
from ..base.errors import ArgumentError
from .clip import Clip, Event

Doubles = npt.NDArray[np.float64]

PREFIX = "CTRL_expressions."
LOOKS = ("Left", "Right", "Up", "Down")
# Subtle motion: control name without L or R -> highest value, and seconds from one random value
# to the next.
MICRO = {
    "browRaiseIn": (0.07, 1.7),
    "browRaiseOuter": (0.05, 2.3),
    "browDown": (0.06, 1.9),
    "eyeSquintInner": (0.08, 1.3),
    "mouthCornerPull": (0.06, 2.1),
    "mouthCornerDepress": (0.04, 2.6),
    "noseNostrilDilate": (0.09, 1.8),  # one value for half a breath
    "mouthPressU": (0.05, 2.9),
    "mouthPressD": (0.05, 2.9),
}
MICRO_JAW = ("jawOpen", 0.018, 1.5)
# Directions of saccades: (share of all saccades, x, y). Up, down and the sides are about twice as
# frequent as diagonals (Lee, Badler & Badler 2002, Eyes Alive, table of measured directions).
# _DIAGONAL is x and y of a unit vector at 45 degrees.
_DIAGONAL = 0.70710678
_DIRECTIONS = (
    (0.16, 1.0, 0.0),
    (0.07, _DIAGONAL, _DIAGONAL),
    (0.18, 0.0, 1.0),
    (0.07, -_DIAGONAL, _DIAGONAL),
    (0.17, -1.0, 0.0),
    (0.08, -_DIAGONAL, -_DIAGONAL),
    (0.19, 0.0, -1.0),
    (0.08, _DIAGONAL, -_DIAGONAL),
)


@dataclass(frozen=True)
class Life:
    """Parameters of idle life.

    Attributes:
        blinks_per_minute: mean number of spontaneous blinks. Second blinks of double blinks, and
            blinks that large saccades trigger, add about 2 per minute. People blink 17 times per
            minute at rest, 26 when talking, 4.5 when reading (Bentivoglio et al. 1997).
        double_blinks: fraction of blinks that a second blink follows at once, 0 to 1.
        gaze: factor for the range of the gaze; 0 looks straight ahead.
        look_degrees: degrees that an eye turns if eyeLookLeft/Right and eyeLookUp/Down are 1.
        lid_follow: value of eyeBlink that a full look down adds, so that the upper lid follows the
            eye, 0 to 1. If the rig's eyeLookDown lowers the lid too, both movements add up.
        micro: factor for the subtle motion of brows, lids, nostrils, mouth and jaw.
    """

    blinks_per_minute: float = 15.0
    double_blinks: float = 0.08
    gaze: float = 1.0
    look_degrees: tuple[float, float] = (35.0, 30.0)
    lid_follow: float = 0.2
    micro: float = 1.0


class Blink(NamedTuple):
    """A blink: its start and the durations of its phases in seconds, and `amount`, the closing of
    the lids from 0 to 1."""

    start: float
    close: float
    hold: float
    open: float
    amount: float
    late: float
    """Seconds by which the right lid lags behind the left."""

    @property
    def end(self) -> float:
        return self.start + self.close + self.hold + self.open + abs(self.late)


class Saccade(NamedTuple):
    """A jump of both eyes; times in seconds, angles in degrees towards the face's left and up."""

    start: float
    duration: float
    before: tuple[float, float]
    after: tuple[float, float]


def idle(
    seed: int,
    duration: float,
    rate: float = 60.0,
    *,
    start: float = 0.0,
    loop: bool = False,
    life: Life | None = None,
) -> Clip:
    """Make a clip of a face at rest, for use as one of the layers of a Mixer.

    Args:
        seed: 0 or more; the same seed gives the same clip.
        duration: seconds.
        rate: frames per second.
        start: seconds, the time of the first frame.
        loop: True: the last frame equals the first, for Layer(extend="repeat"); viewers notice a
            loop under half a minute.
        life: parameters of the movement; None for the defaults.

    Returns:
        A clip of raw controls, values in [0, 1], with an event "idle.blink" for each blink.

    Raises:
        ValueError: a seed below 0, a duration or rate that is not above 0, a loop below 2 s.

    From:
        Blinks: log-normal intervals (Cruz et al. 2011); lids fall in 50 to 78 ms and rise in more
        than twice that time (Evinger, Manning & Sibony 1991). Saccades: duration 21 ms plus 2.2 ms
        per degree (Bahill, Clark & Stark 1975; Carpenter 1988), minimum jerk, sizes and directions
        similar to Eyes Alive (Lee, Badler & Badler 2002); large ones trigger blinks (Evinger et al.
        1994); small ones occur during fixation (Martinez-Conde et al. 2004). The upper lid follows
        the eye up and down (Becker & Fuchs 1988).
    """
    life = life or Life()
    if seed < 0:
        raise ArgumentError(f"seed: a whole number from 0 was expected, found {seed}")
    for name, value in (("duration", duration), ("rate", rate)):
        if not (math.isfinite(value) and value > 0.0):
            raise ArgumentError(f"{name}: a number above 0 was expected, found {value}")
    if loop and duration < 2.0:
        raise ArgumentError(f"duration: at least 2 s were expected of a loop, found {duration}")
    count = math.floor(duration * rate + 1e-6) + 1
    times = np.arange(count) / rate
    length = float(times[-1])
    if loop and length < 2.0:
        raise ArgumentError(f"rate: frames over at least 2 s were expected of a loop, found {rate}")
    saccades = make_saccades(seed, length, life, loop)
    blinks = make_blinks(seed, length, life, loop, saccades)
    curves = _gaze_curves(times, saccades, life)
    curves |= _micro_curves(seed, times, life.micro, loop)
    _close_lids(curves, times, blinks, life)
    return Clip(
        [PREFIX + name for name in curves],
        np.clip(list(curves.values()), 0.0, 1.0),
        rate,
        start=start,
        events=[Event(start + b.start, "idle.blink", b.end - b.start) for b in blinks],
        metadata={"source": "risorius idle", "seed": str(seed)},
    )


# -- random numbers --------------------------------------------------------------------------------


class _Dice:
    def __init__(self, seed: int, stream: int) -> None:
        self._bits = np.random.PCG64(np.random.SeedSequence([seed, stream]))

    def uniform(self, low: float = 0.0, high: float = 1.0) -> float:
        return low + (high - low) * ((int(self._bits.random_raw()) >> 11) * 2.0**-53)

    def normal(self) -> float:
        """A random number, approximately normal with mean 0 and standard deviation 1.

        It is a sum of twelve uniform numbers, because logarithms differ between machines.
        """
        total = -6.0
        for _ in range(12):
            total += self.uniform()
        return total

    def lognormal(self, median: float, sigma: float) -> float:
        return median * _exp(sigma * self.normal())


def _exp(x: float) -> float:
    """e to the power of x within 0.5 % for |x| below 3, with the same bits everywhere."""
    value = 1.0 + x / 1024.0
    for _ in range(10):
        value *= value
    return value


# -- blinks ----------------------------------------------------------------------------------------


def make_blinks(
    seed: int, length: float, life: Life, loop: bool, saccades: list[Saccade]
) -> list[Blink]:
    """Make blinks, sorted by start; they do not overlap.

    Args:
        seed: 0 or more; the same seed gives the same blinks.
        length: seconds to fill.
        life: frequency of the blinks.
        loop: True: the eyes are open at the start and the end.
        saccades: saccades of the same face; some of the large ones trigger a blink.
    """
    dice = _Dice(seed, 1)
    wanted = []
    if life.blinks_per_minute > 0.0:
        sigma = 0.7
        median = 60.0 / life.blinks_per_minute / _exp(sigma * sigma / 2.0)
        time = dice.uniform(0.3, 1.0) * median
        while time < length:
            wanted.append(_blink(dice, time))
            if dice.uniform() < life.double_blinks:
                wanted.append(_blink(dice, wanted[-1].end + dice.uniform(0.06, 0.2)))
            time = wanted[-1].end + max(dice.lognormal(median, sigma) - 0.25, 0.3)
        for saccade in saccades:
            size = max(abs(a - b) for a, b in zip(saccade.after, saccade.before, strict=True))
            if size > 10.0 and dice.uniform() < 0.4:
                wanted.append(_blink(dice, saccade.start - 0.01))
    # In a loop no blink may reach its first or last 0.1 s. Other clips may begin and end within a
    # blink.
    first, last = (0.1, length - 0.1) if loop else (-1.0, length + 1.0)
    blinks: list[Blink] = []
    for blink in sorted(wanted):
        free = not blinks or blink.start >= blinks[-1].end + 0.05
        if free and blink.start >= first and blink.end <= last:
            blinks.append(blink)
    return blinks


def _blink(dice: _Dice, start: float) -> Blink:
    close = dice.uniform(0.05, 0.078)
    hold = dice.uniform(0.005, 0.03)
    rise = close * dice.uniform(2.3, 2.8)
    whole = dice.uniform() < 0.8
    amount = dice.uniform(0.97, 1.0) if whole else dice.uniform(0.6, 0.95)
    return Blink(start, close, hold, rise, amount, dice.uniform(-0.006, 0.006))


def lid(blink: Blink, times: npt.ArrayLike) -> Doubles:
    """The closing of a lid by a blink at some times: 0 is open, 1 is closed.

    The lid closes fast and opens ever more slowly. `blink.late`, the delay of the right lid, is not
    added.

    Args:
        blink: the blink.
        times: seconds on the clock of blink.start.
    """
    t = np.asarray(times, np.float64) - blink.start
    up = np.clip((t - blink.close - blink.hold) / blink.open, 0.0, 1.0)
    down, back = smooth_step(t / blink.close), smooth_step(up * (2.0 - up))
    return blink.amount * down * (1.0 - back)


def _close_lids(
    curves: dict[str, Doubles], times: Doubles, blinks: list[Blink], life: Life
) -> None:
    """Set the lid controls of both sides from blinks and from the gaze, which the lids follow.
    Each blink also lowers the brow a little.

    Args:
        curves: control name without prefix -> its curve; changed.
        times: float64[frames], seconds.
        blinks: the blinks.
        life: gives the fraction of the gaze that the lids follow.
    """
    for side, sign in (("L", 0.0), ("R", 1.0)):
        closed = np.zeros(times.size)
        for blink in blinks:
            own = blink._replace(start=blink.start + sign * blink.late)
            first, last = np.searchsorted(times, (own.start, own.end))
            part = slice(int(first), int(last))
            closed[part] = np.maximum(closed[part], lid(own, times[part]))
        follow = life.lid_follow * curves[f"eyeLookDown{side}"]
        curves[f"eyeBlink{side}"] = 1.0 - (1.0 - closed) * (1.0 - follow)
        curves[f"eyeWiden{side}"] = 0.7 * life.lid_follow * curves[f"eyeLookUp{side}"]
        curves[f"browDown{side}"] = curves[f"browDown{side}"] + 0.03 * closed


# -- gaze ------------------------------------------------------------------------------------------


def make_saccades(seed: int, length: float, life: Life, loop: bool) -> list[Saccade]:
    """Make saccades, sorted by start; each begins at the gaze direction at which its predecessor
    ended.

    Args:
        seed: 0 or more; the same seed gives the same saccades.
        length: seconds to fill.
        life: range of the gaze; a gaze of 0 gives no saccades.
        loop: True: the last saccade ends where the first one starts, straight ahead.
    """
    if life.gaze == 0.0:
        return []
    dice = _Dice(seed, 2)
    out: list[Saccade] = []
    gaze, place = (0.0, 0.0), (0.0, 0.0)  # direction of the eyes, and the fixated point
    end = length - 0.4 if loop else length
    time = dice.uniform(0.2, 0.8)
    while time < end:
        if dice.uniform() < 0.45:  # a small saccade during a fixation
            after = _beside(dice, place, 0.35)
            pause = dice.lognormal(0.5, 0.5)
        else:
            place = _next_place(dice, place, life.gaze)
            after = _beside(dice, place, 0.4)
            away = abs(place[0]) + abs(place[1]) > 4.0
            pause = dice.lognormal(0.55 if away else 1.0, 0.6)
        out.append(_saccade(time, gaze, after))
        gaze = after
        time = out[-1].start + out[-1].duration + min(max(pause, 0.14), 6.0)
    if loop and out:
        while out and out[-1].start + out[-1].duration > end:
            out.pop()
        out.append(_saccade(end, out[-1].after if out else (0.0, 0.0), (0.0, 0.0)))
    return out


def _saccade(start: float, before: tuple[float, float], after: tuple[float, float]) -> Saccade:
    x, y = after[0] - before[0], after[1] - before[1]
    return Saccade(start, 0.021 + 0.0022 * math.sqrt(x * x + y * y), before, after)


def _beside(dice: _Dice, place: tuple[float, float], degrees: float) -> tuple[float, float]:
    return (
        place[0] + degrees * dice.uniform(-1.0, 1.0),
        place[1] + degrees * dice.uniform(-1.0, 1.0),
    )


def _next_place(dice: _Dice, place: tuple[float, float], scale: float) -> tuple[float, float]:
    """The next gaze direction in degrees. If `place` is far from straight ahead, the next
    direction is often near straight ahead (0, 0).

    Args:
        dice: source of random numbers.
        place: the current gaze direction in degrees, to the left and up.
        scale: factor of the range of the gaze.
    """
    if abs(place[0]) + abs(place[1]) > 4.0 * scale and dice.uniform() < 0.7:
        return (scale * dice.uniform(-1.2, 1.2), scale * dice.uniform(-0.8, 0.8))
    size = min(dice.lognormal(4.5, 0.7), 22.0) * scale
    chance, at = dice.uniform(), 0
    while at < len(_DIRECTIONS) - 1 and chance >= _DIRECTIONS[at][0]:
        chance -= _DIRECTIONS[at][0]
        at += 1
    _, x, y = _DIRECTIONS[at]
    x, y = x + dice.uniform(-0.2, 0.2), y + dice.uniform(-0.2, 0.2)
    limits = (22.0 * scale, 14.0 * scale)
    return (
        min(max(place[0] + size * x, -limits[0]), limits[0]),
        min(max(place[1] + 0.7 * size * y, -limits[1]), limits[1]),
    )


def _gaze_curves(times: Doubles, saccades: list[Saccade], life: Life) -> dict[str, Doubles]:
    angles = np.zeros((2, times.size))
    starts = np.searchsorted(times, [s.start for s in saccades] or [0.0])
    for i, saccade in enumerate(saccades):
        part = slice(int(starts[i]), int(starts[i + 1]) if i + 1 < len(saccades) else None)
        s = np.clip((times[part] - saccade.start) / saccade.duration, 0.0, 1.0)
        way = s * s * s * (10.0 + s * (6.0 * s - 15.0))
        for axis in range(2):
            before, after = saccade.before[axis], saccade.after[axis]
            angles[axis, part] = before + (after - before) * way
    aside, up = angles[0] / life.look_degrees[0], angles[1] / life.look_degrees[1]
    values = (aside, -aside, up, -up)
    return {
        f"eyeLook{look}{side}": np.maximum(value, 0.0)
        for look, value in zip(LOOKS, values, strict=True)
        for side in ("L", "R")
    }


# -- subtle motion ---------------------------------------------------------------------------------


def _micro_curves(seed: int, times: Doubles, scale: float, loop: bool) -> dict[str, Doubles]:
    """Curves of subtle motion. The curve of each side is three quarters common motion and one
    quarter motion of its own; the jaw has one curve."""
    out = {}
    for stream, (name, (amount, step)) in enumerate(MICRO.items()):
        common, left, right = (
            _noise(_Dice(seed, 16 + 4 * stream + n), times, step, loop) for n in range(3)
        )
        for side, own in (("L", left), ("R", right)):
            out[name + side] = scale * amount * _raised(0.75 * common + 0.25 * own)
    name, amount, step = MICRO_JAW
    out[name] = scale * amount * _raised(_noise(_Dice(seed, 15), times, step, loop))
    return out


def _raised(noise: Doubles) -> Doubles:
    """Map [-1, 1] smoothly to [0, 1], with mostly low values."""
    half = 0.5 + 0.5 * noise
    return half * half


def _noise(dice: _Dice, times: Doubles, step: float, loop: bool) -> Doubles:
    """Slow noise in [-1, 1]: four fifths of a random cubic B-spline with a point every `step`
    seconds, plus one fifth of a spline with a point every 0.36 * `step` seconds. Periodic only if
    `loop` is True."""
    return 0.8 * _spline(dice, times, step, loop) + 0.2 * _spline(dice, times, 0.36 * step, loop)


def _spline(dice: _Dice, times: Doubles, step: float, loop: bool) -> Doubles:
    length = float(times[-1])
    count = max(round(length / step), 4) if loop else math.floor(length / step) + 1
    if loop:
        step = length / count
    points = np.array([dice.uniform(-1.0, 1.0) for _ in range(count + 3)])
    if loop:
        points[count:] = points[:3]
    at = times / step
    first = np.minimum(np.floor(at).astype(np.int64), count - 1)
    x = at - first
    rest = 1.0 - x
    weights = (
        rest * rest * rest,
        3.0 * x * x * x - 6.0 * x * x + 4.0,
        3.0 * rest * rest * rest - 6.0 * rest * rest + 4.0,
        x * x * x,
    )
    out = np.zeros(times.size)
    for n, weight in enumerate(weights):
        out += weight * points[first + n]
    return out / 6.0
