# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the objects of a character by custom properties with pointers and indices, not by names."""

from __future__ import annotations

from typing import TypeGuard, cast

import bpy

from . import saved
from .blender_types import ArmatureObject, Context, MeshObject

RIG = "risorius_rig"  # on meshes and control armature: the deforming armature
CONTROLS = "risorius_controls"  # on the deforming armature: the control armature
DNA = "risorius_dna"  # on the deforming armature: the Text that holds the DNA file
LOD = "risorius_lod"  # on the deforming armature: the level that the viewport shows
LOD_RENDER = "risorius_lod_render"  # on the deforming armature: level in renders; -1: as LOD
LOD_BY_DISTANCE = (
    "risorius_lod_by_distance"  # on the rig: whether camera distance chooses the level
)
# Array property of the deforming armature: entry n is the distance from the camera, in Blender
# units, at which level of detail n + 1 begins.
LOD_DISTANCES = "risorius_lod_distances"
FOLLOW = "risorius_follow"  # on the rig: whether it copies the transform of the control armature
UNIT = "risorius_unit"  # on the deforming armature: metres per Blender unit at import
SOURCE = "risorius_source"  # on the deforming armature: path of the imported file
TEXTURES = "risorius_textures"  # on the deforming armature: text about the textures found
OVERDRIVE = "risorius_overdrive"  # on the control armature: whether sliders reach 1.5, not 1
RANGES = "risorius_ranges"  # on the control armature: capture range, see range_properties.py
CURVES = "risorius_curves"  # on the control armature: unknown curves, see unknown_curves.py
BODY_NECK = "risorius_body_neck"  # on the control armature: neck bones of the body, one per line
BODY_HEAD = "risorius_body_head"  # on the control armature: head bone of the body
MESH_PREFIX = "risorius_mesh_"  # prefix of numbered properties of the rig: pointers to its meshes
MESH = "dna_mesh"  # on a mesh object: index of its mesh in the DNA file
RESIDUAL = "risorius_residual"  # colour attribute: distance of the solved face from the source mesh
LODS = "dna_lods"  # on a mesh object: the levels that show it
JOINT = "dna_joint"  # on a bone: index of its joint in the DNA file
# Prefix of custom properties of a mesh object. The rest of a property's name is the name of a flag
# such as hide_render; the property stores the value of this flag that the add-on wrote last.
HIDDEN_PREFIX = "risorius_"
MODE = "risorius_mode"  # on a mesh object: LIVE or KEYS
# Custom property of a mesh object in Direct mode (see skinning/direct.py): persistent uid of the
# object's Armature modifier, which is switched off in this mode.
FINISHED = "risorius_finished"
SKINNING = "risorius_skinning"  # on the deforming armature: "LIVE" forbids Direct mode
JOINTS_SHOWN = "risorius_joints_shown"  # on the rig: saved with shown joints by an old add-on
VALUES = "risorius_values"  # on the deforming armature: the mesh that drivers read maps from
NAMES = "risorius_names"  # on a Mesh: names that the user assigned to shape keys, see assigned.py
LANDMARK = "risorius_landmark"  # on an empty: name of its head landmark, see points.py
LANDMARK_FOUND = "risorius_landmark_found"  # on the empty: detected position in the head's space
LANDMARKS = "risorius_landmarks"  # on a collection: marks it as container of head landmarks
REAL = "risorius_real"  # on a Key of a LIVE mesh: channels that have a shape key of their own
KEY_NAMES = "risorius_key_names"  # on a Key in LIVE mode: channel -> name given by the user
KEY_ORDER = "risorius_key_order"  # on a Key in LIVE mode: channels in the user's order of keys
# Name of the driver variable by which the add-on recognises its shape keys of single channels.
CHANNEL_VARIABLE = "risorius_channel"
TEST = (
    "risorius_test"  # on the deforming armature: a channel's test override, see channel_preview.py
)
LOOK = "risorius_look"  # on the deforming armature: solo and mute settings, see look_masks.py
# Custom property of the deforming armature: kind, largest motion and contents of its heat map. The
# colour attribute of the coloured meshes has this name too.
HEAT = "risorius_heat"
HEAT_BEFORE = "risorius_heat_before"  # on a Mesh with a heat map: colour attributes active before
# Custom property of a baked deforming armature or control armature: settings of the bake. The
# evaluator skips a deforming armature that has this property.
BAKED = "risorius_baked"
MAPS = "maps"  # on the deforming armature: values of the animated maps
CHANNELS = "channels"  # on the deforming armature: values of the channels
FACE = "face"  # the bone of the control armature with the control properties
PART = "risorius_part"  # on a control bone: its role, such as "head", also after renaming
OUTLINES = "risorius_outlines"  # on the control armature: scale of each hidden outline, by PART
BOARD = "risorius_board"  # on a bone of the face board: its original name
BOARD_KIND = "risorius_board_kind"  # on the control armature: "PRIMARY"; missing: complete board
LEAD = "risorius_lead"  # on the control armature: "BOARD" if the face board moves the face
PULL = "risorius_pull"  # on the deforming armature: its driver keeps the controls evaluated
PINS = "risorius_pins"  # on the control armature: flat list of mesh, vertex of each drag pin
HANDLES_SELECTED = "risorius_handles_selected"  # a list like PINS: selected drag handles
HANDLES_HIDDEN = "risorius_handles_hidden"  # a list like PINS: hidden drag handles
_MOST_MESHES = 1 << 16  # mesh indices of a DNA file have 16 bits


