# SPDX-License-Identifier: MIT
"""Refits skin weights to the remaining joints, so that vertices move as in the source face."""

from __future__ import annotations

import copy

import numpy as np

from .. import Mesh
from ..author.geometry import skeleton as sk
from ..author.geometry.skeleton import Doubles, Ints
from .simplex import shares

_MOST = 12  # largest number of joints per vertex, usual for such faces
# Numbers of joints that are tried per vertex: the 14 joints with the largest weights, and the 6
# nearest joints.
_TAKEN_OVER, _NEAR = 14, 6
_AT_ONCE = 512  # number of vertices that are refitted together
_EVEN = 3e-3  # strength of the pull towards the weights after the takeover, which are smooth


class Refit:
    """Refits the weights of meshes of one LOD, from products of joint motions over all poses."""

    def __init__(self, products: Doubles, places: Doubles, parents: Ints, kept: Ints) -> None:
        """Args:
        products: float64[J, 4, J, 4], products of the motions of two joints at the LOD, summed over
            all poses.
        places: float64[J, 3], rest positions of the joints relative to the face's centre.
        parents: int64[J], parent of each joint.
        kept: indices of the remaining joints that the LOD lists, ascending.
        """
        self.products = np.ascontiguousarray(products.transpose(0, 2, 1, 3))
        self.places, self.parents, self.kept = places, parents, kept

    def refit(self, mesh: Mesh, points: Doubles, rows: Doubles) -> Mesh:
        """The mesh with weights of the remaining joints only.

        Vertices whose joints all remain keep their weights exactly.

        Args:
            mesh: the mesh with its old weights.
            points: float64[V, 3], vertices relative to the face's centre.
            rows: float64[V, J], weights after other joints took over vertices of removed joints.
        """
        had = sk.dense_weights(mesh, len(self.places))
        stays = np.zeros(len(self.places), bool)
        stays[self.kept] = True
        changed = np.flatnonzero(had[:, ~stays].any(axis=1))
        most = min(_MOST, max(1, int(mesh.maximum_influence_per_vertex) or _MOST))
        out: dict[int, tuple[Ints, Doubles]] = {}
        for begin in range(0, len(changed), _AT_ONCE):
            some = changed[begin : begin + _AT_ONCE]
            joints, weights = self._some(points[some], had[some], rows[some], most)
            out |= {
                int(v): (joints[at][weights[at] > 0], weights[at][weights[at] > 0])
                for at, v in enumerate(some)
            }
        return _with_rows(mesh, out)

    def _some(
        self, points: Doubles, had: Doubles, rows: Doubles, most: int
    ) -> tuple[Ints, Doubles]:
        """The refitted joints and weights of n vertices, both [n, k].

        Args:
            points: float64[n, 3], the vertices relative to the face's centre.
            had: float64[n, J], weights in the source face.
            rows: float64[n, J], weights after other joints took over vertices of removed joints.
            most: largest number of joints of a vertex.
        """
        own = np.argsort(-had, axis=1, kind="stable")[:, : int((had > 0).sum(axis=1).max())]
        held = np.take_along_axis(had, own, axis=1)
        tried = self._tried(points, rows)
        p = np.concatenate([points, np.ones((len(points), 1))], axis=1)
        gram = np.einsum(
            "vr,vklrs,vs->vkl", p, self.products[tried[:, :, None], tried[:, None]], p,
            optimize=True,
        )  # fmt: skip
        right = np.einsum(
            "vr,vkjrs,vs,vj->vk", p, self.products[tried[:, :, None], own[:, None]], p, held,
            optimize=True,
        )  # fmt: skip
        start = np.take_along_axis(rows, tried, axis=1)
        same = (tried[:, :, None] == tried[:, None]) & np.tri(tried.shape[1], k=-1, dtype=bool)
        twice = same.any(axis=2)  # True for a joint that is already in the vertex's list
        start[twice] = 0
        start /= np.maximum(start.sum(axis=1, keepdims=True), 1e-30)
        # A joint may be listed twice. The second entry is made so costly that its weight becomes 0.
        at = np.arange(tried.shape[1])
        diagonal = np.einsum("vkk->vk", gram)
        gram[:, at, at] += np.where(twice, 1e3 * diagonal.max(axis=1, keepdims=True) + 1e-12, 0)
        even = _EVEN * diagonal.mean(axis=1)
        gram[:, at, at] += even[:, None]
        found = shares(gram, right + even[:, None] * start, most)
        return tried, found

    def _tried(self, points: Doubles, rows: Doubles) -> Ints:
        """int64[n, k]: joints that a vertex may follow, with repetitions.

        The joints are the ones with the largest weights in `rows`, the parent of the first of them,
        and the nearest joints.

        Args:
            points: float64[n, 3], the vertices relative to the face's centre.
            rows: float64[n, J], weights after other joints took over vertices of removed joints.
        """
        took = self.kept[np.argsort(-rows[:, self.kept], axis=1, kind="stable")[:, :_TAKEN_OVER]]
        places = self.places[self.kept]
        apart = (points**2).sum(1)[:, None] - 2 * points @ places.T + (places**2).sum(1)
        near = self.kept[np.argsort(apart, axis=1, kind="stable")[:, :_NEAR]]
        above = self.parents[took[:, :1]]
        above = np.where(np.isin(above, self.kept), above, took[:, :1])
        return np.concatenate([took, above, near], axis=1)


def _with_rows(mesh: Mesh, rows: dict[int, tuple[Ints, Doubles]]) -> Mesh:
    """The mesh with new joints and weights of some vertices.

    Args:
        mesh: the mesh; not changed.
        rows: vertex -> (its joints, their weights).
    """
    out = copy.copy(mesh)
    offsets = np.asarray(mesh.skin_offsets, np.int64)
    joints = np.split(np.asarray(mesh.skin_joint_indices, np.int64), offsets[1:-1])
    weights = np.split(np.asarray(mesh.skin_weights, np.float64), offsets[1:-1])
    for vertex, (joint, weight) in rows.items():
        joints[vertex], weights[vertex] = joint, weight
    counts = [len(row) for row in joints]
    out.skin_offsets = np.concatenate([[0], np.cumsum(counts)])
    out.skin_joint_indices = np.concatenate(joints)
    out.skin_weights = np.concatenate(weights)
    return out
