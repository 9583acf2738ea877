# SPDX-License-Identifier: MIT
"""Turns a face that moves by blend shapes into a face that moves by joints.

The native fit finds joints, weights and joint motions for the displacements by each control. Joint
groups store the motions. Blend shapes correct the errors that the joints leave.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .. import Dna, DnaError, JointGroup
from ..base.errors import ArgumentError
from ..rigs.edit import regroup
from ..rigs.rotation import Convention
from .combinations import Combination, Combinations
from .fitting import FitOptions, Progress, fit_joints
from .geometry import skeleton as sk
from .geometry.blocks import LARGE
from .geometry.fewer import fewer_vertices
from .geometry.simplify import Floats
from .geometry.skeleton import Doubles
from .geometry.wanted import Wanted, joined_displacements
from .level_meshes import LevelMeshes, level_meshes
from .levels import LodOptions, extend_levels, joint_budgets, joint_order, level_joints
from .lighter import Lightened, deltas_of, within_deltas
from .meshes import Made, channels_of
from .naming import joint_names
from .parents import choose_parents, joint_motions, room_for_second, second_joints
from .pivots import Pivot, find_pivots
from .reference import Reference, reference_of, refit
from .work import (
    MM,
    Joints,
    Level,
    MeshErrors,
    RigOptions,
    Work,
    begin,
    carried_shifts,
    dense,
    given,
    joined_positions,
    listed_meshes,
    needs_joints,
    new_weights,
    resting,
)

# Finished fraction of the work after the preparation, after the fit of the joints, and after making
# the meshes.
_BEGUN, _FIT, _MESHES = 0.1, 0.7, 0.8
_SOLVED = 0.6  # finished fraction of the work on correctives once joint values are solved
_EMPTY = 2.0  # groups by region may have this factor more coefficients than groups by drivers


@dataclass
class JointRig:
    """A face of joints, and its errors relative to the face of shapes."""

    dna: Dna
    new_joints: list[str]
    errors: list[MeshErrors]  # errors of the meshes of all levels
    levels: list[Level]
    height_mm: float  # height of the tallest mesh
    deltas_before: int  # number of blend shape deltas of the input at LOD 0
    deltas_after: int  # number of blend shape deltas of the rig at LOD 0
    tolerance_mm: float | None  # blend shapes correct larger errors of joints; None: no shapes
    raised: bool  # whether the tolerance was raised to keep at most the input's number of deltas
    columns: list[int]  # index of each expression's input
    combinations: list[Combination]  # errors of the correctives
    reference: Reference  # joints, weights and levels for other faces
    ended: str = ""  # reason why there are fewer levels than requested, or ""


def make_joint_rig(
    dna: Dna,
    options: RigOptions | None = None,
    progress: Progress | None = None,
    like: Reference | None = None,
) -> JointRig:
    """Replace the blend shapes of a face by new joints with the same motion.

    Existing joints keep their motions. Controls and correctives keep their names and meaning. Skin
    weights, joint groups and blend shape targets are replaced.

    Args:
        dna: a face with blend shapes; it is not changed.
        options: options of the rig, such as the number of joints.
        progress: gets the finished fraction, 0 to 1; returns False to stop.
        like: reference of a joint rig of the same topology. The face gets the joints, weights and
            LODs of the reference, and only the motions are fitted, which takes less time.

    Raises:
        DnaError: a value is not finite, nothing moves, or progress returned False.
        ValueError: the face has no mesh, a joint changes its size, every joint moves, no expression
            moves a blend shape of LOD 0, the LOD options are invalid, or the face has another
            topology than `like`.
        BudgetError: the tables would be too large for the size of the face.
    """
    work, fit, made, regions = _made(dna, options or RigOptions(), progress, like)
    made.finish()
    names = list(work.dna.joint_names)[len(dna.joint_names) :]
    combinations = _combine(work, made, regions, _part(progress, _MESHES, 1.0))
    made.meshes = list(work.dna.meshes)
    rig = JointRig(
        work.dna,
        names,
        made.errors,
        made.levels(),
        height_mm(dna),
        deltas_of(dna),
        deltas_of(work.dna),
        made.options.tolerance_mm if made.options.shapes else None,
        False,
        work.columns,
        combinations,
        reference_of(work, fit, made),
        made.coarse.ended,
    )
    if made.options.lighter:
        lighten(rig, dna)
    return rig


def lighten(rig: JointRig, source: Dna) -> None:
    """Remove the shortest blend shape deltas of a rig that has more deltas than its source.

    The errors in `rig` are updated.

    Args:
        rig: the joint rig; it is changed.
        source: the face of shapes from which it was made.
    """
    found = within_deltas(rig.dna, source)
    rig.dna, rig.deltas_before, rig.deltas_after = found.dna, found.before, found.after
    if rig.tolerance_mm is not None and found.shortest_mm > rig.tolerance_mm:
        rig.tolerance_mm, rig.raised = found.shortest_mm, True
    _take_errors(rig, found)


def _take_errors(rig: JointRig, found: Lightened) -> None:
    """Raise stored largest errors of a rig to the lengths of its removed deltas if these are
    longer, and store the new number of deltas of each LOD."""
    dna, channels = rig.dna, channels_of(rig.dna)
    for errors in rig.errors:
        for row, column in enumerate(rig.columns):
            off = found.dropped.get((errors.name, channels.get(column, -1)), 0.0)
            errors.largest[row] = max(errors.largest[row], off)
    finest = [dna.mesh_names[m] for m in listed_meshes(dna, 0)]
    for combination in rig.combinations:
        channel = channels.get(combination.column, -1)
        off = max((found.dropped.get((name, channel), 0.0) for name in finest), default=0.0)
        combination.largest = max(combination.largest, off)
    for lod, level in enumerate(rig.levels):
        names = {dna.mesh_names[m] for m in listed_meshes(dna, lod)}
        level.deltas = deltas_of(dna, lod)
        largest = [float(e.largest.max()) for e in rig.errors if e.name in names]
        level.largest_with_shapes = max(largest, default=0.0)


def height_mm(dna: Dna) -> float:
    """The height of the head in mm, to which relative tolerances and errors refer."""
    return _height(dna) * MM.get(dna.translation_unit, 10.0)


def _height(dna: Dna) -> float:
    """The height of the tallest mesh of LOD 0 in the file's unit; the largest extent if all are
    flat."""
    sizes = [
        np.ptp(np.asarray(dna.meshes[m].positions, np.float64), axis=0)
        for m in listed_meshes(dna, 0)
    ]
    tallest = max((float(size[1]) for size in sizes), default=0.0)
    return tallest or max((float(size.max()) for size in sizes), default=0.0)


def find_reference(
    dna: Dna, options: RigOptions | None = None, progress: Progress | None = None
) -> Reference:
    """Make only the reference of a joint rig, which is faster than make_joint_rig().

    Args:
        dna: a face with blend shapes; it is not changed.
        options: options of the rig, such as the number of joints.
        progress: gets the finished fraction, 0 to 1; returns False to stop.

    Raises:
        DnaError: see make_joint_rig().
        ValueError: see make_joint_rig().
    """
    work, fit, made, _ = _made(dna, options or RigOptions(), progress, None, whole=False)
    return reference_of(work, fit, made)


def _made(
    dna: Dna,
    o: RigOptions,
    progress: Progress | None,
    like: Reference | None,
    *,
    whole: bool = True,
) -> tuple[Work, Joints, Made, dict[str, list[str]]]:
    """Make the joints, their behaviour and the meshes of all LODs.

    Args:
        dna: the face of shapes.
        o: options of the rig.
        progress: gets the finished fraction.
        like: reference whose joints and weights are reused, or None.
        whole: whether meshes get blend shapes and errors are measured.

    Returns: the face with quantities computed from it, the joints, the meshes, names of joints by
        region.
    """
    o.lods.check()
    go_on = _counting(progress, sum(1 + len(m.positions) // LARGE for m in dna.meshes))
    work = begin(dna, go_on)
    wanted, work.wanted = work.wanted, {}  # large arrays, so they are released early
    needs = {m for m in wanted if needs_joints(work, wanted[m])}
    needs = {m for m in needs if not any(word in dna.mesh_names[m] for word in o.kept)}
    if like is not None:  # meshes without joints in the reference keep their shapes
        needs = {m for m in needs if dna.mesh_names[m] in like.weights}
    if not needs & set(listed_meshes(dna, 0)):
        raise ArgumentError("no mesh of LOD 0 has a blend shape that an expression moves")
    shaped = [m for m in listed_meshes(dna, 0) if m in needs]
    unit = MM.get(dna.translation_unit, 10.0)
    coarse = LevelMeshes(_level_count(dna, o.lods))
    attributes: dict[int, Floats] = {}
    if like is None:
        coarse = level_meshes(work, wanted, o.lods, coarse.count, attributes, go_on)
    work.levels = coarse.count
    o = replace(o, fit=replace(o.fit, least_effect=o.least_effect_mm / unit))
    if o.tolerance_mm is None:
        o = replace(o, tolerance_mm=o.tolerance * height_mm(dna))
    on, fewer = work, None
    if like is None:
        fewer = fewer_vertices(
            work, shaped, wanted, o.fit_vertices, attributes, coarse.triangles, go_on
        )
        on = fewer.work if fewer is not None else work
        fitted = fewer.wanted if fewer is not None else wanted
        # The fit takes most of the time, so it gets most of the progress.
        fit, weights = _new_joints(on, shaped, fitted, o, _part(progress, _BEGUN, _FIT))
        _take_chosen(work, on)
    else:
        like.check(work)
        work.levels = len(like.levels)
        work.pivots = _pivots(work, shaped, wanted, _jaw(work))
        fit, weights = refit(work, like, shaped, wanted, o)
    beside = _beside_parents(work, fit)
    held = new_weights(on, shaped, weights)
    effects = _effects(on, shaped, beside, held)
    names = like.names if like else _names(work, fit, effects, _places(on, shaped, fit, held))
    regions = _add_joints(work, fit, names)
    _add_behavior(work, beside, effects, regions, o)
    made = Made(work, o, weights, coarse, like, whole=whole, fewer=fewer)
    for lod in range(work.levels):
        made.go_on = _asking(progress, _FIT + (_MESHES - _FIT) * lod / work.levels)
        made.add_level(lod, wanted, needs)
    return work, fit, made, regions


def _take_chosen(work: Work, other: Work) -> None:
    """Copy quantities that were chosen in `other`, the face with simplified meshes, to `work`: the
    parents, pivots and mirrored joints, the joints of each LOD, and heirs (for each joint that a
    LOD lacks, the joint that takes its vertices)."""
    work.parents, work.new, work.pivots = other.parents, other.new, other.pivots
    work.mirrored, work.heirs = other.mirrored, other.heirs


def _counting(progress: Progress | None, least: int) -> Callable[[], None]:
    """A function that passes a finished fraction to `progress`, and raises DnaError if `progress`
    returns False. The fraction grows with each call and approaches _BEGUN (0.1).

    Args:
        progress: gets the finished fraction.
        least: number of calls after which the fraction is half of _BEGUN.
    """
    calls = itertools.count(1)

    def ask() -> None:
        done = next(calls)
        _asking(progress, _BEGUN * done / (done + least))()

    return ask


def _asking(progress: Progress | None, share: float) -> Callable[[], None]:
    """A function that passes the finished fraction `share` to `progress`, and raises DnaError if
    `progress` returns False."""

    def ask() -> None:
        if progress is not None and progress(share) is False:
            raise DnaError("stopped")

    return ask


def _new_joints(
    work: Work,
    shaped: list[int],
    wanted: dict[int, Wanted],
    options: RigOptions,
    progress: Progress | None,
) -> tuple[Joints, dict[int, Doubles]]:
    """Fit joints and dense weights of the meshes of LOD 0. Sets five attributes of `work`: pivots,
    parents, new (the new joints of each LOD), mirrored (the joint of the other side), and heirs
    (for each joint that a LOD lacks, the joint that takes its vertices)."""
    room = room_for_second(work, shaped, wanted, options.fit.joints)
    own = replace(options.fit, joints=options.fit.joints - room)
    jaw = _jaw(work)
    fit, weights = _fit(work, shaped, wanted, jaw, own, progress)
    work.parents = choose_parents(work, shaped, fit, weights, jaw)
    fit, weights, work.parents = second_joints(work, shaped, fit, weights, room)
    _order_levels(work, shaped, fit, weights, options)
    return fit, weights


def _combine(
    work: Work, made: Made, regions: dict[str, list[str]], progress: Progress | None
) -> list[Combination]:
    """Add joint values and blend shapes for the correctives. Returns the correctives' errors.

    Args:
        work: the face.
        made: the meshes of all LODs.
        regions: region -> names of its joints.
        progress: gets the finished fraction of this step.
    """
    if not work.combined:
        return []
    found = Combinations(work, made.options, made.fewer)
    found.solve(lambda share: _asking(progress, _SOLVED * share)())
    # Expressions and correctives share one joint group, because all values of a joint must be in
    # one group.
    before = len(work.source.joint_names)
    columns = sk.column_deltas(work.dna, sk.column_count(work.source))[work.columns, before:, :6]
    values = np.concatenate([columns.transpose(1, 2, 0), found.values()], axis=2)
    group = _joint_group(work, values, [*work.columns, *found.order])
    work.dna.joint_groups = [*work.groups, group]
    work.dna = grouped(work.dna, regions)
    lods = max(1, work.source.lod_count)
    return found.finish(lods, lambda _share: _asking(progress, _SOLVED)())


def grouped(dna: Dna, regions: dict[str, list[str]]) -> Dna:
    """The face with joint groups by region. If joint groups by the controls that drive the joints
    have less than half as many coefficients, the face gets these groups.

    Groups by controls have fewer coefficients if many correctives each move a few joints of a
    region.

    Args:
        dna: a face; it is not changed.
        regions: region -> names of its joints.
    """
    out, by_region = regroup(dna, regions=regions, combinations=0, timed=0)
    other, by_drivers = regroup(dna, combinations=0, timed=0)
    far_smaller = _EMPTY * by_drivers.after.coefficients < by_region.after.coefficients
    return other if far_smaller else out


def _level_count(dna: Dna, options: LodOptions) -> int:
    """The number of LODs. A face with networks or solvers keeps its own number of LODs."""
    own = max(1, dna.lod_count)
    fixed = len(dna.machine_learned_behavior.neural_networks) or len(dna.rbf_behavior.solvers)
    return own if fixed else max(own, options.count)


def _jaw(work: Work) -> int | None:
    """The index of the source's joint that jawOpen moves most; None if the face has no jawOpen or
    jawOpen moves no joint."""
    opening = [e for e, name in enumerate(work.names) if name.endswith("jawOpen")]
    if not opening:
        return None
    turned = np.linalg.norm(work.motions[opening[0]] - np.eye(3, 4), axis=(1, 2))
    return int(turned.argmax()) if turned.max() > 1e-9 else None


def _part(progress: Progress | None, begin: float, end: float) -> Progress | None:
    return None if progress is None else lambda share: progress(begin + share * (end - begin))


def _order_levels(
    work: Work, shaped: Sequence[int], fit: Joints, weights: dict[int, Doubles], o: RigOptions
) -> None:
    """Choose the new joints of each LOD. Sets three attributes of `work`: new (the new joints of
    each LOD), mirrored (the joint of the other side), and heirs (for each joint that a LOD lacks,
    the joint that takes its vertices).

    Args:
        work: the face.
        shaped: indices of the fitted meshes.
        fit: the joints.
        weights: index of a mesh -> float64[V, joints], skin weights of the mesh.
        o: options of the rig, with the number of joints of each LOD.
    """
    used = given(work)
    count = len(fit.joints) - len(used)
    budgets = joint_budgets(o.lods, work.levels, count)
    own = np.arange(count) + len(work.source.joint_names)
    mirrored = fit.mirrored
    place = np.concatenate([used, own])
    # Shifts of joints that no expression moves, such as the neck, count as further expressions, so
    # that each vertex keeps following the joint that it follows in the source.
    carried = carried_shifts(work, resting(work))[:, place]
    order, heirs = joint_order(
        joined_positions(work, shaped),
        np.concatenate([weights[m][:, place] for m in shaped]),
        sk.matrices_of_vectors(np.concatenate([fit.rotations, np.zeros_like(carried)])),
        np.concatenate([fit.translations, carried]),
        fit.joints,
        mirrored,
        len(used),
    )
    work.new = [level_joints(order, mirrored, budget) - len(used) for budget in budgets]
    work.mirrored = _mirrored_given(work)
    work.mirrored |= dict(zip(place.tolist(), place[mirrored].tolist(), strict=True))
    work.heirs = {int(place[joint]): int(place[heir]) for joint, heir in heirs.items()}


def _mirrored_given(work: Work) -> dict[int, int]:
    """Joint of the source -> the joint at its mirrored place (x negated); a joint in the middle or
    without such a joint names itself."""
    near = 1e-3 * np.ptp(work.positions, axis=0).max()
    out = {}
    for joint, place in enumerate(work.positions):
        apart = np.linalg.norm(work.positions - place * [-1, 1, 1], axis=1)
        other = int(apart.argmin())
        out[joint] = other if abs(place[0]) > near and apart[other] < near else joint
    return out


def _fit(
    work: Work,
    meshes: Sequence[int],
    wanted: dict[int, Wanted],
    jaw: int | None,
    options: FitOptions,
    progress: Progress | None,
) -> tuple[Joints, dict[int, Doubles]]:
    """Fit all meshes of the finest LOD together. Returns the joints and dense weights by mesh.

    Args:
        work: the face.
        meshes: indices of the meshes.
        wanted: index of a mesh -> displacements of the mesh in each expression.
        jaw: index of the joint that opens the mouth, or None.
        options: options of the fit.
        progress: gets the finished fraction of the fit.
    """
    dna = work.source
    neutral = joined_positions(work, meshes)
    moved = joined_displacements(wanted, meshes).astype(np.float32)
    edges, begin = [], [0]
    for m in meshes:
        edges.append(sk.mesh_edges(dna.meshes[m]) + np.uint32(begin[-1]))
        begin.append(begin[-1] + len(dna.meshes[m].positions))
    used = given(work)
    work.pivots = _pivots(work, meshes, wanted, jaw)
    fit = fit_joints(
        neutral,
        moved,
        np.concatenate(edges),
        given=work.positions[used],
        motions=work.motions[:, used],
        pivots=work.pivots,
        options=options,
        progress=progress,
    )
    new = np.arange(len(fit.joints) - len(used)) + len(dna.joint_names)
    place = np.concatenate([used, new])
    rows = dense(fit, place, len(dna.joint_names) + len(new))
    parts = {m: rows[a:b] for m, a, b in zip(meshes, begin[:-1], begin[1:], strict=True)}
    found = Joints(
        np.asarray(fit.joints),
        np.asarray(fit.rotations),
        np.asarray(fit.translations),
        np.asarray(fit.mirrored, np.int64),
    )
    return found, parts


def _pivots(
    work: Work, meshes: Sequence[int], wanted: dict[int, Wanted], jaw: int | None
) -> list[Pivot]:
    moved = joined_displacements(wanted, meshes).astype(np.float32)
    return find_pivots(
        work.names,
        joined_positions(work, meshes),
        moved.astype(np.float64),
        work.source.joint_names,
        work.positions,
        jaw=jaw is not None,
    )


def _names(work: Work, fit: Joints, effects: Doubles, places: Doubles) -> list[str]:
    """Names of the new joints, from their places and the expressions that move them.

    Args:
        work: the face.
        fit: the joints.
        effects: float64[C, new joints], largest displacement by each joint in each expression, mm.
        places: float64[new joints, 3], middle of the vertices of each joint.
    """
    dna = work.dna
    first = len(given(work))
    left = -1 if dna.coordinate_system[0] == "left" else 1
    pairs = fit.mirrored[first:] - first
    taken = set(dna.joint_names)
    return joint_names(places, effects, pairs, work.names, left=left, taken=taken)


def _add_joints(work: Work, fit: Joints, names: list[str]) -> dict[str, list[str]]:
    """Append the new joints to the joints of the Dna. Returns region -> names of its new joints."""
    dna = work.dna
    positions = fit.joints[len(given(work)) :]
    rest = sk.world_matrices(dna, np.zeros((len(dna.joint_names), 9)))[work.parents]
    local = np.linalg.solve(rest[:, :3, :3], (positions - rest[:, :3, 3])[..., None])[..., 0]
    dna.joint_names = [*dna.joint_names, *names]
    dna.joint_parents = [*(int(p) for p in dna.joint_parents), *work.parents]
    dna.neutral_joint_translations = np.concatenate([dna.neutral_joint_translations, local])
    dna.neutral_joint_rotations = np.concatenate(
        [dna.neutral_joint_rotations, np.zeros_like(local)]
    )
    extend_levels(dna, work.levels)
    mapping, before = dna.lod_joint_mapping, len(work.source.joint_names)
    dna.lod_joint_mapping = [
        [*map(int, mapping[lod]), *(before + work.new[lod]).tolist()] for lod in range(work.levels)
    ]
    dna.joint_row_count = 9 * len(dna.joint_names)
    regions: dict[str, list[str]] = {}
    for name in names:
        regions.setdefault(name.split("_")[2].rstrip("0123456789"), []).append(name)
    return regions


def _beside_parents(work: Work, fit: Joints) -> Doubles:
    """float64[C, new joints, 3, 4]: motion of each new joint relative to its parent's motion, in
    each of C expressions."""
    own = joint_motions(fit)[:, len(given(work)) :]
    parents = work.motions[:, work.parents]
    turns = np.swapaxes(parents[..., :3], -1, -2)
    shifts = own[..., 3] - parents[..., 3]
    return np.concatenate([turns @ own[..., :3], (turns @ shifts[..., None])], axis=-1)


def _places(work: Work, meshes: Sequence[int], fit: Joints, held: Doubles) -> Doubles:
    """float64[new joints, 3]: mean of the positions of each joint's vertices, weighted by squared
    skin weights, or the position of a joint without vertices.

    Args:
        work: the face.
        meshes: indices of the fitted meshes.
        fit: the joints.
        held: float64[V, new joints], weights of the new joints on the vertices of these meshes.
    """
    rows = held**2
    total = rows.sum(axis=0)[:, None]
    middles = (rows.T @ joined_positions(work, meshes)) / np.maximum(total, 1e-30)
    return np.where(total > 1e-12, middles, fit.joints[len(given(work)) :])


def _effects(work: Work, meshes: Sequence[int], motions: Doubles, held: Doubles) -> Doubles:
    """float64[C, new joints]: largest displacement of a vertex by each joint alone, in mm, in each
    of C expressions.

    Args:
        work: the face.
        meshes: indices of the fitted meshes.
        motions: float64[C, new joints, 3, 4], motions relative to the parents.
        held: float64[V, new joints], weights of the new joints on the vertices of these meshes.
    """
    positions = joined_positions(work, meshes)
    moves = motions - np.eye(3, 4)
    out = np.zeros(motions.shape[:2])
    for joint in range(motions.shape[1]):
        rows = np.flatnonzero(held[:, joint])
        own = moves[:, joint].reshape(-1, 4)
        moved = own[:, :3] @ positions[rows].T + own[:, 3:]
        squares = (moved.reshape(len(moves), 3, -1) ** 2).sum(axis=1) * held[rows, joint] ** 2
        out[:, joint] = np.sqrt(squares.max(axis=1, initial=0))
    return out * MM.get(work.source.translation_unit, 10.0)


def _add_behavior(
    work: Work,
    motions: Doubles,
    effects: Doubles,
    regions: dict[str, list[str]],
    options: RigOptions,
) -> None:
    """Add a joint group of the new joints, and divide it into dense groups by region.

    Args:
        work: the face.
        motions: float64[C, new joints, 3, 4], motions relative to the parents.
        effects: float64[C, new joints], largest displacement of a vertex in mm; a joint does not
            move in an expression in which this is below options.least_effect_mm.
        regions: region -> names of its joints.
        options: options of the rig.
    """
    dna = work.dna
    before = len(work.source.joint_names)
    # Express the motions, which are relative to the parents, in the parents' neutral frames.
    frames = sk.world_matrices(dna, np.zeros((len(dna.joint_names), 9)))[work.parents]
    whole = np.zeros((*motions.shape[:2], 4, 4))
    whole[..., :3, :], whole[..., 3, 3] = motions, 1
    carried = np.linalg.inv(frames) @ whole @ frames
    neutral = np.asarray(dna.neutral_joint_translations, np.float64)[before:]
    local = carried[..., :3, :3]
    shifts = np.einsum("ejik,jk->eji", local, neutral) + carried[..., :3, 3] - neutral
    count = local.shape[1]
    values = np.zeros((count, 6, len(work.columns)))
    values[:, :3] = shifts.transpose(1, 2, 0)
    convention = Convention.of(dna)
    for column in range(len(work.columns)):
        values[:, 3:, column] = sk.euler_angles(convention, local[column])
    values *= (options.least_effect_mm <= effects.T)[:, None]
    work.groups = list(dna.joint_groups)
    dna.joint_groups = [*work.groups, _joint_group(work, values, work.columns)]
    work.dna, _ = regroup(dna, regions=regions, combinations=0, timed=0)


def _joint_group(work: Work, values: Doubles, columns: Sequence[int]) -> JointGroup:
    """A joint group of the new joints.

    Args:
        work: the face.
        values: float64[new joints, 6, columns], translations and Euler angles by each input.
        columns: indices of the inputs.
    """
    count = len(values)
    # Joints of the coarsest LOD come first, because a LOD uses the first rows of a joint group.
    last = np.array([sum(joint in level for level in work.new) for joint in range(count)])
    order = np.argsort(-last, kind="stable")
    rows = values[order].reshape(6 * count, -1)
    joints = order + len(work.source.joint_names)
    outputs = (9 * joints[:, None] + np.arange(6)).ravel()
    kept = np.flatnonzero(rows.any(axis=1))
    levels = np.repeat(last[order], 6)[kept]
    return JointGroup(
        lods=[int((levels > lod).sum()) for lod in range(work.levels)],
        input_indices=list(columns),
        output_indices=outputs[kept],
        values=rows[kept].astype(np.float32),
        joint_indices=np.arange(count) + len(work.source.joint_names),
    )
