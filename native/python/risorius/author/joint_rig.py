# SPDX-License-Identifier: MIT
"""A face that moves by blend shapes made into one that moves by joints.

Dna --columns, displacements--> fit --weights, joint groups--> Dna --what remains--> blend shapes
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from .. import BlendShapeTarget, Dna, JointGroup, Mesh
from ..base.errors import ArgumentError
from ..rigs.edit import regroup
from ..rigs.rotation import Convention
from . import skeleton as sk
from .fitting import FitOptions, JointFit, fit_joints, fit_weights
from .naming import joint_names
from .skeleton import Doubles, Ints

MM = {"cm": 10.0, "m": 1000.0}
_LEAST_WEIGHT = 1e-3
_LEAST_SHARE = 0.1  # vertices that hang on the neck beyond it are left to blend shapes
_RIGID_MM = 0.02  # a mesh that its joints bring so near needs no others


@dataclass(frozen=True)
class RigOptions:
    """What the joint rig is to be."""

    fit: FitOptions = field(default_factory=FitOptions)
    # A blend shape keeps what joints leave of a vertex beyond this, in mm; None: no blend shapes.
    tolerance_mm: float | None = 0.05
    # A joint does not follow an expression in which it moves no vertex further than this.
    least_effect_mm: float = 0.02


@dataclass
class MeshErrors:
    """What is left of each expression's motion on one mesh, by joints alone and with shapes."""

    name: str
    expressions: list[str]
    motion: Doubles  # [E] root mean square of the motion, mm
    joints_rms: Doubles  # [E] mm
    joints_largest: Doubles  # [E] mm
    largest: Doubles  # [E] mm, with blend shapes
    worst_vertex: Ints  # [E] by joints alone
    half_largest: Doubles  # [E] mm, by joints alone with the control at 0.5


@dataclass
class JointRig:
    """A face made of joints, and how near it comes to the one it was made from."""

    dna: Dna
    new_joints: list[str]
    errors: list[MeshErrors]
    height_mm: float  # of the largest mesh
    deltas_before: int  # vertices times targets
    deltas_after: int


@dataclass
class _Work:
    """The face that is made, and what of it is computed once."""

    source: Dna
    dna: Dna
    columns: list[int]  # inputs that move a vertex
    names: list[str]  # of these
    motions: Doubles  # [C, J, 3, 4] of the joints that were there
    positions: Doubles  # [J, 3]
    head: int  # what new joints hang on


def make_joint_rig(
    dna: Dna,
    options: RigOptions | None = None,
    progress: Callable[[float], bool | None] | None = None,
) -> JointRig:
    """The same face with new joints that do what its blend shapes did.

    Joints that are there keep their motions, controls and correctives keep their names and
    meaning; skin weights, joint groups and blend shape targets are made anew.

    Args:
        dna: a face with blend shapes; it stays as it is.
        options: how many joints, and what blend shapes keep.
        progress: told the share that is done, 0 to 1; False stops.

    Raises:
        DnaError: a value that is not finite, nothing that moves, or progress said False.
        ValueError: no mesh, a joint that changes its size, no joint that rests.
    """
    o = options or RigOptions()
    work = _begin(dna)
    mapping = dna.lod_mesh_mapping
    first = [int(m) for m in mapping[0]] if len(mapping) else list(range(len(dna.meshes)))
    wanted = {m: _displacements(work, dna.meshes[m]) for m in range(len(dna.meshes))}
    shaped = [m for m in first if _needs_joints(work, dna.meshes[m], wanted[m])]
    if not shaped:
        raise ArgumentError("no mesh of LOD 0 has a blend shape that an expression moves")
    fit, weights = _fit(work, shaped, wanted, o.fit, progress)
    names, regions = _add_joints(work, fit)
    _add_behavior(work, fit, _effects(work, shaped, fit, weights), regions, o)
    motions = sk.column_motions(work.dna, sk.column_count(dna))[work.columns]
    rest = sk.world_matrices(work.dna, np.zeros((len(work.dna.joint_names), 9)))[:, :3, 3]
    meshes, errors = [], []
    for m, mesh in enumerate(dna.meshes):
        if not _needs_joints(work, mesh, wanted[m]):
            meshes.append(mesh)
            continue
        rows = weights.get(m)
        if rows is None:
            rows = _other_weights(work, mesh, wanted[m], rest, motions, o.fit)
        rows = _with_resting(work, mesh, rows)
        made, left = _finish_mesh(work, m, rows, motions, wanted[m], o)
        meshes.append(made)
        if m in first:
            errors.append(left)
    work.dna.meshes = meshes
    work.dna.mesh_blend_shape_channel_mapping = np.array(
        [
            (m, t.blend_shape_channel_index)
            for m, x in enumerate(meshes)
            for t in x.blend_shape_targets
        ]
    ).reshape(-1, 2)
    unit = MM.get(dna.translation_unit, 10.0)
    tallest = max(
        (np.ptp(np.asarray(dna.meshes[m].positions, np.float64)[:, 1]) for m in first), default=0
    )
    return JointRig(work.dna, names, errors, float(tallest) * unit, _deltas(dna), _deltas(work.dna))


