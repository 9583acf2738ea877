# SPDX-License-Identifier: GPL-3.0-or-later
"""How the parts of a character find each other: object pointers and indices, never names."""

from __future__ import annotations

from typing import TypeGuard, cast

import bpy

from . import saved
from .blender_types import ArmatureObject, Context, MeshObject

RIG = "risorius_rig"  # on meshes and control armature: the deforming armature
CONTROLS = "risorius_controls"  # on the deforming armature: the control armature
DNA = "risorius_dna"  # on the deforming armature: the Text that holds the file
LOD = "risorius_lod"  # on the deforming armature: the level that the viewport shows
LOD_RENDER = "risorius_lod_render"  # on the same: that of renders, -1 for the viewport's
LOD_BY_DISTANCE = "risorius_lod_by_distance"  # on the same: the camera's distance chooses
LOD_DISTANCES = "risorius_lod_distances"  # on the same: where level n gives way to n + 1
FOLLOW = "risorius_follow"  # on the same: its place is that of the control armature
UNIT = "risorius_unit"  # on the deforming armature: metres per Blender unit at import
SOURCE = "risorius_source"  # on the deforming armature: the path it came from
TEXTURES = "risorius_textures"  # on the deforming armature: words on which textures were found
OVERDRIVE = "risorius_overdrive"  # on the control armature: hard maximum is 1.5
RANGES = "risorius_ranges"  # on the control armature: capture range, see range_properties.py
CURVES = "risorius_curves"  # on the control armature: unknown curves, see unknown_curves.py
BODY_NECK = "risorius_body_neck"  # on the control armature: bones of the body, a line each
BODY_HEAD = "risorius_body_head"  # the same for the head
MESH_PREFIX = "risorius_mesh_"  # + number, on the deforming armature: a mesh
MESH = "dna_mesh"  # on a mesh object: its number in the DNA
RESIDUAL = "risorius_residual"  # colours of a mesh: what solved curves leave of another
LODS = "dna_lods"  # on a mesh object: the levels that show it
JOINT = "dna_joint"  # on a bone: its number in the DNA
HIDDEN_PREFIX = "risorius_"  # + flag, on a mesh: what was last written to the flag
MODE = "risorius_mode"  # on a mesh object: LIVE or KEYS
# On a mesh object: it is in Direct mode now, see direct.py; the persistent uid of the modifier.
FINISHED = "risorius_finished"
SKINNING = "risorius_skinning"  # on the deforming armature: "LIVE" where Direct is not wanted
JOINTS_SHOWN = "risorius_joints_shown"  # on the same: its joints were shown in an older file
VALUES = "risorius_values"  # on the deforming armature: the mesh that drivers read maps from
NAMES = "risorius_names"  # on a Mesh: what the user says of its shape keys, see assigned.py
LANDMARK = "risorius_landmark"  # on an empty: the landmark of a head that it is, see points.py
LANDMARK_FOUND = "risorius_landmark_found"  # on the same: where it was found, in the head's space
LANDMARKS = "risorius_landmarks"  # on a collection: it holds the landmarks of a head
REAL = "risorius_real"  # on a Key: channels that are real keys although the mesh is LIVE
KEY_NAMES = "risorius_key_names"  # on a Key in LIVE mode: names that the user gave to our keys
KEY_ORDER = "risorius_key_order"  # on a Key in LIVE mode: their order, as channels
CHANNEL_VARIABLE = "risorius_channel"  # name of the driver variable of our keys
TEST = (
    "risorius_test"  # on the deforming armature: a channel's test override, see channel_preview.py
)
LOOK = "risorius_look"  # on the deforming armature: what of the face is shown, see look_masks.py
HEAT = "risorius_heat"  # on the same: which heat map it shows; on its meshes: the colours of that
HEAT_BEFORE = "risorius_heat_before"  # on a Mesh with such colours: what was active before them
BAKED = "risorius_baked"  # on rig or controls: what was baked; the rig's is not live meanwhile
MAPS = "maps"  # on the deforming armature: values of the animated maps
CHANNELS = "channels"  # on the deforming armature: values of the channels
FACE = "face"  # the bone of the control armature that bears the controls
PART = "risorius_part"  # on the control armature's bones: what each is, whatever its name
OUTLINES = "risorius_outlines"  # on the control armature: sizes of its hidden outlines, by PART
BOARD = "risorius_board"  # on the bones of the face board: the name of each
BOARD_KIND = "risorius_board_kind"  # on the control armature: "PRIMARY" for that board
LEAD = "risorius_lead"  # on the control armature: "BOARD" where the face board moves the face
PULL = "risorius_pull"  # on the deforming armature: its driver keeps the controls evaluated
PINS = "risorius_pins"  # on the control armature: mesh and vertex of each pin of a drag, flat
HANDLES_SELECTED = "risorius_handles_selected"  # on the same, like pins: handles that go together
HANDLES_HIDDEN = "risorius_handles_hidden"  # on the same, like pins: handles that are not offered
_MOST_MESHES = 1 << 16  # the numbers of a DNA file have 16 bits


