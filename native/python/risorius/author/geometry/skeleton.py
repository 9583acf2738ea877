# SPDX-License-Identifier: MIT
"""Computes motions of joints and vertices of a Dna with a single input at 1.

A column is an input of joint groups and blend shape channels: a raw control or a corrective. The
functions use double precision. They do not use the evaluator, which computes all controls together.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ... import Dna, Mesh
from ...rigs.rotation import Convention

FARTHEST = 1e9
"""Largest coordinate in a face's unit: 10,000 km. Squares of larger ones could overflow."""
Doubles = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

STILL = 1e-9  # smaller deviations of a joint's motion from the identity are rounding errors


def rotation_matrices(convention: Convention, angles: Doubles) -> Doubles:
    """float64[..., 3, 3]: rotation matrices for column vectors, from Euler angles.

    Args:
        convention: order, signs and unit of the angles.
        angles: float64[..., 3], Euler angles about x, y and z in the convention's unit.
    """
    turned = angles * convention.signs * convention.radians
    out = np.broadcast_to(np.eye(3), (*angles.shape[:-1], 3, 3))
    for axis in convention.order:
        c, s = np.cos(turned[..., axis]), np.sin(turned[..., axis])
        step = np.zeros((*angles.shape[:-1], 3, 3))
        i, j = (axis + 1) % 3, (axis + 2) % 3
        step[..., axis, axis] = 1
        step[..., i, i] = step[..., j, j] = c
        step[..., j, i], step[..., i, j] = s, -s
        out = step @ out
    return out


def euler_angles(convention: Convention, matrices: Doubles) -> Doubles:
    """float64[n, 3]: Euler angles in the convention's unit. Small rotations give small angles.

    Args:
        convention: order, signs and unit of the angles.
        matrices: float64[n, 3, 3], rotations of column vectors.
    """
    i, j, k = convention.order
    parity = 1 if j == (i + 1) % 3 else -1
    m = matrices
    out = np.zeros((len(m), 3))
    out[:, j] = np.arcsin(np.clip(-parity * m[:, k, i], -1, 1))
    out[:, i] = np.arctan2(parity * m[:, k, j], m[:, k, k])
    out[:, k] = np.arctan2(parity * m[:, j, i], m[:, i, i])
    return out * convention.signs / convention.radians


def rotation_vectors(matrices: Doubles) -> Doubles:
    """float64[..., 3]: rotation vectors (axis times angle in radians) of matrices [..., 3, 3]."""
    m = matrices
    axis = np.stack(
        [
            m[..., 2, 1] - m[..., 1, 2],
            m[..., 0, 2] - m[..., 2, 0],
            m[..., 1, 0] - m[..., 0, 1],
        ],
        axis=-1,
    )
    sine = np.linalg.norm(axis, axis=-1) / 2
    cosine = (np.trace(m, axis1=-2, axis2=-1) - 1) / 2
    angle = np.arctan2(sine, cosine)
    return axis * (angle / np.maximum(2 * sine, 1e-30))[..., None]


def matrices_of_vectors(vectors: Doubles) -> Doubles:
    """float64[..., 3, 3]: rotation matrices of rotation vectors float64[..., 3] (Rodrigues)."""
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1)
    cross = cross.reshape(*x.shape, 3, 3) / np.maximum(angle, 1e-30)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)


def column_count(dna: Dna) -> int:
    """The number of inputs of joint groups and blend shape channels, at least the number of raw
    controls."""
    lists = [g.input_indices for g in dna.joint_groups] + [dna.blend_shape_channels.input_indices]
    most = max((int(values.max()) + 1 for values in lists if len(values)), default=0)
    # The file's own column count is not used, because no reader checks it against the joint groups.
    return max(most, len(dna.raw_control_names))


def psd_parts(dna: Dna) -> dict[int, frozenset[int]]:
    """Index of a corrective's input -> the raw controls of the corrective."""
    out: dict[int, set[int]] = {}
    rows, columns = np.asarray(dna.psds.rows), np.asarray(dna.psds.columns)
    for row, column in zip(rows.tolist(), columns.tolist(), strict=True):
        out.setdefault(int(row), set()).add(int(column))
    return {row: frozenset(parts) for row, parts in sorted(out.items())}


def joint_levels(dna: Dna) -> list[Ints]:
    """Joint indices by depth in the hierarchy, one array for each depth: first the roots, then
    their children, and so on."""
    at = np.asarray(dna.joint_parents, np.int64)
    depth = (at != np.arange(len(at))).astype(np.int64)
    for _ in range(len(at).bit_length()):  # pointer jumping: 1 step up, then 2, then 4
        depth += depth[at]
        at = at[at]
    order = np.argsort(depth, kind="stable")
    return np.split(order, np.cumsum(np.bincount(depth))[:-1]) if len(at) else []


