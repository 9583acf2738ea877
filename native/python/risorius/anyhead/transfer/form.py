# SPDX-License-Identifier: MIT
"""Computes the deformation gradient at each vertex between two surfaces with equal triangles.

The gradients are of Sumner and Popovic ("Deformation Transfer for Triangle Meshes", 2004), but at
vertices and smoothed over 2 cm: the form of a lip's edge or a pore does not determine how far a
mouth opens.
"""

from __future__ import annotations

import numpy as np

from ...author.geometry.skeleton import Doubles
from ..surface import Surface
from .smoothing import Smoothing, areas

EVENED = 2.0  # cm: smoothing radius of the gradients
_UNSURE = 0.3  # least weight of a vertex, for vertices that only followed their neighbours
_ALIKE = 0.1  # natural logarithm of a stretch: far smaller changes get the least exponent
_STEADY = 1e-6  # weight of the identity, for directions without edges


def changes_of_form(before: Surface, after: Doubles, trust: Doubles) -> Doubles:
    """float64[V, 3, 3]: matrices that map small vectors at a vertex from `before` to `after`.

    Args:
        before: a surface in cm.
        after: float64[V, 3], positions of its vertices on another head.
        trust: float64[V], 0 to 1: confidence in the positions `after`; weights below 0.3 count as
            0.3.
    """
    mixed, own = _sums(before, after)
    share = np.maximum(trust, _UNSURE)[:, None]
    sums = np.concatenate([mixed.reshape(-1, 9) * share, own.reshape(-1, 9) * share], axis=1)
    even = Smoothing(before).solver(areas(before), EVENED / np.sqrt(2)).solve(sums)
    mixed, own = even[:, :9].reshape(-1, 3, 3), even[:, 9:].reshape(-1, 3, 3)
    scale = np.maximum(np.trace(own, axis1=1, axis2=2), 1e-30)[:, None, None]
    steady = _STEADY * scale * np.eye(3)
    turned = np.linalg.solve(own + steady, np.swapaxes(mixed + steady, 1, 2))
    return np.asarray(np.swapaxes(turned, 1, 2))


def softened(forms: Doubles, least: float) -> Doubles:
    """float64[..., 3, 3]: matrices with weaker stretches; rotations stay.

    The motions of heads of similar size are more alike than the heads, and a small change of form
    is partly an error of the registration. Each principal stretch is raised to a power, from
    `least` for small changes to 1 for large changes, so that strongly stylised heads move fully.

    Args:
        forms: float64[..., 3, 3], regular matrices.
        least: the power of a stretch near 1.
    """
    left, stretch, right = np.linalg.svd(forms)
    change = np.log(np.maximum(stretch, 1e-9))
    power = (change**2 + least * _ALIKE**2) / (change**2 + _ALIKE**2)
    return np.asarray((left * np.exp(power * change)[..., None, :]) @ right)


def _sums(before: Surface, after: Doubles) -> tuple[Doubles, Doubles]:
    """float64[V, 3, 3] each: for each vertex, the sum of b a^T and the sum of a a^T over its edges
    and its normal. a is the vector on the surface `before`, b the same vector on the surface
    `after`. Normals are scaled to the length of the edges."""
    count = len(before.points)
    edges = before.edges()
    a = before.points[edges[:, 1]] - before.points[edges[:, 0]]
    b = after[edges[:, 1]] - after[edges[:, 0]]
    mixed, own = np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
    for row in range(3):
        for column in range(3):
            for end in (0, 1):
                at = edges[:, end]
                mixed[:, row, column] += np.bincount(at, b[:, row] * a[:, column], count)
                own[:, row, column] += np.bincount(at, a[:, row] * a[:, column], count)
    normals = [s.normals() for s in (before, Surface(after, before.triangles))]
    square = np.trace(own, axis1=1, axis2=2)
    grown = np.trace(mixed, axis1=1, axis2=2).clip(0) / np.maximum(square, 1e-30)
    mixed += (square * grown)[:, None, None] / 2 * normals[1][:, :, None] * normals[0][:, None, :]
    own += square[:, None, None] / 2 * normals[0][:, :, None] * normals[0][:, None, :]
    return mixed, own
