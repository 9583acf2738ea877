# SPDX-License-Identifier: MIT
"""Makes the hairs of brows, lashes and beard."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from risorius.base.easing import smooth_step

from ..paint.atlas import tile
from ..paint.places import beard_density, brow_density, brow_place, brow_ridge, brow_width
from ..people import Person
from ..polygons import Floats, Ints
from .growth import curled, grow, tangent
from .strips import Strips, joined, make_strips, unit
from .surface import Surface, joined_roots

_BROW_SPACING = 0.0115  # decimetres between the roots of two cards
_BEARD_SPACING = 0.037  # decimetres between the roots of two cards
_OVER_LIP = 0.6  # factor on spacing and width of the beard's cards
_LONGEST_OVER_LIP = 0.08  # decimetres: longest hair above the lip
_RIM = 0.010  # decimetres from the data's line of lashes to the outer rim of the lid
# U (upper lid) or D (lower lid) -> (number of lash cards of one lid, longest lash in decimetres)
_LASHES = {"U": (48, 0.098), "D": (26, 0.044)}


def _turned(vectors: Floats, normals: Floats, angles: Floats) -> Floats:
    """float64[n, 3]: vectors rotated about the skin's normals by angles in radians."""
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    return np.asarray(c * vectors + s * np.cross(normals, vectors))


def brow_flow(surface: Surface) -> Floats:
    """float64[V, 3]: direction of brow hairs, upright at the nose, flat at the temple.

    Hairs below the middle line rise more steeply than hairs above it, which descend in the outer
    half of the brow; so the hairs form a ridge.

    Args:
        surface: surface of the head.
    """
    man, eye = surface.man, surface.eye
    along, height = brow_place(man, eye)
    side = np.sign(man[:, 0])
    steps = np.linspace(-0.2, 1.2, 57)
    rise = np.interp(along, steps, np.gradient(brow_ridge(steps), 1.4 / 56)) / 0.44
    arc = tangent(np.column_stack([side, rise, np.zeros(len(man))]), surface.normals)
    t = np.clip(along, 0, 1)
    across = np.clip(height / brow_width(t), -1, 1)
    low = np.interp(t, [0.0, 0.12, 0.3, 0.6, 1.0], [64, 56, 42, 26, 8])
    high = np.interp(t, [0.0, 0.12, 0.3, 0.6, 1.0], [56, 34, 2, -16, -14])
    angle = low + (high - low) * smooth_step(0.5 + 0.5 * across)
    # A positive rotation about the outward normal raises hairs on the left side of the face, and
    # lowers them on the right side.
    return tangent(_turned(arc, surface.normals, np.radians(angle) * side), surface.normals)


def brows(surface: Surface, person: Person) -> Strips:
    """Makes both brows; all people have their roots at the same places of the skin.

    Args:
        surface: surface of the head.
        person: the person; hairs of children and women are shorter, hairs of old people longer.
    """
    random = np.random.default_rng(21)
    front = surface.man_normals[:, 2] > 0.1  # excludes the inside of the eye socket
    density = brow_density(surface.man, surface.eye) * front
    roots = surface.scattered(density, _BROW_SPACING, random)
    along, _ = brow_place(roots.of(surface.man), surface.eye)
    n = len(roots)
    long = np.interp(along, [0.0, 0.18, 0.5, 1.0], [0.05, 0.085, 0.085, 0.055])
    size = 0.85 if person.gender == "female" else 1.0
    size *= float(np.interp(person.age, (8, 20, 60, 80), (0.8, 1.0, 1.05, 1.3)))
    long = long * surface.scale * size * random.uniform(0.8, 1.15, n)
    flow = brow_flow(surface) + 0.16 * random.normal(0, 1, surface.man.shape)
    rise = np.radians(random.uniform(10, 22, n)), np.radians(random.uniform(-2, 6, n))
    near = np.flatnonzero(np.abs(surface.man[:, 1] - 0.2) < 0.4)
    points, out = grow(surface, roots, flow, long, rise, 3, near, least=0.003)
    tiles = tile("brows", random.integers(0, 8, n))
    half = 0.0115 * surface.scale * random.uniform(0.8, 1.2, n)
    taper = np.array([1.0, 1.0, 0.7])
    turns = np.radians(random.uniform(-15, 15, n))
    return make_strips(points, out, half, taper, tiles, roots, turns)