def _deltas(dna: Dna) -> int:
    return sum(len(t.vertex_indices) for mesh in dna.meshes for t in mesh.blend_shape_targets)


def _begin(dna: Dna) -> _Work:
    if not dna.meshes or not dna.joint_names:
        raise ArgumentError("a face with meshes and at least one joint was expected")
    count = sk.column_count(dna)
    deltas = sk.column_deltas(dna, count)
    if np.any(deltas[..., 6:9]):
        joint = int(np.argwhere(deltas[..., 6:9].any(axis=(0, 2)))[0, 0])
        raise ArgumentError(f"joint {dna.joint_names[joint]} changes its size: not supported")
    motions = sk.column_motions(dna, count)
    moving = np.flatnonzero(deltas.any(axis=(1, 2)))
    shaped = {c for mesh in dna.meshes for c in sk.column_shapes(dna, mesh, count)}
    columns = sorted(shaped | {int(c) for c in moving})
    names = [_column_name(dna, column) for column in columns]
    rest = sk.world_matrices(dna, np.zeros((len(dna.joint_names), 9)))
    work = _Work(dna, copy.copy(dna), columns, names, motions[columns], rest[:, :3, 3], 0)
    work.head = _head(work)
    return work


def _column_name(dna: Dna, column: int) -> str:
    raw = dna.raw_control_names
    if column < len(raw):
        return raw[column]
    rows = np.asarray(dna.psds.rows, np.int64)
    parts = np.asarray(dna.psds.columns, np.int64)[rows == column]
    return " x ".join(raw[int(p)] if p < len(raw) else str(p) for p in parts) or f"input {column}"


def _head(work: _Work) -> int:
    """The resting joint that most of what moves hangs on."""
    dna = work.source
    share = np.zeros(len(dna.joint_names))
    for mesh in dna.meshes:
        moved = np.linalg.norm(_displacements(work, mesh), axis=2).max(axis=0)
        share += moved @ sk.dense_weights(mesh, len(share))
    still = np.isclose(work.motions, np.eye(3, 4), atol=1e-12).all(axis=(0, 2, 3))
    if not still.any():
        raise ArgumentError("a joint that no control moves was expected, such as the head")
    return int(np.argmax(np.where(still, share + 1e-30, -1)))


def _displacements(work: _Work, mesh: Mesh) -> Doubles:
    """float64[C, V, 3]: where each input at 1 brings the vertices, less where they rest."""
    positions = np.asarray(mesh.positions, np.float64)
    weights = sk.dense_weights(mesh, len(work.source.joint_names))
    shapes = sk.column_shapes(work.source, mesh, sk.column_count(work.source))
    out = np.zeros((len(work.columns), len(positions), 3))
    still = np.eye(3, 4)
    for row, column in enumerate(work.columns):
        delta = shapes.get(column)
        if not np.allclose(work.motions[row], still, atol=1e-12):
            shaped = positions if delta is None else positions + delta
            out[row] = sk.skinned(shaped, weights, work.motions[row]) - positions
        elif delta is not None:
            out[row] = delta
    return out


