# SPDX-License-Identifier: MIT
"""Vertices of a face as a function of its raw controls, and what each control does to them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .._native import Dna, Rig
from ..base.errors import ArgumentError
from ..rigs.rotation import Convention

Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
STEP = 1.0 / 256


class Surface:
    """The meshes of one LOD, skinned and shaped as the evaluated rig says.

    Positions are in the file's units and axes. What turns the neck or the head outside of the
    face's own controls takes no part: it is the head's own space.

    Attributes:
        mesh_indices: the meshes of the LOD, indices into dna.meshes.
        vertex_counts: of each mesh of the file, whether it is one of the LOD or not.
        lod: the level of detail.
        rig: the compiled face.
    """

    def __init__(self, dna: Dna, rig: Rig, lod: int = 0) -> None:
        """Take what is needed of a face.

        Args:
            dna: the file, with its geometry.
            rig: compiled from it, with Euler angles as rotation.
            lod: from 0, below the number of LODs.

        Raises:
            ValueError: a LOD or a rig that does not fit.
        """
        if rig.rotation != "euler" or rig.joint_count != len(dna.joint_names):
            raise ArgumentError(
                f"rig: Euler angles of {len(dna.joint_names)} joints were expected, found "
                f"{rig.rotation} of {rig.joint_count}"
            )
        if not 0 <= lod < max(1, rig.lod_count):
            raise ArgumentError(f"lod: 0 to {rig.lod_count - 1} was expected, found {lod}")
        self.rig, self.lod = rig, lod
        self.mesh_indices = [int(m) for m in dna.lod_mesh_mapping[lod]]
        self.vertex_counts = [len(mesh.positions) for mesh in dna.meshes]
        self._dna = dna
        self._rest = np.linalg.inv(self._world(np.zeros((1, rig.joint_count, 9))))[0]

    def positions(
        self, raw: npt.ArrayLike, mesh: int, vertices: npt.ArrayLike | None = None
    ) -> Floats:
        """Where raw controls bring vertices: float32[V, 3].

        Args:
            raw: float[R].
            mesh: an index into dna.meshes.
            vertices: int[V]; None is all.

        Raises:
            ValueError: an index that is out of range, a value that is no number.
        """
        rows = self._rows(mesh, vertices)
        return self._posed(self._raw(raw)[None], mesh, rows)[0].astype(np.float32)

    def jacobian(
        self,
        raw: npt.ArrayLike,
        mesh: int,
        vertices: npt.ArrayLike,
        lowest: npt.ArrayLike | None = None,
        highest: npt.ArrayLike | None = None,
    ) -> Floats:
        """What each control does to vertices at a pose, per unit of it: float32[V, 3, R].

        By differences of the evaluated rig, so correctives, solvers and networks count; to the side
        that the limits leave.

        Args:
            raw: float[R], the pose.
            mesh: an index into dna.meshes.
            vertices: int[V].
            lowest, highest: float[R] or one number; None is 0 and 1.

        Raises:
            ValueError: an index that is out of range, a value that is no number.
        """
        at = self._raw(raw)
        rows = self._rows(mesh, vertices)
        _, high = limits(len(at), lowest, highest)
        step = np.where(at + STEP <= high, STEP, -STEP)
        poses = np.concatenate([at[None], at + np.diag(step)])
        out = self._posed(poses, mesh, rows)
        return np.moveaxis((out[1:] - out[0]) / step[:, None, None], 0, -1).astype(np.float32)

    def _raw(self, raw: npt.ArrayLike) -> Doubles:
        return vector("raw", raw, len(self.rig.raw_control_names))

    def _rows(self, mesh: int, vertices: npt.ArrayLike | None) -> Ints:
        if mesh not in range(len(self.vertex_counts)):
            raise ArgumentError(
                f"mesh: an index below {len(self.vertex_counts)} was expected, found {mesh}"
            )
        count = self.vertex_counts[mesh]
        if vertices is None:
            return np.arange(count)
        rows = np.asarray(vertices)
        if rows.ndim != 1 or (rows.size and rows.dtype.kind not in "iu"):
            raise ArgumentError("vertices: a list of whole numbers was expected")
        if rows.size and not (rows.min() >= 0 and rows.max() < count):
            found = int(rows[(rows < 0) | (rows >= count)][0])
            raise ArgumentError(f"vertices: indices below {count} were expected, found {found}")
        return rows.astype(np.int64)

    def _posed(self, raw: Doubles, mesh: int, rows: Ints) -> Doubles:
        pose = self.rig.evaluate_batch(raw.astype(np.float32), lod=self.lod, threads=1)
        moves = self._world(pose.joints.astype(np.float64)) @ self._rest
        geometry = self._dna.meshes[mesh]
        points = np.ones((len(raw), len(rows), 4))
        points[..., :3] = geometry.positions[rows]
        place = np.full(self.vertex_counts[mesh], -1)
        place[rows] = np.arange(len(rows))
        for target in geometry.blend_shape_targets:
            weights = pose.blend_shapes[:, target.blend_shape_channel_index].astype(np.float64)
            at = place[target.vertex_indices]
            if weights.any() and (at >= 0).any():
                add = weights[:, None, None] * target.deltas[at >= 0].astype(np.float64)
                points[:, at[at >= 0], :3] += add
        out = np.zeros((len(raw), len(rows), 3))
        offsets = geometry.skin_offsets.astype(np.int64)
        counts = offsets[rows + 1] - offsets[rows]
        for i in range(int(counts.max(initial=0))):
            used = np.flatnonzero(counts > i)
            at = offsets[rows[used]] + i
            joint = geometry.skin_joint_indices[at].astype(np.int64)
            weight = geometry.skin_weights[at].astype(np.float64)
            moved = np.einsum("nvij,nvj->nvi", moves[:, joint, :3], points[:, used])
            out[:, used] += weight[:, None] * moved
        return out

    def _world(self, deltas: Doubles) -> Doubles:
        dna, convention = self._dna, Convention.of(self._dna)
        angles = dna.neutral_joint_rotations.astype(np.float64) + deltas[..., 3:6]
        angles = angles * convention.signs * convention.radians
        turn = np.broadcast_to(np.eye(3), (*angles.shape[:-1], 3, 3))
        for axis in convention.order:
            c, s = np.cos(angles[..., axis]), np.sin(angles[..., axis])
            i, j = (axis + 1) % 3, (axis + 2) % 3
            step = np.zeros((*angles.shape[:-1], 3, 3))
            step[..., axis, axis] = 1
            step[..., i, i] = step[..., j, j] = c
            step[..., j, i], step[..., i, j] = s, -s
            turn = step @ turn
        out = np.zeros((*deltas.shape[:-1], 4, 4))
        out[..., :3, :3] = turn * (1 + deltas[..., 6:9])[..., None, :]
        out[..., :3, 3] = dna.neutral_joint_translations.astype(np.float64) + deltas[..., :3]
        out[..., 3, 3] = 1
        done = set[int]()
        while len(done) < len(dna.joint_parents):
            for joint, parent in enumerate(int(p) for p in dna.joint_parents):
                if joint in done or (parent != joint and parent not in done):
                    continue
                if parent != joint:
                    out[:, joint] = out[:, parent] @ out[:, joint]
                done.add(joint)
        return out


def vector(name: str, values: npt.ArrayLike, count: int) -> Doubles:
    """float64[count] of what a caller gave.

    Args:
        name: of the argument.
        values: one number for all, or one for each.
        count: how many there must be.

    Raises:
        ValueError: another shape, a value that is no number.
    """
    out = np.asarray(values, np.float64)
    if out.shape not in ((), (count,)):
        raise ArgumentError(f"{name}: {count} numbers were expected, found {list(out.shape)}")
    if not np.isfinite(out).all():
        raise ArgumentError(f"{name}: finite numbers were expected")
    return np.array(np.broadcast_to(out, (count,)))


def limits(
    count: int, lowest: npt.ArrayLike | None, highest: npt.ArrayLike | None
) -> tuple[Doubles, Doubles]:
    """float64[R] twice: between which values each control may be.

    Args:
        count: R.
        lowest: float[R] or one number; None is 0.
        highest: float[R] or one number; None is 1.

    Raises:
        ValueError: another shape, no number, a lowest above its highest.
    """
    low = vector("lowest", 0.0 if lowest is None else lowest, count)
    high = vector("highest", 1.0 if highest is None else highest, count)
    if (low > high).any():
        at = int(np.argmax(low > high))
        raise ArgumentError(
            f"lowest[{at}]: at most highest[{at}] {high[at]:g} was expected, found {low[at]:g}"
        )
    return low, high
