# SPDX-License-Identifier: MIT
"""Levels of detail of a joint rig: how many joints and vertices each has, and which.

A coarser level has some of the joints of the finer one, and they move as they do there: a joint
group then needs only fewer of its rows, and one clip plays at every level.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .. import Dna
from ..base.errors import ArgumentError
from .geometry.skeleton import Doubles, Ints

# Of what LOD 0 has, about as in faces that are made by hand: joints stay longer than vertices.
_JOINTS = (1.0, 0.8, 0.6, 0.45, 0.3, 0.2, 0.12, 0.06)
_FALL = 0.6  # of the vertices, from level to level
_LEAST_JOINTS = 4
# Clear films, lashes and what lies inside the mouth; they go when nothing is left of them.
_SMALL = ("lash", "saliva", "shell", "cornea", "eyeedge", "cartilage", "tongue")
_LEAST_VERTICES = 24


@dataclass(frozen=True)
class LodOptions:
    """How many levels there are, and the budget of each; levels of the source are kept."""

    count: int = 8
    joints: tuple[int, ...] = ()  # new ones at each level; without: shares of those of LOD 0
    vertices: tuple[int, ...] = ()  # of all meshes; without: 0.6 of the level before

    def check(self) -> None:
        """Raises ValueError for budgets of another number of levels, or that grow."""
        if not 1 <= self.count <= 32:
            raise ArgumentError(f"lods.count: 1 to 32 was expected, found {self.count}")
        for name, budgets in (("joints", self.joints), ("vertices", self.vertices)):
            if not budgets:
                continue
            if len(budgets) != self.count:
                raise ArgumentError(
                    f"lods.{name}: {self.count} numbers were expected, found {len(budgets)}"
                )
            falls = all(a >= b for a, b in itertools.pairwise(budgets))
            if not falls or budgets[-1] < 0:
                raise ArgumentError(f"lods.{name}: numbers that do not grow were expected")


def joint_budgets(options: LodOptions, levels: int, joints: int) -> list[int]:
    """New joints of each level, none more than of the one before.

    Args:
        options: budgets, if there are any.
        levels: how many there are.
        joints: of LOD 0.
    """
    if options.joints:
        wanted = [min(joints, n) for n in options.joints]
        return [wanted[min(lod, len(wanted) - 1)] for lod in range(levels)]
    shares = [_JOINTS[lod] if lod < len(_JOINTS) else _JOINTS[-1] for lod in range(levels)]
    return [min(joints, max(_LEAST_JOINTS, round(share * joints))) for share in shares]


class _Merging:
    """Joints that leave one after the other, each handing its vertices to the one most like it."""

    def __init__(self, points: Doubles, weights: Doubles, motions: Doubles, fixed: int) -> None:
        self.points = points  # [V, 4], (p, 1)
        self.weights = weights.copy()
        self.motions = motions  # [J, E, 3, 4], what a joint adds to a point
        self.heirs: dict[int, int] = {}
        self.there = np.ones(len(motions), bool)
        self.can_leave = np.arange(len(motions)) >= fixed
        self.costs = np.full((len(motions),) * 2, np.inf)
        for joint in np.flatnonzero(self.can_leave):
            self._price(int(joint))

    def _price(self, joint: int) -> None:
        """Squared error of a joint's vertices when each of the others takes them."""
        held = np.flatnonzero(self.weights[:, joint])
        rows = self.weights[held, joint, None] * self.points[held]
        values, axes = np.linalg.eigh(rows.T @ rows)
        root = axes * np.sqrt(np.clip(values, 0, None))
        reached = (self.motions @ root).reshape(len(self.motions), -1)
        error = ((reached - reached[joint]) ** 2).sum(axis=1)
        error[joint] = np.inf
        self.costs[joint] = np.where(self.there, error, np.inf)

    def cheapest(self, pairs: Ints) -> list[int]:
        """The joint that is missed least, and that of the other side with it."""
        own = self.costs.min(axis=1)
        score = np.where(pairs == np.arange(len(pairs)), own, own + own[pairs])
        first = int(np.where(self.there & self.can_leave, score, np.inf).argmin())
        return sorted({first, int(pairs[first])})

    def leave(self, joints: Sequence[int]) -> None:
        self.there[list(joints)] = False
        self.costs[:, list(joints)] = np.inf
        for joint in joints:
            heir = int(self.costs[joint].argmin())
            self.costs[joint] = np.inf
            self.heirs[joint] = heir
            self.weights[:, heir] += self.weights[:, joint]
            self.weights[:, joint] = 0
            if self.can_leave[heir]:
                self._price(heir)


