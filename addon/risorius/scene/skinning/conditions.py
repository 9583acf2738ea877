# SPDX-License-Identifier: GPL-3.0-or-later
"""Decides which meshes of a face can be in Direct mode, and whether its bones have to be posed.

Direct mode writes final vertex positions to the live shape key of a mesh and disables its armature
modifier. A Plan is computed again after edits, and reused during playback. The tables have session
uids of datablocks as keys.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...logic.base.sentences import Sentence, told
from ..base import compat, drivers, last_written, parts, saved, session
from ..base.blender_types import ArmatureObject, Depsgraph, MeshObject
from ..character import armatures, meshes, runtime
from . import live_keys, skins

_PLACES = ("location", "rotation", "scale", "delta")  # beginnings of data paths of a transform
_STRAIGHT = 1e-6  # difference of a matrix element from which a mesh counts as moved from its rig
_PLAIN = (True, False, False, False, "")  # unedited settings of a mesh's armature modifier
_FOREIGN_KINDS = (bpy.types.Object, bpy.types.NodeTree, bpy.types.Collection)


@dataclass(frozen=True)
class Plan:
    """The way in which a face is shown: by Direct mode or by Blender's modifiers.

    Attributes:
        direct: session uids of the mesh objects in Direct mode, which get final vertex positions.
        posed: whether the bones of the deforming armature are posed.
        why: why bones are posed, or why a mesh is not in `direct`; empty if all meshes are in
            `direct` and no bones are posed.
    """

    direct: frozenset[int] = frozenset()
    posed: bool = True
    why: tuple[Sentence, ...] = ()


ORDINARY = Plan()  # the form of files: every mesh is deformed by its armature modifier


@dataclass
class _Kept:
    """State of a face at the last check.

    Attributes:
        plan: the Plan of the face.
        signature: settings that are compared to notice changes, from _signature.
        is_fresh: False if an edit since then may have changed the plan.
    """

    plan: Plan
    signature: tuple[object, ...]
    is_fresh: bool = True


# Session uid of a deforming armature -> its plan.
_kept: dict[int, _Kept] = session.table("conditions.plans", ("rewrite", "undo", "load"))
# Session uid of a mesh object -> sequence number of the add-on's last write to the mesh. The update
# that reports this write does not count as an edit.
_written: dict[int, int] = session.table("conditions.written", ("undo", "load"))
_writes = session.value("conditions.writes", 0, ("quit",))
# (session uid of a scene, name of a view layer) -> sequence number of the last write that an update
# of the layer's dependency graph reported.
_told: dict[tuple[int, str], int] = session.table("conditions.told", ("undo", "load"))
_restored = session.value("conditions.restored", False, ("load",))
# Session uid of a datablock other than an object -> number of its drivers when it was last updated.
_drivers: dict[int, int] = session.table("conditions.drivers", ("undo", "load"))
# Session uid of an object outside of characters -> its parent, the targets of its constraints and
# modifiers, and the number of its drivers, when it was last updated.
_pointing: dict[int, tuple[object, ...]] = session.table("conditions.pointing", ("undo", "load"))
# Session uid of a deforming armature -> number of calls of hold_ordinary that have begun and not
# ended.
_ordinary: dict[int, int] = session.table("conditions.ordinary", ("load",))


def of(rig: ArmatureObject, live: runtime.Runtime) -> Plan:
    """The plan of a face, updated if it was edited since the last check.

    Args:
        rig: deforming armature, the original.
        live: the character's Runtime.
    """
    if rig.session_uid in _ordinary:
        return ORDINARY
    kept = _kept.get(rig.session_uid)
    if kept is None or not kept.is_fresh:
        kept = _kept[rig.session_uid] = _Kept(look(rig, live), _signature(rig))
    return kept.plan


def known(rig: ArmatureObject) -> Plan | None:
    """The plan with which a face was last shown; None if it is unknown or hold_ordinary is active.

    Args:
        rig: deforming armature.
    """
    kept = _kept.get(rig.session_uid)
    return kept.plan if kept is not None and rig.session_uid not in _ordinary else None


def note_moved(rig: ArmatureObject) -> None:
    """Mark a plan as outdated, because keys or drivers move joints.

    This is necessary because Blender reports no edit for keys that a script inserted.

    Args:
        rig: deforming armature.
    """
    kept = _kept.get(rig.session_uid)
    if kept is not None and kept.plan.direct:
        kept.is_fresh = False


def hold_ordinary(rig: ArmatureObject, on: bool) -> None:
    """Keep a face out of Direct mode: bones posed, modifiers enabled. Calls may be nested.

    Args:
        rig: deforming armature.
        on: True: begin; False: end.
    """
    count = _ordinary.get(rig.session_uid, 0) + (1 if on else -1)
    if count > 0:
        _ordinary[rig.session_uid] = count
    else:
        _ordinary.pop(rig.session_uid, None)


def note_written(item: MeshObject) -> None:
    """Record that the add-on wrote a mesh, which is not an edit.

    Args:
        item: the mesh object.
    """
    _writes.now += 1
    _written[item.session_uid] = _writes.now


def forget_written() -> None:
    """Forget the add-on's writes of a frame, because Blender evaluates them without an update."""
    _written.clear()


