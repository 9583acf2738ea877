# SPDX-License-Identifier: GPL-3.0-or-later
"""Hides and shows the outlines (custom shapes) of control bones, and places them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bpy

from ...logic.character import plans
from ..base import parts
from ..base.blender_types import ArmatureObject
from ..lod import lods
from . import armatures, bone_shapes, runtime


def are_hidden(controls: ArmatureObject) -> bool:
    """Whether the outlines of a control armature are hidden by `hide`."""
    return parts.OUTLINES in controls


def hide(controls: ArmatureObject) -> None:
    """Hide the outlines of the control bones by a scale of 0; the face board stays visible.

    The bones are not hidden, because Blender's editors leave out the keys of hidden bones.

    Args:
        controls: control armature of the face.
    """
    sizes = {part: bone.custom_shape_scale_xyz[:] for part, bone in _bones(controls)}
    if are_hidden(controls) or not sizes:
        return
    controls[parts.OUTLINES] = sizes
    for _part, bone in _bones(controls):
        bone.custom_shape_scale_xyz = (0.0, 0.0, 0.0)


def show(controls: ArmatureObject) -> None:
    """Show hidden outlines in their earlier sizes.

    Args:
        controls: control armature of the face.
    """
    held: Any = controls.get(parts.OUTLINES)
    sizes = held.to_dict() if hasattr(held, "to_dict") else {}
    for part, bone in _bones(controls):
        if not any(bone.custom_shape_scale_xyz[:]):  # otherwise the user has set a size
            bone.custom_shape_scale_xyz = sizes.get(part, (1.0, 1.0, 1.0))
    controls.pop(parts.OUTLINES, None)


def stand_beside(rig: ArmatureObject) -> int:
    """Place the outlines as on a newly imported face.

    On faces that older versions of the add-on imported, the outlines cover the eyes. Hidden
    outlines are shown. Sizes and positions that the user changed are lost.

    Args:
        rig: the character's deforming armature.

    Returns:
        The number of moved or scaled outlines.
    """
    controls, live = parts.controls_there(rig), runtime.there(rig)
    levels, unit = tuple(lods.built(rig)) or (0,), runtime.unit_of(rig)
    plan = plans.plan_character(live.dna, rig.name, levels, unit, live.rests)
    show(controls)
    room, moved = armatures.outline_room(plan), 0
    for part, bone in _bones(controls):
        if part in bone_shapes.PLACED and not bone_shapes.is_placed(bone, part, room):
            bone_shapes.place(bone, part, room)
            moved += 1
    return moved


def _bones(controls: ArmatureObject) -> Iterator[tuple[str, bpy.types.PoseBone]]:
    """(role such as "head", bone) of each control bone with an outline."""
    for bone in controls.pose.bones:
        part = bone.bone.get(parts.PART)
        if isinstance(part, str) and bone.custom_shape is not None:
            yield part, bone


def tidy(controls: ArmatureObject) -> int:
    """Remove the custom shape objects of the bones from all collections.

    Blender's Append puts each object without a collection into the scene, where it would be visible
    at the origin.

    Args:
        controls: control armature of an appended face.

    Returns:
        The number of objects that were removed from collections.
    """
    # Pose bones of a newly appended object may lack their Bone, so names come from the armature.
    names = {b.name for b in controls.data.bones if parts.PART in b or parts.BOARD in b}
    ours = (bone for bone in controls.pose.bones if bone.name in names)
    shapes = {shape for shape in (bone.custom_shape for bone in ours) if shape is not None}
    left = 0
    for shape in shapes:
        homes = [c for c in shape.users_collection if c.library is None]
        for home in homes:
            home.objects.unlink(shape)
        left += bool(homes)
    return left
