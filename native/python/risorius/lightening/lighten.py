# SPDX-License-Identifier: MIT
"""Makes a finished face lighter: fewer joints, correctives and levels of detail.

Order of the steps: LODs, correctives, joints with refitted weights, blend shapes.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from .. import Dna, DnaError, JointGroup, Rig
from .._native import keep_parts
from ..author.geometry import skeleton as sk
from ..author.geometry.skeleton import Doubles, Ints
from ..author.work import CARRIED_MM, MM, listed_meshes, require_sizes
from ..base.budget import Budget
from ..base.errors import ArgumentError
from .correctives import contributions, least_correctives, middle_of, require_correctives
from .joints import (
    Leaving,
    held_by_joint,
    joint_table,
    mirrored_joints,
    needed_joints,
    require_count,
)
from .measure import Told, Vertices, errors, microseconds
from .poses import Pose, descendants, motion_rows, poses_of
from .shapes import add_shapes
from .weights import Refit

Progress = Callable[[float], bool | None]

_ROUNDS = 4  # largest number of rounds of choosing joints and refitting weights
_BETTER = 0.97  # a further round follows if the error is below this fraction of the smallest one
_FIGHT = 1.0  # exponent by which the importance of a pose grows with its error
# Memory limit of intermediate tables in bytes: a constant, plus a factor times the face's size.
_BASE_BYTES, _BYTES_PER_BYTE = 1 << 29, 128


@dataclass
class Size:
    """Counts of joints, meshes and other items of a face, its file size, and its evaluation
    time."""

    joints: int
    correctives: int
    levels: int
    meshes: int
    channels: int
    deltas: int
    coefficients: int  # coefficients of joint groups, including zeros
    file_bytes: int
    microseconds: float  # median duration of one evaluation at LOD 0

    @classmethod
    def of(cls, dna: Dna, file_bytes: int, rig: Rig) -> Size:
        """Counts the joints, meshes and other items of a face, and measures its evaluation time.

        Args:
            dna: the face.
            file_bytes: size of its file in bytes.
            rig: compiled from it.
        """
        return cls(
            len(dna.joint_names),
            dna.psd_count,
            dna.lod_count,
            len(dna.meshes),
            len(dna.blend_shape_channel_names),
            sum(len(t.vertex_indices) for m in dna.meshes for t in m.blend_shape_targets),
            sum(np.asarray(group.values).size for group in dna.joint_groups),
            file_bytes,
            microseconds(rig),
        )


@dataclass
class ExpressionError:
    """The error of the lighter face in one pose, at the kept LOD where this error is largest."""

    name: str  # name of the control, or names of a corrective's controls joined by +
    largest_mm: float
    rms_mm: float  # of the LOD with the largest error
    lod: int  # the LOD with the largest error, numbered as in the lighter face
    # "": the pose of a single control; otherwise whether the corrective was "kept" or "removed"
    corrective: str


@dataclass
class LightenReport:
    """The sizes before and after `lighten`, the removed joints and correctives, and the errors."""

    before: Size
    after: Size
    lods: list[int]  # kept LODs, in the numbering of the input
    removed_joints: list[str] = field(default_factory=list)
    removed_correctives: list[str] = field(default_factory=list)
    expressions: list[ExpressionError] = field(default_factory=list)


@dataclass
class _Work:
    """The source face with the kept LODs, and the poses in which faces are compared."""

    dna: Dna
    poses: list[Pose]
    middle: Doubles
    told: Told


def lighten(
    dna: Dna,
    *,
    joints: int | None = None,
    correctives: int | None = None,
    lods: Sequence[int] | None = None,
    keep: Sequence[str] = (),
    shapes_mm: float | None = None,
    measured: bool = True,
    progress: Progress | None = None,
) -> tuple[Dna, LightenReport]:
    """A copy of a face with fewer joints, correctives and levels of detail.

    Raw and GUI controls keep their names and numbers; remaining joints keep their names and
    motions, so animation still plays. Joints are removed in mirrored pairs if other joints can move
    their vertices with the least error; the weights of these vertices are refitted over all
    expressions. Correctives that displace vertices least are removed. Root, spine, neck, head, jaw
    and eyes stay, and joints that networks, twists, swings or rotation controls need, with all
    their ancestors.

    Args:
        dna: a face with meshes; not changed.
        joints: number of joints to keep; None: all that the kept LODs need.
        correctives: number of correctives to keep; None: all.
        lods: numbers of the LODs to keep, 0 is the finest, in any order; None: all.
        keep: names of further joints that must stay.
        shapes_mm: blend shapes correct vertices with a larger error in mm; None: no blend shapes.
        measured: whether to report the errors of all expressions.
        progress: called with the fraction of the work done, 0 to 1; returning False stops it.

    Returns:
        The lighter face and a report.

    Raises:
        ArgumentError: more joints or correctives than the face has, fewer joints than must stay, an
            unknown LOD, a face without correctives or meshes, or no reduction requested.
        BudgetError: the intermediate tables would be far larger than the face's file.
        DnaError: an inconsistent face; "stopped" if progress returned False.
    """
    if joints is None and correctives is None and lods is None:
        raise ArgumentError("joints, correctives or lods: one at least was expected")
    require_sizes(dna)
    _require_finite(dna)
    _check_size(dna)
    levels = _levels(dna, lods)
    before = Size.of(dna, len(dna.to_bytes()), Rig(dna))
    source = dna.filter_lods(levels) if len(levels) < dna.lod_count else copy.copy(dna)
    _require_parts(source, joints, correctives, keep)
    rig = Rig(source)
    poses = poses_of(source, rig)
    work = _Work(source, poses, middle_of(source), _part(progress, 0.0, 0.1))
    leaving = [] if correctives is None else _fewer_correctives(work, rig, correctives)
    fewer = _without(source, leaving)
    gone: list[int] = []
    if joints is not None and joints < len(fewer.joint_names):
        work.told = _part(progress, 0.1, 0.6)
        fewer, gone = _fewer_joints(work, fewer, joints, keep)
    mates = _mates(source, leaving, poses)
    if shapes_mm is not None:
        unit = MM.get(dna.translation_unit, 10.0)
        stay = [pair for pair in mates if pair[1].input >= 0]
        fewer = add_shapes(source, fewer, stay, shapes_mm / unit, _part(progress, 0.6, 0.8))
    after = Size.of(fewer, len(fewer.to_bytes()), Rig(fewer))
    report = LightenReport(before, after, levels)
    report.removed_joints = [source.joint_names[j] for j in gone]
    by_input = {pose.input: pose.name for pose in poses}
    raw = len(source.raw_control_names)
    report.removed_correctives = [by_input.get(raw + row, f"corrective {row}") for row in leaving]
    if measured:
        report.expressions = _compare(source, fewer, mates, _part(progress, 0.8, 1.0))
    return fewer, report


def _levels(dna: Dna, lods: Sequence[int] | None) -> list[int]:
    """The LODs to keep, ascending. Raises: ArgumentError: an unknown LOD, or an empty list."""
    count = max(1, dna.lod_count)
    if lods is None:
        return list(range(count))
    for lod in lods:
        if not 0 <= lod < count:
            raise ArgumentError(f"lods: 0 to {count - 1} were expected, found {lod}")
    if not lods:
        raise ArgumentError("lods: at least one level of detail was expected, found none")
    return sorted(set(lods))


def _require_finite(dna: Dna) -> None:
    """Raises ArgumentError for weights, coefficients or rest poses that are not finite."""
    for name, mesh in zip(dna.mesh_names, dna.meshes, strict=False):
        if not np.isfinite(mesh.skin_weights).all():
            raise ArgumentError(f"mesh {name}: skin weights that are finite were expected")
    for number, group in enumerate(dna.joint_groups):
        if not np.isfinite(group.values).all():
            raise ArgumentError(f"joint group {number}: finite coefficients were expected")
    rest = (dna.neutral_joint_translations, dna.neutral_joint_rotations)
    if not all(np.isfinite(values).all() for values in rest):
        raise ArgumentError("joints: finite positions and rotations were expected")


def _require_parts(
    dna: Dna, joints: int | None, correctives: int | None, keep: Sequence[str]
) -> None:
    """Raises ArgumentError for impossible numbers of joints or correctives, before the work."""
    if correctives is not None:
        require_correctives(dna, correctives)
    needed = needed_joints(dna, keep)
    if joints is not None:
        require_count(dna, joints, needed)


def _check_size(dna: Dna) -> None:
    """Raises BudgetError if the intermediate tables would be far larger than the face."""
    budget = Budget(_BASE_BYTES + _BYTES_PER_BYTE * dna.size_in_bytes(), 0)
    joints, raw = len(dna.joint_names), len(dna.raw_control_names)
    poses = raw + dna.psd_count
    budget.hold(2 * 4 * raw * poses, f"{raw:,} controls in {poses:,} poses")
    inputs = sk.column_count(dna)
    budget.hold(8 * 9 * joints * inputs, f"{joints:,} joints that {inputs:,} inputs move")
    most = max((len(mesh.positions) for mesh in dna.meshes), default=0)
    budget.hold(8 * 12 * joints * poses, f"{joints:,} joints in {poses:,} poses")
    budget.hold(4 * 8 * 16 * joints * joints, f"pairs of {joints:,} joints")
    budget.hold(2 * 8 * most * joints, f"weights of {joints:,} joints")


def _part(progress: Progress | None, begin: float, end: float) -> Told:
    """A function that reports progress from `begin` to `end`, and raises DnaError if the caller
    stops the work.

    Args:
        progress: called with the fraction of the whole work done; returning False stops the work.
        begin, end: fractions of the whole work at the beginning and at the end of this part.
    """

    def told(share: float) -> None:
        if progress is not None and progress(begin + share * (end - begin)) is False:
            raise DnaError("stopped")

    return told


def _fewer_correctives(work: _Work, rig: Rig, correctives: int) -> list[int]:
    """Chooses the correctives to remove: their rows, from 0.

    Args:
        work: the source face and its poses.
        rig: compiled from the source face.
        correctives: number of correctives to keep.
    """
    contribution = contributions(work.dna, rig, work.poses)
    work.told(1.0)
    return least_correctives(work.dna, work.dna.psd_count - correctives, contribution)


def _without(dna: Dna, leaving: Sequence[int]) -> Dna:
    """The face without the correctives in `leaving`, and without joint groups and columns of zeros
    that remain."""
    if not leaving:
        return dna
    stays = [row not in set(leaving) for row in range(dna.psd_count)]
    return _dense(keep_parts(dna, joints=[True] * len(dna.joint_names), correctives=stays))


def _dense(dna: Dna) -> Dna:
    """The face without zero columns in joint groups and without joint groups that move nothing."""
    groups = []
    for group in dna.joint_groups:
        values = np.asarray(group.values)
        if not len(group.output_indices) or not values.any():
            continue
        used = values.any(axis=0)
        groups.append(
            group
            if used.all()
            else JointGroup(
                lods=group.lods,
                input_indices=np.asarray(group.input_indices)[used],
                output_indices=group.output_indices,
                joint_indices=group.joint_indices,
                values=values[:, used],
            )
        )
    dna.joint_groups = groups
    return dna


def _fewer_joints(work: _Work, dna: Dna, joints: int, keep: Sequence[str]) -> tuple[Dna, list[int]]:
    """The face with `joints` joints, and the indices of the removed joints.

    Poses with large errors get more importance in the next round. The result is the round whose
    largest error at LOD 0 is smallest; rounds end when that error falls by less than 3 %, or after
    four rounds.

    Args:
        work: the source face and its poses.
        dna: the face after the removal of correctives.
        joints: number of joints to keep.
        keep: names of further joints that must stay.
    """
    thinning = _Thinning(dna, work.middle, needed_joints(dna, keep))
    counts = np.array([1.0 / np.sqrt(pose.controls) for pose in thinning.poses])
    best: tuple[float, Doubles] | None = None
    for number in range(_ROUNDS):
        gone, rows = thinning.choose(joints, counts)
        off = thinning.largest(thinning.made(gone, rows, counts, [0]))
        work.told(0.8 * (number + 1) / _ROUNDS)
        largest = float(off.max(initial=0.0))
        enough = best is not None and largest > _BETTER * best[0]
        if best is None or largest < best[0]:
            best = largest, counts
        if enough:
            break
        counts = counts * np.clip(off / max(float(np.median(off)), 1e-9), 0.5, 4.0) ** _FIGHT
    assert best is not None
    counts = best[1]
    gone, rows = thinning.choose(joints, counts)
    out = thinning.made(gone, rows, counts, range(dna.lod_count))
    work.told(1.0)
    return _dense(out), gone


class _Thinning:
    """The data that all rounds of joint removal of a face share."""

    def __init__(self, dna: Dna, middle: Doubles, needed: Sequence[int]) -> None:
        self.dna, self.middle, self.needed = dna, middle, needed
        self.rig = Rig(dna)
        self.poses = poses_of(dna, self.rig)
        self.parents = np.asarray(dna.joint_parents, np.int64)
        self.table, self.mirrored = joint_table(dna), mirrored_joints(dna)
        self.level: dict[int, int] = {}  # index of a mesh -> its finest LOD
        for lod in reversed(range(dna.lod_count)):
            self.level |= {m: lod for m in listed_meshes(dna, lod) if m < len(dna.meshes)}
        self.numbers = sorted(self.level)
        self.meshes = [dna.meshes[m] for m in self.numbers]
        self.points = [np.asarray(mesh.positions, np.float64) - middle for mesh in self.meshes]
        self.starts = np.cumsum([0, *(len(points) for points in self.points)])
        self.goal = Vertices(dna, self.rig, 0)
        self.rest = sk.world_matrices(dna, np.zeros((len(self.parents), 9)))[:, :3, 3] - middle

    def choose(self, joints: int, counts: Doubles) -> tuple[list[int], Leaving]:
        """Chooses joints to remove. The returned object has the vertex weights of the other joints.

        Args:
            joints: number of joints to keep.
            counts: float64[poses], importance of each pose.
        """
        sizes = np.zeros(max(1, self.dna.lod_count))
        for m, points in zip(self.numbers, self.points, strict=True):
            sizes[self.level[m]] += len(points)
        importance = [
            np.full(len(points), 1.0 / sizes[self.level[m]])
            for m, points in zip(self.numbers, self.points, strict=True)
        ]
        whole = np.concatenate(self.points)
        leaving = Leaving(
            _products(self.dna, self.rig, 0, self.poses, counts, self.middle),
            np.concatenate([whole, np.ones((len(whole), 1))], axis=1),
            held_by_joint(self.meshes, len(self.parents)),
            np.concatenate(importance),
        )
        many = len(self.parents) - joints
        return leaving.choose(many, self.needed, self.parents, self.mirrored, self.table), leaving

    def made(
        self, gone: Sequence[int], leaving: Leaving, counts: Doubles, levels: Sequence[int]
    ) -> Dna:
        """The face without the joints `gone`, with refitted weights at the LODs `levels`.

        Args:
            gone: indices of the removed joints.
            leaving: the vertex weights after other joints took over vertices of removed joints.
            counts: float64[poses], importance of each pose.
            levels: LODs whose meshes get refitted weights; other meshes are not refitted.
        """
        stays = np.ones(len(self.parents), bool)
        stays[list(gone)] = False
        out, meshes = copy.copy(self.dna), list(self.dna.meshes)
        for lod in sorted(set(self.level.values()) & set(levels)):
            products = leaving.products
            if lod:
                products = _products(self.dna, self.rig, lod, self.poses, counts, self.middle)
            there = np.flatnonzero(stays & self.table[:, lod])
            refit = Refit(products, self.rest, self.parents, there)
            for at, m in enumerate(self.numbers):
                if self.level[m] == lod:
                    begin, end = int(self.starts[at]), int(self.starts[at + 1])
                    rows = _rows(leaving, begin, end, len(stays))
                    meshes[m] = refit.refit(self.meshes[at], self.points[at], rows)
        out.meshes = meshes
        return keep_parts(out, joints=stays.tolist(), correctives=[True] * self.dna.psd_count)

    def largest(self, made: Dna) -> Doubles:
        """float64[poses]: the largest error of a vertex of LOD 0, in the file's unit."""
        own = Vertices(made, Rig(made), 0)
        ways = (self.goal.at(pose.raw) - own.at(pose.raw) for pose in self.poses)
        return np.array([np.linalg.norm(way, axis=1).max(initial=0.0) for way in ways])


