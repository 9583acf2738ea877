# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the values of blend shape channels and animated maps, which drivers of a character read.

Materials read the maps from one mesh of the character, the carrier.
"""

from __future__ import annotations

from collections.abc import Callable

import bpy
import numpy as np
from numpy.typing import NDArray

from ..base import compat, parts, saved
from ..base.blender_types import ArmatureObject, MeshObject
from ..material import materials


def write(
    rig: ArmatureObject,
    maps: NDArray[np.float32],
    channels: NDArray[np.float32],
    simulated: Callable[[bpy.types.Object], bool],
) -> None:
    """Write the values of channels and animated maps to a face.

    Args:
        rig: deforming armature; Blender is not notified of its change.
        maps: float32[M], values of the animated maps.
        channels: float32[C], values of the blend shape channels.
        simulated: function that returns whether tagging a mesh object would reset a simulation.
    """
    _fill(rig, parts.CHANNELS, channels)
    _fill(rig, parts.MAPS, maps)
    carrier = parts.carrier_of(rig)
    if carrier == rig or not _fill(carrier, parts.MAPS, maps):
        return
    if simulated(carrier):
        _fill_unheard(rig, carrier, maps)
    else:
        carrier.update_tag(refresh={"OBJECT"})


def _fill_unheard(
    rig: ArmatureObject, carrier: bpy.types.Object, maps: NDArray[np.float32]
) -> None:
    """Write maps to the evaluated copies of the carrier, and let Blender update the materials.

    The carrier is not tagged for an update, because the update would reset its simulation.
    """
    layers = (layer for scene in bpy.data.scenes for layer in scene.view_layers)
    for graph in (layer.depsgraph for layer in layers):
        seen = carrier.evaluated_get(graph) if graph is not None else carrier
        if seen.is_evaluated:
            _fill(seen, parts.MAPS, maps)
    for item in parts.meshes_of(rig):
        for slot in item.material_slots:
            if slot.material is not None and next(materials.map_drivers(slot.material), None):
                compat.tree_of(slot.material).update_tag()


def _fill(owner: bpy.types.Object, name: str, values: NDArray[np.float32]) -> bool:
    fits = len(values) > 0 and saved.length(owner, name) == len(values)
    if fits:
        owner[name][:] = values.tolist()
    return fits


def carry(rig: ArmatureObject, item: MeshObject) -> None:
    """Make a mesh of a character the carrier of its animated maps, which materials read.

    Args:
        rig: deforming armature.
        item: the mesh; Blender must evaluate it before drivers are pointed at it.
    """
    item.pop(parts.MAPS, None)  # the length of an overridable array cannot change
    item[parts.MAPS] = rig[parts.MAPS].to_list()
    item.property_overridable_library_set(f'["{parts.MAPS}"]', True)
    parts.point(rig, parts.VALUES, item)


def carry_on_largest(rig: ArmatureObject) -> None:
    """Make the mesh with most vertices the carrier of the maps.

    Args:
        rig: deforming armature.
    """
    items = [item for item in parts.meshes_of(rig) if item.library is None]
    if items and saved.length(rig, parts.MAPS):
        carry(rig, max(items, key=lambda item: len(item.data.vertices)))


def point_materials(rig: ArmatureObject, owner: bpy.types.Object) -> None:
    """Point the drivers of a character's materials at the object that stores the animated maps.

    Args:
        rig: deforming armature.
        owner: the deforming armature, or the mesh that carries the maps.
    """
    for item in parts.meshes_of(rig):
        for slot in item.material_slots:
            for curve in materials.map_drivers(slot.material):
                for variable in compat.driver_of(curve).variables:
                    for target in variable.targets:
                        if target.id != owner:
                            target.id = owner