def lash_curves(positions: Floats, faces: Ints) -> Floats:
    """float64[columns, 3]: the line on the lid where the data's lashes begin.

    The data's lashes are a grid: its first row is behind the lid's edge, its second row on the
    edge.

    Args:
        positions: float64[V, 3] of the person, in decimetres.
        faces: int64[n, 4], faces of the lashes of one lid.
    """
    grid = _grid(faces)
    rows = positions[grid]
    if rows[0, :, 2].mean() > rows[-1, :, 2].mean():  # the tips are in front of the roots
        rows = rows[::-1]
    line = rows[1]
    return np.asarray(line if abs(line[0, 0]) < abs(line[-1, 0]) else line[::-1])


def _grid(faces: Ints) -> Ints:
    """int64[rows, columns]: the vertices of a grid of quads; there are more columns than rows."""
    where: dict[int, tuple[int, int]] = {}
    rest = [f.tolist() for f in faces]
    for vertex, place in zip(rest.pop(0), ((0, 0), (1, 0), (1, 1), (0, 1)), strict=True):
        where[vertex] = place
    while rest:
        for face in rest:
            known = [k for k in range(4) if face[k] in where and face[(k + 1) % 4] in where]
            if known:
                break
        else:
            raise ValueError("lashes of the data: a grid of quads was expected")
        rest.remove(face)
        k = known[0]
        a, b, c, d = (face[(k + i) % 4] for i in range(4))
        (ax, ay), (bx, by) = where[a], where[b]
        way = (-(by - ay), bx - ax)  # the quad's other side is to the left of this edge
        where.setdefault(c, (bx + way[0], by + way[1]))
        where.setdefault(d, (ax + way[0], ay + way[1]))
    table = np.array(list(where.values()))
    table -= table.min(axis=0)
    out = np.zeros(table.max(axis=0) + 1, np.int64)
    out[table[:, 0], table[:, 1]] = list(where)
    return np.asarray(out if out.shape[0] < out.shape[1] else out.T)


def lashes(surface: Surface, lines: dict[str, Floats], person: Person) -> Strips:
    """Makes the lashes of all four lids: upper lashes long and curled, lower ones short and sparse.

    Args:
        surface: surface of the head.
        lines: "LU", "LD", "RU" or "RD" -> float64[n, 3], lash_curves from the nose outward.
        person: the person; lashes of women and children are longer.
    """
    random = np.random.default_rng(22)
    parts = []
    for name, line in lines.items():
        count, long = _LASHES[name[1]]
        sign = 1.0 if name[0] == "L" else -1.0
        upper = name[1] == "U"
        t = (np.arange(count) + random.uniform(0.2, 0.8, count)) / count
        t = 0.06 + 0.94 * t if upper else 0.14 + 0.86 * t
        steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
        at = np.concatenate([[0], np.cumsum(steps)]) / steps.sum()
        begin = np.column_stack([np.interp(t, at, line[:, k]) for k in range(3)])
        # Lashes are rooted at the outer rim, because skin behind it folds in when the eye closes.
        roots = surface.nearest(begin + _RIM * surface.scale * np.array([0.0, 0.0, 1.0]))
        root = roots.of(surface.positions)
        fan = np.interp(t, [0, 0.35, 0.7, 1.0], [-0.55, 0.0, 0.55, 1.05])
        fan += random.normal(0, 0.08, count)
        grown = np.interp(t, [0, 0.25, 0.7, 0.92, 1.0], [0.45, 0.75, 1.0, 0.9, 0.6])
        size = 1.08 if person.gender == "female" or person.age < 14 else 0.85
        length = long * surface.scale * size * grown * random.uniform(0.85, 1.1, count)
        if upper:
            first, last = np.radians(random.uniform(-6, 8, count)), np.radians(78.0)
        else:
            first, last = np.radians(random.uniform(-38, -22, count)), np.radians(-18.0)
        points = _arcs(root, np.sign(sign) * fan, length, first, last)
        out = np.zeros_like(points)
        out[...] = [0.0, 0.5 if upper else 0.2, 1.0]
        half = (0.0062 if upper else 0.0044) * surface.scale * random.uniform(0.85, 1.15, count)
        tiles = tile("lashes", random.integers(0, 16, count))
        taper = np.array([1.0, 1.0, 0.95, 0.85, 0.7])
        parts.append(make_strips(points, out, half, taper, tiles, roots, held=0.0))
    return joined(parts)


