# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes overrides of linked characters that can be animated.

Blender refuses bulk writes to linked data and to overrides that are not editable, and to the
shape keys of every override. So the override is made fully editable. Its meshes either have real
keys (a shape key for each channel), which drivers move without any write, or the meshes are copied
into this file.
"""

from __future__ import annotations

from typing import Any, TypeVar

import bpy

from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..base import compat, last_written, parts
from ..base.blender_types import ArmatureObject, Context, MeshObject
from ..character import meshes
from ..frame import evaluate
from . import duplicates

Owned = TypeVar("Owned", bound=bpy.types.ID)


def linked_rig(context: Context) -> ArmatureObject | None:
    """The linked character that the active object shows or belongs to, or None."""
    item = context.object
    if item is None:
        return None
    if item.instance_type == "COLLECTION" and item.instance_collection is not None:
        inside = item.instance_collection.all_objects
        return next((o for o in inside if o.library and parts.is_rig(o)), None)
    rig = parts.rig_of(item)
    return rig if rig is not None and rig.library is not None else None


def make_override(
    context: Context, rig: ArmatureObject, local_meshes: bool = False
) -> tuple[ArmatureObject, list[str]]:
    """Override a linked character so that it can be animated here.

    Args:
        context: Blender context; its active object may be the instance that is replaced.
        rig: the linked deforming armature.
        local_meshes: True: copy the meshes into this file; False: drive their real keys.

    Returns:
        The override's deforming armature, and sentences for a report.

    Raises:
        FaceError: Blender made no override; the text names the datablock.
    """
    shown = _instance_of(context, rig)
    root: Any = shown.instance_collection if shown else _linked_root(rig)
    before = {o.session_uid for o in bpy.data.objects}
    root.override_hierarchy_create(
        context.scene, context.view_layer, reference=shown, do_fully_editable=True
    )
    new = next(
        (r for r in parts.rigs() if r.session_uid not in before and _overrides(r, rig)), None
    )
    if new is None:
        raise FaceError(told("Blender made no override of {face}.", face=rig.name))
    if shown is not None:
        _take_place(shown, new, root)
    elif isinstance(root, bpy.types.Collection):
        _unlink(context.scene, root)
    _show(context, new)
    return new, own_shapes(new, local_meshes)


def repair(context: Context, rig: ArmatureObject, local_meshes: bool = False) -> list[str]:
    """Make an override that Blender made by itself fully editable.

    Args:
        context: Blender context; its view layer is updated.
        rig: deforming armature of the override.
        local_meshes: True: copy the meshes into this file; False: drive their real keys.

    Returns:
        Sentences for a report.
    """
    assert rig.override_library is not None
    root = rig.override_library.hierarchy_root
    kinds = ("objects", "meshes", "armatures", "materials", "collections", "shape_keys")
    for kind in kinds:
        for item in getattr(bpy.data, kind):
            held = item.override_library
            if held is not None and held.hierarchy_root == root:
                held.is_system_override = False
    context.view_layer.update()
    return own_shapes(rig, local_meshes)


def own_shapes(rig: ArmatureObject, local_meshes: bool) -> list[str]:
    """Make the shape keys of an override follow the controls.

    Meshes with a live key (one key with the sum of all channels) are copied into this file, because
    drivers cannot move a live key.

    Args:
        rig: the override's deforming armature.
        local_meshes: True copies all meshes, False only meshes with a live key.

    Returns:
        Sentences for a report.
    """
    done, owned = [], {}
    for item in parts.meshes_of(rig):
        live = meshes.live_block(item) is not None
        if not is_locked(item) or not (live or local_meshes):
            continue
        _localize(item, owned)
        if live and not local_meshes:
            done.append(f"{item.name} has a live key: its mesh was copied into this file.")
    duplicates.separate(rig)
    last_written.forget()
    return done


def is_locked(item: MeshObject) -> bool:
    """Whether the mesh datablock of an object, with its shape keys, belongs to another file."""
    return item.data.library is not None or item.data.override_library is not None


def unlock_shapes(rig: ArmatureObject) -> bool:
    """Copy all meshes that belong to another file into this file, so that the mode of their shape
    keys can be switched.

    Args:
        rig: deforming armature of the character.

    Returns:
        Whether at least one mesh was copied.
    """
    owned = {}
    locked = [item for item in parts.meshes_of(rig) if is_locked(item)]
    for item in locked:
        _localize(item, owned)
    if locked:
        duplicates.separate(rig)
    return bool(locked)


def trouble(rig: ArmatureObject) -> str:
    """A sentence about refused writes to an override, or about an override that is not editable.

    Empty if there is no such trouble.
    """
    names = [item.name for item in evaluate.refused(rig)]
    if rig.override_library is not None and rig.override_library.is_system_override:
        names = names or [rig.name]
    if not names:
        return ""
    return f"Blender's override of {', '.join(names)} cannot be written: the face stands still."


def _localize(item: MeshObject, owned: dict[str, bpy.types.Material]) -> None:
    """Copy a mesh into this file, with copies of its override materials.

    Without the mesh these materials would be outside the hierarchy of the override, and Blender
    would delete them when the library changes.

    Args:
        item: the mesh object.
        owned: name of an override material -> its copy; new copies are added.
    """
    left = [item.data, *item.data.materials]
    item.data = _local_copy(item.data)
    for index, material in enumerate(item.data.materials):
        if material is None or material.override_library is None:
            continue
        if material.name not in owned:
            owned[material.name] = _local_copy(material)
        item.data.materials[index] = owned[material.name]
    # Remove the old mesh and material overrides. They no longer belong to a hierarchy of overrides,
    # so Blender 5.2 would report them as errors when the file is opened.
    for old in dict.fromkeys(left):
        if old is not None and old.override_library is not None and old.users == 0:
            bpy.data.batch_remove([old])


def _local_copy(item: Owned) -> Owned:
    own = item.copy()
    return own.make_local(clear_liboverride=True) if own.override_library is not None else own


def _overrides(item: bpy.types.ID, linked: bpy.types.ID) -> bool:
    held = item.override_library
    return held is not None and held.reference == linked


def _instance_of(context: Context, rig: ArmatureObject) -> bpy.types.Object | None:
    """The active object, if it is an instance of the collection with the rig."""
    item = context.object
    if item is None or item.library or item.instance_type != "COLLECTION":
        return None
    held = item.instance_collection
    return item if held is not None and rig in held.all_objects[:] else None


def _linked_root(rig: ArmatureObject) -> bpy.types.Collection | ArmatureObject:
    """The linked collection that contains this rig and is a child of a local collection.

    The rig itself if there is no such collection.
    """
    homes = [s.collection for s in bpy.data.scenes if s.library is None]
    homes += [c for c in bpy.data.collections if c.library is None]
    for home in homes:
        for child in home.children:
            if child.library is not None and rig in child.all_objects[:]:
                return child
    return rig


def _unlink(scene: bpy.types.Scene, collection: bpy.types.Collection) -> None:
    """Remove a linked collection from a scene, because its override replaces it."""
    for home in (scene.collection, *scene.collection.children_recursive):
        if home.library is None and collection in home.children[:]:
            home.children.unlink(collection)


def _take_place(shown: bpy.types.Object, rig: ArmatureObject, collection: bpy.types.ID) -> None:
    """Move an override to the position of an instance of the linked collection.

    The instance then shows nothing, and is deleted if it has no children and no other datablock
    uses it.

    Args:
        shown: the object that shows the instance.
        rig: deforming armature of the override.
        collection: not used.
    """
    place = shown.matrix_world.copy()
    shown.instance_collection = None
    shown.instance_type = "NONE"
    for item in (rig, parts.controls_of(rig)):
        if item is not None and item.parent is None:
            item.matrix_world = place @ item.matrix_world
    if not shown.children and shown.users == len(shown.users_collection):
        bpy.data.objects.remove(shown)


def _show(context: Context, rig: ArmatureObject) -> None:
    """Select only the control armature of a character, and make it active, as after an import."""
    layer, controls = context.view_layer, parts.controls_of(rig)
    compat.deselect_all(layer)
    if controls is not None and controls.name in layer.objects:
        controls.select_set(True, view_layer=layer)
        layer.objects.active = controls
