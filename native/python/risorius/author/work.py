# SPDX-License-Identifier: MIT
"""What the steps from a face of shapes to one of joints share: options, errors, the face itself."""

from __future__ import annotations

import copy
from collections.abc import Container, Sequence
from dataclasses import dataclass, field

import numpy as np

from .. import Dna, JointGroup, Mesh
from ..base.budget import Budget
from ..base.errors import ArgumentError
from .fitting import FitOptions, JointFit
from .geometry import skeleton as sk
from .geometry.skeleton import Doubles, Ints
from .levels import LodOptions
from .pivots import Pivot

MM = {"cm": 10.0, "m": 1000.0}
# A vertex that follows another joint of the neck than before counts as one that is so far off: a
# head that is turned moves them about so far against each other.
CARRIED_MM = 20.0
# The most memory that making a rig may take: the dense table of all expressions is about a hundred
# times as large as the deltas in the file.
_BASE_BYTES, _BYTES_PER_BYTE = 1 << 28, 128
# Of the head's height: 0.16 mm of 240. The default of the command line, of Blender and of the
# sample people.
TOLERANCE = 1 / 1500
_RIGID_MM = 0.02  # a mesh that its joints bring so near needs no others


@dataclass(frozen=True)
class RigOptions:
    """What the joint rig is to be."""

    fit: FitOptions = field(default_factory=FitOptions)
    # A blend shape keeps what joints leave of a vertex beyond this, in mm; None: beyond
    # `tolerance`, a share of the head's height.
    tolerance_mm: float | None = None
    tolerance: float = TOLERANCE
    shapes: bool = True  # False: no blend shapes, joints alone
    # Whether the rig has at most as many deltas as its input: what joints leave beyond the
    # tolerance is then kept as far as these go.
    lighter: bool = True
    # A joint leaves an expression in which it moves no vertex further: others take over.
    least_effect_mm: float = 0.05
    lods: LodOptions = field(default_factory=LodOptions)
    # Meshes that keep their weights and blend shapes, by parts of their names: eyeballs, which turn
    # with a joint of their own.
    kept: tuple[str, ...] = ()
    between: bool = True  # whether errors on the way to 1 are measured, a tenth of the work


@dataclass
class MeshErrors:
    """What is left of each expression's motion on one mesh, by joints alone and with shapes."""

    name: str
    vertices: int
    expressions: list[str]
    motion: Doubles  # [E] root mean square of the motion, mm
    joints_rms: Doubles  # [E] mm
    joints_largest: Doubles  # [E] mm
    largest: Doubles  # [E] mm, with blend shapes
    worst_vertex: Ints  # [E] by joints alone
    # [E] mm, by joints alone with the control at 0.25, 0.5 and 0.75, against the line or the arc
    between_largest: Doubles
    lod: int = 0


@dataclass
class Level:
    """A level of detail of what was made, and what is left of the motion of all its meshes."""

    joints: int  # new ones
    vertices: int
    deltas: int
    rms: float  # mm, by joints alone, over vertices and expressions
    largest: float  # mm, by joints alone
    largest_with_shapes: float  # mm


@dataclass
class Joints:
    """The head and the joints that controls move, then new ones; as a fit gives them."""

    joints: Doubles  # [J, 3]
    rotations: Doubles  # [E, J, 3], vectors
    translations: Doubles  # [E, J, 3]
    mirrored: Ints  # [J] the joint of the other side, itself in the middle


@dataclass
class Work:
    """The face that is made, and what of it is computed once."""

    source: Dna
    dna: Dna
    columns: list[int]  # inputs that move a vertex, but correctives
    names: list[str]  # of these
    motions: Doubles  # [C, J, 3, 4] of the joints that were there
    positions: Doubles  # [J, 3]
    head: int  # what most of the face hangs on
    wanted: dict[int, Doubles] = field(default_factory=dict)  # displacements of each mesh, at first
    levels: int = 1
    new: list[Ints] = field(default_factory=list)  # joints of each level, among the new ones
    pivots: list[Pivot] = field(default_factory=list)
    mirrored: dict[int, int] = field(default_factory=dict)  # joints of the other side
    groups: list[JointGroup] = field(default_factory=list)  # of the joints that were there
    combined: dict[int, frozenset[int]] = field(default_factory=dict)  # correctives: their controls
    parents: list[int] = field(default_factory=list)  # of the new joints
    heirs: dict[int, int] = field(
        default_factory=dict
    )  # what takes a joint's vertices in its place


