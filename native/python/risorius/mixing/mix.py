# SPDX-License-Identifier: MIT
"""Faces mixed: what is a number is the mean by weights, what is a name or a list stays.

Each vertex has a weight of each parent, from the shares of its regions; a joint has the mean of
those of the vertices that hang on it. What a region takes from another face is brought to the size
of the whole mix and to the region's place there: a brow of a tall face stays a brow on a small one.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from .. import BlendShapeTarget, Dna, JointGroup, Mesh
from ..author.geometry import skeleton as sk
from ..author.geometry.skeleton import Doubles
from ..base.errors import ArgumentError
from ..rigs.rotation import Convention
from .hair import give_hair, without_hair
from .regions import REGIONS, Masks


@dataclass
class Mix:
    """How much of each parent there is: on the whole, and otherwise in some regions.

    In a region the parents named there have their shares, and what these leave is as on the whole.
    """

    shares: Sequence[float]  # [P] of the whole; made to sum to 1
    regions: Mapping[str, Mapping[int, float]] = field(default_factory=dict)

    def whole(self) -> Doubles:
        """float64[P]: the shares of the whole, with sum 1. Raises ValueError as table."""
        whole = np.array(self.shares, np.float64)
        if not len(whole) or not np.isfinite(whole).all() or (whole < 0).any() or not whole.sum():
            raise ArgumentError("shares from 0 on were expected, one of them above 0")
        return np.asarray(whole / whole.sum())

    def table(self) -> Doubles:
        """float64[regions, P]: the shares of each region; rows sum to 1.

        Raises:
            ValueError: a share that is none, shares that are 0 together, or above 1 in a region.
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
    """A face with the weighted mean of all that its parents have.

    Args:
        parents: compatible ones, see check_compatible; they stay as they are.
        mix: shares of them.
        name: of the new face; None: that of the parent with the largest share.
        masks: of the first parent's regions, where they are known already.

    Returns:
        Where all of it is one parent's, that parent's every bit. Metadata and hair are those of
        the parent with the largest share.

    Raises:
        ValueError: shares that make no sense, a region that the first parent does not have.
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
    out.meshes = [
        _mesh([p.meshes[m] for p in parents], places.of(part), len(out.joint_names))
        for m, part in enumerate(masks.meshes)
    ]
    of_joints = places.of(_joint_masks(parents[0], masks))
    _neutral_pose(out, parents, of_joints)
    out.joint_groups = _joint_groups(out, parents, of_joints)
    _maps(out, parents, mix.whole())
    _descriptor(out, parents, mix.whole(), most, name)
    give_hair(out, leading)
    return out


@dataclass
class Share:
    """What points have of each parent.

    Attributes:
        weights: float64[n, P], rows sum to 1.
        scaled: float64[n, P], the same times the size that each parent's lengths get.
        shift: float64[n, 3], what is added to places.
    """

    weights: Doubles
    scaled: Doubles
    shift: Doubles

    def places(self, points: Sequence[object]) -> Doubles:
        """float64[n, 3] of the parents' points.

        Args:
            points: float64[n, 3] of each parent.
        """
        return _mean(points, self.scaled) + self.shift


class Places:
    """Shares of points by what they have of the regions."""

    def __init__(self, parents: Sequence[Dna], mix: Mix, masks: Masks) -> None:
        self.table = mix.table()
        self.own = np.array([region in mix.regions for region in REGIONS])
        self.whole = mix.whole()
        skin = masks.skin
        positions = [np.asarray(p.meshes[skin].positions, np.float64) for p in parents]
        part = masks.meshes[skin]
        face = 1 - part[:, REGIONS.index("neck")] - part[:, REGIONS.index("skull")]
        mixed = np.asarray(sum(g * p for g, p in zip(self.whole, positions, strict=True)))
        size = _spread(mixed, face)
        # Where two regions meet is what has to fit: rims lie upon each other.
        rims = part * (1 - part) + 1e-3 * part
        sizes = [[size / _spread(p, face) for _ in REGIONS] for p in positions]
        for outer in ("neck", "skull"):  # what is round the face has the size of its rim
            at = REGIONS.index(outer)
            for own, p in zip(sizes, positions, strict=True):
                own[at] = _spread(mixed, rims[:, at]) / _spread(p, rims[:, at])
        self.sizes = np.array(sizes)  # [P, regions]
        middles = np.stack([_middles(p, rims) for p in positions])  # [P, regions, 3]
        self.shifts = _middles(mixed, rims) - self.sizes[:, :, None] * middles

    def of(self, masks: Doubles) -> Share:
        """Of some points.

        Args:
            masks: float64[n, regions], rows sum to 1.
        """
        if not self.own.any():
            rows = np.tile(self.whole, (len(masks), 1))
            return Share(rows, rows, np.zeros((len(masks), 3)))
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
    """float64[regions, 3]."""
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


def _mean(values: Sequence[object], weights: Doubles) -> Doubles:
    """float64[n, ...]: the mean of arrays of the same shape by float64[n, P] weights of rows."""
    rows = [np.asarray(v, np.float64) for v in values]
    shape = (-1, *[1] * (rows[0].ndim - 1))
    return np.asarray(sum(weights[:, p].reshape(shape) * row for p, row in enumerate(rows)))


def _mesh(parents: Sequence[Mesh], share: Share, joints: int) -> Mesh:
    """A mesh between those of the parents.

    Args:
        parents: of one topology.
        share: of its vertices.
        joints: how many there are.
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
        setattr(out, values, _mean([getattr(m, values) for m in parents], weights[vertex]))
    mixed = np.asarray(out.normals, np.float64)
    length = np.linalg.norm(mixed, axis=1, keepdims=True)
    # Of one parent alone normals stay as they are, also where they are not quite 1 long.
    alone = (weights == 1).any(axis=1).all()
    if not alone:
        out.normals = mixed / np.where(length > 0, length, 1)
    out.blend_shape_targets = _targets(parents, share.scaled)
    _skin(out, parents, weights, joints)
    return out