def _needs_joints(work: _Work, mesh: Mesh, wanted: Doubles) -> bool:
    """Whether blend shapes move the mesh, and not the joints that are there alone (an eyeball)."""
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


def _resting(work: _Work, mesh: Mesh) -> Doubles:
    """float64[V]: the share of a vertex that hangs on joints which no expression moves, such as
    those of the neck, the head not counted."""
    before = sk.dense_weights(mesh, len(work.source.joint_names))
    before[:, _given(work)] = 0
    return np.asarray(before.sum(axis=1))


def _for_the_rest(work: _Work, mesh: Mesh, wanted: Doubles) -> Doubles:
    """What the joints have to do, so that with the resting share it becomes what is wanted."""
    return wanted / np.maximum(1 - _resting(work, mesh), _LEAST_SHARE)[:, None]


def _fit(
    work: _Work,
    meshes: Sequence[int],
    wanted: dict[int, Doubles],
    options: FitOptions,
    progress: Callable[[float], bool | None] | None,
) -> tuple[JointFit, dict[int, Doubles]]:
    """The fit of all meshes of the finest LOD together, and dense weights of each."""
    dna = work.source
    neutral = np.concatenate([np.asarray(dna.meshes[m].positions, np.float64) for m in meshes])
    asked = [_for_the_rest(work, dna.meshes[m], wanted[m]) for m in meshes]
    moved = np.concatenate(asked, axis=1).astype(np.float32)
    edges, begin = [], [0]
    for m in meshes:
        edges.append(sk.mesh_edges(dna.meshes[m]) + np.uint32(begin[-1]))
        begin.append(begin[-1] + len(dna.meshes[m].positions))
    used = _given(work)
    fit = fit_joints(
        neutral,
        moved,
        np.concatenate(edges),
        given=work.positions[used],
        motions=work.motions[:, used],
        options=options,
        progress=progress,
    )
    new = np.arange(len(fit.joints) - len(used)) + len(dna.joint_names)
    place = np.concatenate([used, new])
    dense = _dense(fit, place, len(dna.joint_names) + len(new))
    parts = {m: dense[a:b] for m, a, b in zip(meshes, begin[:-1], begin[1:], strict=True)}
    return fit, parts


def _given(work: _Work) -> Ints:
    """The head, and the joints that controls move."""
    still = np.isclose(work.motions, np.eye(3, 4), atol=1e-12).all(axis=(0, 2, 3))
    return np.array([work.head, *np.flatnonzero(~still)])


def _dense(fit: JointFit, place: Ints, joints: int) -> Doubles:
    out = np.zeros((len(fit.weights), joints))
    rows = np.arange(len(out))[:, None]
    np.add.at(out, (rows, place[np.asarray(fit.weight_joints, np.int64)]), fit.weights)
    return out


def _add_joints(work: _Work, fit: JointFit) -> tuple[list[str], dict[str, list[str]]]:
    """The new joints at the end of the Dna's, children of the head; their names, and by region."""
    dna = work.dna
    first = len(_given(work))
    positions = np.asarray(fit.joints)[first:]
    turns, shifts = np.asarray(fit.rotations)[:, first:], np.asarray(fit.translations)[:, first:]
    reach = 0.1 * np.ptp(positions, axis=0).max()
    amounts = np.linalg.norm(shifts, axis=2) + reach * np.linalg.norm(turns, axis=2)
    left = -1 if dna.coordinate_system[0] == "left" else 1
    names = joint_names(positions, amounts, work.names, left=left, taken=set(dna.joint_names))
    rest = sk.world_matrices(dna, np.zeros((len(dna.joint_names), 9)))[work.head]
    local = (positions - rest[:3, 3]) @ np.linalg.inv(rest[:3, :3]).T
    dna.joint_names = [*dna.joint_names, *names]
    dna.joint_parents = [*(int(p) for p in dna.joint_parents), *[work.head] * len(names)]
    dna.neutral_joint_translations = np.concatenate([dna.neutral_joint_translations, local])
    dna.neutral_joint_rotations = np.concatenate(
        [dna.neutral_joint_rotations, np.zeros_like(local)]
    )
    everyone = range(len(dna.joint_names))
    new = everyone[-len(names) :]
    mapping = dna.lod_joint_mapping
    dna.lod_joint_mapping = [[*map(int, mapping[lod]), *new] for lod in range(len(mapping))]
    dna.joint_row_count = 9 * len(everyone)
    regions: dict[str, list[str]] = {}
    for name in names:
        regions.setdefault(name.split("_")[2].rstrip("0123456789"), []).append(name)
    return names, regions


