# SPDX-License-Identifier: MIT
"""Defines the options, errors and intermediate data that all steps of making a joint rig share."""

from __future__ import annotations

import copy
from collections.abc import Callable, Container, Sequence
from dataclasses import dataclass, field

import numpy as np

from .. import Dna, JointGroup, Mesh
from ..base.budget import Budget
from ..base.errors import ArgumentError
from .fitting import FitOptions, JointFit
from .geometry import skeleton as sk
from .geometry.blocks import LARGE
from .geometry.skeleton import Doubles, Ints
from .geometry.wanted import Wanted
from .levels import LodOptions
from .pivots import Pivot

MM = {"cm": 10.0, "m": 1000.0}
# Shift in mm of a joint in carried_shifts(), one of the joints that no expression moves. A vertex
# that follows another neck joint than in the source has this error, because a rotation of the head
# moves the vertex about this far from its right position.
CARRIED_MM = 20.0
# Largest memory of making a rig: a constant plus a factor times the file's size. The dense table of
# all expressions is about a hundred times as large as the deltas in the file.
_BASE_BYTES, _BYTES_PER_BYTE = 1 << 28, 128
# Tolerance relative to the head's height: 0.16 mm for a head of 240 mm. Default of the command
# line, of Blender and of the sample people.
TOLERANCE = 1 / 1500
_RIGID_MM = 0.02  # a mesh needs no new joints if the existing joints' error is smaller


@dataclass(frozen=True)
class RigOptions:
    """Options of a joint rig."""

    fit: FitOptions = field(default_factory=FitOptions)
    # Largest error in mm that the joints may leave at a vertex; blend shapes correct larger errors.
    # None: `tolerance` times the height of the head.
    tolerance_mm: float | None = None
    tolerance: float = TOLERANCE
    shapes: bool = True  # False: joints only, no blend shapes
    # Whether the rig has at most as many blend shape deltas as the source face. If necessary, the
    # shortest deltas are removed even above the tolerance.
    lighter: bool = True
    # A joint does not move in an expression in which it would move every vertex by less than this
    # distance in mm.
    least_effect_mm: float = 0.05
    lods: LodOptions = field(default_factory=LodOptions)
    # Substrings of the names of meshes that keep weights and blend shapes, such as eyeballs, which
    # turn with their own joint.
    kept: tuple[str, ...] = ()
    # Whether errors at control values between 0 and 1 are measured, which takes a tenth of the
    # total time.
    between: bool = True
    # Joints are fitted to meshes that have about this number of vertices together; larger meshes
    # are simplified for the fit. Then the weights are transferred to all vertices of the whole
    # meshes, and blend shapes correct the errors that remain.
    fit_vertices: int = LARGE


@dataclass
class MeshErrors:
    """The errors of each expression on one mesh, by joints alone and with blend shapes."""

    name: str
    vertices: int
    expressions: list[str]
    motion: Doubles  # [E] root mean square of the wanted displacements, mm
    joints_rms: Doubles  # [E] root mean square error of the joints alone, mm
    joints_largest: Doubles  # [E] largest error of the joints alone, mm
    largest: Doubles  # [E] largest error with blend shapes, mm
    worst_vertex: Ints  # [E] vertex with the largest error of the joints alone
    # [E] largest error in mm of the joints alone with the control at 0.25, 0.5 and 0.75, relative
    # to the wanted positions on a line or an arc
    between_largest: Doubles
    lod: int = 0


@dataclass
class Level:
    """A level of detail of the rig, and the errors of its meshes."""

    joints: int  # number of new joints
    vertices: int
    deltas: int  # number of blend shape deltas
    rms: float  # root mean square error of the joints alone, over vertices and expressions, mm
    largest: float  # largest error of the joints alone, mm
    largest_with_shapes: float  # largest error with blend shapes, mm


@dataclass
class Joints:
    """Joints of a fit: the head, the existing joints that controls move, then the new joints."""

    joints: Doubles  # [J, 3] positions
    rotations: Doubles  # [E, J, 3] rotation vectors
    translations: Doubles  # [E, J, 3] shifts of the joints
    mirrored: Ints  # [J] the joint of the other side; a joint in the middle names itself