def joint_order(
    positions: Doubles,
    weights: Doubles,
    rotations: Doubles,
    translations: Doubles,
    centres: Doubles,
    mirrored: Ints,
    fixed: int,
) -> tuple[list[int], dict[int, int]]:
    """New joints, what a face needs most first; those of both sides one after the other.

    Again and again the joint leaves whose vertices another moves most alike; that one takes them.
    The second value names for each joint the one that took its vertices.

    Args:
        positions: float64[V, 3].
        weights: float64[V, J].
        rotations: float64[E, J, 3, 3].
        translations: float64[E, J, 3].
        centres: float64[J, 3], where the joints are.
        mirrored: int64[J], of each joint that of the other side, itself in the middle.
        fixed: the first joints, which stay at all levels and are not in the list.
    """
    turned = rotations - np.eye(3)
    shift = translations - np.einsum("ejik,jk->eji", turned, centres)
    motions = np.concatenate([turned, shift[..., None]], axis=3).transpose(1, 0, 2, 3)
    numbers = np.arange(len(centres))
    pairs = np.where((mirrored >= fixed) & (numbers >= fixed), mirrored, numbers)
    merging = _Merging(
        np.column_stack([positions, np.ones(len(positions))]), weights, motions, fixed
    )
    removed: list[int] = []
    while len(removed) < len(centres) - fixed:
        leaving = merging.cheapest(pairs)
        merging.leave(leaving)
        removed += leaving
    return removed[::-1], merging.heirs


def level_joints(order: Sequence[int], mirrored: Ints, budget: int) -> Ints:
    """The first joints of the order that the budget holds, both of a pair or none; sorted.

    Args:
        order: of joint_order.
        mirrored: of each joint that of the other side.
        budget: how many there may be.
    """
    out: list[int] = []
    at = 0
    while at < len(order):
        step = 2 if at + 1 < len(order) and mirrored[order[at]] == order[at + 1] else 1
        if len(out) + step > budget:
            break
        out += order[at : at + step]
        at += step
    return np.array(sorted(out), np.int64)


def vertex_budgets(options: LodOptions, levels: int, existing: Sequence[int]) -> list[int]:
    """Vertices of each level.

    Args:
        options: budgets, if there are any.
        levels: how many there are.
        existing: vertices of the levels that the source has.
    """
    out = list(existing)
    while len(out) < levels:
        given = options.vertices[len(out)] if len(out) < len(options.vertices) else None
        out.append(given if given is not None else round(_FALL * out[-1]))
    return out[:levels]


def mesh_budget(name: str, vertices: int, share: float) -> int:
    """Vertices that a mesh has at a level: 0 where it is left out.

    Args:
        name: of the mesh.
        vertices: of the fine one.
        share: of the fine level's vertices that the level may have.
    """
    wanted = round(share * vertices)
    if wanted >= _LEAST_VERTICES:
        return wanted
    if any(word in name.lower() for word in _SMALL):
        return 0
    return min(vertices, _LEAST_VERTICES)


def level_name(name: str, lod: int) -> str:
    """The name of a mesh at another level: head_lod0_mesh -> head_lod3_mesh.

    Args:
        name: of the fine one.
        lod: the level.
    """
    if re.search(r"lod\d+", name):
        return re.sub(r"lod\d+", f"lod{lod}", name)
    return f"{name}_lod{lod}"


def extend_levels(dna: Dna, levels: int) -> None:
    """As many levels as there are to be: what the new ones list is what the last one did.

    Meshes and joints are not listed here; blend shapes end with the levels that there were.

    Args:
        dna: is changed.
        levels: at least as many as it has.
    """
    had = max(1, dna.lod_count)
    more = levels - had
    if more <= 0:
        return
    dna.lod_count = levels

    def longer(mapping: object) -> list[list[int]]:
        rows = [[int(i) for i in mapping[lod]] for lod in range(len(mapping))]  # type: ignore[arg-type, index]
        return rows + [rows[-1] if rows else []] * (levels - len(rows))

    for name in ("lod_joint_mapping", "lod_animated_map_mapping", "lod_mesh_mapping"):
        setattr(dna, name, longer(getattr(dna, name)))
    shapes = longer(dna.lod_blend_shape_mapping)
    dna.lod_blend_shape_mapping = shapes[:had] + [[]] * more
    channels = dna.blend_shape_channels
    channels.lods = [*(int(n) for n in channels.lods), *[0] * more]
    dna.blend_shape_channels = channels
    maps = dna.animated_maps
    last = [int(n) for n in maps.lods]
    maps.lods = last + last[-1:] * more
    dna.animated_maps = maps
    groups = []
    for group in dna.joint_groups:
        rows = [int(n) for n in group.lods]
        group.lods = rows + rows[-1:] * more
        groups.append(group)
    dna.joint_groups = groups
