# SPDX-License-Identifier: GPL-3.0-or-later
"""Hides differences of the API between Blender 4.2 and 5.2 behind common functions."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import cast

import bpy

from ...logic.base.sentences import told
from .blender_types import Animated, NodeTree

NEWEST_TRIED = (5, 2)  # newest Blender version that packaging/check/blender/matrix.sh tests


def notice() -> str:
    """A sentence if this Blender is newer than all tested versions, else ""."""
    if bpy.app.version[:2] <= NEWEST_TRIED:
        return ""
    return told(
        "This is Blender {running}; Risorius was tried up to Blender {tried}. Everything can be "
        "used; if something looks wrong, look for an update of Risorius.",
        tried=".".join(map(str, NEWEST_TRIED)),
        running=".".join(map(str, bpy.app.version[:2])),
    )


def curves_of(action: bpy.types.Action) -> Iterator[bpy.types.FCurve]:
    """All F-curves of an action. Blender 4.4 adds layers and slots; 5.0 removes action.fcurves."""
    if hasattr(action, "layers") and len(action.layers):
        for layer in action.layers:
            for strip in layer.strips:
                for bag in getattr(strip, "channelbags", ()):
                    yield from bag.fcurves
    elif hasattr(action, "fcurves"):
        yield from action.fcurves


def _strips(layer: bpy.types.ActionLayer) -> list[bpy.types.ActionKeyframeStrip]:
    """The strips of a layer of an action; all are keyframe strips, Blender's only kind."""
    return cast("list[bpy.types.ActionKeyframeStrip]", layer.strips)


def make_node_tree(material: bpy.types.Material) -> None:
    """Give a material a node tree. Since Blender 5.0 each has one, and setting use_nodes warns."""
    if material.node_tree is None:
        material.use_nodes = True


def tree_of(material: bpy.types.Material) -> NodeTree:
    """The node tree of a material that has one."""
    return material.node_tree


def driver_of(curve: bpy.types.FCurve) -> bpy.types.Driver:
    """The driver of an F-curve from AnimData.drivers."""
    assert curve.driver is not None
    return curve.driver


def uid_of(modifier: bpy.types.Modifier) -> int:
    """A number that identifies a modifier of an object, also after renaming.

    0 if this Blender version has no such number.
    """
    return int(getattr(modifier, "persistent_uid", 0))


def _selecting(bone: bpy.types.PoseBone) -> bpy.types.Bone:
    """The object that stores the selection of a bone: the Bone; since Blender 5.0 the PoseBone."""
    return cast("bpy.types.Bone", bone) if hasattr(bone, "select") else bone.bone


def is_bone_selected(bone: bpy.types.PoseBone) -> bool:
    """Whether a bone of an armature is selected in pose mode."""
    return bool(_selecting(bone).select)


def select_bone(bone: bpy.types.PoseBone, chosen: bool = True) -> None:
    """Select or deselect a bone of an armature in pose mode; other bones keep their state.

    Args:
        bone: the pose bone.
        chosen: True: select; False: deselect.
    """
    _selecting(bone).select = chosen


def deselect_all(layer: bpy.types.ViewLayer) -> None:
    """Deselect all objects of a view layer.

    The update and the copied list avoid a crash of Blender 4.2: a selection rebuilds the list of
    objects during its iteration if objects were added or removed since the last update.
    """
    layer.update()
    for item in layer.objects[:]:
        item.select_set(False, view_layer=layer)


def add_curves(action: bpy.types.Action, owner: Animated) -> bpy.types.ActionChannelbag:
    """Create the collection for the F-curves of a new action.

    Args:
        action: a new action.
        owner: the datablock that will play the action.

    Returns:
        An object with `fcurves` and `groups`: the channel bag of a new slot; before Blender 4.4 the
        action.
    """
    if not hasattr(action, "slots"):
        return cast("bpy.types.ActionChannelbag", action)
    slot = action.slots.new(id_type=owner.id_type, name=owner.name)
    strip = action.layers.new("Layer").strips.new(type="KEYFRAME")
    return cast("bpy.types.ActionKeyframeStrip", strip).channelbag(slot, ensure=True)


def slot_for(action: bpy.types.Action, owner: Animated) -> bpy.types.ActionSlot | None:
    """The slot of an action that fits a datablock; None before Blender 4.4 or if none fits.

    First choice is the slot in use, then the slot with the datablock's name, then the first slot
    for the datablock's type.

    Args:
        action: any action.
        owner: the object or the shape keys that play it or will play it.
    """
    kinds = (owner.id_type, "UNSPECIFIED")
    slots = [s for s in getattr(action, "slots", ()) if s.target_id_type in kinds]
    data = owner.animation_data
    current = getattr(data, "action_slot", None) if data and data.action == action else None
    if current is not None:
        return current
    named = [s for s in slots if s.name_display == owner.name]
    return (named or slots or [None])[0]


def bag_for(action: bpy.types.Action, owner: Animated) -> bpy.types.ActionChannelbag | None:
    """The channel bag with the F-curves of an action for a datablock, or None.

    Args:
        action: any action; only its first layer and strip are read. Before Blender 4.4 the action
            itself is returned.
        owner: the object or the shape keys that determine the slot.
    """
    if not hasattr(action, "slots") or not len(action.layers):
        own = action if hasattr(action, "fcurves") else None
        return cast("bpy.types.ActionChannelbag | None", own)
    slot = slot_for(action, owner)
    strips = _strips(action.layers[0])
    return strips[0].channelbag(slot) if slot is not None and len(strips) else None


def curves_for(action: bpy.types.Action, owner: Animated) -> list[bpy.types.FCurve]:
    """The F-curves of an action that move a datablock.

    If the action has slots, these are the curves of the slot that fits the datablock.

    Args:
        action: any action.
        owner: the object or the shape keys that determine the slot.
    """
    if not hasattr(action, "slots") or not len(action.layers):
        return list(getattr(action, "fcurves", ()))
    slot = slot_for(action, owner)
    bags = [s.channelbag(slot) for y in action.layers for s in _strips(y)] if slot else []
    return [curve for bag in bags if bag is not None for curve in bag.fcurves]


def played_actions(owner: Animated) -> list[bpy.types.Action]:
    """The active action of a datablock and the actions of its NLA strips, also in meta strips."""
    data = owner.animation_data
    if data is None:
        return []
    found = [] if data.action is None else [data.action]
    for track in data.nla_tracks:
        found += actions_in(track.strips)
    return list(dict.fromkeys(found))


def actions_in(strips: Iterable[bpy.types.NlaStrip]) -> Iterator[bpy.types.Action]:
    """The actions of NLA strips, also inside meta strips."""
    for strip in strips:
        if strip.action is not None:
            yield strip.action
        yield from actions_in(strip.strips)


def assign_action(
    target: bpy.types.AnimData | bpy.types.NlaStrip,
    action: bpy.types.Action,
    slot: bpy.types.ActionSlot | None = None,
) -> None:
    """Let an object's animation data, or an NLA strip, play an action.

    Args:
        target: the animation data or the strip.
        action: any action.
        slot: slot of the action; None lets Blender choose. Must be None before Blender 4.4.
    """
    target.action = action
    if slot is not None:
        target.action_slot = slot


def strips_of(scene: bpy.types.Scene) -> bpy.types.StripsTopLevel:
    """The strips of a scene's sequencer, which is created if missing."""
    editor = scene.sequence_editor or scene.sequence_editor_create()
    return editor.strips if hasattr(editor, "strips") else editor.sequences