def parent_order(dna: Dna) -> list[int]:
    """Joint indices, parents before their children."""
    return [int(joint) for level in joint_levels(dna) for joint in level]


def column_deltas(dna: Dna, columns: int) -> Doubles:
    """float64[columns, joints, 9]: values that each input at 1 adds to the joints' attributes.

    Args:
        dna: the face.
        columns: number of inputs, the result of column_count().
    """
    out = np.zeros((columns, len(dna.joint_names) * 9))
    for group in dna.joint_groups:
        values = np.asarray(group.values, np.float64)
        inputs = np.asarray(group.input_indices, np.int64)
        out[inputs[:, None], np.asarray(group.output_indices, np.int64)[None]] += values.T
    return out.reshape(columns, len(dna.joint_names), 9)


def world_matrices(dna: Dna, deltas: Doubles) -> Doubles:
    """float64[..., joints, 4, 4]: matrices from the joints' axes to the world, column vectors.

    Args:
        dna: the face with its neutral pose and hierarchy.
        deltas: float64[..., joints, 9], tx ty tz rx ry rz sx sy sz added to the neutral pose.
    """
    convention = Convention.of(dna)
    local = np.zeros((*deltas.shape[:-1], 4, 4))
    angles = np.asarray(dna.neutral_joint_rotations, np.float64) + deltas[..., 3:6]
    turn = rotation_matrices(convention, angles)
    local[..., :3, :3] = turn * (1 + deltas[..., 6:9])[..., None, :]
    local[..., :3, 3] = np.asarray(dna.neutral_joint_translations, np.float64) + deltas[..., :3]
    local[..., 3, 3] = 1
    out = local.copy()
    parents = np.asarray(dna.joint_parents, np.int64)
    for level in joint_levels(dna)[1:]:
        out[..., level, :, :] = out[..., parents[level], :, :] @ local[..., level, :, :]
    return out


def column_motions(dna: Dna, columns: int, value: float = 1.0) -> Doubles:
    """float64[columns, joints, 3, 4]: motion of each joint from the neutral pose by each input.

    A motion is the matrix from neutral to posed positions of points that follow the joint.

    Args:
        dna: the face.
        columns: number of inputs.
        value: value of the input; all others are 0.
    """
    deltas = value * column_deltas(dna, columns)
    rest = world_matrices(dna, np.zeros_like(deltas[0]))
    posed = world_matrices(dna, deltas)
    return (posed @ np.linalg.inv(rest))[..., :3, :]


def skin_entries(mesh: Mesh) -> tuple[Ints, Ints, Doubles]:
    """Vertex, joint and weight of each skin weight, sorted by vertex.

    The weights of a vertex are scaled to the sum 1.

    Args:
        mesh: the mesh.
    """
    count, offsets = len(mesh.positions), np.asarray(mesh.skin_offsets, np.int64)
    vertex = np.repeat(np.arange(len(offsets) - 1 if len(offsets) else 0), np.diff(offsets))
    weight = np.asarray(mesh.skin_weights, np.float64)
    total = np.bincount(vertex, weights=weight, minlength=count)
    return (
        vertex,
        np.asarray(mesh.skin_joint_indices, np.int64),
        weight / np.where(total > 0, total, 1)[vertex],
    )


def dense_weights(mesh: Mesh, joints: int) -> Doubles:
    """float64[V, joints]: skin weights as a dense matrix; rows have the sum 1, or 0 for a vertex
    without weights.

    Args:
        mesh: the mesh.
        joints: number of joints.
    """
    vertex, joint, weight = skin_entries(mesh)
    out = np.zeros((len(mesh.positions), joints))
    np.add.at(out, (vertex, joint), weight)
    return out


def column_shapes(dna: Dna, mesh: Mesh, columns: int) -> dict[int, Doubles]:
    """Input -> float64[V, 3], the displacements by its blend shapes before skinning.

    Args:
        dna: the face with the blend shape channels.
        mesh: the mesh with the targets.
        columns: number of inputs.
    """
    drives, out = _drives(dna), dict[int, Doubles]()
    for target in mesh.blend_shape_targets:
        for column in drives.get(int(target.blend_shape_channel_index), ()):
            if column < columns:
                delta = out.setdefault(column, np.zeros((len(mesh.positions), 3)))
                vertices = np.asarray(target.vertex_indices, np.int64)
                if (np.diff(vertices) > 0).all():  # no vertex occurs twice
                    delta[vertices] += target.deltas
                else:
                    np.add.at(delta, vertices, target.deltas)
    return out


def shaped_columns(dna: Dna, mesh: Mesh, columns: int) -> set[int]:
    """The inputs that drive a blend shape of a mesh.

    Args:
        dna: the face with the blend shape channels.
        mesh: the mesh with the targets.
        columns: number of inputs.
    """
    drives = _drives(dna)
    channels = {int(target.blend_shape_channel_index) for target in mesh.blend_shape_targets}
    return {c for channel in channels for c in drives.get(channel, ()) if c < columns}