def end_updates(depsgraph: Depsgraph) -> None:
    """Record that the add-on's handlers have finished for an update of a graph.

    Blender reports the meshes that the handlers wrote only once to each graph. So the graph's next
    update that reports one of these meshes is an edit.

    Args:
        depsgraph: the graph; graphs of other view layers report the same writes later.
    """
    _told[_key_of(depsgraph)] = _writes.now


def _key_of(depsgraph: Depsgraph) -> tuple[int, str]:
    layer = depsgraph.view_layer
    return depsgraph.scene.session_uid, layer.name if layer is not None else ""


@dataclass
class _Edits:
    """The datablocks that an update reports as edited.

    Attributes:
        told: sequence number of the add-on's last write to a mesh that an earlier update of the
            same dependency graph reported.
        meshes: session uids of characters' mesh objects that anyone but this add-on edited.
        rigs: session uids of edited deforming armatures, and of their data.
        foreign: whether an object outside all characters was edited.
    """

    told: int
    meshes: set[int] = field(default_factory=set)
    rigs: set[int] = field(default_factory=set)
    foreign: bool = False

    def add(self, update: bpy.types.DepsgraphUpdate, item: bpy.types.ID) -> None:
        """Add an edited datablock.

        Args:
            update: Blender's report of the edit.
            item: the original (not evaluated) datablock.
        """
        if isinstance(item, bpy.types.Armature):
            self.rigs.add(item.session_uid)
        elif isinstance(item, bpy.types.Object):
            self._add_object(update, item)
        else:
            if isinstance(item, _FOREIGN_KINDS):
                self.foreign |= getattr(item, "type", "GEOMETRY") == "GEOMETRY"
            self.foreign |= _has_other_drivers(item)

    def _add_object(self, update: bpy.types.DepsgraphUpdate, item: bpy.types.Object) -> None:
        uid = item.session_uid
        if parts.MESH in item and parts.RIG in item:
            ours = _written.get(uid, 0) > self.told
            if not ours and (update.is_updated_geometry or update.is_updated_transform):
                self.meshes.add(uid)
        elif parts.CONTROLS in item:
            if update.is_updated_geometry:
                self.rigs.add(uid)
                skins.forget_bones(uid)
        elif parts.RIG not in item and _may_read_anew(item):
            self.foreign = True


def _may_read_anew(item: bpy.types.Object) -> bool:
    """Whether an object outside of characters may refer to other objects than at the last call.

    A dragged lamp is updated at each step and reads no face, so its update must not count.
    """
    if any(modifier.type == "NODES" for modifier in item.modifiers):
        return True  # inputs of geometry nodes can be objects, which are not compared
    pointed = _pointed(item)
    if _pointing.get(item.session_uid) == pointed:
        return False
    _pointing[item.session_uid] = pointed
    return True