def begin(dna: Dna) -> Work:
    if not dna.meshes or not dna.joint_names:
        raise ArgumentError("a face with meshes and at least one joint was expected")
    require_sizes(dna)
    count = sk.column_count(dna)
    together = sk.psd_parts(dna)
    _check_size(dna, count, together)
    deltas = sk.column_deltas(dna, count)
    if np.any(deltas[..., 6:9]):
        joint = int(np.argwhere(deltas[..., 6:9].any(axis=(0, 2)))[0, 0])
        raise ArgumentError(f"joint {dna.joint_names[joint]} changes its size: not supported")
    motions = sk.column_motions(dna, count)
    moving = np.flatnonzero(deltas.any(axis=(1, 2)))
    shaped = {c for mesh in dna.meshes for c in sk.column_shapes(dna, mesh, count)}
    columns = sorted((shaped | {int(c) for c in moving}) - set(together))
    if not columns:
        raise ArgumentError("a face with controls that move it was expected, found none that does")
    names = [_column_name(dna, column) for column in columns]
    rest = sk.world_matrices(dna, np.zeros((len(dna.joint_names), 9)))
    work = Work(dna, copy.copy(dna), columns, names, motions[columns], rest[:, :3, 3], 0)
    work.combined = together
    work.wanted = {m: displacements(work, mesh) for m, mesh in enumerate(dna.meshes)}
    work.head = _head(work)
    return work


def require_sizes(dna: Dna) -> None:
    """Refuse a face whose meshes cannot be computed with.

    Args:
        dna: of any file.

    Raises:
        ArgumentError: no mesh, all of its vertices in one point, coordinates that are not finite
            or beyond FARTHEST, whose squares leave the numbers.
    """
    if not dna.meshes:
        raise ArgumentError("a face with meshes was expected")
    spread = 0.0
    for name, mesh in zip(dna.mesh_names, dna.meshes, strict=False):
        points = np.asarray(mesh.positions, np.float64)
        moved = [np.asarray(t.deltas, np.float64) for t in mesh.blend_shape_targets]
        largest = max((float(np.abs(x).max(initial=0.0)) for x in (points, *moved)), default=0.0)
        if not largest <= sk.FARTHEST:
            raise ArgumentError(
                f"mesh {name}: coordinates up to {sk.FARTHEST:g} were expected, found {largest:g}"
            )
        if len(points):
            spread = max(spread, float(np.ptp(points, axis=0).max()))
    if not spread:
        raise ArgumentError("a mesh of some size was expected, found vertices in one point")


def _check_size(dna: Dna, count: int, together: Container[int]) -> None:
    """Raises: BudgetError: tables of what inputs do to joints and vertices would be far larger than
    the face.

    Args:
        dna: the face.
        count: of its inputs.
        together: inputs that are correctives.
    """
    budget = Budget(_BASE_BYTES + _BYTES_PER_BYTE * dna.size_in_bytes(), 0)
    joints, vertices = len(dna.joint_names), [len(mesh.positions) for mesh in dna.meshes]
    numbers = 9 + 3 * 16  # attributes, and the matrices of a joint on its way to the world
    budget.hold(8 * numbers * count * joints, f"{joints:,} joints that {count:,} inputs move")
    budget.hold(8 * joints * max(vertices), f"weights of {joints:,} joints")
    alone = sum(column not in together for column in range(count))
    place = f"{sum(vertices):,} vertices that {alone:,} inputs move"
    budget.hold(8 * 3 * sum(vertices) * alone, place)


def _column_name(dna: Dna, column: int) -> str:
    raw = dna.raw_control_names
    return raw[column] if column < len(raw) else f"input {column}"


def _head(work: Work) -> int:
    """The resting joint that most of what moves hangs on."""
    dna = work.source
    share = np.zeros(len(dna.joint_names))
    for m, mesh in enumerate(dna.meshes):
        moved = np.linalg.norm(work.wanted[m], axis=2).max(axis=0)
        share += moved @ sk.dense_weights(mesh, len(share))
    still = np.isclose(work.motions, np.eye(3, 4), atol=1e-12).all(axis=(0, 2, 3))
    if not still.any():
        raise ArgumentError("a joint that no control moves was expected, such as the head")
    return int(np.argmax(np.where(still, share + 1e-30, -1)))


def displacements(work: Work, mesh: Mesh) -> Doubles:
    """float64[C, V, 3]: where each input at 1 brings the vertices, less where they rest.

    Args:
        work: the face of shapes.
        mesh: one of its own.
    """
    positions = np.asarray(mesh.positions, np.float64)
    weights = sk.dense_weights(mesh, len(work.source.joint_names))
    shapes = sk.column_shapes(work.source, mesh, sk.column_count(work.source))
    out = np.zeros((len(work.columns), len(positions), 3))
    rests = np.isclose(work.motions, np.eye(3, 4), atol=1e-12).all(axis=(1, 2, 3))
    for row, column in enumerate(work.columns):
        delta = shapes.get(column)
        if not rests[row]:
            shaped = positions if delta is None else positions + delta
            out[row] = sk.skinned(shaped, weights, work.motions[row]) - positions
        elif delta is not None:
            out[row] = delta
    return out


