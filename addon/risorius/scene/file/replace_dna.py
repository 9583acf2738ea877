# SPDX-License-Identifier: GPL-3.0-or-later
"""Replaces a character's DNA file and keeps its objects.

The new character is built as separate objects first, so that a bad file changes nothing. Then its
data move into the existing objects, meshes, shape keys and bones. So references to these data, and
additions by the user, stay.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, cast

import bpy

from ...logic.base import names
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ...logic.character import plans
from ..base import console, drivers, last_written, parts, saved, storage
from ..base.blender_types import ArmatureObject, Context, MeshObject
from ..character import armatures, board, board_bones, build, runtime, values
from ..gaze import gaze_settings
from ..lod import lods
from ..skinning import ordinary, skins
from ..upkeep import duplicates
from . import refit_joints, refit_meshes
from .file_change import Change


class ReplaceError(FaceError):
    """A character's file cannot be replaced; the text is one sentence for users."""


def replace_file(
    context: Context,
    rig: ArmatureObject,
    path: str | Path,
    progress: Callable[[float], object] = lambda _share: None,
) -> list[str]:
    """Replace the DNA file of a character by another DNA file.

    Args:
        context: a Blender context with scene and view layer.
        rig: deforming armature of the character.
        path: path of the DNA file; it may be the same file.
        progress: function that is called with the progress, 0 to 1.

    Returns:
        Sentences about new parts, removed parts, and the user's additions. They are also written to
        a Text and to the console.

    Raises:
        ReplaceError: the character cannot be changed now.
        OSError, DnaError, PlanError, SpaceError: the file cannot be used; nothing was changed.
    """
    _check(rig)
    with armatures.kept_selection(context):
        before = runtime.there(rig)
        unit = runtime.unit_of(rig)
        levels = tuple(lods.built(rig)) or (0,)
        old = plans.plan_character(before.dna, rig.name, levels, unit, before.rests)
        fresh, warnings = build.import_file(
            context, path, _options(rig, levels, unit), lambda share: progress(share * 0.7)
        )
        gaze_settings.begin(parts.controls_there(fresh), runtime.there(fresh))
        after = runtime.there(fresh).with_board(before.board)
        now = tuple(lods.built(fresh))
        new = plans.plan_character(after.dna, rig.name, now, unit, after.rests)
        change = Change(rig, before, after, old, new, report=list(warnings))
        led, places = board.leads_face(rig), board.places_of(parts.controls_there(rig), before)
        _exchange(context, change, fresh)
        progress(0.95)
        _renew_board(context, change, led, places)
    context.view_layer.update()
    _keep_report(change)
    return change.report


def _check(rig: ArmatureObject) -> None:
    controls = parts.controls_of(rig)
    if runtime.of(rig) is None or controls is None:
        raise ReplaceError(told("{face} has lost its data or its control armature.", face=rig.name))
    for item in (rig, controls, *parts.meshes_of(rig)):
        if item.library or item.override_library or item.data.library:
            raise ReplaceError(
                told(
                    "{name} is linked: replace its DNA in the .blend file that contains the face.",
                    name=item.name,
                )
            )
        if item.mode == "EDIT":
            raise ReplaceError(told("{name} is in edit mode: leave that first.", name=item.name))


def _options(rig: ArmatureObject, levels: tuple[int, ...], unit: float) -> build.BuildOptions:
    meshes = parts.meshes_of(rig)
    return build.BuildOptions(
        lods=levels,
        mode="LIVE",
        normals=any(m.data.has_custom_normals for m in meshes) or not meshes,
        unit=unit,
        nearest_lods=True,
    )


def _exchange(context: Context, change: Change, fresh: ArmatureObject) -> None:
    """Move the data of the new character into the old objects, and remove the new objects.

    Args:
        context: a Blender context with a view layer.
        change: the replacement.
        fresh: deforming armature of the newly built character.
    """
    rig = change.rig
    ordinary.leave(rig)
    refit_joints.replace_joints(context, change)
    fresh_meshes = {m[parts.MESH]: m for m in parts.meshes_of(fresh)}
    kept = refit_meshes.replace_meshes(change, fresh_meshes)
    _take_properties(change, fresh)
    values.carry_on_largest(rig)
    _sliders(change)
    entries = drivers.Entries(rig, _array_labels(change))
    build.settle(context, rig, parts.controls_there(rig), parts.carrier_of(rig))
    entries.move()
    values.point_materials(rig, parts.carrier_of(rig))
    _report_entries(change, entries)
    for index in [i for i in fresh_meshes if i not in kept]:
        _adopt(change, fresh, fresh_meshes[index])
    refit_meshes.finish_shapes(change)
    _number_meshes(rig)
    lods.show(rig)
    refit_joints.replace_control_places(context, change)
    build.remove(fresh)
    lods.show(rig)
    last_written.forget()
    skins.forget({item.session_uid for item in parts.meshes_of(rig)})
    for item in (rig, parts.controls_there(rig), *parts.meshes_of(rig)):
        item.update_tag()


