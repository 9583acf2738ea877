# SPDX-License-Identifier: MIT
"""Interpolates values at the template's vertices to the vertices of another head.

Each vertex takes the value of the nearest template point that has a similar normal. Vertices
without such a point (the back of a throat, hair, a collar, a hole of a scan) get a smooth
continuation of their neighbours' values over the head's triangles.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..._native import ClosestPoints
from ...author.geometry.skeleton import Doubles, Ints
from ..surface import Surface
from ..telling import Progress, telling
from .smoothing import Smoothing, areas

_FACING = 0.4  # least cosine between the normals of a vertex and its point on the template
_FARTHEST = 1.5  # cm: largest distance of that point
_NEAR = 0.3  # cm: distance of that point at which the weight of its value is 1/e
_UNSURE = 0.5  # least trust of a template vertex, for vertices that only followed their neighbours
_EVENED = 0.02  # cm: smoothing radius of the values
_ASIDE = 0.3  # cm: smoothing radius of the values with which outliers are compared
_OUTLIER = 0.4  # of a pose's longest displacement: deviation at which a weight is quartered
_ROUNDS = 3  # of the search for outliers
_AT_REST = 1e-7  # of the area: weight of the value 0, for vertices without known neighbours


class Spreading:
    """Interpolation from the vertices of a registered template to the head's vertices.

    Attributes:
        known: float64[V], 0 to 1: confidence in the template's point of each head vertex.
    """

    def __init__(
        self,
        target: Surface,
        template: Surface,
        trust: Doubles,
        parting: Doubles | None = None,
        threads: int = 0,
        progress: Progress | None = None,
    ) -> None:
        """Find the template's point of each vertex, and factorise the smoothing system.

        Args:
            target: the head in cm.
            template: the template with its vertices on the head.
            trust: float64[template vertices], 0 to 1: confidence in the position of each vertex.
            parting: float64[template vertices, n, 3], displacements of n poses that part lips and
                lids; they reveal head vertices that are matched to the wrong side of a slit.
            threads: number of threads; 0: one for each core.
            progress: receives the finished share of the work, 0 to 1; stops the work if it
                returns False.

        Raises:
            Stopped: `progress` returned False.
        """
        tell = telling(progress)
        self._of, first = _merged(target)
        merged = Surface(target.points[first], self._of[target.triangles])
        self._threads = threads
        normals = target.normals()[first]
        triangle, shares, distance = ClosestPoints(template.points, template.triangles).nearest(
            merged.points, normals, _FACING, _FARTHEST, threads
        )
        found = triangle >= 0
        self._corners = template.triangles[np.where(found, triangle, 0)]
        self._shares = np.where(found[:, None], shares, 0.0)
        sure = np.einsum("nk,nk->n", self._shares, np.maximum(trust, _UNSURE)[self._corners])
        near = np.exp(-np.square(np.where(found, distance, _FARTHEST) / _NEAR))
        self._held = np.where(found, sure * near, 0.0)
        tell(0.2)
        area, smoothing = areas(merged), Smoothing(merged)
        if parting is not None and parting.size:
            rounds = telling(progress, 0.2, 0.8)
            self._held *= self._fitting(smoothing, area, parting, rounds)
        tell(0.8)
        self.known = self._held[self._of]
        self._held *= area
        self._solver = smoothing.solver(self._held + _AT_REST * area, _EVENED)

    def _fitting(
        self, smoothing: Smoothing, area: Doubles, parting: Doubles, tell: Callable[[float], bool]
    ) -> Doubles:
        """float64[n], 0 to 1: how close the motion of each vertex in the poses is to its
        neighbours' motion.

        tell: gets the finished share of the work.
        """
        longest = np.linalg.norm(parting, axis=2).max(axis=0)
        values = self._values(parting.reshape(len(parting), -1))
        fits = np.ones(len(values))
        for number in range(_ROUNDS):
            tell(number / _ROUNDS)
            held = self._held * fits * area
            solver = smoothing.solver(held + _AT_REST * area, _ASIDE)
            tell((number + 0.5) / _ROUNDS)
            even = solver.solve(values * held[:, None], self._threads)
            off = np.linalg.norm((values - even).reshape(len(values), -1, 3), axis=2) / longest
            fits = np.square(1.0 / (1.0 + np.square(off.max(axis=1) / _OUTLIER)))
        return fits

    def _values(self, values: Doubles) -> Doubles:
        """float64[n, k]: values of the template's vertices, interpolated at the head vertices."""
        out = np.zeros((len(self._corners), values.shape[1]))
        for k in range(3):
            out += self._shares[:, k, None] * values[self._corners[:, k]]
        return out

    def spread(self, values: Doubles) -> Doubles:
        """float64[V, k]: the smoothed values at the head's vertices.

        Args:
            values: float64[template vertices, k], any k values per vertex.
        """
        right = self._values(values) * self._held[:, None]
        return np.asarray(self._solver.solve(right, self._threads)[self._of])


def _merged(surface: Surface) -> tuple[Ints, Ints]:
    """int64[V]: an index for each vertex, equal for vertices with the same position and normal, as
    at texture seams; int64[n]: one vertex of each index."""
    size = float(np.ptp(surface.points, axis=0).max()) or 1.0
    normals = surface.normals()
    places = np.round(surface.points / (1e-6 * size)).astype(np.int64)
    # Touching lips have vertices at the same position with opposite normals, which must stay apart.
    facing = np.round(normals * 0.7).astype(np.int64)
    _, first, of = np.unique(
        np.concatenate([places, facing], axis=1), axis=0, return_index=True, return_inverse=True
    )
    return of.ravel(), first
