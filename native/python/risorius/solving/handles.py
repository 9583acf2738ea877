# SPDX-License-Identifier: MIT
"""Places handles for dragging: few vertices by which as many controls as possible can be set.

The idea is from Jin Huat Kim and Karan Singh, "Optimizing UI Layouts for Deformable Face-Rig
Manipulation", ACM Transactions on Graphics 40 (4), 2021. The authors use integer programming; here
handles are chosen one after the other, each for controls that the earlier ones cannot move.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..base.given import MOST, checked, whole
from .surface import Doubles, Floats, Surface

_MOST_CANDIDATES = 3000  # largest number of vertices that are considered
_CHUNK = 1024  # vertices whose Jacobian is computed together


def place_handles(surface: Surface, mesh: int, count: int = 24) -> npt.NDArray[np.int64]:
    """int64[n]: vertices of a mesh that are good handles, best first; n is at most count.

    On a symmetric face the handles are symmetric too, but the last one may lack its mirror image.

    Args:
        surface: surface of the face.
        mesh: index in dna.meshes.
        count: largest number of handles.

    Raises:
        ValueError: an unknown mesh, a count below 1.
    """
    checked("count", whole, count, 1, MOST)
    places = surface.positions(surface.rig.initial_raw_controls, mesh).astype(np.float64)
    if not len(places):
        return np.zeros(0, np.int64)
    size = float(np.ptp(places, axis=0).max())
    candidates = _shown(places, surface, size)
    candidates = candidates[:: max(1, -(-len(candidates) // _MOST_CANDIDATES))]
    reach = _reach(surface, mesh, candidates)
    mirrored = _mirrored(places, surface.side, surface.up, size)
    chosen: list[int] = []
    near = np.full(len(candidates), np.inf)
    while len(chosen) < count:
        left = np.sqrt((reach**2).sum(axis=(1, 2)))
        score = left * np.minimum(1, near / (size / 10))
        best = int(np.argmax(score))
        if not score[best] > 1e-6 * size:
            break
        pair = [int(candidates[best])]
        if mirrored[pair[0]] not in (-1, pair[0]) and len(chosen) + 2 <= count:
            pair.append(int(mirrored[pair[0]]))
        for vertex in pair:
            if vertex not in chosen:
                chosen.append(vertex)
            near = np.minimum(near, np.linalg.norm(places[candidates] - places[vertex], axis=1))
        _leave_out(reach, surface, mesh, pair)
    return np.array(chosen, np.int64)


def _shown(places: Doubles, surface: Surface, size: float) -> npt.NDArray[np.int64]:
    """int64[n]: vertices that are visible from the front, without the inside of the mouth.

    Args:
        places: float64[V, 3], neutral positions.
        surface: surface of the face, which knows the file's axes.
        size: largest extent of the mesh.
    """
    depth = places @ surface.front
    flat = places[:, [surface.side, surface.up]]
    cells = np.floor((flat - flat.min(axis=0)) / (size / 50))
    cell = cells.astype(np.int64)
    grid = np.full((cell[:, 0].max() + 3, cell[:, 1].max() + 3), -np.inf)
    np.maximum.at(grid, (cell[:, 0] + 1, cell[:, 1] + 1), depth)
    return np.flatnonzero(depth > grid[cell[:, 0] + 1, cell[:, 1] + 1] - size / 40)


def _reach(surface: Surface, mesh: int, vertices: npt.NDArray[np.int64]) -> Floats:
    """float32[n, 3, R]: displacement of each vertex per unit of each control, from
    the neutral pose.

    Args:
        surface: surface of the face.
        mesh: index in dna.meshes.
        vertices: int64[n], indices of vertices.
    """
    rest = surface.rig.initial_raw_controls
    parts = [vertices[i : i + _CHUNK] for i in range(0, len(vertices), _CHUNK)]
    return np.concatenate([surface.jacobian(rest, mesh, part) for part in parts])


def _mirrored(places: Doubles, side: int, up: int, size: float) -> npt.NDArray[np.int64]:
    """int64[V]: the mirrored vertex of each vertex, on the midline the vertex itself; -1: none.

    Args:
        places: float64[V, 3], neutral positions.
        side: index of the axis from left to right.
        up: index of the vertical axis.
        size: largest extent of the mesh.
    """
    near = size / 300
    middle = (places[:, side].min() + places[:, side].max()) / 2
    other = places.copy()
    other[:, side] = (0.0 if abs(middle) < size / 50 else 2 * middle) - places[:, side]
    order = np.argsort(places[:, up], kind="stable")
    heights = places[order, up]
    begins = np.searchsorted(heights, other[:, up] - near)
    ends = np.searchsorted(heights, other[:, up] + near)
    out = np.full(len(places), -1)
    for vertex in range(len(places)):
        rows = order[begins[vertex] : ends[vertex]]
        if len(rows):
            apart = np.abs(places[rows] - other[vertex]).sum(axis=1)
            nearest = int(np.argmin(apart))
            if apart[nearest] < near:
                out[vertex] = rows[nearest]
    return out


def _leave_out(reach: Floats, surface: Surface, mesh: int, vertices: list[int]) -> None:
    """Removes from `reach` the combinations of controls that the new handles can already drag.

    Args:
        reach: float32[n, 3, R], displacements by controls; changed in place.
        surface: surface of the face.
        mesh: index in dna.meshes.
        vertices: the new handles.
    """
    rows = surface.jacobian(surface.rig.initial_raw_controls, mesh, np.array(vertices))
    _, values, directions = np.linalg.svd(rows.reshape(-1, rows.shape[2]), full_matrices=False)
    for value, direction in zip(values, directions, strict=True):
        if value > 1e-3 * values[0]:
            reach -= (reach @ direction)[..., None] * direction
