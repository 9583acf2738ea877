# SPDX-License-Identifier: GPL-3.0-or-later
"""The user's edits, relative to the import, and their transfer.

A number counts as edited if it differs bit for bit from the import of the original file. Only where
Blender moved a shape key with the basis, the rounding of two float32 additions is allowed.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Float32 = NDArray[np.float32]
Mask = NDArray[np.bool_]


def changed(present: Float32, imported: Float32) -> Mask:
    """Which coordinates of positions differ from the imported ones, bool[V, 3].

    Args:
        present, imported: float32[V, 3].
    """
    return np.asarray(present != imported)


def shaped(basis: Float32, indices: NDArray[np.int64], deltas: Float32) -> Float32:
    """Coordinates of a shape key as the import makes them: the basis plus sparse deltas.

    Args:
        basis: float32[V, 3].
        indices: int64[n], vertices that move.
        deltas: float32[n, 3], by how much.
    """
    points = basis.copy()
    np.add.at(points, indices, deltas)
    return points


def key_edits(
    basis: Float32, points: Float32, imported_basis: Float32, wanted: Float32
) -> tuple[Mask, Float]:
    """The edits of a shape key.

    Args:
        basis: float32[V, 3] the current basis.
        points: float32[V, 3] the current key.
        imported_basis: float32[V, 3] the imported basis.
        wanted: float32[V, 3] `shaped(basis, ...)` of the key's channel.

    Returns:
        bool[V], and float64[V, 3]: difference between the key's delta and the channel's; 0
        elsewhere.
    """
    differs = points != wanted
    if not differs.any():
        return np.zeros(len(points), np.bool_), np.zeros(points.shape)
    # An edit of the basis moves a key by the same offset, in float32: four sums, here and
    # there, are each rounded to half a unit in the last place: two units of the largest number
    # among them.
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
    """Weights of a triangle's corners at points of its plane.

    Args:
        points: float64[n, 3].
        corners: float64[n, 3, 3] a triangle for each point.

    Returns:
        float64[n, 3], each row at least 0 and of sum 1; a triangle without area gives thirds.
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
    """Number, largest and mean length of moves.

    Args:
        moves: float64[n, 3] Blender units.
        unit: metres per Blender unit.

    Returns:
        n, largest and mean in millimetres; 0 without moves.
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
    """Change the sparse targets of a channel to given sums at some vertices.

    Args:
        targets: (vertex indices, deltas float32[K, 3]) of each target, at least one.
        vertices: int64[n] ascending, where the sum changes.
        totals: float32[n, 3] the new sums there.

    Returns:
        The targets with all other deltas unchanged; new vertices are added to the first one.
    """
    row_of = {int(v): row for row, v in enumerate(vertices)}
    placed: set[int] = set()
    result = []
    for indices, deltas in targets:
        written = deltas.copy()
        for place, vertex in enumerate(indices.tolist()):
            if vertex in row_of:
                # Write a repeated vertex once and 0 otherwise, because the sum counts.
                written[place] = 0.0 if vertex in placed else totals[row_of[vertex]]
                placed.add(vertex)
        result.append((indices, written))
    missing = np.array([v for v in vertices.tolist() if v not in placed], np.int64)
    if len(missing):
        indices, deltas = result[0]
        added = totals[[row_of[int(v)] for v in missing]]
        joined = np.concatenate([indices, missing.astype(indices.dtype)])
        rows = np.concatenate([deltas, added])
        if np.all(indices[1:] > indices[:-1]):  # a file that keeps them in order stays so
            order = np.argsort(joined, kind="stable")
            joined, rows = joined[order], rows[order]
        result[0] = (joined, rows)
    return result
