# SPDX-License-Identifier: MIT
"""Mixes faces: numeric values become weighted means; names and lists are not changed.

Each vertex has a weight for each parent, from the shares of its regions; a joint has the mean
weights of its vertices. A region from another face is scaled to the size of the mixed face and
moved to the region's position in the mixed face, so that a tall face's brow fits a small face.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from .. import BlendShapeTarget, Dna, Mesh
from ..author.geometry import skeleton as sk
from ..author.geometry.skeleton import Doubles
from ..base.errors import ArgumentError
from ..rigs.rotation import Convention
from .compatible import alike
from .groups import mixed_groups
from .hair import give_hair, without_hair
from .regions import REGIONS, Masks
from .share import Share, mean_of


@dataclass
class Mix:
    """The share (fraction) of each parent in the whole face, with exceptions for some regions.

    In a region, the listed parents get their listed shares. The rest is divided among all parents,
    including the listed ones, in proportion to `shares`.
    """

    shares: Sequence[float]  # [P], for the whole face; normalised to sum 1
    regions: Mapping[str, Mapping[int, float]] = field(default_factory=dict)

    def whole(self) -> Doubles:
        """float64[P]: the parents' shares in the whole face, with sum 1. Raises: ValueError: an
        invalid share, or shares that are all 0."""
        whole = np.array(self.shares, np.float64)
        if not len(whole) or not np.isfinite(whole).all() or (whole < 0).any() or not whole.sum():
            raise ArgumentError("shares from 0 on were expected, at least one of them above 0")
        return np.asarray(whole / whole.sum())

    def table(self) -> Doubles:
        """float64[regions, P]: the parents' shares in each region; rows sum to 1.

        Raises:
            ValueError: an invalid share, an unknown region, shares that are all 0, or shares of a
                region that sum to more than 1.
        """
        whole = self.whole()
        out = np.tile(whole, (len(REGIONS), 1))
        for region, own in self.regions.items():
            if region not in REGIONS:
                known = ", ".join(REGIONS)
                raise ArgumentError(f"a region of {known} was expected, found {region!r}")
            given = np.zeros(len(whole))
            for parent, share in own.items():
                given[parent] = share
            total = given.sum()
            if not np.isfinite(given).all() or (given < 0).any() or total > 1 + 1e-9:
                raise ArgumentError(
                    f"{region}: shares from 0 to 1, and at most 1 together, were expected, "
                    f"found {total:g}"
                )
            out[REGIONS.index(region)] = given + max(0.0, 1 - total) * whole
        return out


def mix_faces(
    parents: Sequence[Dna], mix: Mix, *, name: str | None = None, masks: Masks | None = None
) -> Dna:
    """Makes the weighted mean of faces.

    Args:
        parents: faces with equal names, topology and behavior, which check_compatible checks; they
            are not changed.
        mix: the shares of the parents.
        name: name of the new face; None: from the parent with the largest share.
        masks: masks of the first parent's regions; None: they are computed if they are needed.

    Returns:
        The mixed face. If one parent has all shares, the mix equals that parent bitwise, except
        for a given `name`. Metadata and hair come from the parent with the largest share.

    Raises:
        ValueError: invalid shares, or a region without vertices in the first parent.
    """
    table = mix.table()
    most = int(np.argmax(mix.whole()))
    alone = np.flatnonzero((table == 1).all(axis=0))
    if len(alone):
        out = copy.copy(parents[int(alone[0])])
        out.name = out.name if name is None else name
        return out
    leading = parents[most]
    parents = [without_hair(parent) for parent in parents]
    masks = masks or Masks(parents[0])
    for region in mix.regions:
        if masks.is_empty(region):
            raise ArgumentError(f"no vertex of {parents[0].name} is of the region {region}")
    places = Places(parents, mix, masks)
    out = copy.copy(parents[0])
    meshes = [p.meshes for p in parents]
    out.meshes = [_mesh(row, places.of_mesh(m)) for m, row in enumerate(zip(*meshes, strict=True))]
    of_joints = places.of_joints()
    _neutral_pose(out, parents, of_joints)
    out.joint_groups = mixed_groups(parents, of_joints)
    _maps(out, parents, mix.whole())
    _descriptor(out, parents, mix.whole(), most, name)
    give_hair(out, leading)
    return out


class Places:
    """Computes the parents' weights for vertices and joints from the parents' shares in the
    regions."""

    def __init__(self, parents: Sequence[Dna], mix: Mix, masks: Masks) -> None:
        self.table = mix.table()
        self.own = np.array([region in mix.regions for region in REGIONS])
        self.whole = mix.whole()
        self._first, self._masks = parents[0], masks
        if not self.own.any():
            return
        skin = masks.skin
        positions = [np.asarray(p.meshes[skin].positions, np.float64) for p in parents]
        part = masks.meshes[skin]
        # Rounding errors of masks may make the difference negative, so it is clipped.
        face = (1 - part[:, REGIONS.index("neck")] - part[:, REGIONS.index("skull")]).clip(0)
        mixed = np.asarray(sum(g * p for g, p in zip(self.whole, positions, strict=True)))
        size = _spread(mixed, face)
        # The position of a region is measured at its rim, so that the region fits the regions
        # beside it. The small second term gives regions without a rim a position too.
        rims = part * (1 - part) + 1e-3 * part
        sizes = [[size / _spread(p, face) for _ in REGIONS] for p in positions]
        # Neck and skull surround the face, so their scale is measured at their border to the face.
        for outer in ("neck", "skull"):
            at = REGIONS.index(outer)
            for own, p in zip(sizes, positions, strict=True):
                own[at] = _spread(mixed, rims[:, at]) / _spread(p, rims[:, at])
        self.sizes = np.array(sizes)  # [P, regions]
        middles = np.stack([_middles(p, rims) for p in positions])  # [P, regions, 3]
        self.shifts = _middles(mixed, rims) - self.sizes[:, :, None] * middles

    def of_mesh(self, mesh: int) -> Share:
        """The parents' weights for the vertices of a mesh.

        Args:
            mesh: index of the mesh.
        """
        if not self.own.any():
            return self._everywhere(len(self._first.meshes[mesh].positions))
        return self._of(self._masks.meshes[mesh])

    def of_joints(self) -> Share:
        """The parents' weights for all joints."""
        if not self.own.any():
            return self._everywhere(len(self._first.joint_names))
        return self._of(_joint_masks(self._first, self._masks))

    def _everywhere(self, count: int) -> Share:
        rows = np.tile(self.whole, (count, 1))
        return Share(rows, rows, np.zeros((count, 3)))

    def _of(self, masks: Doubles) -> Share:
        """The parents' weights for points with these masks, float64[n, regions], whose rows sum to
        1."""
        parts = masks * self.own
        rest = (1 - parts.sum(axis=1, keepdims=True)).clip(0) * self.whole
        inside = parts @ self.table
        shift = np.einsum("nr,rp,prk->nk", parts, self.table, self.shifts)
        scaled = np.einsum("nr,rp,pr->np", parts, self.table, self.sizes)
        return Share(rest + inside, rest + scaled, shift)


