# SPDX-License-Identifier: GPL-3.0-or-later
"""The one place of coordinate and unit conversion: DNA file space to Blender space.

Blender: z up, a face looks along -y, its left is +x, right-handed, metres / scene unit scale.
Column vectors: v' = scale * axes @ v. A rotation M becomes axes @ M @ axes^T, which is a
rotation also where `axes` mirrors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]

_DIRECTIONS = {
    "right": (1.0, 0.0, 0.0),
    "left": (-1.0, 0.0, 0.0),
    "up": (0.0, 0.0, 1.0),
    "down": (0.0, 0.0, -1.0),
    "front": (0.0, -1.0, 0.0),
    "back": (0.0, 1.0, 0.0),
}
_METRES = {"cm": 0.01, "m": 1.0}
_SEQUENCES = ("xyz", "xzy", "yxz", "yzx", "zxy", "zyx")


class SpaceError(ValueError):
    """A file whose axes or units cannot be converted; the text is one sentence for users."""


@dataclass(frozen=True)
class Space:
    """How one file's numbers become Blender's.

    Attributes:
        axes: float64[3, 3], columns are the file's x, y and z axes in Blender's axes.
        scale: Blender units per file unit.
        radians: radians per file angle unit.
        sequence: axis numbers in the order in which rotations are applied.
        signs: float64[3], +1 or -1 per Euler angle.
        flip_faces: whether corner order must be reversed.
    """

    axes: Float
    scale: float
    radians: float
    sequence: tuple[int, int, int]
    signs: Float
    flip_faces: bool

    def points(self, values: NDArray[np.float32] | Float) -> Float:
        """Convert positions, offsets or deltas, [n, 3] file units to Blender units."""
        return np.asarray(values, np.float64) @ (self.axes.T * self.scale)

    def directions(self, values: NDArray[np.float32] | Float) -> Float:
        """Convert normals, [n, 3], length kept."""
        return np.asarray(values, np.float64) @ self.axes.T

    def scales(self, values: NDArray[np.float32] | Float) -> Float:
        """Convert scale deltas, [n, 3]: axes are exchanged, signs kept."""
        return np.asarray(values, np.float64) @ np.abs(self.axes).T

    def rotations(self, angles: NDArray[np.float32] | Float) -> Float:
        """Convert Euler angles of the file, [n, 3], to rotation matrices float64[n, 3, 3]."""
        matrices = euler_matrices(
            np.asarray(angles, np.float64) * self.radians * self.signs, self.sequence
        )
        return self.axes @ matrices @ self.axes.T

    def file_points(self, values: NDArray[np.float32] | Float) -> Float:
        """The inverse of `points`: [n, 3] Blender units to file units."""
        return np.asarray(values, np.float64) @ self.axes / self.scale

    def file_rotations(self, matrices: Float, near: Float) -> Float:
        """The inverse of `rotations`: float64[n, 3, 3] to Euler angles of the file, [n, 3].

        Args:
            matrices: rotations in Blender's axes.
            near: float64[n, 3] file angles; of all angles that mean the same rotation those
                nearest to these are returned.
        """
        turned = self.axes.T @ matrices @ self.axes
        units = self.radians * self.signs
        return euler_angles(turned, self.sequence, np.asarray(near, np.float64) * units) / units

    @property
    def delta_matrix(self) -> NDArray[np.float32]:
        """float32[3, 3] that takes a shape delta of the file to Blender units."""
        return np.ascontiguousarray(self.axes * self.scale, np.float32)


def make_space(
    coordinate_system: Sequence[str],
    translation_unit: str,
    rotation_unit: str,
    rotation_sequence: str,
    rotation_signs: Sequence[int],
    face_winding_order: str,
    unit_scale: float = 1.0,
) -> Space:
    """Read a file's conventions.

    Args:
        coordinate_system: directions of the file's x, y and z axes.
        translation_unit: "cm" or "m".
        rotation_unit: "degrees" or "radians".
        rotation_sequence: such as "xyz"; the first rotation is applied first.
        rotation_signs: one per axis.
        face_winding_order: "ccw" or "cw".
        unit_scale: metres per Blender unit of the scene.

    Returns:
        The Space of that file in that scene.

    Raises:
        SpaceError: a word that is not known, or axes that do not span space.
    """
    for what, word, known in (
        ("translation unit", translation_unit, tuple(_METRES)),
        ("rotation unit", rotation_unit, ("degrees", "radians")),
        ("rotation sequence", rotation_sequence, _SEQUENCES),
        ("face winding order", face_winding_order, ("ccw", "cw")),
    ):
        if word not in known:
            raise SpaceError(f"The file's {what} {word!r} is not one of {', '.join(known)}.")
    if any(word not in _DIRECTIONS for word in coordinate_system):
        raise SpaceError(f"The file's axes {tuple(coordinate_system)} are not directions.")
    axes = np.array([_DIRECTIONS[word] for word in coordinate_system]).T
    determinant = float(np.linalg.det(axes))
    if abs(determinant) < 0.5:
        raise SpaceError(f"The file's axes {tuple(coordinate_system)} lie in one plane.")
    return Space(
        axes=axes,
        scale=_METRES[translation_unit] / (unit_scale or 1.0),
        radians=np.pi / 180.0 if rotation_unit == "degrees" else 1.0,
        sequence=tuple("xyz".index(c) for c in rotation_sequence),  # type: ignore[arg-type]
        signs=np.where(np.asarray(rotation_signs, np.float64) < 0, -1.0, 1.0),
        flip_faces=(face_winding_order == "cw") != (determinant < 0),
    )


def euler_matrices(angles: Float, sequence: Sequence[int]) -> Float:
    """Rotation matrices for column vectors; sequence[0] is applied first.

    Args:
        angles: float64[n, 3] radians about x, y and z.
        sequence: three axis numbers.

    Returns:
        float64[n, 3, 3].
    """
    result = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for axis in sequence:
        cosine, sine = np.cos(angles[:, axis]), np.sin(angles[:, axis])
        following, last = (axis + 1) % 3, (axis + 2) % 3
        turn = np.zeros((len(angles), 3, 3))
        turn[:, axis, axis] = 1.0
        turn[:, following, following] = turn[:, last, last] = cosine
        turn[:, last, following] = sine
        turn[:, following, last] = -sine
        result = turn @ result
    return np.ascontiguousarray(result)


def euler_angles(matrices: Float, sequence: Sequence[int], near: Float) -> Float:
    """Angles whose `euler_matrices` are these; the inverse of that function.

    Args:
        matrices: float64[n, 3, 3] rotations for column vectors.
        sequence: three axis numbers; sequence[0] is applied first.
        near: float64[n, 3] radians; the solution nearest to them is chosen.

    Returns:
        float64[n, 3] radians about x, y and z.
    """
    i, j, k = sequence
    sign = 1.0 if (j - i) % 3 == 1 else -1.0  # even or odd order of axes
    m = matrices
    flat = np.hypot(m[:, i, i], m[:, j, i])  # the cosine of the middle angle
    result = np.empty((len(m), 3))
    for n in range(len(m)):
        middle = np.arctan2(-sign * m[n, k, i], flat[n])
        if flat[n] > 1e-7:
            first = np.arctan2(sign * m[n, k, j], m[n, k, k])
            last = np.arctan2(sign * m[n, j, i], m[n, i, i])
        else:  # the first and last axis coincide: keep the first angle, the last takes the rest
            first = near[n, i]
            known = np.zeros((1, 3))
            known[0, i], known[0, j] = first, middle
            turn = m[n] @ euler_matrices(known, sequence)[0].T
            last = np.arctan2(sign * turn[j, i], turn[i, i])
        angles = np.empty(3)
        angles[[i, j, k]] = first, middle, last
        other = np.empty(3)
        other[[i, j, k]] = first + np.pi, np.pi - middle, last + np.pi
        choices = [near[n] + (a - near[n] + np.pi) % (2 * np.pi) - np.pi for a in (angles, other)]
        result[n] = min(choices, key=lambda a: float(np.sum(np.abs(a - near[n]))))
    return result


def quaternions(matrices: Float) -> Float:
    """Rotation matrices float64[n, 3, 3] to unit quaternions float64[n, 4] (w x y z), w >= 0.

    The largest of the four components is computed from the diagonal and the others from it,
    so that no row divides by a small number.
    """
    m = matrices
    xx, yy, zz = m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]
    squares = np.stack(
        [1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz], axis=1
    )
    a, b, c = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    d, e, f = m[:, 1, 0] + m[:, 0, 1], m[:, 0, 2] + m[:, 2, 0], m[:, 2, 1] + m[:, 1, 2]
    s = squares
    rows = np.stack(
        [
            np.stack([s[:, 0], a, b, c], axis=1),
            np.stack([a, s[:, 1], d, e], axis=1),
            np.stack([b, d, s[:, 2], f], axis=1),
            np.stack([c, e, f, s[:, 3]], axis=1),
        ],
        axis=1,
    )
    result = rows[np.arange(len(m)), np.argmax(squares, axis=1)]
    result = result / np.linalg.norm(result, axis=1, keepdims=True)
    return np.where(result[:, :1] < 0, -result, result)


def world_matrices(rotations: Float, offsets: Float, parents: NDArray[np.uint16]) -> Float:
    """Chain parent-relative rotations and offsets to matrices of the whole.

    Args:
        rotations: float64[J, 3, 3] parent-relative.
        offsets: float64[J, 3] parent-relative.
        parents: parent of each joint; a root is its own.

    Returns:
        float64[J, 4, 4]. Parents may stand after their children.
    """
    count = len(parents)
    local = np.tile(np.eye(4), (count, 1, 1))
    local[:, :3, :3] = rotations
    local[:, :3, 3] = offsets
    world = np.empty_like(local)
    done = [False] * count
    for joint in range(count):
        chain = []
        while not done[joint]:
            chain.append(joint)
            if parents[joint] == joint:
                break
            joint = int(parents[joint])  # noqa: PLW2901
        for link in reversed(chain):
            parent = int(parents[link])
            world[link] = local[link] if parent == link else world[parent] @ local[link]
            done[link] = True
    return world


@dataclass(frozen=True)
class JointSpace:
    """Turns pose deltas of chosen joints into what Blender keeps on a pose bone.

    Attributes:
        space: the file's Space.
        joints: int64[n] the joints that are turned.
        neutral_angles: float64[n, 3] file units.
        neutral_inverse: float64[n, 3, 3] inverse of the neutral rotation in Blender's axes.
    """

    space: Space
    joints: NDArray[np.int64]
    neutral_angles: Float
    neutral_inverse: Float

    def bone_channels(self, deltas: NDArray[np.float32]) -> tuple[Float, Float, Float]:
        """Pose deltas to bone channels.

        The bone's basis is R(n)^-1 T(dt) R(n + dr) S(1 + ds): the neutral is the rest pose.

        Args:
            deltas: float32[J, 9] of all joints: tx ty tz rx ry rz sx sy sz, file units.

        Returns:
            location[n, 3], rotation quaternion[n, 4] (w x y z), scale[n, 3].
        """
        own = deltas[self.joints].astype(np.float64)
        location = np.einsum("nij,nj->ni", self.neutral_inverse, self.space.points(own[:, :3]))
        turned = self.space.rotations(self.neutral_angles + own[:, 3:6])
        rotation = quaternions(self.neutral_inverse @ turned)
        return location, rotation, 1.0 + self.space.scales(own[:, 6:9])


def make_joint_space(
    space: Space, neutral_angles: NDArray[np.float32], joints: Sequence[int]
) -> JointSpace:
    """Prepare the conversion of the chosen joints, see JointSpace.

    Args:
        space: the file's Space.
        neutral_angles: float32[J, 3] of all joints, file units.
        joints: indices of the joints to convert.
    """
    chosen = np.asarray(joints, np.int64)
    angles = np.asarray(neutral_angles, np.float64).reshape(-1, 3)[chosen]
    return JointSpace(space, chosen, angles, space.rotations(angles).transpose(0, 2, 1).copy())


def quaternion_product(a: Float, b: Float) -> Float:
    """Hamilton product of quaternions (w x y z): b is applied first."""
    w, v = a[..., :1], a[..., 1:]
    x, u = b[..., :1], b[..., 1:]
    return np.concatenate(
        [w * x - np.sum(v * u, axis=-1, keepdims=True), w * u + x * v + np.cross(v, u)], axis=-1
    )


def quaternion_matrix(q: Float) -> Float:
    """Unit quaternion (w x y z) to float64[3, 3]."""
    w, x, y, z = np.asarray(q, np.float64) / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_fraction(q: Float, fraction: float) -> Float:
    """The rotation q (w x y z) by only a part of its angle, the short way."""
    q = np.asarray(q, np.float64) / np.linalg.norm(q)
    q = -q if q[0] < 0 else q
    length = float(np.linalg.norm(q[1:]))
    if length < 1e-12:
        return np.array([1.0, 0.0, 0.0, 0.0])
    angle = np.arctan2(length, q[0]) * fraction
    return np.concatenate([[np.cos(angle)], q[1:] / length * np.sin(angle)])


def yaw_pitch(direction: Float) -> tuple[float, float]:
    """Angles of a direction from straight ahead (-y): yaw to the face's left (+x), pitch up."""
    x, y, z = (float(v) for v in direction)
    return float(np.arctan2(x, -y)), float(np.arctan2(z, np.hypot(x, y)))