def _pointed(item: bpy.types.Object) -> tuple[object, ...]:
    """The objects to which an object refers by parent, constraints and modifiers, and the number
    of its drivers."""
    bones = item.pose.bones if item.pose is not None else ()
    holds = [*item.constraints, *(hold for bone in bones for hold in bone.constraints)]
    targets = [
        (_uid(getattr(hold, "target", None)), getattr(hold, "subtarget", "")) for hold in holds
    ]
    targets += [(_uid(t.target), t.subtarget) for h in holds for t in getattr(h, "targets", ())]
    modifiers = [_uid(getattr(modifier, "object", None)) for modifier in item.modifiers]
    data = item.animation_data
    count = len(data.drivers) if data is not None else 0
    parent = (_uid(item.parent), item.parent_type, item.parent_bone)
    return parent, tuple(targets), tuple(modifiers), count


def _uid(thing: object) -> int:
    """The session uid of a datablock, or 0. Uids are kept instead of Blender objects."""
    return thing.session_uid if isinstance(thing, bpy.types.ID) else 0


def _has_other_drivers(item: bpy.types.ID) -> bool:
    """Whether a datablock has more or fewer drivers than at its last update."""
    data = getattr(item, "animation_data", None)
    count = len(data.drivers) if data is not None else 0
    was = _drivers.get(item.session_uid, 0)
    _drivers[item.session_uid] = count
    return count != was


def note_updates(depsgraph: Depsgraph) -> set[int]:
    """Mark the plans that an edit may have changed as outdated.

    Args:
        depsgraph: dependency graph with the updates of the edit.

    Returns:
        Session uids of meshes edited by anyone but this add-on; empty after undo and redo.
    """
    edits = _Edits(_told.get(_key_of(depsgraph), 0))
    for update in depsgraph.updates:
        item = update.id.original if update.id is not None else None
        if item is not None:
            edits.add(update, item)
    for rig in parts.rigs():
        kept = _kept.get(rig.session_uid)
        if kept is None or not kept.is_fresh:
            continue
        own = {item.session_uid for item in parts.meshes_of(rig)} & edits.meshes
        armature = edits.rigs & {rig.session_uid, rig.data.session_uid}
        kept.is_fresh = not (edits.foreign or armature or own)
        if own or armature:
            last_written.inputs.pop(rig.session_uid, None)  # weights or rest may have changed
    look_quickly()
    if _restored.now:  # undo reloads all meshes; skins.doubt finds the ones that may differ
        _restored.now = False
        return set()
    return edits.meshes


def note_restored() -> None:
    """Record an undo or redo: the next update reports all restored data, which is not an edit."""
    _restored.now = True


def look_quickly() -> None:
    """Mark plans as outdated if settings that are quick to compare have changed, such as object
    modes, selection, modifiers and shape keys."""
    for rig in parts.rigs():
        kept = _kept.get(rig.session_uid)
        if kept is not None and kept.is_fresh and kept.signature != _signature(rig):
            kept.is_fresh = False
            last_written.inputs.pop(rig.session_uid, None)


_TAGGED = ("OBJECT", "MESH", "KEY", "ARMATURE", "COLLECTION", "SCENE")


def look_at_tagged(scene: bpy.types.Scene) -> None:
    """Called before a frame: find edits of a script since the last update of a scene.

    Without an interface Blender reports these edits only with the frame, together with all
    animated datablocks.

    Args:
        scene: the original.
    """
    graphs = [layer.depsgraph for layer in scene.view_layers if layer.depsgraph is not None]
    tagged = {kind for kind in _TAGGED for graph in graphs if graph.id_type_updated(kind)}
    if not tagged:
        return
    look_quickly()
    if "MESH" in tagged:
        skins.doubt()
        for rig in parts.rigs():
            last_written.inputs.pop(rig.session_uid, None)


def stale(rig: ArmatureObject) -> bool:
    """Whether the plan of a face is outdated; False if there is no plan.

    Args:
        rig: the deforming armature.
    """
    kept = _kept.get(rig.session_uid)
    return kept is not None and not kept.is_fresh


def _signature(rig: ArmatureObject) -> tuple[object, ...]:
    data = rig.data
    shown = armatures.joints_are_shown(rig)
    own = (rig.mode, rig.select_get(), shown, data.pose_position, rig.get(parts.SKINNING))
    return (*own, len(bpy.data.objects), *map(_mesh_signature, parts.meshes_of(rig)))


