# SPDX-License-Identifier: MIT
"""Converts coordinate systems with matrices in double precision.

It shares no code with the native module.
"""

import itertools
from dataclasses import dataclass

import numpy as np

DIRECTIONS = {
    "left": (-1, 0, 0),
    "right": (1, 0, 0),
    "up": (0, 1, 0),
    "down": (0, -1, 0),
    "front": (0, 0, 1),
    "back": (0, 0, -1),
}
PAIRS = (("left", "right"), ("up", "down"), ("front", "back"))
ALL_AXES = [axes for order in itertools.permutations(PAIRS) for axes in itertools.product(*order)]
ALL_SEQUENCES = ["xyz", "xzy", "yxz", "yzx", "zxy", "zyx"]
ALL_SIGNS = list(itertools.product((1, -1), repeat=3))


@dataclass(frozen=True)
class System:
    """Axes, rotations and units of a file, with the values that Dna uses."""

    coordinate_system: tuple = ("right", "up", "front")
    rotation_sequence: str = "xyz"
    rotation_signs: tuple = (1, 1, 1)
    face_winding_order: str = "ccw"
    translation_unit: str = "cm"
    rotation_unit: str = "degrees"

    def arguments(self):
        """The system as keyword arguments of Dna.convert."""
        fields = dict(self.__dict__)
        fields["axes"] = fields.pop("coordinate_system")
        return fields


def system_of(dna):
    """The coordinate system of a Dna."""
    return System(**{name: getattr(dna, name) for name in System.__dataclass_fields__})


def random_system(rng):
    """A random choice of axes, rotation sequence, rotation signs, winding order and units."""
    return System(
        ALL_AXES[rng.integers(48)],
        ALL_SEQUENCES[rng.integers(6)],
        ALL_SIGNS[rng.integers(8)],
        *(pair[rng.integers(2)] for pair in (("ccw", "cw"), ("cm", "m"), ("degrees", "radians"))),
    )


def change(source, target):
    """The matrix C that converts row vectors from source axes to target axes, float64[3, 3]."""
    rows = [np.array([DIRECTIONS[a] for a in s.coordinate_system], float) for s in (source, target)]
    return rows[0] @ rows[1].T


def scale_of_unit(source, target):
    """The factor that converts lengths from the source's unit to the target's unit."""
    centimetres = {"cm": 1.0, "m": 100.0}
    return centimetres[source.translation_unit] / centimetres[target.translation_unit]


def radians(system, angles):
    """Convert a file's angles to radians about the system's axes, with rotation signs applied."""
    unit = np.pi / 180 if system.rotation_unit == "degrees" else 1.0
    return np.asarray(angles, float) * system.rotation_signs * unit


def rotation(system, angles):
    """Rotation matrices for row vectors [..., 3, 3] of angles of a file [..., 3]."""
    angles = radians(system, angles)
    out = np.broadcast_to(np.eye(3), (*angles.shape, 3))
    for name in system.rotation_sequence:
        axis = "xyz".index(name)
        c, s = np.cos(angles[..., axis]), np.sin(angles[..., axis])
        step = np.zeros((*angles.shape, 3))
        step[..., axis, axis] = 1
        a, b = {0: (1, 2), 1: (2, 0), 2: (0, 1)}[axis]
        step[..., a, a] = step[..., b, b] = c
        step[..., a, b], step[..., b, a] = s, -s
        out = out @ step
    return out


def mapped_rotation(c, matrices):
    """Rotation matrices R converted to the target axes: transpose(C) R C; `c` is from change()."""
    return c.T @ matrices @ c


def order_stays(source, target):
    """Whether both systems rotate about the same axes in the same order.

    Then each angle of one system corresponds to one angle of the other system.
    """
    c = change(source, target)
    moved = ["xyz"[int(np.argmax(np.abs(c["xyz".index(a)])))] for a in source.rotation_sequence]
    return "".join(moved) == target.rotation_sequence


def local_matrices(dna, deltas=None):
    """Joint matrices relative to the parents, float64[joints, 4, 4]: scale, rotate, translate.

    deltas: float[joints, 9], added to the neutral pose, in the file's units; None: neutral pose.
    """
    system = system_of(dna)
    translations = np.asarray(dna.neutral_joint_translations, float)
    angles = np.asarray(dna.neutral_joint_rotations, float)
    scales = np.ones_like(translations)
    if deltas is not None:
        deltas = np.asarray(deltas, float)
        translations = translations + deltas[:, :3]
        angles = angles + deltas[:, 3:6]
        scales = scales + deltas[:, 6:]
    out = np.zeros((len(translations), 4, 4))
    out[:, :3, :3] = scales[:, :, None] * rotation(system, angles)
    out[:, 3, :3] = translations
    out[:, 3, 3] = 1
    return out


def world_matrices(dna, deltas=None):
    """World matrices of joints, float64[joints, 4, 4]; a parent's index may exceed its child's."""
    local = local_matrices(dna, deltas)
    parents = np.asarray(dna.joint_parents)
    world = [None] * len(local)

    def solve(joint):
        if world[joint] is None:
            parent = int(parents[joint])
            world[joint] = local[joint] if parent == joint else local[joint] @ solve(parent)
        return world[joint]

    for joint in range(len(local)):
        solve(joint)
    return np.array(world).reshape(-1, 4, 4)


def mapped_world(source, target, matrices):
    """World matrices M in the target system: inverse(C) M C, lengths in the target's unit."""
    c = np.eye(4)
    c[:3, :3] = change(source, target)
    out = np.linalg.inv(c) @ matrices @ c
    out[:, 3, :3] *= scale_of_unit(source, target)
    return out