def _arcs(root: Floats, fan: Floats, length: Floats, first: Floats, last: float) -> Floats:
    """float64[n, 5, 3]: points of lashes that curl from one elevation to another.

    Args:
        root: float64[n, 3], roots in decimetres.
        fan: float64[n], distance to the side (+x) per distance to the front.
        length: float64[n], length of each lash in decimetres.
        first: float64[n], elevation at the root in radians.
        last: elevation at the tip in radians.
    """
    flat = unit(np.column_stack([fan, np.zeros(len(fan)), np.ones(len(fan))]))
    points = [root]
    for k in range(4):
        angle = first + (last - first) * ((k + 0.5) / 4) ** 1.2
        way = flat * np.cos(angle)[:, None] + np.array([0.0, 1.0, 0.0]) * np.sin(angle)[:, None]
        points.append(points[-1] + way * length[:, None] / 4)
    return np.stack(points, axis=1)


def beard(surface: Surface, lips: Floats, person: Person) -> Strips:
    """Makes the cards of beard and moustache.

    Args:
        surface: surface of the head.
        lips: float64[V], 1 on the lips and in the mouth, else 0.
        person: the person; its beard_style is not "none".
    """
    style = person.beard_style
    random = np.random.default_rng(23)
    man, full = surface.man, style == "full"
    density = beard_density(man, lips, style)
    over = _over_lip(man)
    spacing = _BEARD_SPACING * (1.0 if full else 0.8)
    # Hair above the lip is short, because long hair would enter the skin if the mouth moves.
    finer = surface.scattered(density * over, _OVER_LIP * spacing, random)
    roots = joined_roots([surface.scattered(density * ~over, spacing, random), finer])
    n = len(roots)
    lip = np.arange(n) >= n - len(finer)
    x, y, z = roots.of(man).T
    under = smooth_step((-0.75 - y) / 0.3) * (np.abs(x) < 0.45)
    long = {"full": 0.20, "short": 0.10, "goatee": 0.11, "moustache": 0.10}[style]
    length = long * (0.55 + 0.75 * under) * random.uniform(0.75, 1.2, n)
    length = np.where(lip, np.minimum(length, _LONGEST_OVER_LIP), length) * surface.scale
    length *= 0.5 + 0.5 * roots.of(density[:, None])[:, 0]
    length *= 0.55 + 0.45 * smooth_step((z + 0.6) / 0.3)  # shorter at the angle of the jaw
    flow = _beard_flow(man) + 0.22 * random.normal(0, 1, man.shape)
    rise = np.radians(random.uniform(28, 50, n)), np.radians(random.uniform(2, 25, n))
    rows = 3 if full else 2
    near = np.flatnonzero((man[:, 1] < 0.1) & (man[:, 2] > -0.9))
    points, out = grow(surface, roots, flow, length, rise, rows, near, least=0.004, fall=0.5)
    if person.hair_curl:
        wind = 0.03 * person.hair_curl * random.uniform(0.5, 1, n)
        points = curled(points, out, wind, np.full(n, 0.8), random)
    tiles = tile("beard", random.integers(0, 8, n))
    half = (0.034 if full else 0.026) * surface.scale * random.uniform(0.8, 1.25, n)
    half *= np.where(lip, _OVER_LIP, 1.0)
    turns = np.radians(random.uniform(-35, 35, n))
    taper = np.array([0.9, 1.0, 0.7])[-rows:]
    return make_strips(points, out, half, taper, tiles, roots, turns, held=0.0)


def _over_lip(man: Floats) -> NDArray[np.bool_]:
    """bool[V]: whether a vertex is in the area of the moustache."""
    return np.asarray((man[:, 1] > -0.72) & (np.abs(man[:, 0]) < 0.34) & (man[:, 2] > 0.1))


def _beard_flow(man: Floats) -> Floats:
    """float64[V, 3]: direction of beard hairs, down, and sideways above the lip."""
    x, _, z = man.T
    aside = np.where(_over_lip(man), np.sign(x) * (0.25 + 2.2 * np.abs(x)), 0.25 * x)
    return np.column_stack([aside, -np.ones(len(man)), 0.15 * (z < 0.0)])
