# SPDX-License-Identifier: MIT
"""Adapts an expression to another person: displacements follow the local change of form.

The data's units fit one build of a face. If another person's lid is half as wide, it moves half as
far. The local change of form, a matrix at each vertex, gives scale and direction (Sumner and
Popovic, "Deformation Transfer for Triangle Meshes", 2004). The jaw rotates by the same angle in all
people, so only the rest of the displacement is converted by the matrices: a change of form that
differs between the edge of a small lip and the chin would turn the skin inside out.
"""

from __future__ import annotations

import numpy as np
from risorius.author.geometry.polygon_mesh import vertex_normals
from risorius.author.geometry.rigid import rigid_fit, rigid_way

from .polygons import Floats, Ints
from .source import BaseMesh

_RINGS = 25  # rounds in which the change of form is smoothed over neighbouring vertices
_WITH_SKIN = "eyelashes"  # groups with this in their name follow the nearest skin
_SKIN = "body"
_JAW = "helper-lower-teeth"
# Decimetres: the share of the jaw's rigid motion in a displacement fades to 0 for vertices that
# this rigid motion moves by about this length or less.
_REST = 0.005


class Proportions:
    """The change of form between two people with the same base mesh."""

    def __init__(
        self, base: BaseMesh, groups: dict[str, Ints], before: Floats, after: Floats
    ) -> None:
        """Computes the change of form.

        Args:
            base: the base mesh with the polygons.
            groups: name of a group of the base mesh -> vertex indices.
            before: float64[V, 3], positions of the person whose displacements are known.
            after: float64[V, 3], positions of the other person.
        """
        self._jaw, self._before, self._after = groups[_JAW], before, after
        self.changes = np.tile(np.eye(3), (len(before), 1, 1))
        faces = [[c[0] for c in face] for rows in base.faces.values() for face in rows]
        sums = _edge_sums(faces, before, after)
        skin = _evened(base, groups[_SKIN], *sums)
        self.changes[groups[_SKIN]] = skin[groups[_SKIN]]
        for name, vertices in groups.items():
            if name == _SKIN or name.startswith("joint"):
                continue
            if _WITH_SKIN in name:
                near = _nearest(before[vertices], before[groups[_SKIN]])
                self.changes[vertices] = skin[groups[_SKIN][near]]
            else:
                own, other = (x[vertices].sum(axis=0) for x in sums)
                self.changes[vertices] = _solved(own[None], other[None])[0]

    def carried(self, displacement: Floats) -> Floats:
        """float64[V, 3]: a displacement adapted to the other person.

        Args:
            displacement: float64[V, 3] of the person `before`.
        """
        bone, change = self._before[self._jaw], self.changes[self._jaw[0]]
        turn, _ = rigid_fit(bone, bone + displacement[self._jaw])
        shift = displacement[self._jaw].mean(axis=0)
        own = rigid_way(self._before, bone.mean(axis=0), turn, shift)
        middle = self._after[self._jaw].mean(axis=0)
        other = rigid_way(self._after, middle, turn, change @ shift)
        length = np.einsum("vi,vi->v", own, own) + _REST**2
        share = np.clip(np.einsum("vi,vi->v", displacement, own) / length, 0, 1)[:, None]
        way: Floats = np.einsum("vij,vj->vi", self.changes, displacement - share * own)
        return way + share * other


def affine_form(faces: list[list[int]], before: Floats, after: Floats) -> Floats:
    """The linear map [3, 3] that best fits the change of form of a whole mesh; shifts are ignored.

    Args:
        faces: the vertices of each polygon.
        before, after: float64[V, 3].
    """
    mixed, own = _edge_sums(faces, before, after)
    return _solved(mixed.sum(axis=0)[None], own.sum(axis=0)[None])[0]


def _edge_sums(faces: list[list[int]], before: Floats, after: Floats) -> tuple[Floats, Floats]:
    """float64[V, 3, 3] each: sums of b a^T and of a a^T over the edges at each vertex.

    a is an edge before and b the same edge after the change of form. The vertex's normal, scaled to
    the length of an edge, is added like an edge. The first sum times the inverse of the second sum
    is the matrix of the change.

    Args:
        faces: the vertices of each polygon.
        before, after: float64[V, 3], positions before and after the change of form.
    """
    start = np.concatenate(faces)
    end = np.concatenate([face[1:] + face[:1] for face in faces])
    mixed = np.zeros((len(before), 3, 3))
    own = np.zeros((len(before), 3, 3))
    a, b = before[end] - before[start], after[end] - after[start]
    for vertex in (start, end):
        _add(mixed, vertex, b[:, :, None] * a[:, None, :])
        _add(own, vertex, a[:, :, None] * a[:, None, :])
    normals = [vertex_normals(p, faces) for p in (before, after)]
    square = np.trace(own, axis1=1, axis2=2)
    grown = np.sqrt(np.trace(mixed, axis1=1, axis2=2).clip(0) / np.maximum(square, 1e-30))
    mixed += (square * grown)[:, None, None] / 2 * normals[1][:, :, None] * normals[0][:, None, :]
    own += square[:, None, None] / 2 * normals[0][:, :, None] * normals[0][:, None, :]
    return mixed, own


def _evened(base: BaseMesh, vertices: Ints, mixed: Floats, own: Floats) -> Floats:
    """float64[V, 3, 3]: changes of form of the skin, smoothed over neighbouring vertices.

    Args:
        base: the base mesh with the polygons.
        vertices: indices of the skin's vertices.
        mixed, own: float64[V, 3, 3], sums over the edges at each vertex.
    """
    there = np.zeros(len(mixed), bool)
    there[vertices] = True
    faces = [[c[0] for c in face] for face in base.faces[_SKIN]]
    start = np.concatenate(faces)
    end = np.concatenate([face[1:] + face[:1] for face in faces])
    for _ in range(_RINGS):
        mixed, own = (_with_neighbours(sums, start, end) for sums in (mixed, own))
        scale = np.maximum(np.trace(own, axis1=1, axis2=2), 1e-30)[:, None, None]
        mixed, own = mixed / scale, own / scale
    out = np.tile(np.eye(3), (len(mixed), 1, 1))
    out[there] = _solved(mixed[there], own[there])
    return out


def _with_neighbours(sums: Floats, start: Ints, end: Ints) -> Floats:
    out = sums.copy()
    _add(out, start, sums[end])
    _add(out, end, sums[start])
    return out


def _add(sums: Floats, rows: Ints, values: Floats) -> None:
    """Does the same as np.add.at(sums, rows, values), on single numbers, which is much faster."""
    wide = sums[0].size
    places = (rows[:, None] * wide + np.arange(wide)).ravel()
    np.add.at(sums.reshape(-1), places, values.ravel())


def _solved(mixed: Floats, own: Floats) -> Floats:
    scale = np.trace(own, axis1=1, axis2=2)[:, None, None]
    steady = own + 1e-6 * scale * np.eye(3)
    towards = mixed + 1e-6 * scale * np.eye(3)
    return np.asarray(np.swapaxes(np.linalg.solve(steady, np.swapaxes(towards, 1, 2)), 1, 2))


def _nearest(points: Floats, others: Floats) -> Ints:
    return np.array([int(((others - p) ** 2).sum(axis=1).argmin()) for p in points])
