# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes drivers that read a character's properties, and finds the drivers of a .blend file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

import bpy

from ...logic.base import names
from . import compat, parts
from .blender_types import ArmatureObject

_ENTRY = re.compile(r'^\["(channels|maps)"\]\[(\d+)\]$')
_GONE = re.compile(r'^\["(gone (channels|maps): .*)"\]$')
# Types of datablocks that contain a node tree; scenes have one up to Blender 4.5.
_WITH_NODES = (
    bpy.types.Material,
    bpy.types.World,
    bpy.types.Light,
    bpy.types.Scene,
    bpy.types.Texture,
    bpy.types.FreestyleLineStyle,
)


def owners() -> Iterator[bpy.types.ID]:
    """Every datablock of this .blend, and the node trees inside datablocks.

    Each driver of the .blend belongs to one of the results. Some of the results cannot have
    drivers.
    """
    for kind in bpy.data.bl_rna.properties:
        if kind.type != "COLLECTION":
            continue
        for item in getattr(bpy.data, kind.identifier):
            if not isinstance(item, bpy.types.ID):
                continue
            yield item
            inner = getattr(item, "node_tree", None) if isinstance(item, _WITH_NODES) else None
            if inner is not None:
                yield inner


def targets_at(item: bpy.types.ID) -> Iterator[tuple[bpy.types.ID, bpy.types.DriverTarget]]:
    """(datablock with the driver, driver target) for all targets that point at a datablock."""
    for owner in owners():
        data = getattr(owner, "animation_data", None)
        for curve in data.drivers if data else ():
            for variable in curve.driver.variables:
                for target in variable.targets:
                    if target.id == item:
                        yield owner, target


class Entries:
    """Redirects drivers that read a blend shape channel or an animated map by its index.

    This is needed if another DNA file gives the channels and maps other indices.

    Args:
        rig: deforming armature.
        labels: "channels" and "maps" -> (labels in the old order, labels in the new order).

    Attributes:
        gone: old labels of channels and maps that drivers read and the new order lacks.
    """

    def __init__(
        self, rig: ArmatureObject, labels: Mapping[str, tuple[Sequence[str], Sequence[str]]]
    ) -> None:
        self._moves: list[tuple[bpy.types.DriverTarget, str]] = []
        self.gone: list[str] = []
        carrier = parts.carrier_of(rig)
        there = [target for _owner, target in targets_at(rig)]
        there += [target for _owner, target in targets_at(carrier) if carrier != rig]
        for target in there:
            found = self._label(target.data_path, labels)
            if found is None:
                continue
            array, label = found
            if label in labels[array][1]:
                path = f'["{array}"][{labels[array][1].index(label)}]'
            else:
                path = self._stand_in(target, array, label)
            if path != target.data_path:
                self._moves.append((target, path))

    def _label(
        self, path: str, labels: Mapping[str, tuple[Sequence[str], Sequence[str]]]
    ) -> tuple[str, str] | None:
        entry, gone = _ENTRY.match(path), _GONE.match(path)
        if entry and int(entry.group(2)) < len(labels[entry.group(1)][0]):
            return entry.group(1), labels[entry.group(1)][0][int(entry.group(2))]
        if gone:  # an earlier change removed the label; the new file may have it again
            array, key = gone.group(2), bpy.utils.unescape_identifier(gone.group(1))
            back = next((x for x in labels[array][1] if _gone_key(array, x) == key), None)
            return (array, back) if back is not None else None
        return None

    def _stand_in(self, target: bpy.types.DriverTarget, array: str, label: str) -> str:
        """Data path of a property with value 0 that replaces a removed channel or map.

        Drivers that read the removed channel or map stay valid with this path.

        Args:
            target: a driver target that reads the channel or map.
            array: "channels" or "maps".
            label: label of the removed channel or map.
        """
        key = _gone_key(array, label)
        assert target.id is not None
        target.id[key] = 0.0
        if label not in self.gone:
            self.gone.append(label)
        return f'["{bpy.utils.escape_identifier(key)}"]'

    def move(self) -> None:
        """Write the new data paths to drivers; Blender must have evaluated the new properties."""
        for target, path in self._moves:
            target.data_path = path


def _gone_key(array: str, label: str) -> str:
    return names.cut(f"gone {array}: {label}")


def moves(owner: bpy.types.Object) -> bool:
    """Whether an object has an action, an NLA track, or a driver of the user.

    The add-on's driver of the property PULL does not count.
    """
    data = owner.animation_data
    return data is not None and bool(
        data.action
        or data.nla_tracks
        or any(c.data_path != f'["{parts.PULL}"]' for c in data.drivers)
    )


def used_controls(controls: ArmatureObject, labels: Sequence[str]) -> set[str]:
    """The control properties that an F-curve of any action moves or a driver sets or reads.

    Args:
        controls: control armature.
        labels: names of the properties to look for.
    """
    paths = {parts.property_path(label): label for label in labels}
    used = {
        paths[curve.data_path]
        for action in bpy.data.actions
        for curve in compat.curves_of(action)
        if curve.data_path in paths
    }
    data = controls.animation_data
    used.update(paths[c.data_path] for c in (data.drivers if data else ()) if c.data_path in paths)
    used.update(paths[t.data_path] for _owner, t in targets_at(controls) if t.data_path in paths)
    return used


def plain_driver(
    curve: bpy.types.FCurve, owner: bpy.types.Object, data_path: str, name: str = "var"
) -> None:
    """Set up a driver that copies one property of an object, without an expression.

    Args:
        curve: F-curve of a new driver without variables.
        owner: the object with the property.
        data_path: path from the object to one number.
        name: name of the driver's variable.
    """
    driver = curve.driver
    assert driver is not None
    driver.type = "SUM"
    variable = driver.variables.new()
    variable.name = name
    variable.type = "SINGLE_PROP"
    variable.targets[0].id_type = "OBJECT"
    variable.targets[0].id = owner
    variable.targets[0].data_path = data_path
