# SPDX-License-Identifier: GPL-3.0-or-later
"""Repairs renamed and deleted parts of a character, or describes parts that cannot be repaired.

Objects, meshes, materials, collections, actions and joints' bones may have any name. Actions, pose
assets and scripts depend on the names of control bones and sliders, so these are restored.
"""

from __future__ import annotations

from typing import cast

import bpy

from ...logic.character import plans
from ..base import console, parts, saved
from ..base.blender_types import ArmatureObject
from ..character import armatures, build, meshes, runtime


def heal(rig: ArmatureObject) -> list[str]:
    """Restore the names of control bones, and missing sliders or sliders of a wrong type.

    The pointer of the control armature to the rig is restored too.

    Args:
        rig: the character's deforming armature, which is not linked.

    Returns:
        Sentences about repaired names and missing sliders.
    """
    controls = rig.get(parts.CONTROLS)
    if not isinstance(controls, bpy.types.Object) or controls.type != "ARMATURE":
        return []
    held = cast("ArmatureObject", controls)
    pointed = saved.item(held, parts.RIG)
    if held.library is None and (pointed is None or not parts.is_rig(pointed)):
        parts.point(held, parts.RIG, rig)
    return [*_bone_names(held), *_sliders(rig)]


def heal_all() -> list[ArmatureObject]:
    """Repair every character of this file and print the repairs to the console.

    Returns:
        The deforming armatures of repaired characters.
    """
    mended = []
    for rig in parts.rigs():
        done = heal(rig)
        console.say(*done)
        mended += [rig] * bool(done)
    return mended


def _bone_names(controls: ArmatureObject) -> list[str]:
    """Restore the names of renamed control bones; Blender updates the paths of their F-curves."""
    bones = controls.data.bones
    if controls.data.library is not None or controls.mode == "EDIT":
        return []
    done = []
    for bone in bones:
        wanted = saved.text(bone, parts.PART) or saved.text(bone, parts.BOARD)
        if wanted and wanted != bone.name and wanted not in bones:
            done.append(f"The bone {bone.name} of {controls.name} was named {wanted} again.")
            bone.name = wanted
    return done


def _sliders(rig: ArmatureObject) -> list[str]:
    """Create missing sliders again, and convert sliders of another type to floats."""
    face, live = parts.face_bone(rig), runtime.of(rig)
    if face is None or live is None:
        return []
    there = dict(face.items())  # reading properties one by one takes four times as long
    wrong = [i for i, label in enumerate(live.labels) if not isinstance(there.get(label), float)]
    if not wrong:
        return []
    planned = plans.plan_controls(live.dna.raw_control_names, live.rests)
    maximum = parts.maximum_of(parts.controls_there(rig))
    done = []
    for i in wrong:
        label, held = live.labels[i], face.get(live.labels[i])
        if held is None:
            done.append(f"The slider {label} of {rig.name} was gone and was made anew.")
        else:
            del face[label]
        face[label] = float(held) if isinstance(held, (int, bool)) else planned[i].rest
        armatures.describe_property(face, planned[i], maximum)
    return done


def missing(item: bpy.types.Object | None) -> list[str]:
    """Describe the lost parts of an object's character.

    Args:
        item: any object, or None.

    Returns:
        Sentences; empty if nothing is lost or the object belongs to no character.
    """
    rig = _rig_of_ruin(item)
    if rig is None:
        lost = item is not None and parts.RIG in item and item.get(parts.RIG) is None
        return ["The deforming armature of this face was deleted; undo brings it back."] * lost
    controls = saved.item(rig, parts.CONTROLS)
    found = []
    if item is not None and item.type == "ARMATURE" and item not in (rig, controls):
        found.append(
            f"{item.name} is a copy of the controls alone and moves nothing: delete it. To copy a "
            f"face, duplicate all objects of its collection."
        )
    if controls is None:
        found.append("The control armature was deleted; undo brings it back.")
    elif controls.pose is None or parts.FACE not in controls.pose.bones:
        found.append(f"{controls.name} has lost its bone {parts.FACE}, which bears the sliders.")
    if not runtime.of(rig):
        text = rig.get(parts.DNA)
        what = (
            f"what {text.name} holds is no DNA file any more"
            if isinstance(text, bpy.types.Text)
            else "the text that holds the DNA was deleted"
        )
        found.append(f"This face has lost its data: {what}; undo brings it back.")
    gone = [k for k in rig.keys() if k.startswith(parts.MESH_PREFIX) and not rig[k]]  # noqa: SIM118
    if gone:
        found.append(f"{len(gone)} of the meshes were deleted.")
    out = [o.name for o in outside(rig)]
    if out:
        found.append(f"{', '.join(out)}: deleted from the scene, still in the file.")
    for mesh in parts.meshes_of(rig):
        key = mesh.data.shape_keys
        if mesh.get(parts.MODE) == "LIVE" and key is not None and not meshes.live_block(mesh):
            found.append(f"{mesh.name} has lost its key {plans.LIVE_KEY}: choose Live again.")
    return found


def _rig_of_ruin(item: bpy.types.Object | None) -> ArmatureObject | None:
    """The deforming armature of an object's character, also if its controls are lost; or None."""
    if item is None:
        return None
    if item.type == "ARMATURE" and parts.CONTROLS in item:
        return cast("ArmatureObject", item)
    rig = item.get(parts.RIG)
    found = rig if isinstance(rig, bpy.types.Object) and parts.CONTROLS in rig else None
    return cast("ArmatureObject | None", found)


def outside(rig: ArmatureObject) -> list[bpy.types.Object]:
    """Parts of a character that are in no collection: Blender's Delete leaves them in the .blend,
    because the other parts point to them.
    """
    return [o for o in parts.members_of(rig) if not o.users_collection]


def bring_back(item: bpy.types.Object, scene: bpy.types.Scene) -> list[bpy.types.Object]:
    """Restore deleted parts of a character into the collection of its remaining parts.

    Args:
        item: an object of the character.
        scene: target if no part is in a collection.

    Returns:
        The restored objects.
    """
    rig = _rig_of_ruin(item)
    if rig is None:
        return []
    lost = outside(rig)
    homes = [o.users_collection[0] for o in parts.members_of(rig) if o.users_collection]
    home = homes[0] if homes else scene.collection
    for one in lost:
        home.objects.link(one)
    return lost


def remove_dead() -> int:
    """Remove characters whose parts were all deleted.

    The parts refer to each other, so Blender would keep and save them for ever.

    Returns:
        The number of removed characters.
    """
    dead = [rig for rig in parts.rigs() if _is_dead(rig)]
    for rig in dead:
        build.remove(rig)
    return len(dead)


def _is_dead(rig: ArmatureObject) -> bool:
    held = parts.members_of(rig)
    if any(o.users_collection or o.use_fake_user or o.library for o in held):
        return False
    ours = {o.as_pointer() for o in held}
    used = bpy.data.user_map(subset=held)
    owners = {u.as_pointer(): u for users in used.values() for u in users}
    strangers = [u for p, u in owners.items() if p not in ours]
    # Other datablocks of these types may use parts of a dead character. Scenes are among these
    # types, because a character with a part in a collection of a scene has returned False already.
    lesser = (bpy.types.Material, bpy.types.Key, bpy.types.Scene)
    return all(isinstance(u, lesser) for u in strangers)