def _rows(leaving: Leaving, begin: int, end: int, joints: int) -> Doubles:
    """float64[V, J]: weights of one mesh after other joints took over removed joints' vertices.

    Args:
        leaving: vertex weights of the remaining joints, of all meshes.
        begin, end: first vertex of the mesh, and the vertex after its last one, counted over all
            meshes.
        joints: number of joints J.
    """
    out = np.zeros((end - begin, joints))
    for joint, (vertices, weights) in enumerate(leaving.held):
        first, last = np.searchsorted(vertices, (begin, end))
        np.add.at(out[:, joint], vertices[first:last] - begin, weights[first:last])
    return out


def _products(
    dna: Dna, rig: Rig, lod: int, poses: Sequence[Pose], counts: Doubles, middle: Doubles
) -> Doubles:
    """float64[J, 4, J, 4]: for each pair of joints the product A^T B of their 3 x 4 motion
    matrices, summed over poses.

    For each joint with children that no pose moves, a shift of the joint and its descendants by
    CARRIED_MM is added as a pose, because otherwise all joints that no pose moves would seem to be
    interchangeable.

    Args:
        dna: the face.
        rig: compiled from it.
        lod: the LOD that is evaluated.
        poses: the poses.
        counts: float64[poses], importance of each pose.
        middle: float64[3], the origin of the points.
    """
    count = len(dna.joint_names)
    out = np.zeros((4 * count, 4 * count))
    still = np.ones(count, bool)
    begin = 0
    for rows in motion_rows(dna, rig, lod, poses, middle):
        share = counts[begin : begin + len(rows)]
        begin += len(rows)
        still &= (np.abs(rows) <= sk.STILL).all(axis=(0, 2, 3))
        flat = (rows * share[:, None, None, None]).transpose(0, 2, 1, 3).reshape(-1, 4 * count)
        out += flat.T @ flat
    out = out.reshape(count, 4, count, 4)
    shift = (CARRIED_MM / MM.get(dna.translation_unit, 10.0)) ** 2
    parents = np.asarray(dna.joint_parents, np.int64)
    for joint in np.flatnonzero(still & (np.bincount(parents, minlength=count) > 0)):
        below = descendants(parents, int(joint))
        out[below[:, None], 3, below[None], 3] += shift
    return out