def _targets(parents: Sequence[Mesh], weights: Doubles) -> list[BlendShapeTarget]:
    """Blend shapes of all vertices that one of the parents moves."""
    own = [
        {int(t.blend_shape_channel_index): t for t in mesh.blend_shape_targets} for mesh in parents
    ]
    channels = list(dict.fromkeys(c for targets in own for c in targets))
    out = []
    for channel in channels if len(own[0]) == len(channels) else sorted(channels):
        delta = np.zeros((len(weights), 3))
        moved = np.zeros(len(weights), bool)
        for p, targets in enumerate(own):
            if channel in targets:
                at = np.asarray(targets[channel].vertex_indices, np.int64)
                share = weights[at, p]
                np.add.at(delta, at, share[:, None] * np.asarray(targets[channel].deltas))
                moved[at[share > 0]] = True
        rows = np.flatnonzero(moved)
        if len(rows):
            out.append(
                BlendShapeTarget(
                    deltas=delta[rows], vertex_indices=rows, blend_shape_channel_index=channel
                )
            )
    return out


def _skin(out: Mesh, parents: Sequence[Mesh], weights: Doubles, joints: int) -> None:
    """Skin weights; where the parents have the same ones, these."""
    fields = ("skin_offsets", "skin_joint_indices", "skin_weights")
    if all(
        np.array_equal(getattr(parents[0], name), getattr(mesh, name))
        for mesh in parents[1:]
        for name in fields
    ):
        return
    rows = _mean([sk.dense_weights(mesh, joints) for mesh in parents], weights)
    most = max(int(mesh.maximum_influence_per_vertex) for mesh in parents)
    if joints > most:  # the smallest beyond what a parent has at most are left out
        least = np.partition(rows, joints - most, axis=1)[:, [joints - most]]
        rows = np.where(rows >= least, rows, 0)
    rows /= rows.sum(axis=1, keepdims=True)
    vertex, joint = np.nonzero(rows)
    counts = (rows > 0).sum(axis=1)
    out.skin_offsets = np.concatenate([[0], np.cumsum(counts)])
    out.skin_joint_indices, out.skin_weights = joint, rows[vertex, joint]
    out.maximum_influence_per_vertex = int(counts.max(initial=0))


def _joint_masks(dna: Dna, masks: Masks) -> Doubles:
    """float64[J, regions]: of each joint the mean of what hangs on it, at the finest level.

    Args:
        dna: the first parent.
        masks: of its regions.
    """
    count = len(dna.joint_names)
    sums, held = np.zeros((count, len(REGIONS))), np.zeros(count)
    listed = dna.lod_mesh_mapping
    for m in listed[0] if len(listed) else range(len(dna.meshes)):
        rows = sk.dense_weights(dna.meshes[int(m)], count)
        sums += rows.T @ masks.meshes[int(m)]
        held += rows.sum(axis=0)
    for joint in reversed(sk.parent_order(dna)):  # a joint without skin is as those below it
        parent = int(dna.joint_parents[joint])
        if parent != joint and held[parent] < 1e-6 and held[joint] > 0:
            sums[parent] += 1e-9 * sums[joint] / held[joint]
            held[parent] += 1e-9
    rest = np.eye(len(REGIONS))[-1]
    out = np.where(held[:, None] > 0, sums / np.maximum(held, 1e-30)[:, None], rest)
    # What is one region's stays one region's, whatever sums make of 1.
    return np.where(np.abs(out - np.rint(out)) < 1e-9, np.rint(out), out)


