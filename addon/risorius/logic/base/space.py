# SPDX-License-Identifier: GPL-3.0-or-later
"""Conversion of coordinates and units between DNA files and Blender.

Blender's axes are right-handed: z is up, a face looks along -y, the face's left is +x. A Blender
unit is `unit_scale` metres.

Column vectors: v' = scale * axes @ v. A rotation M becomes axes @ M @ axes^T, which is a rotation
also if `axes` mirrors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from .errors import FaceError
from .sentences import told

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


class SpaceError(FaceError):
    """Axes or units of a file cannot be converted; the text is one sentence for users."""


@dataclass(frozen=True)
class Space:
    """The conversion from one file's coordinates and units to Blender's.

    Attributes:
        axes: float64[3, 3], columns are the file's x, y and z axes in Blender's axes.
        scale: Blender units per file unit.
        radians: radians per file angle unit.
        sequence: axis numbers in the order in which rotations are applied.
        signs: float64[3], +1 or -1 per Euler angle.
        flip_faces: True: the order of the corners of each face must be reversed.
    """

    axes: Float
    scale: float
    radians: float
    sequence: tuple[int, int, int]
    signs: Float
    flip_faces: bool

    def points(self, values: NDArray[np.float32] | Float) -> Float:
        """Convert positions, offsets or deltas, float[n, 3], from file units to Blender units."""
        return np.asarray(values, np.float64) @ (self.axes.T * self.scale)

    def directions(self, values: NDArray[np.float32] | Float) -> Float:
        """Convert normals, float[n, 3], to Blender's axes; their lengths stay."""
        return np.asarray(values, np.float64) @ self.axes.T

    def rotations(self, angles: NDArray[np.float32] | Float) -> Float:
        """Convert Euler angles of the file, float[n, 3], to rotation matrices float64[n, 3, 3]."""
        matrices = euler_matrices(
            np.asarray(angles, np.float64) * self.radians * self.signs, self.sequence
        )
        return self.axes @ matrices @ self.axes.T

    def file_points(self, values: NDArray[np.float32] | Float) -> Float:
        """The inverse of `points`: float[n, 3], from Blender units to file units."""
        return np.asarray(values, np.float64) @ self.axes / self.scale

    def file_rotations(self, matrices: Float, near: Float) -> Float:
        """The inverse of `rotations`: float64[n, 3, 3] to Euler angles of the file, float64[n, 3].

        Args:
            matrices: rotations in Blender's axes.
            near: float64[n, 3], angles in the file's unit. Of all equivalent angles, the angles
                nearest to `near` are returned.
        """
        turned = self.axes.T @ matrices @ self.axes
        units = self.radians * self.signs
        return euler_angles(turned, self.sequence, np.asarray(near, np.float64) * units) / units

    @property
    def delta_matrix(self) -> NDArray[np.float32]:
        """float32[3, 3]: the matrix that converts a shape delta from the file's axes and units to
        Blender's.
        """
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
    """Make the Space of a file from the conventions in its descriptor.

    Args:
        coordinate_system: directions of the file's x, y and z axes.
        translation_unit: "cm" or "m".
        rotation_unit: "degrees" or "radians".
        rotation_sequence: order of rotations such as "xyz", the first one first.
        rotation_signs: sign of the rotation about each axis; below 0 means that it is reversed.
        face_winding_order: "ccw" or "cw".
        unit_scale: metres per Blender unit of the scene.

    Returns:
        The Space of the file in the scene.

    Raises:
        SpaceError: unknown word, or axes that lie in one plane.
    """
    for what, word, known in (
        ("translation unit", translation_unit, tuple(_METRES)),
        ("rotation unit", rotation_unit, ("degrees", "radians")),
        ("rotation sequence", rotation_sequence, _SEQUENCES),
        ("face winding order", face_winding_order, ("ccw", "cw")),
    ):
        if word not in known:
            raise SpaceError(
                told(
                    "The file's {what} {word!r} is not one of {known}.",
                    what=what,
                    word=word,
                    known=", ".join(known),
                )
            )
    axes = _axes(coordinate_system)
    return Space(
        axes=axes,
        scale=_METRES[translation_unit] / (unit_scale or 1.0),
        radians=np.pi / 180.0 if rotation_unit == "degrees" else 1.0,
        sequence=tuple("xyz".index(c) for c in rotation_sequence),  # type: ignore[arg-type]
        signs=np.where(np.asarray(rotation_signs, np.float64) < 0, -1.0, 1.0),
        flip_faces=(face_winding_order == "cw") != bool(np.linalg.det(axes) < 0),
    )


def _axes(coordinate_system: Sequence[str]) -> Float:
    """float64[3, 3]: the columns are the file's axes in Blender's axes. Raises: SpaceError."""
    if any(word not in _DIRECTIONS for word in coordinate_system):
        raise SpaceError(
            told(
                "The file's axes {coordinate_system} are not directions.",
                coordinate_system=tuple(coordinate_system),
            )
        )
    axes = np.array([_DIRECTIONS[word] for word in coordinate_system]).T
    if abs(np.linalg.det(axes)) < 0.5:
        raise SpaceError(
            told(
                "The file's axes {coordinate_system} lie in one plane: three independent "
                "directions were expected.",
                coordinate_system=tuple(coordinate_system),
            )
        )
    return axes


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
    """The inverse of `euler_matrices`: the angles of rotation matrices.

    Args:
        matrices: float64[n, 3, 3] rotations for column vectors.
        sequence: three axis numbers; sequence[0] is applied first.
        near: float64[n, 3] radians; of all equivalent angles, the nearest to these are returned.

    Returns:
        float64[n, 3] radians about x, y and z.
    """
    i, j, k = sequence
    sign = 1.0 if (j - i) % 3 == 1 else -1.0  # even or odd permutation of the axes
    m = matrices
    flat = np.hypot(m[:, i, i], m[:, j, i])  # the cosine of the middle angle
    result = np.empty((len(m), 3))
    for n in range(len(m)):
        middle = np.arctan2(-sign * m[n, k, i], flat[n])
        if flat[n] > 1e-7:
            first = np.arctan2(sign * m[n, k, j], m[n, k, k])
            last = np.arctan2(sign * m[n, j, i], m[n, i, i])
        else:  # gimbal lock: take the first angle from `near` and solve for the last
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


def world_matrices(rotations: Float, offsets: Float, parents: NDArray[np.uint16]) -> Float:
    """Combine parent-relative rotations and offsets into world matrices.

    Args:
        rotations: float64[J, 3, 3] parent-relative.
        offsets: float64[J, 3] parent-relative.
        parents: int[J], parent of each joint; a root is its own parent.

    Returns:
        float64[J, 4, 4]. Parents may have higher indices than their children.
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


class Direction(Protocol):
    """Three numbers, x, y and z: an array, or a vector of another library."""

    def __getitem__(self, axis: int, /) -> float: ...


def yaw_pitch(direction: Direction | Float) -> tuple[float, float]:
    """Angles of a direction from straight ahead (-y): yaw to the face's left (+x), pitch up.

    Args:
        direction: x, y, z of any length except 0.

    Returns:
        Yaw and pitch in radians.
    """
    x, y, z = float(direction[0]), float(direction[1]), float(direction[2])
    return float(np.arctan2(x, -y)), float(np.arctan2(z, np.hypot(x, y)))
