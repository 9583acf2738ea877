# SPDX-License-Identifier: MIT
"""Makes scalp hair by style: short crop, receding, afro, long, bun."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from risorius.base.easing import smooth_step

from ..paint.atlas import DENSE, TILES, tile
from ..paint.places import HAIRLINES, hairline_height, thinned, wavy
from ..people import Person
from ..polygons import Floats, Ints
from .growth import curled, eased, grow, tangent
from .strips import ROOT_DEEP, Strips, joined, make_strips, unit
from .surface import Roots, Surface

# Position of the whorl at the crown on the man's head, in decimetres: x from the middle of the
# face, y and z from the middle of the left eye.
_WHORL = np.array([0.10, 0.86, -1.40])
_PARTING = 0.10  # x of the parting on the man's head; his left is positive
_THIN = TILES["scalp"][4] - DENSE  # number of thin tiles
_LINE_OF_BROWS, _HIGH_ON_FOREHEAD = 0.27, 0.62  # heights on the man's head where a fringe ends
_FINE = 0.75  # factor on the spacing of short hair at the hairline over the forehead
_CLOSE = 0.6  # hair_length below which an afro lies flat on the head


def whorl_flow(surface: Surface, side: float) -> Floats:
    """float64[V, 3]: direction of hair from the whorl at the crown outward; it spirals near the
    whorl.

    Args:
        surface: surface of the head.
        side: strength, 0 to 1, with which hair over the forehead is combed to the character's
            right.
    """
    man, normals = surface.man, surface.man_normals
    away = tangent(man - _WHORL, normals)
    distance = np.linalg.norm(man - _WHORL, axis=1)
    swirl = np.cross(normals, away) * (0.9 * np.exp(-distance / 0.3))[:, None]
    flow = away + swirl
    down = smooth_step((np.abs(normals[:, 0]) - 0.45) / 0.4)[:, None]
    flow = flow * (1 - down) + down * np.array([0.0, -1.0, -0.12])
    front = smooth_step((man[:, 2] + 0.7) / 0.7) * smooth_step((man[:, 1] - 0.45) / 0.25)
    flow = flow + (side * front)[:, None] * np.array([-0.9, 0.25, 0.1])
    return tangent(flow, surface.normals)


def _roots(
    surface: Surface,
    spacing: float,
    random: np.random.Generator,
    style: str,
    even: bool = True,
    fine: float = 0.0,
) -> tuple[Roots, Floats]:
    """Roots behind an uneven hairline, and float64[n], their distances from it in decimetres.

    Args:
        surface: surface of the head.
        spacing: smallest distance between two roots at density 1, in decimetres.
        random: generator of the roots.
        style: hair style, a key of HAIRLINES.
        even: False for short hair, which is denser where it lies flat, and sparser where it stands
            up.
        fine: 0: the density behind the hairline is even; above 0: hair is denser at the hairline
            than behind it, except along the parting, where with 1 it is as dense as at the
            hairline.
    """
    man = surface.man
    inside = hairline_height(man, *HAIRLINES[style])
    inside = inside + 0.014 * wavy(man, random, 3.0) + 0.005 * wavy(man, random, 9.0)
    # Wide waves in the hairline make its corners at the temples round, and leave single hairs in
    # front of the line.
    if even:
        inside = inside + 0.016 * wavy(man, random, 1.6)
    density = smooth_step((inside + 0.03) / 0.11 if even else inside / 0.07)
    density = density * (1 - thinned(man, style))
    if not even:
        density = density * (1 - 0.5 * smooth_step((man[:, 1] - 0.4) / 0.3))
        density = density * (1 - 0.3 * smooth_step((inside - 0.08) / 0.1))
        # Single cards are visible over the forehead, so they are denser and narrower there.
        edge = np.exp(-((inside / 0.09) ** 2)) * smooth_step((man[:, 2] + 0.8) / 0.4)
        density = density * (_FINE**2 + (1 - _FINE**2) * edge)
    if fine:
        parting = np.exp(-(((man[:, 0] - _PARTING) / 0.09) ** 2)) * smooth_step(
            (man[:, 1] - 0.5) / 0.2
        )
        within = smooth_step((inside - 0.05) / 0.08) * (1 - fine * parting)
        density = density * (1 - 0.6 * within)
    density[surface.man_normals[:, 1] < -0.8] = 0
    roots = surface.scattered(density, spacing, random)
    return roots, roots.of(inside[:, None])[:, 0]


def _tiles(inside: Floats, random: np.random.Generator, edge: float = 0.07) -> Floats:
    """int64[n]: atlas tiles of strips: thin at the hairline and at random places, dense elsewhere.

    Args:
        inside: float64[n], distance of each root from the hairline in decimetres.
        random: generator of the tiles.
        edge: distance from the hairline in decimetres up to which tiles are thin.
    """
    n = len(inside)
    thin = (inside < edge * random.uniform(0.4, 1.3, n)) | (random.random(n) < 0.12)
    numbers = np.where(thin, DENSE + random.integers(0, _THIN, n), random.integers(0, DENSE, n))
    return tile("scalp", numbers)


def _scalp_vertices(surface: Surface) -> Floats:
    man = surface.man
    return np.flatnonzero((hairline_height(man) > -0.25) & (man[:, 1] > -0.95))


def crop(surface: Surface, person: Person) -> Strips:
    """Short hair: some centimetres long on top, brushed aside, shorter at the sides and the nape.

    Args:
        surface: surface of the head.
        person: the person; `hair_length` is a factor on the usual length.
    """
    return _short(surface, person, 31, "crop", top=0.32, sides=0.22)


def receding(surface: Surface, person: Person) -> Strips:
    """Hair of an old man: receded at the temples, thin on top, combed back.

    Args:
        surface: surface of the head.
        person: the person; `hair_length` is a factor on the usual length.
    """
    return _short(surface, person, 32, "receding", top=0.30, sides=0.20)


def _short(
    surface: Surface, person: Person, seed: int, style: str, top: float, sides: float
) -> Strips:
    random = np.random.default_rng(seed)
    recession = HAIRLINES[style][0]
    spacing = 0.043 if recession == 0 else 0.046
    roots, inside = _roots(surface, _FINE * spacing, random, style, even=False)
    n = len(roots)
    man = roots.of(surface.man)
    high = smooth_step((man[:, 1] - 0.30) / 0.40)
    fore = smooth_step((man[:, 2] + 0.5) / 0.6) * high
    length = sides + (top - sides) * high + 0.16 * fore
    edge = 0.5 + 0.2 * fore * (recession == 0)  # hair over the forehead hides the hairline
    length *= edge + (1 - edge) * smooth_step(inside / 0.2)
    nape = smooth_step((-0.25 - man[:, 1]) / 0.3)
    length *= (1 - 0.45 * nape) * person.hair_length * surface.scale * random.uniform(0.75, 1.2, n)
    flow = whorl_flow(surface, 0.6 if recession == 0 else 0.3)
    if recession:
        back = tangent(np.tile([0.15, 0.1, -1.0], (len(flow), 1)), surface.normals)
        comb = smooth_step((surface.man[:, 1] - 0.2) / 0.3)[:, None]
        flow = tangent(flow * (1 - comb) + comb * back, surface.normals)
    clump = 0.14 * np.column_stack([wavy(surface.man, random, 6.0) for _ in range(3)])
    flow, sway = flow + clump, 0.14 * random.normal(0, 1, (n, 3))
    quiff = fore * (recession == 0)
    low = 16 + (18 if recession == 0 else 12) * high - 4 * quiff
    rise = np.radians(low + random.uniform(-7, 9, n)), np.radians(2 + 6 * high - 6 * quiff)
    near = _scalp_vertices(surface)
    points, out = grow(surface, roots, flow, length, rise, 5, near, 0.006, sway=sway)
    points = eased(points)
    half = (0.024 + 0.026 * high) * surface.scale * (spacing / 0.043) * random.uniform(0.8, 1.25, n)
    half *= 0.5 + 0.5 * smooth_step(inside / 0.14)
    turns = np.radians(random.uniform(-1, 1, n) * (6 + 20 * high))
    # Limits the rotation of cards, so that their edges at the root are not deep in the skin.
    steep = np.arcsin(np.clip(ROOT_DEEP * surface.scale / half, 0, 1))
    turns = np.clip(turns, -steep, steep)
    taper = np.array([0.85, 0.97, 1.0, 0.91, 0.7])
    return make_strips(points, out, half, taper, _tiles(inside, random, 0.15), roots, turns)


def afro(surface: Surface, person: Person) -> Strips:
    """Tight curls that stand away from the head; short curls lie on it.

    Args:
        surface: surface of the head.
        person: the person; `hair_length` is a factor on 4 cm.
    """
    random = np.random.default_rng(33)
    short = person.hair_length < _CLOSE
    roots, inside = _roots(surface, 0.046 if short else 0.062, random, "afro")
    n = len(roots)
    man = roots.of(surface.man)
    length = 0.42 * person.hair_length * surface.scale * random.uniform(0.75, 1.15, n)
    length *= 0.35 + 0.65 * smooth_step(inside / 0.22)
    flow = tangent(random.normal(0, 1, surface.man.shape), surface.normals)
    # Cards lie flat at the hairline, because there is too little hair to hide the edges of upright
    # cards.
    upright = np.zeros(n) if short else smooth_step((inside - 0.03) / 0.15)

    def between(lying: tuple[float, float], standing: tuple[float, float]) -> Floats:
        low, high = random.uniform(*lying, n), random.uniform(*standing, n)
        return np.radians(low + upright * (high - low))

    rise = between((15, 40), (45, 88)), between((0, 35), (10, 80))
    rows = 2 if short else 4
    near = _scalp_vertices(surface)
    points, out = grow(surface, roots, flow, length, rise, rows, near, 0.01, 0.7)
    wind = 0.05 * person.hair_curl * person.hair_length * random.uniform(0.6, 1.2, n)
    points = curled(points, out, wind, random.uniform(0.6, 1.3, n), random)
    half = 0.090 * (0.5 + 0.5 * person.hair_length) * random.uniform(0.8, 1.2, n)
    half *= (
        (0.4 + 0.6 * smooth_step((inside + 0.02) / 0.15)) * surface.scale * (0.75 if short else 1.0)
    )
    middle = np.array([0.0, 0.1, -0.75])
    out = unit(out + 0.6 * unit(man - middle)[:, None])
    turns = between((-16, 16), (0, 180))
    taper = np.array([0.7, 1.0, 1.1, 0.95])[-rows:]
    strips = make_strips(points, out, half, taper, _tiles(inside, random, 0.05), roots, turns)
    # A frown moves the forehead's skin; narrow cards keep their edges above the skin there.
    strips.sides[:, 0] *= (0.5 + 0.5 * smooth_step(inside / 0.15))[:, None]
    return strips


def long(surface: Surface, person: Person) -> Strips:
    """Hair to the shoulders, parted beside the middle, that falls behind the face.

    Args:
        surface: surface of the head.
        person: the person; `hair_length` is a factor on the usual length, and `hair_fringe` above 0
            adds a fringe.
    """
    random = np.random.default_rng(34)
    roots, inside = _roots(surface, 0.066, random, "long", fine=1.0)
    n = len(roots)
    man = roots.of(surface.man)
    flow = parted_flow(surface)
    sway = 0.10 * random.normal(0, 1, (n, 3))
    # Hairs end at about the same height, so hairs with higher roots are longer.
    way = 0.85 * (man[:, 1] + 0.55) + 1.15
    length = np.clip(way, 1.0, 2.6) * person.hair_length * surface.scale
    length *= random.uniform(0.88, 1.08, n)
    rise = np.radians(random.uniform(6, 14, n)), np.zeros(n)
    above = np.flatnonzero(surface.man[:, 1] > -1.9)
    # smallest height above the skin in decimetres, so that raised ears stay below the hair
    least = (0.036 + 0.02 * random.random(n)) * surface.scale
    points, out = grow(surface, roots, flow, length, rise, 9, above, least, 0.5, 0.55, 1.2, sway)
    wave = 0.05 * (0.25 + person.hair_curl) * random.uniform(0.5, 1.2, n)
    points = curled(points, out, wave, random.uniform(0.5, 1.6, n), random)
    half = (
        (0.026 + 0.056 * smooth_step(inside / 0.14)) * surface.scale * random.uniform(0.8, 1.2, n)
    )
    turns = np.radians(random.uniform(-10, 10, n))
    taper = np.interp(np.linspace(0, 1, 9), [0, 0.2, 0.8, 1], [0.7, 1.0, 1.0, 0.75])
    tiles = _tiles(inside, random, 0.10)
    falling = make_strips(points, out, half, taper, tiles, roots, turns, held=0.0)
    if not person.hair_fringe:
        return falling
    return joined([falling, _fringe(surface, person, len(taper), random)])


def _fringe(surface: Surface, person: Person, rows: int, random: np.random.Generator) -> Strips:
    """A fringe: hair from behind the hairline falls over the forehead, and ends at one height.

    Args:
        surface: surface of the head.
        person: the person; `hair_fringe` is the length of the fringe, 0 to 1.
        rows: number of points of a guide.
        random: generator of the strips.
    """
    man = surface.man
    inside = hairline_height(man, *HAIRLINES[person.hair_style])
    x, y, z = man.T
    density = smooth_step((0.34 - inside) / 0.15) * (inside > 0.01)
    density = density * smooth_step((0.50 - np.abs(x)) / 0.10) * (y > 0.42) * (z > -0.75)
    roots = surface.scattered(density, 0.054, random)
    n = len(roots)
    top = smooth_step((surface.man_normals[:, 1] - 0.3) / 0.4)
    flow = np.column_stack([0.35 * x * top + 0.10, -1 + 0.7 * top, 0.2 + top])
    length = 1.1 * surface.scale * random.uniform(0.9, 1.1, n)
    rise = np.radians(random.uniform(14, 26, n)), np.zeros(n)
    near = np.flatnonzero((y > -0.3) & (z > -1.5))
    # A gap below the fringe leaves room for the moving skin of the forehead.
    least = (0.025 + 0.03 * random.random(n)) * surface.scale
    sway = 0.07 * random.normal(0, 1, (n, 3))
    points, out = grow(surface, roots, flow, length, rise, rows, near, least, 0.4, 0.3, 1.0, sway)
    end = _LINE_OF_BROWS + (1 - person.hair_fringe) * (_HIGH_ON_FOREHEAD - _LINE_OF_BROWS)
    points, out = _ended(surface, points, out, end + 0.02 * random.normal(0, 1, n), near)
    half = random.uniform(0.034, 0.056, n) * surface.scale
    taper = np.interp(np.linspace(0, 1, rows), [0, 0.2, 0.75, 1], [0.7, 1.0, 0.9, 0.6])
    turns = np.radians(random.uniform(-8, 8, n))
    tiles = _tiles(roots.of(inside[:, None])[:, 0], random, 0.06)
    return make_strips(points, out, half, taper, tiles, roots, turns, held=0.0)


def _ended(
    surface: Surface, points: Floats, out: Floats, end: Floats, near: Ints
) -> tuple[Floats, Floats]:
    """Shortens guides to end where they first descend to a given height on the head.

    The number of their points stays.

    Args:
        surface: surface of the head.
        points, out: float64[n, rows, 3] each, from `grow`.
        end: float64[n], height y of each guide's end on the man's head, in decimetres above the
            middle of the left eye.
        near: indices of vertices that the guides may come near.
    """
    n, rows, _ = points.shape
    _, _, vertex = surface.below(points.reshape(-1, 3), near)
    height = surface.man[vertex, 1].reshape(n, rows)
    k = np.arange(rows)
    for guide in range(n):
        # A tip that turns up again is ignored, because it would cross the height a second time.
        down = np.minimum.accumulate(height[guide])
        last = float(np.interp(-end[guide], -down, k))
        at = np.linspace(0, max(last, 0.5), rows)
        for way in (points, out):
            way[guide] = np.column_stack([np.interp(at, k, way[guide, :, j]) for j in range(3)])
    return points, unit(out)


def parted_flow(surface: Surface) -> Floats:
    """float64[V, 3]: direction of hair that falls to both sides of a parting, and behind the ears.

    Args:
        surface: surface of the head.
    """
    man = surface.man
    x, y, z = man.T
    aside = np.tanh((x - _PARTING) / 0.03)
    top = smooth_step((y - 0.35) / 0.45)
    flow = np.column_stack([1.0 * aside * top, -0.55 - 0.6 * (1 - top), -0.35 - 0.1 * top])
    fore = smooth_step((z + 0.5) / 0.5) * top
    flow[:, 1] += 0.4 * fore
    flow[:, 2] -= 0.55 * fore
    # Hair in front of the ears and above them points back; below the ears it points down.
    before = smooth_step((z + 0.95) / 0.3) * smooth_step((y + 0.35) / 0.25) * (1 - top)
    flow[:, 2] -= 0.9 * before
    low = smooth_step((-0.35 - y) / 0.25)[:, None]
    flow = flow * (1 - low) + low * np.array([0.0, -1.0, 0.0])
    return tangent(flow, surface.normals)


# Position of the bun on the man's head, in decimetres: x from the middle of the face, y and z from
# the middle of the left eye.
_KNOT = np.array([0.0, 0.46, -1.72])


def bun(surface: Surface, person: Person) -> Strips:
    """Hair that is drawn back into a bun.

    Args:
        surface: surface of the head.
        person: the person; `hair_length` is a factor on the bun's size.
    """
    random = np.random.default_rng(35)
    roots, inside = _roots(surface, 0.060, random, "bun", fine=0.01)
    n = len(roots)
    man = roots.of(surface.man)
    knot = int(((surface.man - _KNOT) ** 2).sum(axis=1).argmin())
    at, out = surface.positions[knot], surface.normals[knot]
    flow = tangent(_KNOT - surface.man, surface.normals)
    sway = 0.05 * random.normal(0, 1, (n, 3))
    length = 1.12 * np.linalg.norm(man - _KNOT, axis=1) * surface.scale
    length = np.minimum(length, 1.5 * surface.scale) * random.uniform(0.9, 1.0, n)
    # Fullness of the hair, which makes it stand off the head: from 0 at the height of the eyes to 1
    # at 0.4 dm above the eyes.
    full = smooth_step(man[:, 1] / 0.4)
    rise = np.radians(random.uniform(3, 9, n) + 9 * full), np.zeros(n)
    above = _scalp_vertices(surface)
    least = (0.004 + 0.035 * full + (0.014 + 0.02 * full) * random.random(n)) * surface.scale
    points, outside = grow(
        surface, roots, flow, length, rise, 6, above, least, 0.3, hug=1.2, sway=sway
    )
    half = (0.032 + 0.04 * smooth_step(inside / 0.14)) * surface.scale * random.uniform(0.8, 1.2, n)
    turns = np.radians(random.uniform(-5, 5, n))
    taper = np.interp(np.linspace(0, 1, 6), [0, 0.2, 0.7, 1], [0.75, 1.0, 0.8, 0.45])
    tiles = _tiles(inside, random, 0.12)
    drawn = make_strips(points, outside, half, taper, tiles, roots, turns)
    size = 0.27 * surface.scale * person.hair_length
    wound = _knot(surface.nearest(at[None]), at + 0.72 * size * out, out, size, random)
    return joined([drawn, wound])


def _knot(
    root: Roots, middle: Floats, axis: Floats, size: float, random: np.random.Generator
) -> Strips:
    """Strips wound about an axis into a ball; the inner ones are opaque.

    Args:
        root: a place on the skin that all strips follow.
        middle: float64[3], middle of the ball in decimetres.
        axis: float64[3], unit vector of the axis, away from the skin.
        size: radius of the ball in decimetres.
        random: generator of the strips.
    """
    count, rows = 64, 6
    across = unit(np.cross(axis, [1.0, 0.0, 0.0]))
    other = np.cross(axis, across)
    inner = np.arange(count) < 24
    begin = np.where(inner, np.arange(count) * 0.7, random.uniform(0, 2 * np.pi, count))
    t = np.linspace(0, 1, rows)
    around = begin[:, None] + np.radians(np.where(inner, 150, 190))[:, None] * t
    low = np.where(inner, np.linspace(-0.9, 1.2, count) * 0 - 0.2, random.uniform(-0.7, 0.5, count))
    up = low[:, None] + np.where(inner, 1.1, random.uniform(0.5, 1.1, count))[:, None] * t
    up = np.minimum(up, 1.35)
    ray = (
        np.cos(up)[..., None]
        * (np.cos(around)[..., None] * across + np.sin(around)[..., None] * other)
        + np.sin(up)[..., None] * axis
    )
    flat = np.where(inner, 0.9, random.uniform(0.97, 1.06, count))[:, None, None]
    points = middle + size * flat * ray
    half = np.where(inner, 0.62, random.uniform(0.16, 0.26, count)) * size
    numbers = np.arange(count)
    tiles = np.where(inner, tile("solid", numbers), tile("scalp", numbers % DENSE))
    roots = Roots(np.repeat(root.corners, count, 0), np.repeat(root.shares, count, 0))
    taper = np.interp(t, [0, 0.15, 0.85, 1], [0.8, 1.0, 1.0, 0.6])
    return make_strips(points, ray, half, taper, tiles, roots, held=0.0)


STYLES: dict[str, Callable[[Surface, Person], Strips]] = {
    "crop": crop,
    "receding": receding,
    "afro": afro,
    "long": long,
    "bun": bun,
}
