# SPDX-License-Identifier: MIT
"""Computes joint positions in the neutral pose, and axes in which the face looks at the viewer.

Vectors are rows, as everywhere in DNA files: v' = v * M.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import risorius
from risorius.rigs.rotation import Convention

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

# Direction of a file axis -> its unit vector (right, up, front) in view axes: x to the viewer's
# right, y up, z towards the viewer.
_DIRECTIONS = {
    "left": (-1, 0, 0),
    "right": (1, 0, 0),
    "up": (0, 1, 0),
    "down": (0, -1, 0),
    "front": (0, 0, 1),
    "back": (0, 0, -1),
}


def view_axes(dna: risorius.Dna) -> Floats:
    """float64[3, 3]: maps file axes to (right, up, front), as point @ matrix."""
    matrix = np.array([_DIRECTIONS.get(a, (0, 0, 0)) for a in dna.coordinate_system], float)
    # If the file's axes are not independent, x right, y up, z front is the best guess.
    return matrix if abs(np.linalg.det(matrix)) > 0.5 else np.eye(3)


def rotations(dna: risorius.Dna) -> Floats:
    """float64[J, 3, 3]: neutral rotation of each joint relative to its parent, for row vectors."""
    convention = Convention.of(dna)
    angles = _rows(dna.neutral_joint_rotations, len(dna.joint_names))
    angles = angles * convention.radians * convention.signs
    product = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for axis in convention.order:
        product = product @ _about(axis, angles[:, axis])
    return np.asarray(product)


def _rows(values: npt.NDArray[np.float32], count: int) -> Floats:
    """float64[count, 3]: the values, three per row; 0 for missing rows and for values that are not
    finite."""
    rows = np.zeros((count, 3))
    given = np.asarray(values, float).reshape(-1, 3)[:count]
    rows[: len(given)] = np.nan_to_num(given, posinf=0.0, neginf=0.0)
    return rows


def _about(axis: int, angles: Floats) -> Floats:
    """float64[J, 3, 3]: rotations about one axis by angles in radians."""
    one, two = (axis + 1) % 3, (axis + 2) % 3
    turn = np.zeros((len(angles), 3, 3))
    turn[:, axis, axis] = 1
    turn[:, one, one] = turn[:, two, two] = np.cos(angles)
    turn[:, one, two], turn[:, two, one] = np.sin(angles), -np.sin(angles)
    return turn


def parents(dna: risorius.Dna) -> Ints:
    """int64[J]: parents; a joint without a valid parent is its own parent, like a root."""
    count = len(dna.joint_names)
    own = np.arange(count)
    found = np.asarray(dna.joint_parents, np.int64)[:count]
    full = own.copy()
    full[: len(found)] = found
    return np.where(full < count, full, own)


def world_positions(dna: risorius.Dna) -> Floats:
    """float64[J, 3]: joint positions in the neutral pose, in file units and file axes."""
    above = parents(dna)
    positions, turns = _rows(dna.neutral_joint_translations, len(above)), rotations(dna)
    done = above == np.arange(len(above))
    while not done.all():
        # All joints at the same depth are computed at once. This takes few rounds, because a face's
        # hierarchy is wide and shallow.
        ready = ~done & done[above]
        if not ready.any():
            break  # parents form a cycle: their joints keep local positions
        up = above[ready]
        positions[ready] = np.einsum("ni,nij->nj", positions[ready], turns[up]) + positions[up]
        turns[ready] = turns[ready] @ turns[up]
        done |= ready
    return positions