def _mesh_signature(item: MeshObject) -> tuple[object, ...]:
    data, key = item.data, item.data.shape_keys
    stack = tuple((m.name, m.show_viewport, m.show_render) for m in item.modifiers)
    own = next((m for m in item.modifiers if isinstance(m, bpy.types.ArmatureModifier)), None)
    first = (item.mode, stack, data.users, len(data.vertices), len(item.constraints))
    first += () if own is None else _settings(own)
    if key is None:
        return (*first, item.get(parts.MODE))
    blocks = key.key_blocks
    values, mutes = np.empty(len(blocks), np.float32), np.empty(len(blocks), bool)
    blocks.foreach_get("value", values)
    blocks.foreach_get("mute", mutes)
    pinned = item.show_only_shape_key, item.active_shape_key_index, key.use_relative
    return (*first, values.tobytes(), mutes.tobytes(), *pinned)


def _settings(own: bpy.types.ArmatureModifier) -> tuple[object, ...]:
    flags = own.use_vertex_groups, own.use_bone_envelopes, own.use_deform_preserve_volume
    return (*flags, own.use_multi_modifier, own.vertex_group)


def look(rig: ArmatureObject, live: runtime.Runtime) -> Plan:
    """Compute the plan of a face from its current state.

    Args:
        rig: deforming armature.
        live: its Runtime.
    """
    whole = next(_whole_face(rig, live), None)
    if whole is not None:
        return Plan(why=(whole,))
    direct, why = set[int](), list[Sentence]()
    for item in parts.meshes_of(rig):
        cause = next(_mesh(item, rig, live), None)
        if cause is None:
            direct.add(item.session_uid)
        else:
            why.append(cause)
    bones = [] if why else list(_readers(rig))
    return Plan(frozenset(direct), bool(why or bones), (*why, *bones))


def _whole_face(rig: ArmatureObject, live: runtime.Runtime) -> Iterator[Sentence]:
    """Yield the reasons why no mesh of a face can be in Direct mode."""
    if rig.get(parts.SKINNING) == "LIVE":
        yield told("Live mode is chosen.")
    if rig.library or rig.override_library or rig.data.library:
        yield told("The character is linked from another file.")
    if rig.mode != "OBJECT":
        yield told("{rig} is in pose or edit mode.", rig=rig.name)
    if rig.data.pose_position != "POSE":
        yield told("{rig} shows its rest position.", rig=rig.name)
    if drivers.moves(rig):
        yield told("Joints of {rig} have keys or drivers of their own.", rig=rig.name)
    if any(len(bone.constraints) for bone in rig.pose.bones):
        yield told("Joints of {rig} have constraints.", rig=rig.name)
    for item in parts.meshes_of(rig):
        if _has_real_keys(item, live):
            yield told("{mesh} has ordinary shape keys instead of the live key.", mesh=item.name)
    changed = _changed_bone(rig, live)
    if changed:
        yield told("The settings of the joint {bone} were changed.", bone=changed)


_BONE_FLAGS = {
    "use_deform": True,
    "use_inherit_rotation": True,
    "use_local_location": True,
    "use_connect": False,
    "use_envelope_multiply": False,
    "use_relative_parent": False,
}


def _changed_bone(rig: ArmatureObject, live: runtime.Runtime) -> str:
    """The name of a bone whose settings make Blender pose it differently from the evaluator, else
    empty."""
    bones = rig.data.bones
    count = len(bones)
    wrong = np.zeros(count, bool)
    for name, wanted in _BONE_FLAGS.items():
        flags = np.empty(count, bool)
        bones.foreach_get(name, flags)
        wrong |= flags != wanted
    segments, scales = np.empty(count, np.int32), np.empty(count, np.int32)
    bones.foreach_get("bbone_segments", segments)
    bones.foreach_get("inherit_scale", scales)
    wrong |= (segments != 1) | (scales != 0)
    rests = np.empty((count, 16), np.float32)
    bones.foreach_get("matrix_local", rests.ravel())
    wrong |= ~np.isfinite(rests).all(axis=1)  # joints too far away for float32
    if wrong.any():
        return bones[int(np.argmax(wrong))].name
    modes = np.empty(len(rig.pose.bones), np.int32)
    rig.pose.bones.foreach_get("rotation_mode", modes)
    for place in np.flatnonzero(modes != 0).tolist():
        name = rig.pose.bones[place].name
        rest = bones.get(name)  # by name: after undo PoseBone.bone may point into freed memory
        if rest is not None and saved.whole(rest, parts.JOINT, -1) in live.owned:
            return name
    return ""


