# SPDX-License-Identifier: GPL-3.0-or-later
"""Remembers the last values written to objects of characters, to skip unchanged values.

The tables have session uids as keys, so that no Blender object is kept.
"""

from __future__ import annotations

import bpy

from . import session

# Session uid of a deforming armature -> inputs of the last evaluation of its face.
inputs: dict[int, object] = session.table("last_written.inputs", ("rewrite", "undo", "load"))
# Session uid of a deforming armature -> bytes of the object matrix that was last written to it.
places: dict[int, object] = session.table("last_written.places", ("rewrite", "undo", "load"))
# Session uid of a Key datablock -> bytes of the channel weights from which its live shape key (the
# sum of all channels) was last computed.
weights: dict[int, object] = session.table("last_written.weights", ("rewrite", "undo", "load"))
# Session uid of a deforming armature -> the object of class Writer (skinning/bone_writer.py) that
# writes the armature's bones.
bone_writers: dict[int, object] = session.table(
    "last_written.bone_writers", ("rewrite", "undo", "load")
)
# Session uid of a deforming armature -> the armature's object of class Reading, see
# frame/joint_readings.py. Undo keeps the table, because a Reading stores which messages were
# printed.
readings: dict[int, object] = session.table("last_written.readings", ("load",))
# Session uids of Key datablocks whose points were last written without notifying Blender.
unheard: set[int] = session.keep("last_written.unheard", set, ("rewrite", "undo", "load"))
# Session uids of objects on which Blender ignored the last write, such as linked objects without an
# override.
_refused: set[int] = session.keep("last_written.refused", set, ("rewrite", "undo", "load"))


def is_new(kept: dict[int, object], item: bpy.types.ID, state: object) -> bool:
    """Store the state of a datablock, and return whether it differs from the state stored before.

    Args:
        kept: table of states: `inputs`, `places` or `weights`.
        item: the datablock.
        state: any value that supports ==.
    """
    if kept.get(item.session_uid) == state:
        return False
    kept[item.session_uid] = state
    return True


def note_refusal(item: bpy.types.ID, taken: bool) -> None:
    """Record whether Blender accepted a write to an object, because Blender reports no refusal.

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
    """Clear the stored values, so that the next evaluation writes all values."""
    session.end("rewrite")
