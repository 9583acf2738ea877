# SPDX-License-Identifier: MIT
"""Values of the template's vertices on another head's own vertices.

Each vertex takes over from the place of the template that lies nearest and faces the same way.
Where none does (the back of a throat, hair, a collar, a hole of a scan) values go on from the
neighbours, over the head's own triangles, so that nothing tears.
"""

from __future__ import annotations

import numpy as np

from ..._native import ClosestPoints
from ...author.geometry.skeleton import Doubles, Ints
from ..surface import Surface
from .smoothing import Smoothing, areas

_FACING = 0.4  # least cosine between normals of places that may be the same
_FARTHEST = 1.5  # cm
_NEAR = 0.3  # cm: a place so far off holds its value a third as much
_UNSURE = 0.5  # of a sure vertex: how much one holds that registration carried along with others
_EVENED = 0.05  # cm, over which values are evened out
_ASIDE = 0.3  # cm, over which neighbours are asked whether a value fits theirs
_OUTLIER = 0.4  # of a pose's longest way: a value so far from its neighbours' holds a quarter
_ROUNDS = 3  # of asking
_AT_REST = 1e-7  # of the area: what hangs on no known place rests


class Spreading:
    """From vertices of a template that lies on a head to the head's vertices.

    Attributes:
        known: float64[V], 0 to 1: how sure the template's place of each vertex is.
    """

    def __init__(
        self,
        target: Surface,
        template: Surface,
        trust: Doubles,
        parting: Doubles | None = None,
        threads: int = 0,
    ) -> None:
        """Finds the places and factorises.

        Args:
            target: the head, cm.
            template: the template's triangles, its points on the head.
            trust: float64[template vertices], 0 to 1: how sure the place of each is.
            parting: float64[template vertices, n, 3], ways in which lips and lids part: vertices
                that a slip of the registration puts across a slit are found by their neighbours.
            threads: 0: one for each core.
        """
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
        area, smoothing = areas(merged), Smoothing(merged)
        if parting is not None and parting.size:
            self._held *= self._fitting(smoothing, area, parting)
        self.known = self._held[self._of]
        self._held *= area
        self._solver = smoothing.solver(self._held + _AT_REST * area, _EVENED)

    def _fitting(self, smoothing: Smoothing, area: Doubles, parting: Doubles) -> Doubles:
        """float64[n], 0 to 1: how well the value of each vertex fits those of its neighbours."""
        longest = np.linalg.norm(parting, axis=2).max(axis=0)
        values = self._values(parting.reshape(len(parting), -1))
        fits = np.ones(len(values))
        for _ in range(_ROUNDS):
            held = self._held * fits * area
            solver = smoothing.solver(held + _AT_REST * area, _ASIDE)
            even = solver.solve(values * held[:, None], self._threads)
            off = np.linalg.norm((values - even).reshape(len(values), -1, 3), axis=2) / longest
            fits = np.square(1.0 / (1.0 + np.square(off.max(axis=1) / _OUTLIER)))
        return fits

    def _values(self, values: Doubles) -> Doubles:
        """float64[n, k] at the places of the vertices, of values of the template's vertices."""
        out = np.zeros((len(self._corners), values.shape[1]))
        for k in range(3):
            out += self._shares[:, k, None] * values[self._corners[:, k]]
        return out

    def spread(self, values: Doubles) -> Doubles:
        """float64[V, k] on the head.

        Args:
            values: float64[template vertices, k].
        """
        right = self._values(values) * self._held[:, None]
        return np.asarray(self._solver.solve(right, self._threads)[self._of])


def _merged(surface: Surface) -> tuple[Ints, Ints]:
    """int64[V] a number for each vertex, the same for those at one place that face one way, as at
    seams of textures; and a vertex of each number."""
    size = float(np.ptp(surface.points, axis=0).max()) or 1.0
    normals = surface.normals()
    places = np.round(surface.points / (1e-6 * size)).astype(np.int64)
    # Lips that touch lie at one place and face each other.
    facing = np.round(normals * 0.7).astype(np.int64)
    _, first, of = np.unique(
        np.concatenate([places, facing], axis=1), axis=0, return_index=True, return_inverse=True
    )
    return of.ravel(), first