def _effects(
    work: _Work, meshes: Sequence[int], fit: JointFit, weights: dict[int, Doubles]
) -> Doubles:
    """float64[C, new joints]: how far each expression moves a vertex by each joint, mm."""
    first, before = len(_given(work)), len(work.source.joint_names)
    positions = np.concatenate(
        [np.asarray(work.source.meshes[m].positions, np.float64) for m in meshes]
    )
    rows = np.concatenate([weights[m][:, before:] for m in meshes])
    turns = sk.matrices_of_vectors(np.asarray(fit.rotations)[:, first:]) - np.eye(3)
    shifts, centres = np.asarray(fit.translations)[:, first:], np.asarray(fit.joints)[first:]
    out = np.zeros(shifts.shape[:2])
    for joint in range(len(centres)):
        held = np.flatnonzero(rows[:, joint])
        arms = positions[held] - centres[joint]
        moved = np.einsum("eik,vk->evi", turns[:, joint], arms) + shifts[:, joint, None]
        lengths = np.linalg.norm(moved, axis=2) * rows[held, joint]
        out[:, joint] = lengths.max(axis=1, initial=0)
    return out * MM.get(work.source.translation_unit, 10.0)


def _add_behavior(
    work: _Work,
    fit: JointFit,
    effects: Doubles,
    regions: dict[str, list[str]],
    options: RigOptions,
) -> None:
    """A joint group of the new joints, which regroup makes into dense ones by region."""
    dna = work.dna
    first, lods = len(_given(work)), max(1, dna.lod_count)
    turns = sk.matrices_of_vectors(np.asarray(fit.rotations)[:, first:])
    frame = sk.world_matrices(dna, np.zeros((len(dna.joint_names), 9)))[work.head, :3, :3]
    frame = frame / np.linalg.norm(frame, axis=0)
    local = frame.T @ turns @ frame
    count = local.shape[1]
    values = np.zeros((count, 6, len(work.columns)))
    shifts = np.asarray(fit.translations)[:, first:] @ frame
    values[:, :3] = shifts.transpose(1, 2, 0)
    convention = Convention.of(dna)
    for column in range(len(work.columns)):
        values[:, 3:, column] = sk.euler_angles(convention, local[column])
    values *= (options.least_effect_mm <= effects.T)[:, None]
    rows = values.reshape(6 * count, -1)
    joints = np.arange(count) + len(work.source.joint_names)
    outputs = (9 * joints[:, None] + np.arange(6)).ravel()
    kept = np.flatnonzero(rows.any(axis=1))
    group = JointGroup(
        lods=[len(kept)] * lods,
        input_indices=work.columns,
        output_indices=outputs[kept],
        values=rows[kept].astype(np.float32),
        joint_indices=joints,
    )
    dna.joint_groups = [*dna.joint_groups, group]
    work.dna, _ = regroup(dna, regions=regions, combinations=0, timed=0)


def _other_weights(
    work: _Work, mesh: Mesh, wanted: Doubles, joints: Doubles, motions: Doubles, options: FitOptions
) -> Doubles:
    """Dense weights of a mesh of a coarser LOD, on all joints. Its neighbours lie further apart:
    evened out as much as the fine mesh' they would lose what they do."""
    positions = np.asarray(mesh.positions, np.float64)
    fit = fit_weights(
        positions,
        _for_the_rest(work, mesh, wanted).astype(np.float32),
        sk.mesh_edges(mesh),
        given=joints,
        motions=motions,
        options=replace(options, smoothness=0.1 * options.smoothness),
    )
    return _dense(fit, np.arange(len(joints)), len(joints))