def _spread(points: Doubles, weights: Doubles) -> float:
    total = max(float(weights.sum()), 1e-30)
    middle = weights @ points / total
    return float(np.sqrt(weights @ ((points - middle) ** 2).sum(axis=1) / total)) or 1.0


def _middles(points: Doubles, masks: Doubles) -> Doubles:
    """float64[regions, 3]: the mean of the points, weighted by each region's mask.

    Args:
        points: float64[n, 3], the points.
        masks: float64[n, regions], weight of each point in each region.
    """
    total = masks.sum(axis=0)[:, None]
    return np.asarray(masks.T @ points / np.maximum(total, 1e-30))


def _descriptor(
    out: Dna, parents: Sequence[Dna], shares: Doubles, most: int, name: str | None
) -> None:
    leading = parents[most]
    out.name = leading.name if name is None else name
    out.archetype, out.gender = leading.archetype, leading.gender
    out.age = round(sum(s * p.age for s, p in zip(shares, parents, strict=True)))
    out.metadata = dict(leading.metadata)


def _mesh(parents: Sequence[Mesh], share: Share) -> Mesh:
    """The weighted mean of the parents' meshes.

    Args:
        parents: meshes with the same topology.
        share: the parents' weights for the vertices of the mesh.
    """
    first, weights = parents[0], share.weights
    out = copy.copy(first)
    out.positions = share.places([m.positions for m in parents])
    corners = np.asarray(first.layout_positions, np.int64)
    for values, layout in (
        ("texture_coordinates", first.layout_texture_coordinates),
        ("normals", first.layout_normals),
    ):
        count = len(getattr(first, values))
        vertex = np.zeros(count, np.int64)
        vertex[np.asarray(layout, np.int64)] = corners
        setattr(out, values, mean_of([getattr(m, values) for m in parents], weights[vertex]))
    mixed = np.asarray(out.normals, np.float64)
    length = np.linalg.norm(mixed, axis=1, keepdims=True)
    # Normals that are equal in all parents or come from one parent stay unchanged, even if their
    # length is not 1.
    alone = (weights == 1).any(axis=1).all()
    if not alone and not all(np.array_equal(first.normals, m.normals) for m in parents[1:]):
        out.normals = mixed / np.where(length > 0, length, 1)
    targets = [m.blend_shape_targets for m in parents]
    if not share.is_whole or not all(alike(targets[0], own) for own in targets[1:]):
        out.blend_shape_targets = _targets(parents, share.scaled)
    _skin(out, parents, weights)
    return out


