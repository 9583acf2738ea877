# SPDX-License-Identifier: MIT
"""Grows guides of hair: polylines that follow a flow over the skin at given angles above it."""

from __future__ import annotations

import numpy as np

from ..polygons import Floats, Ints
from .strips import unit
from .surface import Roots, Surface

_SUBSTEPS = 2  # steps of a guide per row
_LOOSE = 0.08  # decimetres above the skin at which `hug` has its full strength
_EASED = 2  # number of smoothing passes
_FREE = -0.4  # height on the man's head below which hair hangs freely


def grow(
    surface: Surface,
    roots: Roots,
    flow: Floats,
    lengths: Floats,
    rise: tuple[Floats, Floats],
    rows: int,
    among: Ints,
    least: Floats | float = 0.004,
    stiff: float = 0.45,
    fall: Floats | float = 0.0,
    hug: float = 0.0,
    sway: Floats | float = 0.0,
) -> tuple[Floats, Floats]:
    """Grows guides from roots.

    Args:
        surface: surface of the head.
        roots: places where the guides begin.
        flow: float64[V, 3], direction of the hair at each vertex.
        lengths: float64[n], length of each guide in decimetres.
        rise: (float64[n], float64[n]), angle above the skin at the root and at the tip, in radians.
        rows: number of points of a guide.
        among: indices of vertices that the guides may come near.
        least: float64[n] or a number, smallest height of a guide above the skin in decimetres; it
            rises from 0 at the root to this value at a third of the length.
        stiff: weight of the previous direction in each step, 0 to 1.
        fall: float64[n] or a number, weight of gravity at the tip.
        hug: weight of the pull that keeps guides near the skin above the height of the ear lobes;
            0: no pull.
        sway: float64[n, 3], constant offset of each guide's direction from the flow. Noise in the
            flow would instead bend a card at every vertex.

    Returns:
        Points of the guides, and outward normals of the skin there, float64[n, rows, 3] each.
    """
    at = roots.of(surface.positions)
    out = unit(roots.of(surface.normals))
    along = tangent(roots.of(flow) + sway, out)
    before = along * np.cos(rise[0])[:, None] + out * np.sin(rise[0])[:, None]
    points, outside = [at], [out]
    step = lengths[:, None] / (rows - 1) / _SUBSTEPS
    for k in range(1, (rows - 1) * _SUBSTEPS + 1):
        t = k / ((rows - 1) * _SUBSTEPS)
        height, normal, vertex = surface.below(at, among)
        angle = rise[0] * (1 - t) ** 1.5 + rise[1] * (1 - (1 - t) ** 1.5)
        way = tangent(flow[vertex] + sway, normal)
        way = way * np.cos(angle)[:, None] + normal * np.sin(angle)[:, None]
        way[:, 1] -= t * np.asarray(fall)
        if hug:
            loose = np.clip((height - 2 * np.asarray(least)) / (_LOOSE * surface.scale), 0, 1)
            loose = loose * (surface.man[vertex, 1] > _FREE)
            way = way - hug * loose[:, None] * normal
        before = unit(stiff * before + (1 - stiff) * way)
        at = at + before * step
        height, normal, _ = surface.below(at, among)
        floor = least * min(1.0, 3 * t)
        at = at + normal * np.maximum(floor - height, 0)[:, None]
        if k % _SUBSTEPS == 0:
            points.append(at)
            outside.append(normal)
    return np.stack(points, axis=1), np.stack(outside, axis=1)


def tangent(vectors: Floats, normals: Floats) -> Floats:
    """float64[n, 3]: vectors projected onto the skin, scaled to length 1.

    Args:
        vectors: float64[n, 3], any vectors.
        normals: float64[n, 3], unit normals of the skin.
    """
    return unit(vectors - (vectors * normals).sum(axis=1, keepdims=True) * normals)


def eased(points: Floats) -> Floats:
    """float64[n, rows, 3]: guides smoothed along their rows; both ends stay.

    Args:
        points: float64[n, rows, 3], points of the guides.
    """
    out = points.copy()
    for _ in range(_EASED):
        out[:, 1:-1] = out[:, 1:-1] / 2 + (out[:, :-2] + out[:, 2:]) / 4
    return out


def curled(
    points: Floats, outside: Floats, radius: Floats, turns: Floats, random: np.random.Generator
) -> Floats:
    """float64[n, rows, 3]: guides wound to coils, whose radius grows from 0 at the root.

    Args:
        points: float64[n, rows, 3], points of the guides.
        outside: float64[n, rows, 3], unit vectors away from the skin.
        radius: float64[n], radius of the coils in decimetres.
        turns: float64[n], number of turns over the whole length.
        random: generator of each guide's start angle.
    """
    way = unit(np.gradient(points, axis=1))
    side = unit(np.cross(way, outside))
    up = np.cross(side, way)
    t = np.linspace(0, 1, points.shape[1])
    angle = 2 * np.pi * (turns[:, None] * t + random.random((len(points), 1)))
    far = radius[:, None] * np.minimum(3 * t, 1)
    # The coil rises only away from the skin, because it would otherwise go through the skin.
    rise = (far * np.sin(angle))[..., None] * up
    inward = np.minimum((rise * outside).sum(axis=2, keepdims=True), 0)
    return np.asarray(points + (far * np.cos(angle))[..., None] * side + rise - inward * outside)