def _with_resting(work: _Work, mesh: Mesh, rows: Doubles) -> Doubles:
    """Neck and spine, which no expression moves, keep the weights that they had."""
    before = sk.dense_weights(mesh, len(work.source.joint_names))
    given = set(_given(work).tolist())
    others = [j for j in range(before.shape[1]) if j not in given]
    out = rows.copy()
    out[:, work.head] += out[:, others].sum(axis=1)  # to a fit all that rests is alike
    out[:, others] = 0
    out *= (1 - before[:, others].sum(axis=1))[:, None] / np.maximum(
        out.sum(axis=1, keepdims=True), 1e-30
    )
    out[:, others] = before[:, others]
    return out


def _finish_mesh(
    work: _Work,
    number: int,
    rows: Doubles,
    motions: Doubles,
    wanted: Doubles,
    options: RigOptions,
) -> tuple[Mesh, MeshErrors]:
    """The mesh with its new weights and with what blend shapes have still to do."""
    mesh = work.source.meshes[number]
    out = copy.copy(mesh)
    _set_skin(out, rows)
    weights = sk.dense_weights(out, rows.shape[1])
    positions = np.asarray(mesh.positions, np.float64)
    mm = MM.get(work.dna.translation_unit, 10.0)
    channel = _channels(work.dna)
    halves = sk.column_motions(work.dna, sk.column_count(work.dna), 0.5)[work.columns]
    found, targets = _no_errors(work.source.mesh_names[number], work.names), []
    for row, column in enumerate(work.columns):
        goal = positions + wanted[row]
        error = np.linalg.norm(sk.skinned(positions, weights, motions[row]) - goal, axis=1) * mm
        half = sk.skinned(positions, weights, halves[row]) - positions - 0.5 * wanted[row]
        found.half_largest[row] = np.linalg.norm(half, axis=1).max() * mm
        found.motion[row] = np.sqrt((wanted[row] ** 2).sum(axis=1).mean()) * mm
        found.joints_rms[row] = np.sqrt((error**2).mean())
        found.joints_largest[row], found.worst_vertex[row] = error.max(), error.argmax()
        if options.tolerance_mm is not None and column in channel:
            moved = np.flatnonzero(error > options.tolerance_mm)
            if len(moved):
                shaped = sk.before_skin(goal[moved], weights[moved], motions[row])
                targets.append(
                    BlendShapeTarget(
                        deltas=shaped - positions[moved],
                        vertex_indices=moved,
                        blend_shape_channel_index=channel[column],
                    )
                )
            error[moved] = 0
        found.largest[row] = error.max()
    out.blend_shape_targets = targets
    return out, found


def _channels(dna: Dna) -> dict[int, int]:
    """The blend shape channel of each input that drives one."""
    channels = dna.blend_shape_channels
    pairs = zip(channels.input_indices, channels.output_indices, strict=True)
    return {int(source): int(channel) for source, channel in pairs}


def _no_errors(name: str, expressions: list[str]) -> MeshErrors:
    def none() -> Doubles:
        return np.zeros(len(expressions))

    worst = np.zeros(len(expressions), np.int64)
    return MeshErrors(name, expressions, none(), none(), none(), none(), worst, none())


def _set_skin(mesh: Mesh, rows: Doubles) -> None:
    kept = np.where(rows > _LEAST_WEIGHT, rows, 0)
    kept /= kept.sum(axis=1, keepdims=True)
    vertex, joint = np.nonzero(kept)
    counts = (kept > 0).sum(axis=1)
    mesh.skin_offsets = np.concatenate([[0], np.cumsum(counts)])
    mesh.skin_weights = kept[vertex, joint]
    mesh.skin_joint_indices = joint
    mesh.maximum_influence_per_vertex = int(counts.max())