def _targets(parents: Sequence[Mesh], weights: Doubles) -> list[BlendShapeTarget]:
    """Blend shape targets with all vertices that any parent moves.

    Args:
        parents: meshes with the same topology.
        weights: float64[V, P], weights of the parents times the scale of their regions.
    """
    own = [
        {int(t.blend_shape_channel_index): t for t in mesh.blend_shape_targets} for mesh in parents
    ]
    channels = list(dict.fromkeys(c for targets in own for c in targets))
    out = []
    for channel in channels if len(own[0]) == len(channels) else sorted(channels):
        vertices, deltas = [np.zeros(0, np.int64)], [np.zeros((0, 3))]
        for p, targets in enumerate(own):
            if channel in targets:
                at = np.asarray(targets[channel].vertex_indices, np.int64)
                share = weights[at, p]
                vertices.append(at[share > 0])
                moved = share[:, None] * np.asarray(targets[channel].deltas)
                deltas.append(moved[share > 0])
        rows, place = np.unique(np.concatenate(vertices), return_inverse=True)
        if len(rows):
            delta = np.zeros((len(rows), 3))
            np.add.at(delta, place.ravel(), np.concatenate(deltas))
            out.append(
                BlendShapeTarget(
                    deltas=delta, vertex_indices=rows, blend_shape_channel_index=channel
                )
            )
    return out


def _skin(out: Mesh, parents: Sequence[Mesh], weights: Doubles) -> None:
    """Sets the mixed skin weights; nothing changes if all parents have the same skin weights.

    Args:
        out: the mixed mesh; changed.
        parents: meshes with the same topology.
        weights: float64[V, P], weights of the parents.
    """
    fields = ("skin_offsets", "skin_joint_indices", "skin_weights")
    if all(
        np.array_equal(getattr(parents[0], name), getattr(mesh, name))
        for mesh in parents[1:]
        for name in fields
    ):
        return
    entries = [sk.skin_entries(mesh) for mesh in parents]
    # One integer per pair of vertex and joint; it sorts pairs by vertex, then joint.
    keys = np.concatenate([vertex << 16 | joint for vertex, joint, _ in entries])
    parts = [weight * weights[vertex, p] for p, (vertex, _, weight) in enumerate(entries)]
    keys, place = np.unique(keys, return_inverse=True)
    weight = np.bincount(place.ravel(), weights=np.concatenate(parts))
    vertex, joint = keys >> 16, keys & 0xFFFF
    # Each vertex keeps its largest weights, up to the parents' largest number of influences.
    most = max(int(mesh.maximum_influence_per_vertex) for mesh in parents)
    first = np.searchsorted(vertex, vertex)
    rank = np.zeros(len(keys), np.int64)
    rank[np.lexsort((-weight, vertex))] = np.arange(len(keys))
    kept = (rank - first < most) & (weight > 0)
    vertex, joint, weight = vertex[kept], joint[kept], weight[kept]
    count = len(out.positions)
    counts = np.bincount(vertex, minlength=count)
    total = np.bincount(vertex, weights=weight, minlength=count)
    out.skin_offsets = np.concatenate([[0], np.cumsum(counts)])
    out.skin_joint_indices, out.skin_weights = joint, weight / total[vertex]
    out.maximum_influence_per_vertex = int(counts.max(initial=0))