def _array_labels(change: Change) -> dict[str, tuple[list[str], list[str]]]:
    runs = (change.before, change.after)
    return {
        parts.CHANNELS: (build.channel_labels(runs[0].dna), build.channel_labels(runs[1].dna)),
        parts.MAPS: (
            names.unique_labels(runs[0].dna.animated_map_names),
            names.unique_labels(runs[1].dna.animated_map_names),
        ),
    }


def _report_entries(change: Change, entries: drivers.Entries) -> None:
    gone = set(entries.gone)
    for array, is_gone, drove, is_new in (
        (
            parts.CHANNELS,
            "The blend shape {label} is gone.",
            "The blend shape {label} is gone: what it drove reads 0 now.",
            "New blend shapes: {added}.",
        ),
        (
            parts.MAPS,
            "The animated map {label} is gone.",
            "The animated map {label} is gone: what it drove reads 0 now.",
            "New animated maps: {added}.",
        ),
    ):
        old, new = _array_labels(change)[array]
        for label in [x for x in old if x not in new]:
            change.report.append(told(drove if label in gone else is_gone, label=label))
        added = [x for x in new if x not in old]
        if added:
            change.report.append(told(is_new, added=names.listed(added)))


def _take_properties(change: Change, fresh: ArmatureObject) -> None:
    """Copy the stored DNA file and the armatures' properties to the old rig.

    The arrays of animated maps and blend shape channels get the lengths for the new file.

    Args:
        change: the replacement.
        fresh: deforming armature of the newly built character.
    """
    rig, controls = change.rig, parts.controls_there(change.rig)
    text, former = fresh[parts.DNA], storage.text_of(rig)
    label = former.name if former is not None else text.name
    parts.point(rig, parts.DNA, text)
    rig[parts.SOURCE] = fresh[parts.SOURCE]
    # Delete the new character's pointer to the Text. Otherwise its removal would remove the Text.
    del fresh[parts.DNA]
    used = [r.get(parts.DNA) for r in parts.rigs()]
    if former is not None and former not in used:
        bpy.data.texts.remove(former)
        if used.count(text) == 1:  # a shared Text keeps its name
            text.name = label
    for name in armatures.LIVE_PROPERTIES:
        if saved.length(rig, name) != saved.length(fresh, name):
            rig.pop(name, None)  # the length of an overridable array cannot change
            rig[name] = [0.0] * saved.length(fresh, name)
        rig.property_overridable_library_set(f'["{name}"]', True)
    levels = sorted({lod for mesh in change.new.meshes for lod in mesh.lods})
    for key in (parts.LOD, parts.LOD_RENDER):
        if saved.whole(rig, key, lods.SAME - 1) not in (*levels, lods.SAME):
            rig.pop(key, None)
            rig[key] = levels[0]
    # Bones, blend shape channels and animated maps have new indices, so forget the last written
    # values.
    last_written.forget()
    for key in change.old.origin:
        controls.data.pop(names.cut(f"dna_{key}"), None)
    for key, value in change.new.origin.items():
        controls.data[names.cut(f"dna_{key}")] = value


def _adopt(change: Change, fresh: ArmatureObject, item: MeshObject) -> None:
    """Add a mesh that only the new file has to the character, unless the user deleted it before.

    Args:
        change: the replacement.
        fresh: deforming armature of the newly built character.
        item: the newly built mesh object.
    """
    rig = change.rig
    label = next(m.label for m in change.new.meshes if m.index == item[parts.MESH])
    was = {names.unique_labels(change.before.dna.mesh_names)[m.index] for m in change.old.meshes}
    if label in was:
        change.report.append(
            told(
                "The mesh {label} was deleted here and stays away, although the DNA file has it.",
                label=label,
            )
        )
        return
    for key in [k for k in fresh.keys() if fresh[k] == item]:  # noqa: SIM118  no dict
        del fresh[key]
    parts.point(item, parts.RIG, rig)
    parts.point(rig, f"{parts.MESH_PREFIX}new{item[parts.MESH]:03d}", item)
    item.parent = rig
    for modifier in item.modifiers:
        if modifier.type == "ARMATURE":
            cast("bpy.types.ArmatureModifier", modifier).object = rig
    refit_joints.rename_groups(change, item)
    home = next((m for m in parts.meshes_of(rig) if m != item), rig)
    for collection in item.users_collection:
        collection.objects.unlink(item)
    for collection in home.users_collection:
        collection.objects.link(item)
    item.name = item.data.name = f"{rig.name.removesuffix('_rig')}_{label}"
    duplicates.retarget_materials(item, rig)
    _share_materials(change, item)
    change.report.append(told("The mesh {label} is new.", label=label))


