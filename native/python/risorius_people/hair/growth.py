# SPDX-License-Identifier: MIT
"""Growth of a hair: it follows a flow over the skin and stands up by its stiffness."""

from __future__ import annotations

import numpy as np

from ..polygons import Floats, Ints
from .strips import unit
from .surface import Roots, Surface

_SUBSTEPS = 2
_LOOSE = 0.08  # decimetres over the skin at which `hug` has its full strength
_EASED = 2  # smoothing passes
_FREE = -0.4  # height on the man below which hair hangs freely


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
    """Grow guides from roots.

    Args:
        surface: the head.
        roots: the points where the guides begin.
        flow: float64[V, 3], direction of the hair at each vertex.
        lengths: float64[n], decimetres.
        rise: float64[n] each, the angle above the skin at the root and at the tip, radians.
        rows: points of each guide.
        among: vertices of the surface that a guide may come near.
        least: float64[n] or a number, smallest height of a tip over the skin, decimetres.
        stiff: share of the previous direction that each step keeps.
        fall: float64[n] or a number, weight of gravity at the tip.
        hug: strength that draws a loose guide back to the skin, above the ends of the ears.
        sway: float64[n, 3], constant offset of each guide from the flow. Noise in the flow itself
            would bend a card at every vertex.

    Returns:
        Points of the guides, and the outward normal of the skin there, float64[n, rows, 3] each.
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
    """Vectors projected into the skin, with unit length, float64[n, 3].

    Args:
        vectors: float64[n, 3].
        normals: float64[n, 3], unit.
    """
    return unit(vectors - (vectors * normals).sum(axis=1, keepdims=True) * normals)


def eased(points: Floats) -> Floats:
    """Guides smoothed along their rows, float64[n, rows, 3]; both ends stay.

    Args:
        points: float64[n, rows, 3].
    """
    out = points.copy()
    for _ in range(_EASED):
        out[:, 1:-1] = out[:, 1:-1] / 2 + (out[:, :-2] + out[:, 2:]) / 4
    return out


def curled(
    points: Floats, outside: Floats, radius: Floats, turns: Floats, random: np.random.Generator
) -> Floats:
    """Guides wound around themselves, from no winding at the root on, float64[n, rows, 3].

    Args:
        points: float64[n, rows, 3].
        outside: float64[n, rows, 3], direction away from the skin.
        radius: float64[n], radius of the winding, decimetres.
        turns: float64[n], number of turns over the whole length.
        random: chooses the start angle of each guide.
    """
    way = unit(np.gradient(points, axis=1))
    side = unit(np.cross(way, outside))
    up = np.cross(side, way)
    t = np.linspace(0, 1, points.shape[1])
    angle = 2 * np.pi * (turns[:, None] * t + random.random((len(points), 1)))
    far = radius[:, None] * np.minimum(3 * t, 1)
    # Raise only away from the skin: otherwise a curl would go through it.
    rise = (far * np.sin(angle))[..., None] * up
    inward = np.minimum((rise * outside).sum(axis=2, keepdims=True), 0)
    return np.asarray(points + (far * np.cos(angle))[..., None] * side + rise - inward * outside)