def needs_joints(work: Work, mesh: Mesh, wanted: Doubles) -> bool:
    """Whether blend shapes move the mesh, and not the joints that are there alone (an eyeball).

    Args:
        work: the face.
        mesh: one of its own.
        wanted: float64[E, V, 3], of it.
    """
    if not mesh.blend_shape_targets:
        return False
    positions = np.asarray(mesh.positions, np.float64)
    weights = sk.dense_weights(mesh, len(work.source.joint_names))
    far = 0.0
    for row in range(len(work.columns)):
        if wanted[row].any():
            by_joints = sk.skinned(positions, weights, work.motions[row]) - positions
            far = max(far, float(np.abs(by_joints - wanted[row]).max()))
    return far * MM.get(work.source.translation_unit, 10.0) > _RIGID_MM


def resting(work: Work) -> Ints:
    """The joints of the source that no expression moves, such as spine, neck and head.

    To a fit all that rests is alike; which of these a vertex follows when a neck is turned by hand
    is to stay as it was.
    """
    moving = set(given(work)[1:].tolist())
    return np.array([j for j in range(len(work.source.joint_names)) if j not in moving])


def carriers(work: Work) -> Ints:
    """int64[joints]: the resting joint that carries a joint: itself, or the next above it.

    Args:
        work: the face; new joints count where their parents are chosen.
    """
    own = set(resting(work).tolist())
    parents = [*(int(p) for p in work.source.joint_parents), *work.parents]
    out = []
    for joint in range(len(parents)):
        at = joint
        for _ in range(len(parents)):
            if at in own:
                break
            at = parents[at]
        out.append(at if at in own else work.head)
    return np.array(out, np.int64)


def carried_shares(work: Work, mesh: Mesh) -> Doubles:
    """float64[V, resting]: how much of each vertex the resting joints carry, by themselves and by
    moving joints below them; rows with sum 1.

    Args:
        work: the face.
        mesh: one of its own, or with its skin.
    """
    count = len(work.source.joint_names)
    weights = sk.dense_weights(mesh, count)
    roots = carriers(work)[:count]
    return np.stack([weights[:, roots == j].sum(axis=1) for j in resting(work)], axis=1)


def carried_shift(work: Work) -> float:
    """How far what a resting joint carries is shifted with it, in the file's unit: what a neck that
    is turned by hand does, as an expression would."""
    return CARRIED_MM / MM.get(work.source.translation_unit, 10.0)


def carried_shifts(work: Work, joints: Ints) -> Doubles:
    """float64[n, joints, 3]: all that hangs on each of these resting joints, shifted with it.

    Args:
        work: the face, parents of new joints chosen.
        joints: resting ones.
    """
    out = np.zeros((len(joints), len(work.source.joint_names) + len(work.parents), 3))
    out[..., 1] = carried_shift(work) * (carriers(work) == np.asarray(joints)[:, None])
    return out


def joined_positions(work: Work, meshes: Sequence[int]) -> Doubles:
    """float64[V, 3]: the vertices of some of the source's meshes, one after the other.

    Args:
        work: the face.
        meshes: which.
    """
    return np.concatenate([np.asarray(work.source.meshes[m].positions, np.float64) for m in meshes])


def new_weights(work: Work, meshes: Sequence[int], weights: dict[int, Doubles]) -> Doubles:
    """float64[V, new joints]: what new joints hold of these vertices.

    Args:
        work: the face.
        meshes: which.
        weights: float64[V, joints] of each mesh.
    """
    return np.concatenate([weights[m][:, len(work.source.joint_names) :] for m in meshes])


def given(work: Work) -> Ints:
    """The head, and the joints that controls move."""
    still = np.isclose(work.motions, np.eye(3, 4), atol=1e-12).all(axis=(0, 2, 3))
    return np.array([work.head, *np.flatnonzero(~still)])


def dense(fit: JointFit, place: Ints, joints: int) -> Doubles:
    """float64[V, joints]: the weights of a fit.

    Args:
        fit: has them, by its own joints.
        place: of each of these, the joint's index.
        joints: how many there are.
    """
    out = np.zeros((len(fit.weights), joints))
    rows = np.arange(len(out))[:, None]
    np.add.at(out, (rows, place[np.asarray(fit.weight_joints, np.int64)]), fit.weights)
    return out


def listed_meshes(dna: Dna, lod: int) -> list[int]:
    """The meshes of a level; all where the file does not say.

    Args:
        dna: the face.
        lod: the level.
    """
    mapping = dna.lod_mesh_mapping
    return [int(m) for m in mapping[lod]] if lod < len(mapping) else list(range(len(dna.meshes)))
