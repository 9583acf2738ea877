# SPDX-License-Identifier: GPL-3.0-or-later
"""How the parts of a character find each other: object pointers and indices, never names."""

import bpy

RIG = "risorius_rig"  # on meshes and control armature: the deforming armature
CONTROLS = "risorius_controls"  # on the deforming armature: the control armature
DNA = "risorius_dna"  # on the deforming armature: the Text that holds the file
LOD = "risorius_lod"  # on the deforming armature: the level that is shown
UNIT = "risorius_unit"  # on the deforming armature: metres per Blender unit at import
SOURCE = "risorius_source"  # on the deforming armature: the path it came from
OVERDRIVE = "risorius_overdrive"  # on the control armature: hard maximum is 1.5
MESH_PREFIX = "risorius_mesh_"  # + number, on the deforming armature: a mesh
MESH = "dna_mesh"  # on a mesh object: its number in the DNA
LODS = "dna_lods"  # on a mesh object: the levels that show it
JOINT = "dna_joint"  # on a bone: its number in the DNA
MODE = "risorius_mode"  # on a mesh object: LIVE or KEYS
REAL = "risorius_real"  # on a Key: channels that are real keys although the mesh is LIVE
KEY_NAMES = "risorius_key_names"  # on a Key in LIVE mode: names that the user gave to our keys
KEY_ORDER = "risorius_key_order"  # on a Key in LIVE mode: their order, as channels
CHANNEL_VARIABLE = "risorius_channel"  # name of the driver variable of our keys
TEST = "risorius_test"  # on the deforming armature: a channel's test override, see testing.py
MAPS = "maps"  # on the deforming armature: values of the animated maps
CHANNELS = "channels"  # on the deforming armature: values of the channels
FACE = "face"  # the bone of the control armature that bears the controls


def rigs():
    """The deforming armatures of all characters of this file."""
    return [o for o in bpy.data.objects if o.type == "ARMATURE" and _object(o, CONTROLS)]


def _object(owner, key):
    value = owner.get(key)
    return value if isinstance(value, bpy.types.Object) else None


def controls_of(rig):
    """The control armature of a character, or None where it was deleted."""
    controls = _object(rig, CONTROLS)
    if controls is None or controls.type != "ARMATURE" or FACE not in controls.pose.bones:
        return None
    return controls


def rig_of(item):
    """The deforming armature of the character that an object belongs to, or None."""
    if item is None:
        return None
    if item.type == "ARMATURE" and _object(item, CONTROLS):
        return item
    rig = _object(item, RIG)
    return rig if rig is not None and _object(rig, CONTROLS) else None


def meshes_of(rig):
    """The mesh objects of a character; what points to another character is not among them."""
    found = []
    for key in rig.keys():  # noqa: SIM118  Blender's ID is no dict
        if key.startswith(MESH_PREFIX):
            item = _object(rig, key)
            if item is not None and item.type == "MESH" and item.get(RIG) == rig:
                found.append(item)
    return found


def active_rig(context):
    """The character of the active object, else the only one of the scene, else None."""
    rig = rig_of(context.object)
    if rig is None:
        there = [r for r in rigs() if r.name in context.scene.objects]
        rig = there[0] if len(there) == 1 else None
    return rig


def face_bone(rig):
    """The pose bone that bears the control properties, or None."""
    controls = controls_of(rig)
    return controls.pose.bones[FACE] if controls else None


def property_path(name):
    """The data path of a control, from its armature object."""
    bone, quoted = bpy.utils.escape_identifier(FACE), bpy.utils.escape_identifier(name)
    return f'pose.bones["{bone}"]["{quoted}"]'
