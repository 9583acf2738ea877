# SPDX-License-Identifier: MIT
"""Selects joints to remove: repeatedly the joint that other joints replace with the least error."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from .. import Dna, Mesh
from ..author.geometry import skeleton as sk
from ..author.geometry.skeleton import Doubles, Ints
from ..base.errors import ArgumentError
from ..base.words import counted
from ..rigs.joint_controls import joint_controls
from .simplex import shares

_HEIRS = 5  # joints that may take over the vertices of a removed joint
# Names of joints that stay, because users and programs rotate them or attach objects to them.
_NEEDED = re.compile(
    r"root|pelvis|hips|spine.*|neck.*|head|facial_c_(facialroot|jaw|neck.*root)|jaw"
    r"|facial_[lr]_eye|(eye_?[lr]|[lr]_?eye)"
)


def needed_joints(dna: Dna, asked: Sequence[str] = ()) -> list[int]:
    """Indices of joints that must stay: root, hips, spine, neck, head, jaw and eyes by their names,
    joints without a parent, joints with rotation controls, joints that networks, twists and swings
    move, and all their ancestors.

    Args:
        dna: the face.
        asked: names of further joints that must stay.

    Raises:
        ArgumentError: an unknown name.
    """
    names = dna.joint_names
    for name in asked:
        if name not in names:
            raise ArgumentError(f"keep: there is no joint {name!r}")
    parents = np.asarray(dna.joint_parents, np.int64)
    known = [name.lower().replace(".", "_") for name in names]
    found = {j for j, name in enumerate(known) if _NEEDED.fullmatch(name)}
    found |= {j for j, name in enumerate(names) if name in asked or parents[j] == j}
    found |= {control.joint for control in joint_controls(dna)[0]}
    setup = dna.twist_swing_behavior
    found |= {int(j) for part in (*setup.twists, *setup.swings) for j in part.output_joint_indices}
    moved = dna.machine_learned_behavior_ext.joints
    keys = zip(moved.parameter_keys, moved.parameter_values, strict=False)
    stride = 10 if (1, 1) in {(int(k), int(v)) for k, v in keys} else 9
    found |= {int(output) // stride for output in moved.output_indices}
    above = found & set(range(len(parents)))
    while above:
        above = {int(parents[joint]) for joint in above} - found
        found |= above
    return sorted(found)


def mirrored_joints(dna: Dna) -> Ints:
    """int64[joints]: the joint at the mirrored position on the other side, up to 0.1 % of the
    face's extent; the joint itself if there is none or if it lies in the middle.

    Args:
        dna: the face.
    """
    rest = sk.world_matrices(dna, np.zeros((len(dna.joint_names), 9)))[:, :3, 3]
    sides = [i for i, axis in enumerate(dna.coordinate_system) if axis in ("left", "right")]
    turn = np.ones(3)
    turn[sides[0] if sides else 0] = -1
    near = 1e-3 * max(float(np.ptp(rest, axis=0).max(initial=0.0)), 1e-9)
    out = np.arange(len(rest))
    for joint, place in enumerate(rest):
        apart = np.linalg.norm(rest - place * turn, axis=1)
        other = int(apart.argmin())
        if np.linalg.norm(place - place * turn) > near and apart[other] < near:
            out[joint] = other
    own = np.arange(len(out))
    return np.asarray(np.where(out[out] == own, out, own))


class Leaving:
    """Removes joints one after the other; other joints (the heirs) take over their vertices."""

    def __init__(
        self,
        products: Doubles,
        points: Doubles,
        held: list[tuple[Ints, Doubles]],
        importance: Doubles,
    ) -> None:
        """Prepares the removal; no joint is removed yet.

        Args:
            products: float64[J, 4, J, 4]: for each pair of joints the product A^T B of their 3 x 4
                motion matrices, summed over poses.
            points: float64[V, 4], vertices of all meshes in homogeneous coordinates.
            held: for each joint, the indices of its vertices and its weights for them.
            importance: float64[V], weight of a vertex's squared error.
        """
        count = len(held)
        self.products, self.points, self.held = products, points, list(held)
        self.importance = importance
        self.own = np.einsum("hrhs->hrs", products).copy()
        self.there = np.ones(count, bool)
        self.costs = np.full(count, np.inf)
        self.heirs: list[tuple[Ints, Doubles]] = [(np.zeros(0, np.int64), np.zeros(0))] * count
        self.near: list[Ints] = []

    def choose(
        self, leaving: int, fixed: Sequence[int], parents: Ints, pairs: Ints, levels: Doubles
    ) -> list[int]:
        """Removes joints, and returns them in the order of removal.

        Args:
            leaving: number of joints to remove.
            fixed: joints that must stay.
            parents: int64[J]; a joint stays until all of its children are removed.
            pairs: int64[J], the mirrored joint; both are removed together if both may be removed
                and `leaving` allows it.
            levels: bool[J, LODs], whether a LOD lists a joint. The heirs of a joint are chosen
                among the remaining joints that all LODs of this joint list too, or among all
                remaining joints if there are none.
        """
        self.levels = levels
        can = np.ones(len(parents), bool)
        can[list(fixed)] = False
        children = np.bincount(parents, minlength=len(parents))
        children -= np.bincount(parents[parents == np.arange(len(parents))], minlength=len(parents))
        pairs = np.where(can & can[pairs], pairs, np.arange(len(pairs)))
        for joint in np.flatnonzero(can):
            self._price(int(joint))
        out: list[int] = []
        while len(out) < leaving:
            free = can & self.there & (children == 0)
            alone = pairs == np.arange(len(pairs))
            score = np.where(alone, self.costs, self.costs + self.costs[pairs])
            whole = free & (alone | free[pairs])
            if leaving - len(out) == 1 and (whole & alone).any():
                whole &= alone
            score = np.where(whole if whole.any() else free, score, np.inf)
            first = int(score.argmin())
            for joint in sorted({first, int(pairs[first])})[: leaving - len(out)]:
                self._leave(joint)
                children[parents[joint]] -= 1
                out.append(joint)
            stale = [
                j for j in np.flatnonzero(can & self.there).tolist()
                if not self.there[self.heirs[j][0]].all()
            ]  # fmt: skip
            for joint in stale:
                self._price(joint)
        return out

    def _price(self, joint: int) -> None:
        """Sets a joint's cost: the squared error of its vertices if the best mixture of other
        joints takes them over."""
        vertices, weights = self.held[joint]
        rows = self.points[vertices]
        spread = (rows * (self.importance[vertices] * weights**2)[:, None]).T @ rows
        cross = np.einsum("hrs,rs->h", self.products[:, :, joint], spread)
        own = np.einsum("hrs,rs->h", self.own, spread)
        single = own - 2 * cross + own[joint]
        may = self.there & (self.levels | ~self.levels[joint]).all(axis=1)
        may[joint] = False
        if not may.any():
            may = self.there.copy()
            may[joint] = False
        heirs = np.flatnonzero(may)
        heirs = heirs[np.argsort(single[heirs], kind="stable")[:_HEIRS]]
        part = self.products[heirs][:, :, heirs]
        gram = np.einsum("hrls,rs->hl", part, spread)
        found = shares(gram[None], cross[None, heirs], len(heirs))[0]
        cost = float(found @ gram @ found - 2 * found @ cross[heirs] + own[joint])
        self.costs[joint] = max(cost, 0.0)
        self.heirs[joint] = heirs[found > 0], found[found > 0]

    def _leave(self, joint: int) -> None:
        vertices, weights = self.held[joint]
        heirs, parts = self.heirs[joint]
        if not self.there[heirs].all():
            self._price(joint)
            heirs, parts = self.heirs[joint]
        self.there[joint] = False
        self.costs[joint] = np.inf
        self.held[joint] = np.zeros(0, np.int64), np.zeros(0)
        for heir, part in zip(heirs.tolist(), parts.tolist(), strict=True):
            whole = np.concatenate([self.held[heir][0], vertices])
            rows, of = np.unique(whole, return_inverse=True)
            values = np.concatenate([self.held[heir][1], part * weights])
            summed = np.bincount(of.ravel(), weights=values, minlength=len(rows))
            self.held[heir] = np.asarray(rows, np.int64), summed.astype(np.float64)
            if np.isfinite(self.costs[heir]):
                self._price(heir)


def require_count(dna: Dna, joints: int, needed: Sequence[int]) -> None:
    """Checks the number of joints to keep.

    Args:
        dna: the face.
        joints: number of joints to keep.
        needed: joints that must stay.

    Raises:
        ArgumentError: more joints than the face has, or fewer than the joints that must stay.
    """
    there = len(dna.joint_names)
    if joints > there:
        raise ArgumentError(
            f"joints: at most the {there:,} that the face has were expected, found {joints:,}"
        )
    if joints < len(needed):
        names = [dna.joint_names[j] for j in needed]
        some = ", ".join(names[:8]) + (" ..." if len(names) > 8 else "")
        raise ArgumentError(
            f"joints: at least {counted(len(needed), 'joint')} that must stay were expected "
            f"({some}), found {joints:,}"
        )


def joint_table(dna: Dna) -> Doubles:
    """bool[J, LODs]: the joints that each LOD lists; True for all if the file has no list.

    Args:
        dna: the face.
    """
    mapping = dna.lod_joint_mapping
    out = np.ones((len(dna.joint_names), max(1, dna.lod_count)), bool)
    for lod in range(min(len(mapping), out.shape[1])):
        out[:, lod] = False
        out[np.asarray(mapping[lod], np.int64), lod] = True
    return out


def held_by_joint(meshes: Sequence[Mesh], joints: int) -> list[tuple[Ints, Doubles]]:
    """(indices of vertices, weights) of each joint; indices count over all meshes.

    Args:
        meshes: meshes of the face.
        joints: number of joints.
    """
    vertices, owners, weights, first = [], [], [], 0
    for mesh in meshes:
        vertex, joint, weight = sk.skin_entries(mesh)
        vertices.append(vertex + first)
        owners.append(joint)
        weights.append(weight)
        first += len(mesh.positions)
    vertex = np.concatenate([np.zeros(0, np.int64), *vertices])
    owner = np.concatenate([np.zeros(0, np.int64), *owners])
    weight = np.concatenate([np.zeros(0), *weights])
    order = np.argsort(owner, kind="stable")
    ends = np.cumsum(np.bincount(owner, minlength=joints))[:-1]
    return list(
        zip(np.split(vertex[order], ends), np.split(weight[order], ends), strict=True)
    )  # a vertex may list a joint twice, and both weights count
