# SPDX-License-Identifier: GPL-3.0-or-later
"""What was last written to the objects of characters: what is unchanged is not written again.

All of it is keyed by session uids, so that no Blender object is kept.
"""

from __future__ import annotations

import bpy

inputs: dict[int, object] = {}  # deforming armature -> what its face was last evaluated from
places: dict[int, object] = {}  # deforming armature -> bytes of the matrix that was last written
weights: dict[int, object] = {}  # shape key -> bytes of the channel weights of its sum
# Deforming armature -> the Writer of frame/bone_writer.py, until its bones change.
bone_writers: dict[int, object] = {}
# Deforming armature -> the Reading of frame/joint_readings.py, until the file is edited. Kept by
# `forget`: it knows what the console was told.
readings: dict[int, object] = {}
unheard: set[int] = set()  # shape keys whose points were last written without an update
_refused: set[int] = set()  # objects of overrides that Blender lets nobody write to


def is_new(kept: dict[int, object], item: bpy.types.ID, state: object) -> bool:
    """Whether a state differs from the one that is kept of a datablock; it is kept from now on.

    Args:
        kept: `inputs`, `places` or `weights`.
        item: the datablock.
        state: anything that compares.
    """
    if kept.get(item.session_uid) == state:
        return False
    kept[item.session_uid] = state
    return True


def note_refusal(item: bpy.types.ID, taken: bool) -> None:
    """Note whether Blender took what was written to an object: it refuses without a word.

    Args:
        item: the object.
        taken: whether it has now what was written.
    """
    if taken:
        _refused.discard(item.session_uid)
    else:
        _refused.add(item.session_uid)


def is_refused(item: bpy.types.ID) -> bool:
    """Whether Blender refused what was last written to an object."""
    return item.session_uid in _refused


def forget() -> None:
    """Let the next evaluation write everything: after undo, load and changes of shape mode."""
    for kept in (inputs, places, weights, bone_writers):
        kept.clear()
    unheard.clear()
    _refused.clear()