@dataclass
class Work:
    """The source face, the face that is made, and quantities that several steps use."""

    source: Dna
    dna: Dna  # the face that is made
    columns: list[int]  # inputs that move a vertex, without correctives
    names: list[str]  # names of these inputs
    motions: Doubles  # [C, J, 3, 4] motions of the source's joints
    positions: Doubles  # [J, 3] neutral positions of the source's joints
    head: int  # the joint that carries most of the motion, of the joints that no expression moves
    # mesh -> its displacements; emptied before the fit, to free memory
    wanted: dict[int, Wanted] = field(default_factory=dict)
    levels: int = 1
    new: list[Ints] = field(default_factory=list)  # indices of each level's new joints
    pivots: list[Pivot] = field(default_factory=list)
    mirrored: dict[int, int] = field(default_factory=dict)  # joint -> joint of the other side
    groups: list[JointGroup] = field(default_factory=list)  # joint groups of the source
    combined: dict[int, frozenset[int]] = field(default_factory=dict)  # corrective -> controls
    parents: list[int] = field(default_factory=list)  # parents of the new joints
    heirs: dict[int, int] = field(
        default_factory=dict
    )  # joint -> joint that takes its vertices at coarser levels


def begin(dna: Dna, go_on: Callable[[], None] = lambda: None) -> Work:
    """The Work of a face: the names and motions of its inputs, the displacements of its meshes, and
    its head joint.

    Args:
        dna: a face with blend shapes; it is not changed.
        go_on: called before each mesh and each block of a large mesh; raises an error to stop.

    Raises:
        ArgumentError: the face has no meshes or joints, no control moves it, controls move every
            joint, a control scales a joint, or require_sizes() rejects the meshes.
        BudgetError: the tables would be too large for the size of the face.
    """
    if not dna.meshes or not dna.joint_names:
        raise ArgumentError("a face with meshes and at least one joint was expected")
    require_sizes(dna)
    count = sk.column_count(dna)
    together = sk.psd_parts(dna)
    _check_size(dna, count, together)
    deltas = sk.column_deltas(dna, count)
    if np.any(deltas[..., 6:9]):
        joint = int(np.argwhere(deltas[..., 6:9].any(axis=(0, 2)))[0, 0])
        raise ArgumentError(
            f"joint {dna.joint_names[joint]} is scaled by a control, which is not supported"
        )
    motions = sk.column_motions(dna, count)
    moving = np.flatnonzero(deltas.any(axis=(1, 2)))
    shaped = {c for mesh in dna.meshes for c in sk.shaped_columns(dna, mesh, count)}
    columns = sorted((shaped | {int(c) for c in moving}) - set(together))
    if not columns:
        raise ArgumentError("a face with controls that move it was expected, found none")
    names = [_column_name(dna, column) for column in columns]
    rest = sk.world_matrices(dna, np.zeros((len(dna.joint_names), 9)))
    work = Work(dna, copy.copy(dna), columns, names, motions[columns], rest[:, :3, 3], 0)
    work.combined = together
    work.wanted = {m: Wanted(work, mesh, go_on) for m, mesh in enumerate(dna.meshes)}
    work.head = _head(work)
    return work


def require_sizes(dna: Dna) -> None:
    """Reject a face with unusable meshes.

    Args:
        dna: the face.

    Raises:
        ArgumentError: the face has no mesh, no mesh has vertices at different places, or a
            coordinate is infinite, NaN, or so large (above 1e9) that its square could
            overflow.
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
        raise ArgumentError("a mesh of some size was expected, found all vertices at one point")


def _check_size(dna: Dna, count: int, together: Container[int]) -> None:
    """Check that the tables of inputs, joints and vertices fit the memory budget.

    Args:
        dna: the face.
        count: number of inputs of the face.
        together: inputs that are correctives.

    Raises:
        BudgetError: the tables would be too large for the size of the face.
    """
    budget = Budget(_BASE_BYTES + _BYTES_PER_BYTE * dna.size_in_bytes(), 0)
    joints, vertices = len(dna.joint_names), [len(mesh.positions) for mesh in dna.meshes]
    numbers = 9 + 3 * 16  # attributes of a joint, and three matrices for its world transform
    budget.hold(8 * numbers * count * joints, f"{joints:,} joints that {count:,} inputs move")
    # A mesh of more than LARGE vertices is processed in blocks, so the tables have the size of a
    # block.
    vertices = [min(count, LARGE) for count in vertices]
    budget.hold(8 * joints * max(vertices), f"weights of {joints:,} joints")
    alone = sum(column not in together for column in range(count))
    place = f"{sum(vertices):,} vertices that {alone:,} inputs move"
    budget.hold(8 * 3 * sum(vertices) * alone, place)


def _column_name(dna: Dna, column: int) -> str:
    raw = dna.raw_control_names
    return raw[column] if column < len(raw) else f"input {column}"


def _head(work: Work) -> int:
    """The joint that carries most of the face's motion, of the joints that no expression moves.

    It has the largest sum of skin weight times largest displacement over all vertices.
    """
    dna = work.source
    share = np.zeros(len(dna.joint_names))
    for m, mesh in enumerate(dna.meshes):
        vertex, joint, weight = sk.skin_entries(mesh)
        share += np.bincount(joint, work.wanted[m].farthest[vertex] * weight, len(share))
    still = np.isclose(work.motions, np.eye(3, 4), atol=1e-12).all(axis=(0, 2, 3))
    if not still.any():
        raise ArgumentError("a joint that no control moves was expected, such as the head")
    return int(np.argmax(np.where(still, share + 1e-30, -1)))


def needs_joints(work: Work, wanted: Wanted) -> bool:
    """Whether blend shapes change the motion of a mesh by more than 0.02 mm; False for an eyeball,
    which existing joints alone move.

    Args:
        work: the face.
        wanted: the displacements of one of its meshes.
    """
    if not wanted.mesh.blend_shape_targets:
        return False
    return wanted.by_joints * MM.get(work.source.translation_unit, 10.0) > _RIGID_MM


def resting(work: Work) -> Ints:
    """The joints of the source that no expression moves, such as spine, neck and head.

    The fit cannot distinguish these joints. But a vertex must keep following the same
    joint, because an animator may rotate the neck.
    """
    moving = set(given(work)[1:].tolist())
    return np.array([j for j in range(len(work.source.joint_names)) if j not in moving])


def carriers(work: Work) -> Ints:
    """int64[joints]: for each joint, its own index if no expression moves it, otherwise the index
    of its nearest ancestor that no expression moves, or of the head if there is no such ancestor.

    Args:
        work: the face. New joints are included if their parents are chosen.
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
    """float64[V, n]: the fraction of a vertex' weights that each of the n joints of resting() has.

    The weight of any other joint counts for the joint of resting() that carriers() gives for it:
    its nearest ancestor that no expression moves. Rows have the sum 1, or 0 for a vertex without
    weights.

    Args:
        work: the face.
        mesh: a mesh of the source, or with weights on the source's joints.
    """
    count = len(work.source.joint_names)
    weights = sk.dense_weights(mesh, count)
    roots = carriers(work)[:count]
    return np.stack([weights[:, roots == j].sum(axis=1) for j in resting(work)], axis=1)