def rigs(linked: bool = False) -> list[ArmatureObject]:
    """The deforming armatures of all characters of this file; linked ones cannot be written.

    Args:
        linked: include linked armatures.
    """
    return [o for o in bpy.data.objects if (linked or o.library is None) and is_rig(o)]


def is_rig(item: bpy.types.Object) -> TypeGuard[ArmatureObject]:
    """Whether an object is the deforming armature of a character."""
    return item.type == "ARMATURE" and saved.item(item, CONTROLS) is not None


def point(owner: bpy.types.Object, key: str, item: bpy.types.ID) -> None:
    """Let a custom property point to another part, also on overrides of linked characters.

    Blender gives a pointer of an override back to the library at load unless it is marked so.

    Args:
        owner: the object that has the property.
        key: name of the property; whatever it held is replaced.
        item: the object or text that it points to from now on.
    """
    owner[key] = item
    owner.property_overridable_library_set(f'["{key}"]', True)


def controls_of(rig: ArmatureObject) -> ArmatureObject | None:
    """The control armature of a character, or None if it was deleted."""
    controls = cast("ArmatureObject | None", saved.item(rig, CONTROLS))
    if controls is None or controls.type != "ARMATURE" or FACE not in controls.pose.bones:
        return None
    return controls


def controls_there(rig: ArmatureObject) -> ArmatureObject:
    """The control armature of a character that has one: whoever asks has looked."""
    controls = controls_of(rig)
    assert controls is not None
    return controls


def keys_there(item: MeshObject) -> bpy.types.Key:
    """The shape keys of a mesh that has some: whoever asks has looked."""
    key = item.data.shape_keys
    assert key is not None
    return key


def carrier_of(rig: ArmatureObject) -> bpy.types.Object:
    """The object with the array MAPS that drivers of a character's materials read.

    It is a mesh of the character: each update of the deforming armature copies all its bones.
    Characters of older files have the array on the deforming armature alone.

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
        rig: its deforming armature; copies are called Anna_rig.001 and so on.
    """
    name, mark, number = rig.name.rpartition("_rig")
    return name + number if mark else rig.name


def maximum_of(controls: ArmatureObject) -> float:
    """The hard maximum of a character's sliders. Args: controls  its control armature."""
    return 1.5 if controls.get(OVERDRIVE) else 1.0


def members_of(rig: ArmatureObject) -> list[bpy.types.Object]:
    """All existing objects of a character: rig, controls, meshes; also of an incomplete
    character."""
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
    """Whether an object is a mesh that stores its mesh index in the DNA file."""
    number = item.get(MESH)
    return item.type == "MESH" and isinstance(number, int) and 0 <= number < _MOST_MESHES


def meshes_pointing_at(rig: ArmatureObject) -> list[MeshObject]:
    """All mesh objects of a character, also linked duplicates that it does not list."""
    listed = meshes_of(rig)
    others = [o for o in bpy.data.objects if o.get(RIG) == rig and is_numbered(o)]
    return listed + [o for o in others if o not in listed]


def active_rig(context: Context) -> ArmatureObject | None:
    """The character of the active object, or the only one of the scene, or None.

    Linked characters are left out, because they cannot be changed.
    """
    rig = rig_of(context.object)
    if rig is None:
        # A linked object may have the same name: identity tells them apart.
        there = [r for r in rigs() if context.scene in r.users_scene]
        rig = there[0] if len(there) == 1 else None
    return rig if rig is not None and rig.library is None else None


def face_bone(rig: ArmatureObject) -> bpy.types.PoseBone | None:
    """The pose bone with the control properties, or None."""
    controls = controls_of(rig)
    return controls.pose.bones[FACE] if controls else None


def property_path(name: str) -> str:
    """The data path of a control, from its armature object."""
    bone, quoted = bpy.utils.escape_identifier(FACE), bpy.utils.escape_identifier(name)
    return f'pose.bones["{bone}"]["{quoted}"]'
