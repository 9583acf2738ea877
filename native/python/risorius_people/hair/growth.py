# SPDX-License-Identifier: MIT
"""How a hair grows: along a flow over the skin, standing up as far as it is stiff."""

from __future__ import annotations

import numpy as np

from ..polygons import Floats, Ints
from .strips import unit
from .surface import Roots, Surface

_SUBSTEPS = 2
_LOOSE = 0.08  # decimetres over the skin where a hair is drawn back most
_EASED = 2  # how often
_FREE = -0.4  # height under which hair hangs freely, of the man


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
    """Guides from roots.

    Args:
        surface: the head.
        roots: where they begin.
        flow: float64[V, 3], the way that hair lies at each vertex.
        lengths: float64[n], decimetres.
        rise: float64[n] each, the angle over the skin at the root and at the tip, radians.
        rows: points of each guide.
        among: vertices of the surface that a guide may come near.
        least: float64[n] or a number, height over the skin that a tip has at least, decimetres.
        stiff: share of the direction so far that each step keeps.
        fall: float64[n] or a number, weight of gravity at the tip.
        hug: how strongly a guide that has left the skin is drawn back to it, above the ears' ends.
        sway: float64[n, 3], by which each guide's own way differs from the flow, along all of it:
            noise of the flow itself would bend a card to and fro from vertex to vertex.

    Returns:
        float64[n, rows, 3] each: points, and the way out of the skin there.
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
    """float64[n, 3]: vectors laid into the skin, unit.

    Args:
        vectors: float64[n, 3].
        normals: float64[n, 3], unit.
    """
    return unit(vectors - (vectors * normals).sum(axis=1, keepdims=True) * normals)


def eased(points: Floats) -> Floats:
    """float64[n, rows, 3]: guides that do not bend to and fro from row to row; both ends stay.

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
    """float64[n, rows, 3]: guides wound about themselves, from nothing at the root on.

    Args:
        points: float64[n, rows, 3].
        outside: float64[n, rows, 3], away from the skin.
        radius: float64[n], decimetres.
        turns: float64[n], over the whole length.
        random: where each begins.
    """
    way = unit(np.gradient(points, axis=1))
    side = unit(np.cross(way, outside))
    up = np.cross(side, way)
    t = np.linspace(0, 1, points.shape[1])
    angle = 2 * np.pi * (turns[:, None] * t + random.random((len(points), 1)))
    far = radius[:, None] * np.minimum(3 * t, 1)
    # Away from the skin alone, or a curl would go through it.
    rise = (far * np.sin(angle))[..., None] * up
    inward = np.minimum((rise * outside).sum(axis=2, keepdims=True), 0)
    return np.asarray(points + (far * np.cos(angle))[..., None] * side + rise - inward * outside)