def carried_shift(work: Work) -> float:
    """The length of the shift in carried_shifts(), CARRIED_MM (20 mm), in the file's unit."""
    return CARRIED_MM / MM.get(work.source.translation_unit, 10.0)


def carried_shifts(work: Work, joints: Ints) -> Doubles:
    """float64[n, joints, 3]: shifts of all joints if one of n joints is shifted upwards by
    CARRIED_MM (20 mm), in the file's unit.

    The fits use these shifts as additional expressions, so that vertices keep following the same
    joint of neck and head.

    Args:
        work: the face; the parents of new joints must be known.
        joints: indices of n joints that no expression moves; resting() lists all such joints.
    """
    out = np.zeros((len(joints), len(work.source.joint_names) + len(work.parents), 3))
    out[..., 1] = carried_shift(work) * (carriers(work) == np.asarray(joints)[:, None])
    return out


def joined_positions(work: Work, meshes: Sequence[int]) -> Doubles:
    """float64[V, 3]: the concatenated vertices of some meshes of the source.

    Args:
        work: the face.
        meshes: indices of the meshes.
    """
    return np.concatenate([np.asarray(work.source.meshes[m].positions, np.float64) for m in meshes])


def new_weights(work: Work, meshes: Sequence[int], weights: dict[int, Doubles]) -> Doubles:
    """float64[V, new joints]: the weights of the new joints on the vertices of some meshes.

    Args:
        work: the face.
        meshes: indices of the meshes.
        weights: index of a mesh -> float64[V, joints], skin weights of the mesh.
    """
    return np.concatenate([weights[m][:, len(work.source.joint_names) :] for m in meshes])


def given(work: Work) -> Ints:
    """Indices of the head and of the source's joints that controls move."""
    still = np.isclose(work.motions, np.eye(3, 4), atol=1e-12).all(axis=(0, 2, 3))
    return np.array([work.head, *np.flatnonzero(~still)])


def dense(fit: JointFit, place: Ints, joints: int) -> Doubles:
    """float64[V, joints]: the weights of a fit as a dense matrix.

    Args:
        fit: the fit.
        place: index in the rig of each joint of the fit.
        joints: number of the rig's joints.
    """
    out = np.zeros((len(fit.weights), joints))
    rows = np.arange(len(out))[:, None]
    np.add.at(out, (rows, place[np.asarray(fit.weight_joints, np.int64)]), fit.weights)
    return out


def listed_meshes(dna: Dna, lod: int) -> list[int]:
    """Indices of the meshes of a LOD; all meshes if the file does not list the LOD.

    Args:
        dna: the face.
        lod: index of the LOD.
    """
    mapping = dna.lod_mesh_mapping
    return [int(m) for m in mapping[lod]] if lod < len(mapping) else list(range(len(dna.meshes)))
