# SPDX-License-Identifier: GPL-3.0-or-later
"""Gives a duplicated character its own materials, shape keys and drivers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import cast

import bpy

from ..base import compat, last_written, parts
from ..base.blender_types import ArmatureObject, MeshObject
from ..character import armatures, meshes
from ..material import materials
from ..skinning import ordinary


def separate_all() -> list[str]:
    """Give every duplicated character its own copies of shared data.

    Returns:
        Sentences about changes, for a report.
    """
    done = []
    for rig in parts.rigs():
        done += separate(rig)
    return done


def separate(rig: ArmatureObject) -> list[str]:
    """Give a character its own copies of shared data, and let drivers read its own properties.

    Args:
        rig: its deforming armature.

    Returns:
        Sentences about changes.
    """
    done = []
    controls = parts.controls_of(rig)
    if controls is not None and controls.get(parts.RIG) not in (rig, None):
        other = controls.get(parts.RIG)
        if isinstance(other, bpy.types.Object) and other.get(parts.CONTROLS) == controls:
            done.append(f"{rig.name} follows the controls of {other.name}.")
    if controls is not None and parts.PULL in rig and not rig.override_library:
        armatures.pull_controls(rig, controls)
    copied = {}
    strays = [m for m in parts.meshes_pointing_at(rig) if m not in parts.meshes_of(rig)]
    if any(parts.FINISHED in item for item in strays):
        ordinary.leave(rig)  # nothing writes positions to a mesh that the character does not list
    for item in parts.meshes_pointing_at(rig):
        done += _own_mesh(item)
        _own_key_drivers(item, rig)
        _own_materials(item, rig, copied)
        modifiers = cast("list[bpy.types.ArmatureModifier]", item.modifiers)
        modifier = next((m for m in modifiers if m.type == "ARMATURE"), None)
        if modifier is not None and modifier.object is None:
            modifier.object = rig
    if copied:
        done.append(f"{rig.name} was given materials of its own.")
    return done


def _own_mesh(item: MeshObject) -> list[str]:
    """Give a mesh object its own mesh datablock if another object uses its datablock too.

    Two faces cannot share a mesh datablock with shape keys.
    """
    if item.data.users < 2 or item.data.shape_keys is None:
        return []
    users = [o for o in bpy.data.objects if o.data == item.data]
    if len(users) < 2 or users[0] == item or item.library or item.data.library:
        return []
    if parts.FINISHED in item:
        ordinary.leave(item[parts.RIG])  # the other object may belong to no character
    item.data = item.data.copy()
    return [f"{item.name} was given a mesh of its own: two faces cannot share live shapes."]


def _retarget(curves: Iterable[bpy.types.FCurve], owner: bpy.types.Object) -> bool:
    changed = False
    for curve in curves:
        for variable in compat.driver_of(curve).variables:
            for target in variable.targets:
                if target.id != owner and variable.type == "SINGLE_PROP":
                    target.id = owner
                    changed = True
    return changed


def _own_key_drivers(item: MeshObject, rig: ArmatureObject) -> None:
    key = item.data.shape_keys
    if key is None or key.animation_data is None:
        return
    names = meshes.real_channels(item)
    paths = {f'key_blocks["{bpy.utils.escape_identifier(n)}"].value' for n in names}
    if _retarget([c for c in key.animation_data.drivers if c.data_path in paths], rig):
        last_written.forget()


def retarget_materials(item: MeshObject, rig: ArmatureObject) -> None:
    """Let the animated maps of a mesh's materials follow another rig.

    Args:
        item: the mesh object.
        rig: deforming armature whose maps the drivers will read.
    """
    for slot in item.material_slots:
        if slot.material is not None:
            _retarget(materials.map_drivers(slot.material), parts.carrier_of(rig))


def _own_materials(
    item: MeshObject, rig: ArmatureObject, copied: dict[str, bpy.types.Material]
) -> None:
    carrier = parts.carrier_of(rig)
    for slot in item.material_slots:
        material = slot.material
        if material is None:
            continue
        curves = list(materials.map_drivers(material))
        foreign = any(
            t.id != carrier
            for c in curves
            for v in compat.driver_of(c).variables
            for t in v.targets
        )
        if not foreign or not curves:
            continue
        # Materials are found by name, because a datablock cannot be hashed safely.
        if material.name not in copied:
            copied[material.name] = material.copy() if material.users > 1 else material
        own = copied[material.name]
        _retarget(materials.map_drivers(own), carrier)
        slot.material = own
        copied[own.name] = own
