# SPDX-License-Identifier: MIT
"""Finds connected pieces of a mesh ("islands"), and pieces that are spheres."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...base.words import joined
from ..geometry.simplify import connected
from ..geometry.skeleton import Doubles, Ints
from ..input.obj import ObjMesh
from .parts import HeadPart, Material, first_vertices, taken_apart

_INNER = re.compile(r"eye|iris|sclera|cornea|mouth|teeth|tooth|tongue|gum", re.IGNORECASE)
_ROUND = 0.12  # largest standard deviation of a sphere's vertices from the radius, in radii


@dataclass(frozen=True)
class Ball:
    """A sphere: indices of its vertices, its centre float64[3] and its radius."""

    vertices: Ints
    middle: Doubles
    radius: float


def islands_of(mesh: ObjMesh) -> Ints:
    """int64[V]: number of the island of each vertex, from 0."""
    sizes = np.fromiter(map(len, mesh.faces), np.int64, len(mesh.faces))
    corners = np.fromiter(itertools.chain.from_iterable(mesh.faces), np.int64, int(sizes.sum()))
    label = connected(len(mesh.positions), corners, sizes)
    return np.unique(label, return_inverse=True)[1].ravel()


def divided(part: HeadPart, of_face: Ints, looks: Sequence[Material]) -> list[HeadPart]:
    """Divide a mesh by materials; each island gets the material of most of its polygons.

    Polygons whose material is named like an eye or a part of the mouth are always cut off, even
    inside an island. A mesh with one material, or with another number of polygons than `of_face`
    has, stays whole and gets the most frequent material.

    Args:
        part: the mesh.
        of_face: int64[polygons], index of each polygon's material.
        looks: the materials.
    """
    used = np.unique(of_face)
    if len(used) < 2 or len(of_face) != len(part.mesh.faces):
        most = int(np.bincount(of_face).argmax()) if len(used) else 0
        part.material = looks[most] if len(used) else None
        _tell(part, looks, set(used.tolist()) - {most})
        return [part]
    islands = islands_of(part.mesh)[first_vertices(part)]
    counts = np.zeros((int(islands.max()) + 1, len(looks)))
    np.add.at(counts, (islands, of_face), 1)
    best = counts.argmax(axis=1)[islands]
    inner = np.array([_INNER.search(look.name) is not None for look in looks])
    best = np.where(inner[of_face], of_face, best)  # lids and lips hide these cuts
    out: list[HeadPart] = []
    for place in np.unique(best).tolist():
        name = f"{part.source}_{looks[place].name}" if out else part.name
        for piece in taken_apart(part, [name], np.where(best == place, 0, -1)):
            piece.material = looks[place]
            out.append(piece)
    _tell(out[0], looks, set(used.tolist()) - set(best.tolist()))
    return out


def _tell(part: HeadPart, looks: Sequence[Material], lost: set[int]) -> None:
    """Add a note to the part's material if materials with pictures are left out.

    Args:
        part: the mesh; its material gets the note.
        looks: the materials of the file.
        lost: indices of the materials that no part of the mesh has.
    """
    names = [looks[place].name for place in sorted(lost) if looks[place].pictures]
    if names and part.material is not None:
        part.material.notes.append(
            f"{part.source}: {joined(names)} left out: polygons of other materials are joined to "
            "theirs, and a mesh has one"
        )


def ball_of(points: Doubles, vertices: Ints, off: float = _ROUND) -> Ball | None:
    """Fit a sphere to vertices. Returns None for fewer than 12 vertices, and for vertices that do
    not lie on a sphere or cover too little of it.

    The vertices must extend over at least 1.2 radii along one axis and 0.8 radii along every axis.

    Args:
        points: float64[V, 3], vertex positions of the mesh.
        vertices: indices of the vertices.
        off: largest standard deviation from the radius, in radii.
    """
    own = points[vertices]
    if len(own) < 12:
        return None
    origin = own.mean(axis=0)
    rows = np.column_stack([2 * (own - origin), np.ones(len(own))])
    solution, _, rank, _ = np.linalg.lstsq(rows, ((own - origin) ** 2).sum(axis=1), rcond=1e-9)
    if rank < 4:
        return None
    middle = origin + solution[:3]
    lengths = np.linalg.norm(own - middle, axis=1)
    radius = float(lengths.mean())
    extent = np.ptp(own, axis=0)
    whole = extent.max() >= 1.2 * radius and extent.min() >= 0.8 * radius
    if not whole or lengths.std() > off * radius:
        return None
    return Ball(vertices, np.asarray(middle), radius)
