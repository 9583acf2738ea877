# SPDX-License-Identifier: GPL-3.0-or-later
"""The last values written to objects of characters; unchanged values are not written again.

Keys are session uids, so that no Blender object is kept.
"""

from __future__ import annotations

import bpy

from . import session

# Deforming armature -> inputs of the last evaluation of its face.
inputs: dict[int, object] = session.table("last_written.inputs", ("rewrite", "undo", "load"))
# Deforming armature -> bytes of the matrix that was last written.
places: dict[int, object] = session.table("last_written.places", ("rewrite", "undo", "load"))
# Shape key -> bytes of the channel weights of its sum.
weights: dict[int, object] = session.table("last_written.weights", ("rewrite", "undo", "load"))
# Deforming armature -> the Writer of frame/bone_writer.py, until its bones change.
bone_writers: dict[int, object] = session.table(
    "last_written.bone_writers", ("rewrite", "undo", "load")
)
# Deforming armature -> the Reading of frame/joint_readings.py, until the file is edited. Undo keeps
# it, because it remembers messages on the console.
readings: dict[int, object] = session.table("last_written.readings", ("load",))
# Shape keys whose points were last written without notifying Blender.
unheard: set[int] = session.keep("last_written.unheard", set, ("rewrite", "undo", "load"))
# Objects of overrides that Blender does not let anyone write to.
_refused: set[int] = session.keep("last_written.refused", set, ("rewrite", "undo", "load"))


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
    """Note whether Blender accepted a write to an object; it refuses silently.

    Args:
        item: the object.
        taken: whether the object has the written value.
    """
    if taken:
        _refused.discard(item.session_uid)
    else:
        _refused.add(item.session_uid)


def is_refused(item: bpy.types.ID) -> bool:
    """Whether Blender refused the last write to an object."""
    return item.session_uid in _refused


def forget() -> None:
    """Let the next evaluation write everything: after undo, load and changes of shape mode."""
    session.end("rewrite")
