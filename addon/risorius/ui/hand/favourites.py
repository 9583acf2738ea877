# SPDX-License-Identifier: GPL-3.0-or-later
# Blender defines properties by annotations. A type checker would report that these annotations
# are no types, so this check is off in this file:
# pyright: reportInvalidTypeForm=false
"""Favourite sliders, and the operator of the star next to a slider."""

from typing import Any

import bpy

from ... import native
from ...scene.hand import favourites
from ..blender_types import Context, Operator, Result
from ..common import FaceOperator, face_controls


def _preferences(context: Context) -> Any:  # noqa: ANN401  importing the class would be circular
    addon = context.preferences.addons.get(native.ADDON)
    return addon.preferences if addon is not None else None


def favourites_of(context: Context) -> list[str]:
    """The names of the active face's favourite sliders.

    If the face has no list of its own, the list of the add-on's preferences is used.
    """
    users = getattr(_preferences(context), "favourites", "")
    return favourites.of(face_controls(context), users)


class RISORIUS_OT_favourite(FaceOperator, Operator):
    """Add a control to the favourites, or remove it"""

    bl_idname = "risorius.favourite"
    bl_label = "Favourite"
    baked_too = True

    controls: bpy.props.StringProperty(
        name="Controls", description="Names of sliders, one in each line", options={"SKIP_SAVE"}
    )

    def execute(self, context: Context) -> Result:
        kept = _preferences(context)
        names = self.controls.split("\n")
        now = favourites.toggle(face_controls(context), names, getattr(kept, "favourites", ""))
        if kept is not None:
            kept.favourites = now
            context.preferences.is_dirty = True
        return {"FINISHED"}


CLASSES = (RISORIUS_OT_favourite,)
