# SPDX-License-Identifier: MIT
"""Solves the joint values of correctives, because joint rotations do not add up like blend shapes.

With all controls of a corrective at 1, the face of joints must have the same shape as the face of
shapes. The values that the joints add in this pose are solved by Gauss-Newton steps. Blend shapes
store the remaining displacements.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np

from .. import BlendShapeTarget, Dna, Mesh
from ..rigs.rotation import Convention
from .geometry import skeleton as sk
from .geometry.blocks import blocks_of, joined_targets, split_mesh
from .geometry.fewer import Fewer
from .geometry.skeleton import Doubles, Ints
from .work import MM, RigOptions, Work, listed_meshes

_STEPS = 3  # number of Gauss-Newton steps
_OFF_MM = 0.05  # vertices with a larger error are corrected; some other vertices must not move
_MOST_OFF, _MOST_HELD = 1500, 500  # largest numbers of both kinds of vertices in a mesh
# Largest number of joints in a Gauss-Newton step. A joint is left out if the weighted squared error
# of its vertices is below _LEAST_SHARE of the largest such error of a joint.
_MOST_JOINTS, _LEAST_SHARE = 128, 2e-4
_LEAST_WEIGHT = 0.01
_DAMPING = 0.01
_AXES = np.eye(3)
_THREADS = 2  # more threads would wait for the interpreter lock
T = TypeVar("T")


@dataclass
class Combination:
    """Errors of the face of joints on the meshes of LOD 0, in mm, with all controls of a corrective
    at 1."""

    name: str
    before: float  # largest error without the corrective
    joints_largest: float  # largest error with the corrective's joint values, without its shapes
    largest: float  # largest error with the corrective's joint values and blend shapes
    column: int = -1  # index of its input


class _Side:
    """The face of shapes or the face of joints, posed with some inputs at 1."""

    def __init__(self, dna: Dna, columns: int) -> None:
        self.dna, self.columns = dna, columns
        self.deltas = sk.column_deltas(dna, columns)
        self.rest = np.linalg.inv(sk.world_matrices(dna, np.zeros_like(self.deltas[0])))

    def worlds(self, active: Sequence[int], extra: Doubles | float = 0.0) -> Doubles:
        """float64[joints, 4, 4]: matrices from the joints' axes to the world, with inputs at 1.

        Args:
            active: inputs at 1.
            extra: values added to the joints' attributes, float64[joints, 9].
        """
        return sk.world_matrices(self.dna, self.deltas[list(active)].sum(axis=0) + extra)

    def motions(self, worlds: Doubles) -> Doubles:
        return (worlds @ self.rest)[:, :3]


class _Skin:
    """A mesh with its weights and shapes in the face of shapes and in the face of joints."""

    def __init__(self, before: Dna, after: Dna, mesh: Mesh, made: Mesh, columns: int) -> None:
        self.positions = np.asarray(mesh.positions, np.float64)
        self.weights = sk.dense_weights(mesh, len(before.joint_names))
        self._own = self.weights.any(axis=0)
        dense = sk.dense_weights(made, len(after.joint_names))
        self._made = sk.Influences(dense)
        self._count = dense.shape[1]
        self.shapes = sk.column_shapes(before, mesh, columns)
        self.made_shapes = sk.column_shapes(after, made, columns)

    def hangs_on(self, first: int) -> bool:
        """Whether a joint with this or a larger index has a weight on the mesh."""
        return bool(self._made.weights[self._made.joints >= first].any())

    def goal(self, side: _Side, active: Sequence[int]) -> Doubles:
        shaped = self.positions + sum((self.shapes[c] for c in active if c in self.shapes), 0.0)
        motions = side.motions(side.worlds(active))
        return sk.skinned(shaped, self.weights[:, self._own], motions[self._own])

    def shaped(self, active: Sequence[int]) -> Doubles:
        """float64[V, 3]: vertices of the face of joints before skinning, with the blend shapes of
        the inputs `active` at 1."""
        return np.asarray(
            self.positions
            + sum((self.made_shapes[c] for c in active if c in self.made_shapes), 0.0)
        )

    def made(self, shaped: Doubles, motions: Doubles) -> Doubles:
        """float64[V, 3]: the skinned vertices of the face of joints.

        Args:
            shaped: float64[V, 3], vertices before skinning, with the blend shapes.
            motions: float64[joints, 3, 4], motions of the joints of the face of joints.
        """
        return self._made.bring(shaped, motions)

    def rows(self, at: Ints) -> Doubles:
        """float64[n, joints]: the weights of the vertices `at` on all joints of the face of
        joints."""
        out = np.zeros((len(at), self._count))
        np.put_along_axis(out, self._made.joints[at], self._made.weights[at], axis=1)
        return out

    def touched(self, joints: Ints) -> Ints:
        """Indices of the vertices on which at least one of `joints` has a weight."""
        there = np.zeros(self._count, bool)
        there[joints] = True
        held = there[self._made.joints] & (self._made.weights > 0)
        return np.flatnonzero(held.any(axis=1))


class Combinations:
    """The correctives of a face, sorted by the number of their controls."""

    def __init__(self, work: Work, options: RigOptions, fewer: Fewer[Work] | None = None) -> None:
        """Sort the correctives of a face.

        Args:
            work: the face of shapes and the face of joints. The meshes of the face of joints must
                already have their skin weights and blend shapes.
            options: options of the rig.
            fewer: simplified meshes on which the joint values are solved; None: the whole meshes
                are used.
        """
        self.work, self.options, self.fewer = work, options, fewer
        self.columns = sk.column_count(work.source)
        self.order = sorted(work.combined, key=lambda c: (len(work.combined[c]), c))
        self.before = _Side(work.source, self.columns)
        self.after = _Side(work.dna, self.columns)
        self.mm = MM.get(work.source.translation_unit, 10.0)
        self.first = len(work.source.joint_names)

    def active(self, column: int) -> list[int]:
        """The inputs at 1 in a corrective's pose: its controls, the correctives of subsets of its
        controls, and the corrective itself."""
        on = self.work.combined[column]
        smaller = [c for c in self.order if c != column and self.work.combined[c] <= on]
        return [*sorted(on), *smaller, column]

    def solve(self, tell: Callable[[float], None]) -> None:
        """Solve the joint values of all correctives.

        Args:
            tell: gets the finished fraction of the work.
        """
        skins = self._skins(0)
        self._each(lambda column: self._solve_one(column, skins), tell)

    def _each(
        self, work: Callable[[int], T], tell: Callable[[float], None] = lambda share: None
    ) -> list[T]:
        """Call a function for each corrective in threads. Returns the results in order.

        Args:
            work: function of a corrective. When it runs, the correctives of a subset of its
                controls are finished.
            tell: gets the finished fraction; an exception that it raises ends the work.
        """
        out: list[T] = []
        pool = ThreadPoolExecutor(_THREADS)
        try:
            for wave in self._waves():
                for one in pool.map(work, wave):
                    out.append(one)
                    tell(len(out) / len(self.order))
        finally:
            pool.shutdown(cancel_futures=True)
        return out

    def _waves(self) -> list[list[int]]:
        """The correctives in their order, divided into runs of correctives that do not depend on
        each other."""
        out: list[list[int]] = []
        for column in self.order:
            on = self.work.combined[column]
            if not out or any(self.work.combined[c] <= on for c in out[-1]):
                out.append([])
            out[-1].append(column)
        return out

    def _skins(self, lod: int) -> list[_Skin]:
        source, dna = self.work.source, self.work.dna
        out = []
        for m in listed_meshes(source, lod):
            mesh, made = source.meshes[m], dna.meshes[dna.mesh_names.index(source.mesh_names[m])]
            if self.fewer is not None and m in self.fewer.made:
                mesh, made = self.fewer.meshes[m].mesh, self.fewer.made[m]
            skin = _Skin(source, dna, mesh, made, self.columns)
            if skin.hangs_on(self.first):
                out.append(skin)
        return out

    def _solve_one(self, column: int, skins: list[_Skin]) -> None:
        active = self.active(column)
        rows, joints = self._rows(skins, active)
        if not len(joints):
            return
        convention = Convention.of(self.work.dna)
        for _ in range(_STEPS):
            worlds = self.after.worlds(active)
            left = rows.goal - sk.skinned(rows.shaped, rows.weights, self.after.motions(worlds))
            step = self._step(joints, worlds, rows, left)
            values = self.after.deltas[active].sum(axis=0)[joints, 3:6]
            turned = sk.matrices_of_vectors(step[:, 3:]) @ sk.rotation_matrices(convention, values)
            self.after.deltas[column, joints, :3] += step[:, :3]
            self.after.deltas[column, joints, 3:6] += sk.euler_angles(convention, turned) - values
        self._leave(column, active, rows, joints)

    def _leave(self, column: int, active: list[int], rows: _Rows, joints: Ints) -> None:
        """Set a corrective's values of a joint to 0 if they move each vertex of `rows` by less than
        options.least_effect_mm.

        Args:
            column: the corrective's input.
            active: inputs at 1 in the pose of the corrective; the corrective is the last.
            rows: the vertices of the corrective's equations.
            joints: indices of the new joints whose values were solved.
        """
        whole = self.after.motions(self.after.worlds(active))
        plain = self.after.motions(self.after.worlds(active[:-1]))
        for joint in joints.tolist():
            at = np.flatnonzero(rows.weights[:, joint])
            motion = whole[joint] - plain[joint]
            moved = rows.shaped[at] @ motion[:, :3].T + motion[:, 3]
            effect = np.linalg.norm(moved, axis=1) * rows.weights[at, joint]
            if effect.max(initial=0) * self.mm < self.options.least_effect_mm:
                self.after.deltas[column, joint] = 0

    def _rows(self, skins: list[_Skin], active: list[int]) -> tuple[_Rows, Ints]:
        """Choose the vertices and the new joints of a corrective's equations.

        Args:
            skins: the meshes.
            active: inputs at 1 in the pose of the corrective; the corrective is the last.

        Returns: vertices with an error, and some other vertices, which must not move; the indices
            of the new joints.
        """
        motions = self.after.motions(self.after.worlds(active))
        parts, found, errors = [], [], []
        for skin in skins:
            goal, shaped = skin.goal(self.before, active), skin.shaped(active[:-1])
            away = np.linalg.norm(goal - skin.made(shaped, motions), axis=1)
            off = np.flatnonzero(away * self.mm > _OFF_MM)
            off = off[:: len(off) // _MOST_OFF + 1]
            parts.append((skin, goal, shaped, off))
            found.append(skin.rows(off)[:, self.first :])
            errors.append(away[off])
        share = (np.concatenate(found) * np.concatenate(errors)[:, None]) ** 2
        total = share.sum(axis=0)
        order = np.argsort(-total, kind="stable")[:_MOST_JOINTS]
        joints = self.first + np.sort(order[total[order] > _LEAST_SHARE * total.max(initial=0)])
        out = []
        for skin, goal, shaped, off in parts:
            hold = np.setdiff1d(skin.touched(joints), off)
            at = np.concatenate([off, hold[:: len(hold) // _MOST_HELD + 1]])
            out.append((goal[at], shaped[at], skin.rows(at)))
        goals, shapes, weights = (np.concatenate(column) for column in zip(*out, strict=True))
        return _Rows(goals, shapes, weights), joints

    def _step(self, joints: Ints, worlds: Doubles, rows: _Rows, left: Doubles) -> Doubles:
        """float64[joints, 6]: a Gauss-Newton step of shifts and rotation vectors.

        Args:
            joints: indices of the joints.
            worlds: world matrices of all joints, float64[joints, 4, 4].
            rows: the vertices.
            left: remaining displacement of each vertex, float64[V, 3].

        The step is in the frames of the joints' parents.
        """
        count = len(joints)
        above = worlds[np.asarray(self.work.dna.joint_parents, np.int64)[joints]]
        places = np.linalg.inv(above) @ worlds[joints]
        arms = (places @ self.after.rest[joints])[:, :3]
        arms[..., 3] -= places[:, :3, 3]
        held = rows.weights[:, joints]
        held = np.where(held > _LEAST_WEIGHT, held, 0.0)
        normal, asked = _equations(above[:, :3, :3], arms, rows.shaped, held, left)
        diagonal = np.diag(normal)
        normal += np.diag(_DAMPING * diagonal + 1e-6 * diagonal.max(initial=1e-9) + 1e-12)
        return np.asarray(np.linalg.solve(normal, asked).reshape(count, 6))

    def values(self) -> Doubles:
        """float64[new joints, 6, correctives]: the values that each corrective adds to the new
        joints; the correctives are in the order of self.order."""
        return self.after.deltas[self.order, self.first :, :6].transpose(1, 2, 0)

    def finish(
        self, lods: int, tell: Callable[[float], None] = lambda share: None
    ) -> list[Combination]:
        """Add blend shapes for the joints' errors, and return the errors of the finest meshes.

        Args:
            lods: number of LODs of the source.
            tell: gets the finished fraction of each block of vertices.
        """
        work = self.work
        self.after = _Side(work.dna, self.columns)
        channels = work.dna.blend_shape_channels
        channel = {
            int(c): int(o)
            for c, o in zip(channels.input_indices, channels.output_indices, strict=True)
        }
        out = [Combination(self._name(c), 0.0, 0.0, 0.0, c) for c in self.order]
        done: set[str] = set()
        meshes = list(work.dna.meshes)
        for lod in range(lods):
            for m in listed_meshes(work.source, lod):
                name = work.source.mesh_names[m]
                if name in done:
                    continue
                done.add(name)
                at = work.dna.mesh_names.index(name)
                finest = dict(zip(self.order, out, strict=True)) if lod == 0 else {}
                blocks, parts = blocks_of(np.asarray(meshes[at].positions, np.float64)), []
                both = (split_mesh(mesh, blocks) for mesh in (work.source.meshes[m], meshes[at]))
                for vertices, before, after in zip(blocks, *both, strict=True):
                    skin = _Skin(work.source, work.dna, before, after, self.columns)
                    if skin.hangs_on(self.first):
                        left = self._each(partial(self._left, skin, finest), tell)
                        parts.append((vertices, self._targets(left, channel)))
                added = joined_targets(parts)
                meshes[at].blend_shape_targets = [*meshes[at].blend_shape_targets, *added]
        work.dna.meshes = meshes
        return out

    def _targets(
        self, left: Sequence[BlendShapeTarget | None], channel: dict[int, int]
    ) -> list[BlendShapeTarget]:
        """The blend shapes of the correctives that have a channel.

        Args:
            left: for each corrective, its blend shape, or None.
            channel: input -> blend shape channel.
        """
        out = []
        for target, column in zip(left, self.order, strict=True):
            if target is not None and column in channel:
                target.blend_shape_channel_index = channel[column]
                out.append(target)
        return out

    def _name(self, column: int) -> str:
        names = self.work.source.raw_control_names
        return " x ".join(names[c].rpartition(".")[2] for c in sorted(self.work.combined[column]))

    def _left(
        self, skin: _Skin, of_column: dict[int, Combination], column: int
    ) -> BlendShapeTarget | None:
        active, found = self.active(column), of_column.get(column)
        goal, shaped = skin.goal(self.before, active), skin.shaped(active[:-1])
        motions = self.after.motions(self.after.worlds(active))
        error = np.linalg.norm(goal - skin.made(shaped, motions), axis=1)
        error *= self.mm
        if found is not None:
            without = self.after.motions(self.after.worlds(active[:-1]))
            plain = goal - skin.made(shaped, without)
            found.before = max(found.before, float(np.linalg.norm(plain, axis=1).max()) * self.mm)
            found.joints_largest = max(found.joints_largest, float(error.max()))
        tolerance = (self.options.tolerance_mm or 0.0) if self.options.shapes else None
        moved = np.flatnonzero(error > (np.inf if tolerance is None else tolerance))
        if found is not None:
            rest = np.delete(error, moved)
            found.largest = max(found.largest, float(rest.max(initial=0)))
        if not len(moved):
            return None
        wanted = sk.before_skin(goal[moved], skin.rows(moved), motions)
        delta = np.zeros_like(skin.positions)
        delta[moved] = wanted - shaped[moved]
        skin.made_shapes[column] = delta
        return BlendShapeTarget(deltas=delta[moved], vertex_indices=moved)


@dataclass
class _Rows:
    """Vertices of a corrective's equations: goals, places before skinning, and weights."""

    goal: Doubles
    shaped: Doubles
    weights: Doubles


