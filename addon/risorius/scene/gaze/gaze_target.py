# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets the eyes' target follow the head, the world, or an object such as the camera."""

from __future__ import annotations

from typing import cast

import bpy

from ..base import parts
from ..base.blender_types import ArmatureObject, Context
from .gaze import CONSTRAINT

_OWN = "risorius_gaze"  # custom property of an Empty that `follow_world` made


def holder_of(controls: ArmatureObject) -> bpy.types.Object | None:
    """The object that the eyes' target follows, or None if the target follows the head."""
    hold = _hold_of(controls)
    return hold.target if hold is not None else None


def is_own(holder: bpy.types.Object) -> bool:
    """Whether an object is an Empty that `follow_world` made to hold a target."""
    return holder.get(_OWN) is not None


def _hold_of(controls: ArmatureObject) -> bpy.types.CopyLocationConstraint | None:
    bone = controls.pose.bones.get("eyes")
    hold = bone.constraints.get(CONSTRAINT) if bone is not None else None
    if hold is None or hold.type != "COPY_LOCATION":
        return None
    return cast("bpy.types.CopyLocationConstraint", hold)


def follow_head(context: Context, controls: ArmatureObject) -> None:
    """Let the target follow the head again; the target stays at its visible position.

    An Empty that `follow_world` made for this target is removed.

    Args:
        context: Blender context; its depsgraph has the evaluated bones.
        controls: control armature of the character.
    """
    hold, bone = _hold_of(controls), controls.pose.bones["eyes"]
    if hold is None:
        return
    seen = controls.evaluated_get(context.evaluated_depsgraph_get())
    shown = seen.pose.bones["eyes"]
    place = seen.convert_space(
        pose_bone=shown, matrix=shown.matrix, from_space="POSE", to_space="LOCAL"
    ).translation
    holder = hold.target
    bone.constraints.remove(hold)
    bone.location = place
    if holder is not None and holder.get(_OWN) == controls:
        bpy.data.objects.remove(holder)
    controls.update_tag()


def follow_object(context: Context, controls: ArmatureObject, item: bpy.types.Object) -> None:
    """Let the eyes look at an object.

    Args:
        context: Blender context; its depsgraph has the evaluated bones.
        controls: control armature of the character.
        item: an object outside the character.
    """
    follow_head(context, controls)
    hold = controls.pose.bones["eyes"].constraints.new("COPY_LOCATION")
    hold.name = CONSTRAINT
    cast("bpy.types.CopyLocationConstraint", hold).target = item
    controls.update_tag()


def follow_world(context: Context, controls: ArmatureObject) -> bpy.types.Object:
    """Fix the target in the world with a movable Empty.

    Args:
        context: Blender context; its scene gets the Empty if the armature is in no collection.
        controls: control armature of the character.

    Returns:
        The Empty.
    """
    seen = controls.evaluated_get(context.evaluated_depsgraph_get())
    place = seen.matrix_world @ seen.pose.bones["eyes"].matrix.translation
    rig = parts.rig_of(controls)
    assert rig is not None
    name = rig.name.removesuffix("_rig")
    holder = bpy.data.objects.new(f"{name}_gaze", None)
    holder.empty_display_type = "SPHERE"
    holder.empty_display_size = controls.data.bones["eyes"].length * 0.3
    holder.location = place
    parts.point(holder, _OWN, controls)
    collections = controls.users_collection or (context.scene.collection,)
    collections[0].objects.link(holder)
    context.view_layer.update()
    follow_object(context, controls, holder)
    return holder