def _joint_masks(dna: Dna, masks: Masks) -> Doubles:
    """float64[J, regions]: mean of the masks of each joint's vertices at LOD 0, by skin weight.

    Args:
        dna: the first parent.
        masks: masks of the first parent's regions.
    """
    count = len(dna.joint_names)
    sums, held = np.zeros((count, len(REGIONS))), np.zeros(count)
    listed, meshes = dna.lod_mesh_mapping, dna.meshes
    for m in listed[0].tolist() if len(listed) else range(len(meshes)):
        if m >= len(meshes):
            continue
        vertex, holds, weight = sk.skin_entries(meshes[m])
        held += np.bincount(holds, weights=weight, minlength=count)
        for region, part in enumerate(masks.meshes[m].T):
            sums[:, region] += np.bincount(holds, weights=weight * part[vertex], minlength=count)
    # A joint without vertices takes the mask of its children; without any, it is of the skull.
    for joint in reversed(sk.parent_order(dna)):
        parent = int(dna.joint_parents[joint])
        if parent != joint and held[parent] < 1e-6 and held[joint] > 0:
            sums[parent] += 1e-9 * sums[joint] / held[joint]
            held[parent] += 1e-9
    rest = np.eye(len(REGIONS))[-1]
    out = np.where(held[:, None] > 0, sums / np.maximum(held, 1e-30)[:, None], rest)
    # Masks within 1e-9 of 0 or 1 become exactly 0 or 1.
    return np.where(np.abs(out - np.rint(out)) < 1e-9, np.rint(out), out)


def _neutral_pose(out: Dna, parents: Sequence[Dna], share: Share) -> None:
    """Sets the neutral pose: joints at the mean of their world positions, with mean rotations.

    Args:
        out: the mix; changed.
        parents: the mixed faces.
        share: weights of the parents for each joint.
    """
    weights = share.weights
    shifts = [np.asarray(p.neutral_joint_translations, np.float64) for p in parents]
    turns = [np.asarray(p.neutral_joint_rotations, np.float64) for p in parents]
    count = len(weights)
    out.neutral_joint_rotations = rotations = _turns(out, turns, weights)
    rest = np.zeros((count, 9))
    places = [sk.world_matrices(p, rest)[:, :3, 3] for p in parents]
    world = share.places(places)
    local = mean_of(shifts, weights)
    # If no region is moved, the mixed faces have equal rotations, and a joint has the same weights
    # as the joint above it, the mean of the joint's local translations gives the same position
    # without rounding errors.
    alike = all(np.array_equal(turns[0], t) for t in turns[1:]) and not share.shift.any()
    frames = np.tile(np.eye(4), (count, 1, 1))
    matrices = sk.rotation_matrices(Convention.of(out), rotations)
    for joint in sk.parent_order(out):
        parent = int(out.joint_parents[joint])
        root = parent == joint
        if not root and not (alike and np.array_equal(weights[joint], weights[parent])):
            frame = frames[parent]
            local[joint] = np.linalg.solve(frame[:3, :3], world[joint] - frame[:3, 3])
        own = np.eye(4)
        own[:3, :3], own[:3, 3] = matrices[joint], local[joint]
        frames[joint] = own if root else frames[parent] @ own
    out.neutral_joint_translations = local


def _turns(out: Dna, turns: Sequence[Doubles], weights: Doubles) -> Doubles:
    """float64[J, 3]: mean rotations in the file's unit; as quaternions if the parents differ.

    Args:
        out: the mix, whose rotation convention is used.
        turns: float64[J, 3] of each parent, neutral rotations in the file's unit.
        weights: float64[J, P], weights of the parents.
    """
    convention = Convention.of(out)
    rows = turns[0].copy()
    for joint in range(len(rows)):
        own = [t[joint] for t in turns]
        if all(np.array_equal(own[0], o) for o in own[1:]):
            continue
        alone = np.flatnonzero(weights[joint] == 1)
        if len(alone):
            rows[joint] = own[int(alone[0])]
            continue
        quaternions = [convention.quaternion(o) for o in own]
        total = np.zeros(4)
        for share, q in zip(weights[joint], quaternions, strict=True):
            total += share * (q if q @ quaternions[0] >= 0 else -q)
        rows[joint] = convention.angles(total / np.linalg.norm(total))
    return rows


def _maps(out: Dna, parents: Sequence[Dna], shares: Doubles) -> None:
    """Sets the slopes and cuts of the conditional table of animated maps to the parents' means by
    their shares in the whole face, float64[P]."""
    maps = copy.copy(parents[0].animated_maps)
    conditionals = copy.copy(maps.conditionals)
    own = [p.animated_maps.conditionals for p in parents]
    for name in ("slope_values", "cut_values"):
        rows = [np.asarray(getattr(table, name), np.float64) for table in own]
        if not all(np.array_equal(rows[0], r) for r in rows[1:]):
            setattr(conditionals, name, sum(s * r for s, r in zip(shares, rows, strict=True)))
    maps.conditionals = conditionals
    out.animated_maps = maps