def _mesh(item: MeshObject, rig: ArmatureObject, live: runtime.Runtime) -> Iterator[Sentence]:
    """Yield the reasons why a mesh cannot be in Direct mode."""
    data = item.data
    if item.library or item.override_library or data.library or data.override_library:
        yield told("{mesh} is linked from another file.", mesh=item.name)
        return
    if item.mode != "OBJECT":
        yield told("{mesh} is being edited.", mesh=item.name)
    if data.users - data.use_fake_user > 1:
        yield told("{mesh} shares its data with another object.", mesh=item.name)
    number = runtime.mesh_number(live, item)
    if number is None or len(data.vertices) != live.vertex_count(number):
        yield told("The number of vertices of {mesh} differs from the DNA file.", mesh=item.name)
        return
    yield from _standing(item, rig)
    yield from _modifiers(item, rig)
    yield from _keys(item, rig, live, number)
    if live_keys.bears_simulation(item):
        yield told(
            "{mesh} has a simulation: an edit of the mesh would reset the simulation cache.",
            mesh=item.name,
        )


def _standing(item: MeshObject, rig: ArmatureObject) -> Iterator[Sentence]:
    """Yield a reason if a mesh was moved relative to its rig."""
    place = np.array(item.matrix_parent_inverse @ item.matrix_basis)
    moved = np.abs(place - np.eye(4)).max() > _STRAIGHT
    moved = moved or item.parent != rig or item.parent_type != "OBJECT" or len(item.constraints)
    if moved or any(curve.data_path.startswith(_PLACES) for curve in _curves(item)):
        yield told("{mesh} was moved relative to {rig}.", mesh=item.name, rig=rig.name)


def _curves(owner: bpy.types.Object | bpy.types.Key) -> Iterator[bpy.types.FCurve]:
    data = owner.animation_data
    if data is not None:
        for action in compat.played_actions(owner):
            yield from compat.curves_for(action, owner)
        yield from data.drivers


def armature_of(item: MeshObject, rig: ArmatureObject) -> bpy.types.ArmatureModifier | None:
    """The armature modifier through which a rig deforms a mesh.

    Args:
        item: the mesh.
        rig: the deforming armature.

    Returns:
        In Direct mode the modifier that the add-on disabled, even if the user has changed its
        object; otherwise the first armature modifier of this rig; None if there is none.
    """
    marked = saved.whole(item, parts.FINISHED, 0)
    own = None
    for modifier in item.modifiers:
        if isinstance(modifier, bpy.types.ArmatureModifier):
            if marked and compat.uid_of(modifier) == marked:
                return modifier
            if own is None and modifier.object == rig:
                own = modifier
    return own


def _modifiers(item: MeshObject, rig: ArmatureObject) -> Iterator[Sentence]:
    """Yield the reasons why the modifiers of a mesh prevent Direct mode.

    The armature modifier must be unchanged, enabled, and before all other enabled modifiers.
    """
    own = armature_of(item, rig)
    if own is None or own.object != rig:
        yield told("{mesh} has no armature modifier of {rig}.", mesh=item.name, rig=rig.name)
        return
    kin = (m for m in item.modifiers if isinstance(m, bpy.types.ArmatureModifier) and m != own)
    if any(modifier.object == rig for modifier in kin):
        yield told("{mesh} has several armature modifiers of {rig}.", mesh=item.name, rig=rig.name)
    enabled = own.show_viewport and own.show_render
    if not enabled and parts.FINISHED not in item:
        yield told("The armature modifier of {mesh} is disabled.", mesh=item.name)
    if _settings(own) != _PLAIN:
        yield told("The armature modifier of {mesh} was changed.", mesh=item.name)
    for modifier in item.modifiers:
        if modifier == own:
            return
        if modifier.show_viewport or modifier.show_render:
            yield told(
                "The modifier {modifier} of {mesh} comes before the armature modifier.",
                modifier=modifier.name,
                mesh=item.name,
            )