def rigs(linked: bool = False) -> list[ArmatureObject]:
    """The deforming armatures of all characters of this file.

    Args:
        linked: True: include linked armatures, which cannot be changed.
    """
    return [o for o in bpy.data.objects if (linked or o.library is None) and is_rig(o)]


def is_rig(item: bpy.types.Object) -> TypeGuard[ArmatureObject]:
    """Whether an object is the deforming armature of a character."""
    return item.type == "ARMATURE" and saved.item(item, CONTROLS) is not None


def point(owner: bpy.types.Object, key: str, item: bpy.types.ID) -> None:
    """Set a custom property that points to another part of the character.

    This works also on overrides of linked characters.

    The property is marked as overridable, because Blender would otherwise reset it to the value in
    the library when the file is opened.

    Args:
        owner: the object that gets the property.
        key: name of the property; an earlier value is replaced.
        item: the object or text to point to.
    """
    owner[key] = item
    owner.property_overridable_library_set(f'["{key}"]', True)


def controls_of(rig: ArmatureObject) -> ArmatureObject | None:
    """The control armature of a character; None if it was deleted or lacks the bone FACE."""
    controls = cast("ArmatureObject | None", saved.item(rig, CONTROLS))
    if controls is None or controls.type != "ARMATURE" or FACE not in controls.pose.bones:
        return None
    return controls


def controls_there(rig: ArmatureObject) -> ArmatureObject:
    """The control armature of a character; the caller must have checked that it exists."""
    controls = controls_of(rig)
    assert controls is not None
    return controls


def keys_there(item: MeshObject) -> bpy.types.Key:
    """The shape keys of a mesh; the caller must have checked that they exist."""
    key = item.data.shape_keys
    assert key is not None
    return key


def carrier_of(rig: ArmatureObject) -> bpy.types.Object:
    """The object with the array MAPS that drivers of a character's materials read.

    This object is a mesh, because a change of the array on the deforming armature would make
    Blender copy all bones of the armature. In older .blend files it is the deforming armature.

    Args:
        rig: deforming armature.
    """
    found = saved.item(rig, VALUES)
    return rig if found is None or found.get(RIG) != rig or MAPS not in found else found


def rig_of(item: bpy.types.Object | None) -> ArmatureObject | None:
    """The deforming armature of the character that an object belongs to, or None."""
    if item is None:
        return None
    if is_rig(item):
        return item
    rig = saved.item(item, RIG)
    return rig if rig is not None and is_rig(rig) else None


def title_of(rig: ArmatureObject) -> str:
    """The unique name of a character.

    Args:
        rig: deforming armature of the character; "Anna_rig.001" gives "Anna.001".
    """
    name, mark, number = rig.name.rpartition("_rig")
    return name + number if mark else rig.name


def maximum_of(controls: ArmatureObject) -> float:
    """The hard maximum of a character's sliders.

    Args:
        controls: the character's control armature.
    """
    return 1.5 if controls.get(OVERDRIVE) else 1.0


def members_of(rig: ArmatureObject) -> list[bpy.types.Object]:
    """The rig, the control armature and the meshes of a character, without deleted objects."""
    held = (rig, saved.item(rig, CONTROLS), *meshes_of(rig))
    return [item for item in held if item is not None]


def meshes_of(rig: ArmatureObject) -> list[MeshObject]:
    """The mesh objects of a character; meshes that point to another character are left out."""
    found = []
    for key in rig.keys():  # noqa: SIM118  Blender's ID is no dict
        if key.startswith(MESH_PREFIX):
            item = saved.item(rig, key)
            if item is not None and item.get(RIG) == rig and is_numbered(item):
                found.append(item)
    return found


def is_numbered(item: bpy.types.Object) -> TypeGuard[MeshObject]:
    """Whether an object is a mesh with a valid index of a DNA mesh in its property MESH."""
    number = item.get(MESH)
    return item.type == "MESH" and isinstance(number, int) and 0 <= number < _MOST_MESHES


def meshes_pointing_at(rig: ArmatureObject) -> list[MeshObject]:
    """All mesh objects that point to a character, also duplicates that the rig does not list."""
    listed = meshes_of(rig)
    others = [o for o in bpy.data.objects if o.get(RIG) == rig and is_numbered(o)]
    return listed + [o for o in others if o not in listed]


def active_rig(context: Context) -> ArmatureObject | None:
    """The character of the active object, or else the only character of the scene, or None.

    Linked characters are left out, because they cannot be changed.
    """
    rig = rig_of(context.object)
    if rig is None:
        # Compare objects, not names, because a linked object may have the same name.
        there = [r for r in rigs() if context.scene in r.users_scene]
        rig = there[0] if len(there) == 1 else None
    return rig if rig is not None and rig.library is None else None


def face_bone(rig: ArmatureObject) -> bpy.types.PoseBone | None:
    """The pose bone with the control properties, or None."""
    controls = controls_of(rig)
    return controls.pose.bones[FACE] if controls else None


def property_path(name: str) -> str:
    """The data path of a control property, relative to the control armature object."""
    bone, quoted = bpy.utils.escape_identifier(FACE), bpy.utils.escape_identifier(name)
    return f'pose.bones["{bone}"]["{quoted}"]'
