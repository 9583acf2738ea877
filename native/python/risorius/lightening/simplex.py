# SPDX-License-Identifier: MIT
"""Least squares with shares that are not negative and sum to 1."""

from __future__ import annotations

import numpy as np

from ..author.geometry.skeleton import Doubles

_RIDGE = 1e-7  # of the largest square: what two joints that move alike share is split evenly
_LEAST = 1e-4  # a smaller share is none


def shares(grams: Doubles, rights: Doubles, most: int) -> Doubles:
    """float64[n, k] with the least w^T G w - 2 b^T w of each row, of sum 1 and none below 0.

    Shares that come out negative leave, all of a row at once; then the smallest beyond the most
    that a row may have. It is near the least, not always at it.

    Args:
        grams: float64[n, k, k], symmetric.
        rights: float64[n, k].
        most: shares of a row at most.
    """
    count, size = rights.shape
    active = np.ones((count, size), bool)
    out = np.zeros((count, size))
    open_rows = np.arange(count)
    for _ in range(size + 2):
        if not len(open_rows):
            break
        found = _solve(grams[open_rows], rights[open_rows], active[open_rows])
        out[open_rows] = found
        leaving = active[open_rows] & (found < _LEAST)
        done = ~leaving.any(axis=1)
        crowded = done & (active[open_rows].sum(axis=1) > most)
        if crowded.any():
            rows = np.flatnonzero(crowded)
            order = np.argsort(-found[rows], axis=1, kind="stable")[:, most:]
            leaving[rows[:, None], order] = active[open_rows[rows, None], order]
        active[open_rows] &= ~leaving
        open_rows = open_rows[leaving.any(axis=1)]
    out[~active] = 0
    return np.asarray(out / out.sum(axis=1, keepdims=True))


def _solve(grams: Doubles, rights: Doubles, active: Doubles) -> Doubles:
    """The least with sum 1 over active shares, of any sign; others are 0."""
    count, size = rights.shape
    diagonal = np.einsum("nkk->nk", grams)
    largest = diagonal.max(axis=1) + 1e-30
    system = np.zeros((count, size + 1, size + 1))
    system[:, :size, :size] = grams / largest[:, None, None] * active[:, :, None] * active[:, None]
    at = np.arange(size)
    system[:, at, at] += np.where(active, _RIDGE, 1.0)
    system[:, size, :size] = system[:, :size, size] = active
    right = np.concatenate([rights / largest[:, None] * active, np.ones((count, 1))], axis=1)
    return np.asarray(np.linalg.solve(system, right[..., None])[:, :size, 0])
