# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the user's edits of positions and shape keys, and prepares their transfer.

A number counts as edited if it differs bit for bit from the import of the original file. If Blender
moved a shape key together with the basis, the rounding of four float32 additions is allowed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Mask = NDArray[np.bool_]


def changed(present: Float32, imported: Float32) -> Mask:
    """Find the coordinates that differ from the imported ones, bool[V, 3].

    Args:
        present, imported: float32[V, 3].
    """
    return np.asarray(present != imported)


def shaped(basis: Float32, indices: NDArray[np.int64], deltas: Float32) -> Float32:
    """Positions of a shape key after import: the basis plus sparse deltas.

    Args:
        basis: float32[V, 3].
        indices: int64[n], indices of vertices that move.
        deltas: float32[n, 3], offsets of these vertices.
    """
    points = basis.copy()
    np.add.at(points, indices, deltas)
    return points


def key_edits(
    basis: Float32, points: Float32, imported_basis: Float32, wanted: Float32
) -> tuple[Mask, Float]:
    """Find the vertices of a shape key that the user edited.

    Args:
        basis: float32[V, 3] the current basis.
        points: float32[V, 3] the current key.
        imported_basis: float32[V, 3] the imported basis.
        wanted: float32[V, 3], `shaped(basis, ...)` with the deltas of the key's channel.

    Returns:
        bool[V], edited vertices, and float64[V, 3], the offset of each from `wanted`; 0 elsewhere.
    """
    differs = points != wanted
    if not differs.any():
        return np.zeros(len(points), np.bool_), np.zeros(points.shape)
    # Blender moves a shape key by the same offset as the basis, in float32. Four sums are rounded,
    # here and in Blender, each by at most half a unit in the last place. So results may differ by
    # two units in the last place of the largest number.
    before = imported_basis + (wanted - basis)
    largest = np.max(np.abs([basis, imported_basis, points, wanted, before]), axis=0)
    rounding = 2.0 * np.spacing(largest)
    moved_along = (basis != imported_basis) & (np.abs(points - wanted) <= rounding)
    mask = np.any(differs & ~moved_along, axis=1)
    difference = np.zeros(points.shape)
    difference[mask] = points[mask].astype(np.float64) - wanted[mask]
    return mask, difference


def index_map(old: Sequence[str], new: Sequence[str]) -> list[int]:
    """Index of each old label among the new ones, -1 if it is missing."""
    where = {label: i for i, label in enumerate(new)}
    return [where.get(label, -1) for label in old]


def barycentric(points: Float, corners: Float) -> Float:
    """Barycentric weights of points in triangles.

    Args:
        points: float64[n, 3], in the plane of their triangles.
        corners: float64[n, 3, 3], corners of the triangle of each point.

    Returns:
        float64[n, 3], at least 0, with a sum of 1 per row; 1/3 each for a triangle without area.
    """
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = points - corners[:, 0]
    aa, ab, bb = (np.sum(x * y, axis=1) for x, y in ((a, a), (a, b), (b, b)))
    ap, bp = np.sum(a * p, axis=1), np.sum(b * p, axis=1)
    area = aa * bb - ab * ab
    safe = np.where(area > 0, area, 1.0)
    v, w = (bb * ap - ab * bp) / safe, (aa * bp - ab * ap) / safe
    weights = np.clip(np.stack([1 - v - w, v, w], axis=1), 0.0, None)
    total = weights.sum(axis=1, keepdims=True)
    good = (area > 0)[:, None] & (total > 0)
    return np.where(good, weights / np.where(total > 0, total, 1.0), 1 / 3)


def sizes(moves: Float, unit: float) -> tuple[int, float, float]:
    """Number, largest and mean length of offsets.

    Args:
        moves: float64[n, 3], offsets in Blender units.
        unit: metres per Blender unit.

    Returns:
        n, and largest and mean length in mm; 0 for an empty array.
    """
    if not len(moves):
        return 0, 0.0, 0.0
    lengths = np.linalg.norm(moves, axis=1) * unit * 1000.0
    return len(moves), float(lengths.max()), float(lengths.mean())


def replace_totals(
    targets: Sequence[tuple[NDArray[np.uint32], Float32]],
    vertices: NDArray[np.int64],
    totals: Float32,
) -> list[tuple[NDArray[np.uint32], Float32]]:
    """Change the sparse targets of a channel so that its deltas have given sums at some vertices.

    Args:
        targets: (vertex indices, deltas float32[K, 3]) of each target, at least one.
        vertices: int64[n] ascending, where the sum changes.
        totals: float32[n, 3], the new sums at these vertices.

    Returns:
        The targets; deltas of other vertices stay, and vertices without a delta are added to the
        first target.
    """
    row_of = {int(v): row for row, v in enumerate(vertices)}
    placed: set[int] = set()
    result = []
    for indices, deltas in targets:
        written = deltas.copy()
        for place, vertex in enumerate(indices.tolist()):
            if vertex in row_of:
                # Write the total for the first occurrence of a vertex and 0 for others, because
                # deltas add up.
                written[place] = 0.0 if vertex in placed else totals[row_of[vertex]]
                placed.add(vertex)
        result.append((indices, written))
    missing = np.array([v for v in vertices.tolist() if v not in placed], np.int64)
    if len(missing):
        indices, deltas = result[0]
        added = totals[[row_of[int(v)] for v in missing]]
        joined = np.concatenate([indices, missing.astype(indices.dtype)])
        rows = np.concatenate([deltas, added])
        if np.all(indices[1:] > indices[:-1]):  # keep ascending order
            order = np.argsort(joined, kind="stable")
            joined, rows = joined[order], rows[order]
        result[0] = (joined, rows)
    return result