def _has_real_keys(item: MeshObject, live: runtime.Runtime) -> bool:
    """Whether a mesh has blend shapes but no live shape key, as with a key per channel (KEYS)."""
    number = runtime.mesh_number(live, item)
    moves = number is not None and live.morph(number).channel_indices.size > 0
    return moves and meshes.live_block(item) is None


def _keys(
    item: MeshObject, rig: ArmatureObject, live: runtime.Runtime, number: int
) -> Iterator[Sentence]:
    """Yield the reasons why the shape keys of a mesh prevent Direct mode.

    The live shape key must be unchanged, and no other shape key may have an effect.
    """
    key, block = item.data.shape_keys, meshes.live_block(item)
    if key is None or block is None:
        if key is not None:
            yield told("{mesh} has shape keys in use besides the live key.", mesh=item.name)
        return
    others = (b for b in key.key_blocks if b not in (block, key.reference_key))
    used = [b for b in others if b.value and not b.mute]
    pinned = item.show_only_shape_key or not key.use_relative
    if used or pinned or parts.REAL in key or next(_curves(key), None) is not None:
        yield told("{mesh} has shape keys in use besides the live key.", mesh=item.name)
    plain = block.value == 1.0 and not block.mute and not block.vertex_group
    if not plain or block.relative_key != key.reference_key:
        yield told("The live key of {mesh} was changed.", mesh=item.name)
    if len(block.points) != len(item.data.vertices):
        yield told("The number of vertices of {mesh} differs from the DNA file.", mesh=item.name)


def _readers(rig: ArmatureObject) -> Iterator[Sentence]:
    """Yield the reasons why bones have to be posed although no mesh needs them."""
    controls = parts.controls_there(rig)
    if rig.select_get():
        yield told("{rig} is selected.", rig=rig.name)
    if parts.JOINTS_SHOWN not in rig and armatures.joints_are_shown(rig):
        yield told("The joints of {rig} are shown.", rig=rig.name)
    own = {controls, *parts.meshes_of(rig)}
    for user in bpy.data.user_map(subset=[rig])[rig]:
        if isinstance(user, (bpy.types.Scene, bpy.types.Collection)):
            continue
        if isinstance(user, bpy.types.Object) and user in own and not _reads_bones(user, rig):
            continue
        if isinstance(user, bpy.types.Material) and not _drives_more(user, rig):
            continue
        yield told("{user} uses {rig}.", user=user.name, rig=rig.name)


def _reads_bones(item: bpy.types.Object, rig: ArmatureObject) -> bool:
    """Whether an object of the character reads the deforming armature.

    One modifier of a mesh object, the armature modifier, does not count.
    """
    count = 0
    for modifier in item.modifiers:
        properties = modifier.bl_rna.properties
        pointed = (getattr(modifier, p.identifier) for p in properties if p.type == "POINTER")
        count += any(thing == rig for thing in pointed)
    holds = [*item.constraints]
    if item.pose is not None:
        holds += [hold for bone in item.pose.bones for hold in bone.constraints]
    if count > (1 if item.type == "MESH" else 0) or any(_targets(hold, rig) for hold in holds):
        return True
    return _has_driver_on(item, rig) or _has_driver_on(item.data, rig)


def _targets(hold: bpy.types.Constraint, rig: ArmatureObject) -> bool:
    targets = [getattr(hold, "target", None), *(t.target for t in getattr(hold, "targets", ()))]
    return rig in targets


def _has_driver_on(owner: bpy.types.ID | None, rig: ArmatureObject) -> bool:
    data = getattr(owner, "animation_data", None)
    return any(
        target.id == rig
        for curve in (data.drivers if data else ())
        for variable in compat.driver_of(curve).variables
        for target in variable.targets
    )


def _drives_more(material: bpy.types.Material, rig: ArmatureObject) -> bool:
    """Whether a driver of a material or of its node tree reads the deforming armature."""
    return _has_driver_on(material, rig) or _has_driver_on(material.node_tree, rig)