def _drives(dna: Dna) -> dict[int, list[int]]:
    """Blend shape channel -> the inputs that drive it."""
    drives: dict[int, list[int]] = {}
    channels = dna.blend_shape_channels
    for source, channel in zip(channels.input_indices, channels.output_indices, strict=True):
        drives.setdefault(int(channel), []).append(int(source))
    return drives


def skinned(positions: Doubles, weights: Doubles, motions: Doubles) -> Doubles:
    """float64[V, 3]: vertices after linear blend skinning.

    Args:
        positions: float64[V, 3], vertices before skinning.
        weights: float64[V, joints], skin weights.
        motions: float64[joints, 3, 4], matrix of each joint from neutral to posed positions.
    """
    blended = (weights @ motions.reshape(len(motions), 12)).reshape(-1, 3, 4)
    return np.einsum("vij,vj->vi", blended[..., :3], positions) + blended[..., 3]


class Influences:
    """Sparse skin weights: the few joints of each vertex, for faces with many joints."""

    def __init__(self, weights: Doubles) -> None:
        """Convert dense weights.

        Args:
            weights: float64[V, joints], skin weights.
        """
        most = int((weights > 0).sum(axis=1).max(initial=1))
        self.joints = np.argsort(-weights, axis=1, kind="stable")[:, :most]  # int64[V, most]
        self.weights = np.take_along_axis(weights, self.joints, axis=1)

    def bring(self, positions: Doubles, motions: Doubles) -> Doubles:
        """float64[V, 3]: vertices after linear blend skinning, as skinned().

        Args:
            positions: float64[V, 3], vertices before skinning.
            motions: float64[joints, 3, 4], matrix of each joint from neutral to posed positions.
        """
        flat = motions.reshape(len(motions), 12)
        blended = sum(
            self.weights[:, k, None] * flat[self.joints[:, k]] for k in range(self.joints.shape[1])
        )
        turned = np.asarray(blended).reshape(-1, 3, 4)
        return np.einsum("vij,vj->vi", turned[..., :3], positions) + turned[..., 3]


class Skin:
    """Vertices with skin weights, for poses of few moving joints. Other joints cost no time."""

    def __init__(self, positions: Doubles, weights: Doubles) -> None:
        """Prepare vertices.

        Args:
            positions: float64[V, 3], vertices before skinning.
            weights: float64[V, joints]; the sum of each row is 1.
        """
        self._axes = np.ascontiguousarray(positions.T)
        self._of_joints = np.ascontiguousarray(weights.T)

    def moved(self, motions: Doubles) -> Doubles:
        """float64[V, 3]: displacements of the vertices by linear blend skinning.

        Args:
            motions: float64[joints, 3, 4], matrix of each joint from neutral to posed positions.
        """
        apart = motions - np.eye(3, 4)
        moving = np.flatnonzero(np.abs(apart).max(axis=(1, 2)) > STILL)
        # Each of the 12 numbers of a motion is a row of all vertices, because sums of long rows are
        # faster than a small matrix product for each vertex.
        rows = (apart[moving].reshape(-1, 12).T @ self._of_joints[moving]).reshape(3, 4, -1)
        x, y, z = self._axes
        return np.asarray((rows[:, 0] * x + rows[:, 1] * y + rows[:, 2] * z + rows[:, 3]).T)


def before_skin(wanted: Doubles, weights: Doubles, motions: Doubles) -> Doubles:
    """float64[V, 3]: positions before skinning that skinning moves to the wanted positions.

    Args:
        wanted: float64[V, 3], positions after skinning.
        weights: float64[V, joints], skin weights.
        motions: float64[joints, 3, 4], matrix of each joint from neutral to posed positions.
    """
    blended = (weights @ motions.reshape(len(motions), 12)).reshape(-1, 3, 4)
    right = (wanted - blended[..., 3])[..., None]
    return np.asarray(np.linalg.solve(blended[..., :3], right)[..., 0])


def mesh_edges(mesh: Mesh) -> npt.NDArray[np.uint32]:
    """uint32[n, 2]: vertex indices of the polygons' edges; each edge occurs once."""
    corners = np.asarray(mesh.layout_positions, np.int64)[np.asarray(mesh.face_layouts, np.int64)]
    offsets = np.asarray(mesh.face_offsets, np.int64)
    following = np.arange(1, len(corners) + 1)
    full = offsets[1:] > offsets[:-1]  # faces without corners have no edges
    following[offsets[1:][full] - 1] = offsets[:-1][full]
    pairs = np.sort(np.stack([corners, corners[following]], axis=1), axis=1)
    pairs = pairs[pairs[:, 0] != pairs[:, 1]]
    count = max(len(mesh.positions), 1)
    key = np.unique(pairs[:, 0] * count + pairs[:, 1])
    return np.stack(np.divmod(key, count), axis=1).astype(np.uint32)