def _neutral_pose(out: Dna, parents: Sequence[Dna], share: Share) -> None:
    """Joints lie at the mean of where they lie in the world, turned by the mean of the turns."""
    weights = share.weights
    shifts = [np.asarray(p.neutral_joint_translations, np.float64) for p in parents]
    turns = [np.asarray(p.neutral_joint_rotations, np.float64) for p in parents]
    count = len(weights)
    out.neutral_joint_rotations = rotations = _turns(out, turns, weights)
    rest = np.zeros((count, 9))
    places = [sk.world_matrices(p, rest)[:, :3, 3] for p in parents]
    world = share.places(places)
    local = _mean(shifts, weights)
    # Where nothing is moved or turned, the mean of the places is the mean of the shifts.
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
    """float64[J, 3]: the mean of turns, as quaternions where they differ."""
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


def _joint_groups(out: Dna, parents: Sequence[Dna], share: Share) -> list[JointGroup]:
    """What controls do to joints: the mean of each row of the joint matrix.

    Groups of the parents that share a joint become one, with the rows and columns of all.
    """
    groups = []
    for own in _together(parents):
        parts = [
            [g for g, at in zip(p.joint_groups, numbers, strict=True) if at]
            for p, numbers in zip(parents, own, strict=True)
        ]
        group = _joint_group(parts, share, max(1, out.lod_count))
        if group is not None:
            groups.append(group)
    return groups


def _together(parents: Sequence[Dna]) -> list[list[list[bool]]]:
    """Which joint groups of each parent come together: bool[parents][groups] of each new group."""
    sets = [[frozenset(map(int, g.joint_indices)) for g in p.joint_groups] for p in parents]
    joined: list[set[int]] = []
    for joints in [own for rows in sets for own in rows if own]:
        met = [known for known in joined if known & joints]
        joined = [known for known in joined if not known & joints] + [set(joints).union(*met)]
    joined.sort(key=min)
    return [[[bool(own & known) for own in rows] for rows in sets] for known in joined]


def _joint_group(
    parts: Sequence[Sequence[JointGroup]], share: Share, levels: int
) -> JointGroup | None:
    """One group of those of the parents: the union of their rows and columns."""
    weights = share.weights
    last: dict[int, int] = {}  # row -> how many levels have it
    columns: dict[int, None] = {}
    joints: dict[int, None] = {}
    for p, groups in enumerate(parts):
        for group in groups:
            joints |= dict.fromkeys(map(int, group.joint_indices))
            rows = np.asarray(group.output_indices, np.int64)
            if not (weights[rows // 9, p] > 0).any():
                continue
            columns |= dict.fromkeys(map(int, group.input_indices))
            lods = [int(group.lods[min(lod, len(group.lods) - 1)]) for lod in range(levels)]
            for at, row in enumerate(rows.tolist()):
                last[row] = max(last.get(row, 0), sum(at < n for n in lods))
    if not last or not columns:
        return None
    order = sorted(last, key=lambda row: -last[row])
    inputs = sorted(columns)
    values = np.zeros((len(order), len(inputs)))
    row_of = {row: at for at, row in enumerate(order)}
    column_of = {column: at for at, column in enumerate(inputs)}
    for p, groups in enumerate(parts):
        for group in groups:
            own = [(i, int(r)) for i, r in enumerate(group.output_indices) if int(r) in row_of]
            used = [(i, int(c)) for i, c in enumerate(group.input_indices) if int(c) in column_of]
            if not own or not used:
                continue
            joints_of = np.array([r // 9 for _, r in own])
            shifts = np.array([r % 9 < 3 for _, r in own])
            part = np.where(shifts, share.scaled[joints_of, p], weights[joints_of, p])
            read = np.ix_([i for i, _ in own], [i for i, _ in used])
            block = np.asarray(group.values, np.float64)[read]
            place = np.ix_([row_of[r] for _, r in own], [column_of[c] for _, c in used])
            values[place] += part[:, None] * block
    counts = np.array([last[row] for row in order])
    return JointGroup(
        lods=[int((counts > lod).sum()) for lod in range(levels)],
        input_indices=inputs,
        output_indices=order,
        values=values.astype(np.float32),
        joint_indices=sorted(joints),
    )


def _maps(out: Dna, parents: Sequence[Dna], shares: Doubles) -> None:
    """Slopes and cuts of what drives animated maps."""
    maps = copy.copy(parents[0].animated_maps)
    conditionals = copy.copy(maps.conditionals)
    own = [p.animated_maps.conditionals for p in parents]
    for name in ("slope_values", "cut_values"):
        rows = [np.asarray(getattr(table, name), np.float64) for table in own]
        if not all(np.array_equal(rows[0], r) for r in rows[1:]):
            setattr(conditionals, name, sum(s * r for s, r in zip(shares, rows, strict=True)))
    maps.conditionals = conditionals
    out.animated_maps = maps
