# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the head and the face that the user has selected."""

from __future__ import annotations

from typing import cast

from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..base import parts
from ..base.blender_types import ArmatureObject, Context, MeshObject
from ..file import shape_key_head
from . import points


def head_of(context: Context) -> MeshObject | None:
    """The head of a selected landmark, a selected mesh with landmarks, the active mesh, or the
    selected mesh with most vertices, in this order. Meshes of imported faces and meshes without
    polygons do not count; None if no other mesh is selected.

    Args:
        context: has the selection.
    """
    there = [item for item in (context.active_object, *context.selected_objects) if item]
    for item in there:
        above = points.head_of(item)
        if above is not None and shape_key_head.is_plain(above):
            return above
    plain = [cast(MeshObject, item) for item in there if shape_key_head.is_plain(item)]
    marked = next((item for item in plain if points.of(item)), None)
    if marked is not None or not plain:
        return marked
    if plain[0] == context.active_object:
        return plain[0]
    return max(plain, key=lambda item: len(item.data.vertices))


def face_of(context: Context) -> ArmatureObject | None:
    """The face to which selected objects belong; without such objects the scene's only face.

    None if the selected objects belong to several faces, or if the scene has no face or several.

    Args:
        context: has the selection.
    """
    chosen = {parts.rig_of(item) for item in (context.active_object, *context.selected_objects)}
    rigs = [rig for rig in chosen if rig is not None]
    if not rigs:
        rigs = [rig for rig in parts.rigs() if context.scene in rig.users_scene]
    return rigs[0] if len(rigs) == 1 else None


def face_there(context: Context) -> ArmatureObject:
    """The selected face, or the only face of the scene.

    Args:
        context: has the selection.

    Raises:
        FaceError: several faces are selected, or none is selected and the scene does not have
            exactly one face.
    """
    rig = face_of(context)
    if rig is None:
        raise FaceError(told("Select the head and one face."))
    return rig
