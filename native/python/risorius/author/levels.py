# SPDX-License-Identifier: MIT
"""Chooses the joints and vertex counts of a joint rig's levels of detail.

A coarser LOD has a subset of the finer LOD's joints with the same motions. So a joint group needs
only fewer rows, and one clip plays at every LOD.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .. import Dna
from ..base.errors import ArgumentError
from .geometry.blocks import LARGE
from .geometry.skeleton import Doubles, Ints

# Fraction of LOD 0's joints that each LOD keeps, about as in hand-made faces. The fraction falls
# more slowly than the number of vertices does.
_JOINTS = (1.0, 0.8, 0.6, 0.45, 0.3, 0.2, 0.12, 0.06)
_FALL = 0.6  # number of vertices relative to the next finer LOD
_LEAST_JOINTS = 4
# Substrings of the names of small meshes that coarse LODs leave out: clear films, lashes, tongue.
_SMALL = ("lash", "saliva", "shell", "cornea", "eyeedge", "cartilage", "tongue")
_LEAST_VERTICES = 24


@dataclass(frozen=True)
class LodOptions:
    """The number of LODs, and the numbers of joints and vertices of each LOD.

    LODs that the source face already has are not simplified again.
    """

    count: int = 8
    joints: tuple[int, ...] = ()  # new joints of each level; empty: fractions of LOD 0's number
    # Number of vertices of each LOD; empty: a LOD has 0.6 times the vertices of the next finer LOD,
    # but at most 60,000.
    vertices: tuple[int, ...] = ()

    def check(self) -> None:
        """Raise ValueError if `count` is not 1 to 32, or if `joints` or `vertices` is given and has
        another number of entries than `count`, increases, or has a negative entry."""
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
    """The number of new joints of each LOD.

    Args:
        options: budgets, if given.
        levels: number of LODs.
        joints: number of new joints of LOD 0.
    """
    if options.joints:
        wanted = [min(joints, n) for n in options.joints]
        return [wanted[min(lod, len(wanted) - 1)] for lod in range(levels)]
    shares = [_JOINTS[lod] if lod < len(_JOINTS) else _JOINTS[-1] for lod in range(levels)]
    return [min(joints, max(_LEAST_JOINTS, round(share * joints))) for share in shares]


class _Merging:
    """Removes joints one after the other; the most similar joint takes a removed joint's vertices.

    Attributes:
        points: float64[V, 4], vertices in homogeneous coordinates.
        weights: float64[V, J], skin weights of the joints that are still there.
        motions: float64[J, E, 3, 4], matrices from a vertex to its displacement by a joint.
        heirs: removed joint -> joint that took its vertices.
        there: bool[J], whether a joint is still there.
        can_leave: bool[J], whether a joint may be removed.
        costs: float64[J, J], squared error if the second joint takes the first joint's vertices.
    """

    def __init__(self, points: Doubles, weights: Doubles, motions: Doubles, fixed: int) -> None:
        self.points = points
        self.weights = weights.copy()
        self.motions = motions
        self.heirs: dict[int, int] = {}
        self.there = np.ones(len(motions), bool)
        self.can_leave = np.arange(len(motions)) >= fixed
        self.costs = np.full((len(motions),) * 2, np.inf)
        for joint in np.flatnonzero(self.can_leave):
            self._price(int(joint))

    def _price(self, joint: int) -> None:
        """For each other joint, compute the squared error if that joint takes the vertices of
        `joint`."""
        held = np.flatnonzero(self.weights[:, joint])
        rows = self.weights[held, joint, None] * self.points[held]
        values, axes = np.linalg.eigh(rows.T @ rows)
        root = axes * np.sqrt(np.clip(values, 0, None))
        reached = (self.motions @ root).reshape(len(self.motions), -1)
        error = ((reached - reached[joint]) ** 2).sum(axis=1)
        error[joint] = np.inf
        self.costs[joint] = np.where(self.there, error, np.inf)

    def cheapest(self, pairs: Ints) -> list[int]:
        """The joint and its mirrored joint with the smallest sum of their costs; one index if the
        joint has no mirrored joint.

        Args:
            pairs: int64[J], the mirrored joint; a joint without one names itself.
        """
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
    """The new joints sorted by importance, the most important first; mirrored joints are adjacent.

    Repeatedly, the joint is removed whose vertices another joint can move with the least error, and
    the other joint takes its vertices. The reverse order of removal is the result.

    Args:
        positions: float64[V, 3], neutral vertices.
        weights: float64[V, J], skin weights.
        rotations: float64[E, J, 3, 3], rotation of each joint in each expression, from neutral.
        translations: float64[E, J, 3], shift of each joint's position in each expression.
        centres: float64[J, 3], positions of the joints.
        mirrored: int64[J], the joint of the other side; a joint in the middle names itself.
        fixed: number of first joints that all LODs keep and that the result does not contain.

    Returns: the order, and joint -> joint that took its vertices.
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
    """The first joints of the order within a budget, sorted. Mirrored pairs are not divided.

    Args:
        order: the order of joint_order().
        mirrored: int64[J], the joint of the other side.
        budget: largest number of joints.
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
    """The number of vertices of each LOD; at most LARGE (60,000) for a new LOD without a given
    budget.

    Args:
        options: budgets, if given.
        levels: number of LODs.
        existing: numbers of vertices of the source's LODs.
    """
    out = list(existing)
    while len(out) < levels:
        given = options.vertices[len(out)] if len(out) < len(options.vertices) else None
        out.append(given if given is not None else min(round(_FALL * out[-1]), LARGE))
    return out[:levels]


def mesh_budget(name: str, vertices: int, share: float) -> int:
    """The number of vertices of a mesh at a LOD; 0 leaves the mesh out.

    Args:
        name: name of the mesh.
        vertices: number of vertices of the mesh at LOD 0.
        share: number of all vertices at the LOD, divided by the number at LOD 0.
    """
    wanted = round(share * vertices)
    if wanted >= _LEAST_VERTICES:
        return wanted
    if any(word in name.lower() for word in _SMALL):
        return 0
    return min(vertices, _LEAST_VERTICES)


def level_name(name: str, lod: int) -> str:
    """The name of a mesh at another LOD: head_lod0_mesh -> head_lod3_mesh.

    Args:
        name: name of the fine mesh.
        lod: index of the LOD.
    """
    if re.search(r"lod\d+", name):
        return re.sub(r"lod\d+", f"lod{lod}", name)
    return f"{name}_lod{lod}"


def extend_levels(dna: Dna, levels: int) -> None:
    """Add LODs that list the same items as the last LOD of the face.

    New LODs have no blend shapes. Callers replace the lists of meshes and joints.

    Args:
        dna: the face to change.
        levels: wanted number of LODs; nothing changes if the face has at least as many.
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
