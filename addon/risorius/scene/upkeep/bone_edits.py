# SPDX-License-Identifier: GPL-3.0-or-later
"""Detects whether the bones of an armature were really edited.

The check is needed because a moved slider tags the armature as if its bones had changed.
"""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from ..base import parts, session

# Session uid of an armature -> (names, roles and joint indices of its bones; rest matrices).
_seen: dict[int, tuple[Sequence[object], bytes]] = session.table(
    "bone_edits.seen", ("undo", "load")
)


def is_edited(armature: bpy.types.Armature) -> bool:
    """Whether the bones of an armature changed since the last call; True at the first call.

    Args:
        armature: the original data of a deforming or a control armature.
    """
    bones = armature.bones
    marks = [(bone.name, bone.get(parts.PART), bone.get(parts.JOINT)) for bone in bones]
    places = np.empty(16 * len(bones), np.float32)
    bones.foreach_get("matrix_local", places)
    state = (marks, places.tobytes())
    if _seen.get(armature.session_uid) == state:
        return False
    _seen[armature.session_uid] = state
    return True
