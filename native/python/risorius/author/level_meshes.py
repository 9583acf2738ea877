# SPDX-License-Identifier: MIT
"""Makes the triangles of coarser LODs, and stops at the first LOD whose skin would look broken."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from .. import Mesh, _native
from ..base.patience import patiently
from .geometry.blocks import LARGE
from .geometry.simplify import Floats, fan_triangles, fewer_triangles, pieces_of
from .geometry.skeleton import Doubles, Ints
from .geometry.wanted import Wanted, known_attributes
from .levels import LodOptions, mesh_budget, vertex_budgets
from .work import Work, listed_meshes

_POSES = 6  # number of expressions with the largest motion that are checked beside the rest pose
_LOOKED_AT = 2000  # smallest number of checked vertices of the fine skin, if it has them
# Limits of a LOD: root mean square and largest distance of its skin from the finest skin, as
# fractions of the longest side of the skin's bounding box.
_RMS, _FARTHEST = 0.005, 0.015
_SLIVERS, _LONG = 0.02, 30.0  # largest fraction of slivers; a sliver is 30 times as long as high
_FOLDS, _FOLDED = 0.03, -0.5  # largest fraction of folded edges; cosine of 120 degrees


@dataclass
class LevelMeshes:
    """Triangles of each coarser LOD; a corner is the index of a vertex layout of the LOD 0 mesh.

    Attributes:
        count: number of LODs, including LODs of the source.
        triangles: (LOD, mesh of the source) -> triangles; meshes that a LOD leaves out have no
            entry.
        ended: reason why there are no more LODs, or "".
    """

    count: int
    triangles: dict[tuple[int, int], Ints] = field(default_factory=dict)
    ended: str = ""


def level_meshes(
    work: Work,
    wanted: Mapping[int, Wanted],
    options: LodOptions,
    levels: int,
    attributes: dict[int, Floats] | None = None,
    go_on: Callable[[], None] = lambda: None,
) -> LevelMeshes:
    """Simplify the meshes of LOD 0 for each coarser LOD.

    If the options give no vertex budgets, the LODs end before the skin of a LOD looks broken: it is
    left out, has too many slivers, too many edges folded by more than 120 degrees, or a large
    distance from the skin of LOD 0. The neutral pose and the expressions that move the skin most
    are checked.

    Args:
        work: the face.
        wanted: mesh of the source -> its displacements.
        options: the budgets.
        levels: largest number of LODs.
        attributes: mesh of the source -> vertex attributes for the simplification. Attributes of
            other meshes are computed and added. None: an empty dictionary.
        go_on: called before each mesh; raises an error to stop.
    """
    known = {} if attributes is None else attributes
    source = work.source
    had = max(1, source.lod_count)
    own = [sum(len(source.meshes[m].positions) for m in listed_meshes(source, lod))
           for lod in range(had)]  # fmt: skip
    budgets = vertex_budgets(options, levels, own)
    fine = listed_meshes(source, 0)
    # The skin is the mesh that the expressions move most. Hair may have more vertices.
    skin = max(fine, key=lambda m: float(wanted[m].squares.sum()))
    out, check = LevelMeshes(min(levels, had)), _Skin(source.meshes[skin], wanted[skin])
    for lod in range(had, levels):
        made: dict[tuple[int, int], Ints] = {}
        for m in fine:
            mesh = source.meshes[m]
            share = budgets[lod] / max(1, budgets[0])
            budget = mesh_budget(source.mesh_names[m], len(mesh.positions), share)
            if not budget:
                continue
            go_on()
            # A large mesh is made from the next finer LOD, because that is faster than from LOD 0.
            finer = None if wanted[m].small else out.triangles.get((lod - 1, m))
            features = known_attributes(known, m, wanted[m])
            triangles = patiently(partial(fewer_triangles, mesh, features, budget, finer), go_on)
            if len(triangles):
                made[lod, m] = triangles
        wrong = "" if options.vertices else check.wrong(made.get((lod, skin)))
        if wrong:
            out.ended = f"LOD {lod} would have {wrong}: there are {lod} levels of {levels}"
            break
        out.triangles |= made
        out.count = lod + 1
    return out


class _Skin:
    """The skin in the neutral pose and in some expressions: the largest connected piece of a
    mesh."""

    def __init__(self, mesh: Mesh, wanted: Wanted) -> None:
        self.positions = np.asarray(mesh.positions, np.float64)
        self.places = np.asarray(mesh.layout_positions, np.int64)
        self.pieces = pieces_of(mesh)
        largest = int(np.bincount(self.pieces).argmax()) if len(self.pieces) else 0
        self.mine = self.pieces == largest
        held = np.flatnonzero(self.mine)
        self.looked_at = held[:: max(1, len(held) // _LOOKED_AT)]
        self.size = float(np.ptp(self.positions[held], axis=0).max()) if len(held) else 1.0
        most = np.argsort(-wanted.squares, kind="stable")[:_POSES]
        self.poses = [self.positions, *(self.positions + way for way in wanted.ways(most))]
        fine = self.places[fan_triangles(mesh)]
        self.fine = fine[self.mine[fine[:, 0]]] if len(fine) else fine
        # A LOD may have as many slivers and folds as the finest mesh, which has some at lid rims.
        self.had = shapes_of(self.poses, self.fine)

    def wrong(self, triangles: Ints | None) -> str:
        """The fault of the skin of a LOD as text; "" if there is none or if the skin has more than
        LARGE (60,000) vertices, because such a skin is not checked.

        Args:
            triangles: int64[n, 3], layout indices; None if the LOD has no skin.
        """
        if triangles is None:
            return "no skin"
        corners = self.places[triangles]
        corners = corners[self.mine[corners[:, 0]]]
        used, local = np.unique(corners, return_inverse=True)
        if len(used) < 4:
            return "no skin"
        return "" if len(used) > LARGE else self._wrong(corners, used, local)

    def _wrong(self, corners: Ints, used: Ints, local: Ints) -> str:
        """The fault of a skin as text.

        Args:
            corners: int64[n, 3], triangles of vertices.
            used: the distinct vertices of the triangles.
            local: for each corner its index in `used`.
        """
        now = shapes_of(self.poses, corners)
        for (slivers, folds), (had_slivers, had_folds) in zip(now, self.had, strict=True):
            if slivers > max(_SLIVERS, had_slivers):
                return f"{slivers:.1%} slivers"
            if folds > max(_FOLDS, had_folds):
                return f"{folds:.1%} of its edges folded over 120 degrees"
        starts = 3 * np.arange(len(corners) + 1, dtype=np.uint32)
        faces = local.ravel().astype(np.uint32)
        checker = _native.SkinChecker(self.positions[used], starts, faces, [], 1.0)
        found = checker.nearest(self.positions[self.looked_at], np.zeros((0, 3)))
        away = found[2] / self.size
        if np.sqrt((away**2).mean()) > _RMS or away.max() > _FARTHEST:
            return f"skin that is {away.max():.1%} of its size away"
        return ""


def shapes_of(poses: Sequence[Doubles], triangles: Ints) -> list[tuple[float, float]]:
    """For each pose, the fractions of triangles that are slivers, and of edges folded by more than
    120 degrees.

    Args:
        poses: float64[V, 3] each, vertex positions.
        triangles: int64[n, 3], vertex indices.
    """
    if not len(triangles):
        return [(0.0, 0.0) for _ in poses]
    pairs = np.sort(np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)]), axis=1)
    faces = np.tile(np.arange(len(triangles)), 3)
    key = pairs[:, 0] * (int(triangles.max()) + 1) + pairs[:, 1]
    order = np.argsort(key, kind="stable")
    begins = np.flatnonzero(np.diff(key[order], prepend=-1))
    sides = np.diff(begins, append=len(key))
    first = begins[sides == 2]
    beside = faces[order[first]], faces[order[first + 1]]
    out = []
    for points in poses:
        a, b, c = (points[triangles[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        twice = np.linalg.norm(normals, axis=1)
        longest = np.max([np.linalg.norm(s, axis=1) for s in (b - a, c - b, a - c)], axis=0)
        slivers = float((longest**2 > _LONG * twice).mean())
        normals = normals / np.maximum(twice, 1e-30)[:, None]
        dots = (normals[beside[0]] * normals[beside[1]]).sum(axis=1)
        out.append((slivers, float((dots < _FOLDED).sum() / len(sides))))
    return out