def _mates(source: Dna, leaving: Sequence[int], poses: Sequence[Pose]) -> list[tuple[Pose, Pose]]:
    """Pairs of a source pose and the same pose of the face without the correctives `leaving`. The
    input of the second pose is renumbered, -1 for a removed corrective.

    Args:
        source: the source face.
        leaving: rows of the removed correctives, from 0.
        poses: poses of the source face.
    """
    raw, rows = len(source.raw_control_names), np.ones(source.psd_count, bool)
    rows[list(leaving)] = False
    place: Ints = np.where(rows, np.cumsum(rows) - 1, -1)
    out = []
    for pose in poses:
        at = pose.input
        if at >= raw:
            at = raw + int(place[at - raw]) if place[at - raw] >= 0 else -1
        out.append((pose, Pose(pose.name, pose.raw, at, pose.controls)))
    return out


def _compare(
    source: Dna, made: Dna, mates: Sequence[tuple[Pose, Pose]], told: Told
) -> list[ExpressionError]:
    """The errors of all poses, the largest first.

    Args:
        source: the source face.
        made: the lighter face.
        mates: pairs of a source pose and the same pose of the lighter face.
        told: called with the fraction of the work done, 0 to 1.
    """
    poses = [pose for pose, _ in mates]
    largest, rms = errors(source, made, (Rig(source), Rig(made)), poses, told)
    mm = MM.get(source.translation_unit, 10.0)
    out = []
    for at, (pose, own) in enumerate(mates):
        lod = int(largest[at].argmax())
        kind = "" if pose.input < len(source.raw_control_names) else "kept"
        out.append(
            ExpressionError(
                pose.name, float(largest[at, lod]) * mm, float(rms[at, lod]) * mm, lod,
                "removed" if own.input < 0 else kind,
            )
        )  # fmt: skip
    return sorted(out, key=lambda e: -e.largest_mm)