def _equations(
    turns: Doubles, arms: Doubles, shaped: Doubles, held: Doubles, left: Doubles
) -> tuple[Doubles, Doubles]:
    """Normal equations of small shifts and turns of joints.

    A joint moves a vertex by weight * T (shift + turn x arm), and the arm is linear in the vertex'
    place. So the sums over vertices reduce to ten moments for each pair of joints, and no matrix
    with a row for each vertex is needed.

    Args:
        turns: float64[J, 3, 3], rotations from the parents' frames to the world (T).
        arms: float64[J, 3, 4], matrices from a place to the arm in the parent's frame.
        shaped: float64[V, 3], places of the vertices before skinning.
        held: float64[V, J], weights.
        left: float64[V, 3], remaining displacements.

    Returns:
        Matrix float64[6 J, 6 J] and right side float64[6 J]; by joint: shift, rotation vector.
    """
    count, middle = len(turns), shaped.mean(axis=0)
    arms = arms.copy()
    arms[..., 3] += arms[..., :3] @ middle
    places = np.concatenate([shaped - middle, np.ones((len(shaped), 1))], axis=1)
    # Displacement of a vertex by a unit shift or rotation of a joint. The displacement is linear in
    # the vertex' position: three rows for x, y and z, and a constant.
    moves = np.zeros((4, count, 6, 3))
    moves[3, :, :3] = turns.transpose(0, 2, 1)
    crossed = np.cross(_AXES, arms.transpose(2, 0, 1)[:, :, None])  # [4, J, axis, 3]
    moves[:, :, 3:] = crossed @ turns.transpose(0, 2, 1)
    flat = moves.reshape(4, -1, 3)
    normal, asked = np.zeros((6 * count, 6 * count)), np.zeros((count, 6))
    part, weighted = np.empty_like(normal), np.empty_like(held)  # buffers, reused for all terms
    for k in range(4):
        asked += (moves[k] @ (held.T @ (places[:, k, None] * left))[..., None])[..., 0]
        for other in range(k, 4):
            np.multiply(held, (places[:, k] * places[:, other])[:, None], out=weighted)
            share = held.T @ weighted
            ways = [(k, other, share)] if other == k else [(k, other, share), (other, k, share.T)]
            for one, two, shares in ways:
                np.matmul(flat[one], flat[two].T, out=part)
                part *= shares.repeat(6, axis=0).repeat(6, axis=1)
                normal += part
    return normal, asked.ravel()
