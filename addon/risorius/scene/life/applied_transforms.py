# SPDX-License-Identifier: GPL-3.0-or-later
"""Apply Transform (Ctrl-A) on a control armature is taken back: the face takes its place from it.

Blender moves what the object had into the bones, and the bones stay where they are. The face,
which follows the object, would jump back to its own size and place.
"""

from __future__ import annotations

import numpy as np
from mathutils import Matrix
from numpy.typing import NDArray

from ..base import parts
from ..base.blender_types import ArmatureObject

_NEAR = 1e-5  # of the largest number: what multiplying in float32 leaves

_noted: dict[
    int, tuple[NDArray[np.float64], NDArray[np.float64]]
] = {}  # session uid of a control armature -> its matrix and its bones, as last seen


def forget() -> None:
    """After load and undo: what was seen before says nothing about what is there."""
    _noted.clear()


def take_back(controls: ArmatureObject) -> list[str]:
    """Give a control armature back what was just applied to it.

    Args:
        controls: a control armature of this file.

    Returns:
        Sentences on what was done.
    """
    if controls.mode == "EDIT" or controls.data.library or controls.data.override_library:
        return []
    before, now = _noted.get(controls.session_uid), _seen(controls)
    _noted[controls.session_uid] = now
    if before is None or not _was_applied(before, now):
        return []
    old, new = (Matrix(matrix.tolist()) for matrix in (before[0], now[0]))
    back = old.inverted() @ new
    controls.data.transform(back)
    controls.matrix_basis = old
    for child in controls.children:
        if child.parent_type == "OBJECT" and child.library is None:
            child.matrix_parent_inverse = back @ child.matrix_parent_inverse
    controls.data.update_tag()
    _noted[controls.session_uid] = _seen(controls)
    return [
        f"{controls.name} was given back the transform that was applied to it: the face takes "
        "its size and place from the object."
    ]


def _seen(controls: ArmatureObject) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """float64[4, 4] the object's own matrix, float64[4, ends] of its control bones at rest."""
    bones = [bone for bone in controls.data.bones if parts.PART in bone]
    ends = [(*end, 1.0) for bone in bones for end in (bone.head_local, bone.tail_local)]
    return np.array(controls.matrix_basis), np.array(ends).reshape(-1, 4).T


def _was_applied(
    before: tuple[NDArray[np.float64], NDArray[np.float64]],
    now: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> bool:
    """Whether the object's matrix changed, and the bones are where they were."""
    (old, rests), (new, moved) = before, now
    if rests.shape != moved.shape or not rests.size or np.array_equal(old, new):
        return False
    if abs(np.linalg.det(old)) < 1e-12:  # flat: there is no way back
        return False
    stood, stands = old @ rests, new @ moved
    limit = _NEAR * np.abs(stood).max()
    return np.abs(stood - stands).max() <= limit and np.abs(rests - moved).max() > limit
