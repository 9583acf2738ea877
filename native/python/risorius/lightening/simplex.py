# SPDX-License-Identifier: MIT
"""Solves least squares problems for weights that are at least 0 and sum to 1."""

from __future__ import annotations

import numpy as np

from ..author.geometry.skeleton import Doubles

_RIDGE = 1e-7  # fraction of the largest diagonal element: joints that move alike get equal weights
_LEAST = 1e-4  # smaller weights are dropped


def shares(grams: Doubles, rights: Doubles, most: int) -> Doubles:
    """float64[n, k]: for each problem, weights w that minimise w^T G w - 2 b^T w.

    The weights are at least 0 and sum to 1. Weights below 1e-4 of a problem are removed all at
    once, then the smallest until `most` are left, so the result is near the minimum but not always
    exact.

    Args:
        grams: float64[n, k, k], G of each problem, symmetric.
        rights: float64[n, k], b of each problem.
        most: largest number of weights above 0 per problem.
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
    """float64[n, k]: minima for weights with sum 1, which may be negative; inactive weights: 0.

    Args:
        grams: float64[n, k, k], matrix of each problem.
        rights: float64[n, k], right side of each problem.
        active: bool[n, k], weights that are not fixed to 0.
    """
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