def _share_materials(change: Change, item: MeshObject) -> None:
    """Give a mesh of a new level of detail the materials of the same mesh in another level."""
    by_index = {m.index: m for m in change.new.meshes}
    base = by_index[item[parts.MESH]].base
    for other in parts.meshes_of(change.rig):
        plan = by_index.get(other[parts.MESH])
        worn = [m for m in other.data.materials if m is not None]
        if other != item and plan is not None and plan.base == base and worn:
            for slot in range(len(item.data.materials)):
                item.data.materials[slot] = worn[slot] if slot < len(worn) else worn[0]
            return


def _number_meshes(rig: ArmatureObject) -> None:
    """Rewrite the rig's pointers to its meshes in the order of the DNA file."""
    there = sorted(parts.meshes_of(rig), key=lambda m: (m[parts.MESH], m.name))
    for key in [k for k in rig.keys() if k.startswith(parts.MESH_PREFIX)]:  # noqa: SIM118
        del rig[key]
    for number, item in enumerate(there):
        parts.point(rig, f"{parts.MESH_PREFIX}{number:03d}", item)


def _sliders(change: Change) -> None:
    """Add the sliders of the new file, and remove sliders that only the old file has.

    Sliders with keys or drivers are not removed.
    """
    controls = parts.controls_there(change.rig)
    face = controls.pose.bones[parts.FACE]
    maximum = parts.maximum_of(controls)
    old = {c.label: c for c in change.old.controls}
    new = {c.label: c for c in change.new.controls}
    for label, control in new.items():
        before = old.get(label)
        if label not in face:
            armatures.add_properties(face, [control], maximum)
        elif before is None or (before.rest, before.lowest) != (control.rest, control.lowest):
            if before is not None and float(face[label]) == before.rest:
                face[label] = control.rest
            armatures.describe_property(face, control, maximum)
    added = [label for label in new if label not in old]
    if added:
        change.report.append(told("New controls: {added}.", added=", ".join(added)))
    gone = [label for label in old if label not in new and label in face]
    used = drivers.used_controls(controls, gone)
    for label in gone:
        if label in used:
            shown: Any = face.id_properties_ui(label)
            shown.update(description="Not in the present file; its keys are kept")
            change.report.append(
                told("The control {label} is gone; its keys and drivers are kept.", label=label)
            )
        else:
            del face[label]
            change.report.append(told("The control {label} is gone.", label=label))


def _renew_board(
    context: Context,
    change: Change,
    led: bool,
    places: Mapping[str, tuple[float, ...]],
) -> None:
    """Build a face board for the new file; handles with the same names keep their location.

    Nothing changes if there was no board, or if both files have the same handles.

    Args:
        context: with a view layer.
        change: the replacement.
        led: whether the board led before the replacement.
        places: bone -> location of each handle before the replacement; empty without a board.
    """
    if not places or board.is_same(change.before, change.after):
        return
    controls = parts.controls_there(change.rig)
    board_bones.remove(context, change.rig)
    board.set_kind(controls, change.before.board)
    if board_bones.add(context, change.rig):
        board.put_places(controls, change.after, places)
        board.set_lead(controls, led)
    old = {handle.bone for handle in change.before.handles}
    new = {handle.bone for handle in change.after.handles}
    if new - old:
        listed = names.listed(sorted(new - old))
        change.report.append(told("New on the face board: {names}.", names=listed))
    if old - new:
        listed = names.listed(sorted(old - new))
        change.report.append(told("Removed from the face board: {names}.", names=listed))


def _keep_report(change: Change) -> None:
    """Write the report of a replacement to a Text and to the console."""
    name = change.rig.name.removesuffix("_rig")
    if not change.report:
        return
    title = f"{name} replace report"
    text = bpy.data.texts.get(title) or bpy.data.texts.new(title)
    lines = [f"{name} is now {Path(change.rig[parts.SOURCE]).name}.", *change.report]
    text.from_string("\n".join(lines) + "\n")
    console.say(*lines)
