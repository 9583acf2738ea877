# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds a complete character in the scene from a DNA file; an error leaves the scene unchanged."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy

from ... import native
from ...logic.base import names
from ...logic.character import plans
from ...logic.material import texture_search
from ..base import compat, form, last_written, parts, sharing, storage
from ..base.blender_types import ArmatureObject, Context, MeshObject
from ..lod import lods
from ..material import materials
from . import armatures, meshes, runtime, values


@dataclass(frozen=True)
class BuildOptions:
    """Options of an import.

    Attributes:
        lods: levels of detail whose meshes are built; 0 is the finest.
        mode: shape keys of the meshes. LIVE: one shape key with the sum of all blend shape
            channels; AUTO: the same, in Direct mode if possible; KEYS: one shape key for each
            channel.
        normals: whether the file's normals are kept as custom normals.
        materials: whether materials are built.
        textures: whether to load textures from the folders near the file and from texture_folder.
        texture_folder: folder to search first; "": none.
        simple_materials: whether to make materials without subsurface, relief and animated maps.
        unit: metres per Blender unit; None or 0: the scene's unit.
        nearest_lods: whether to build the finest level of the DNA file if it has none of `lods`.
    """

    lods: tuple[int, ...] = (0,)
    mode: str = "AUTO"
    normals: bool = True
    materials: bool = True
    textures: bool = True
    texture_folder: str = ""
    simple_materials: bool = False
    unit: float | None = None
    nearest_lods: bool = False


@dataclass(frozen=True)
class _File:
    """A DNA file that was read and compiled.

    Attributes:
        path: path of the file.
        content: bytes of the file.
        dna: Dna parsed from these bytes.
        rig: risorius.Rig compiled from the Dna.
    """

    path: Path
    content: bytes
    dna: native.Dna
    rig: native.Rig


def _read(path: str | Path) -> _File:
    # Read the file only once, because another program may write it meanwhile.
    risorius = native.module()
    content = Path(path).read_bytes()
    dna = risorius.load(content)
    return _File(Path(path), content, dna, risorius.Rig(dna))


def import_file(
    context: Context,
    path: str | Path,
    options: BuildOptions,
    progress: Callable[[float], object] = lambda _share: None,
) -> tuple[ArmatureObject, list[str]]:
    """Build a character from a file.

    Args:
        context: a Blender context with scene and view layer.
        path: path of the DNA file.
        options: levels, shapes and materials to build.
        progress: function that is called with the progress, 0 to 1.

    Returns:
        The deforming armature, and warnings as sentences.

    Raises:
        OSError: the file cannot be read.
        DnaError: the file is damaged.
        PlanError, SpaceError: no character can be built from the file.
    """
    file = _read(path)
    dna = file.dna
    progress(0.15)
    unit = options.unit or context.scene.unit_settings.scale_length
    options = replace(options, unit=unit)
    if options.nearest_lods:
        options = replace(options, lods=plans.existing_lods(dna, options.lods))
    rests = file.rig.initial_raw_controls
    plan = plans.plan_character(dna, file.path.stem, options.lods, unit, rests)
    plan = replace(plan, name=names.unique_labels([plan.name], bpy.data.collections.keys())[0])
    progress(0.25)
    made = []
    try:
        rig, warnings = _build(context, plan, file, options, made, progress)
    except BaseException:
        _remove(made)
        runtime.forget_unused(parts.rigs())
        raise
    _turning, unfilled = native.part("rigs.joint_controls").joint_controls(dna)
    late = plans.layer_warnings(file.rig.ignored_layers)
    return rig, [*dna.warnings, *unfilled, *warnings, *late]


def _build(
    context: Context,
    plan: plans.CharacterPlan,
    file: _File,
    options: BuildOptions,
    made: list[bpy.types.ID],
    progress: Callable[[float], object],
) -> tuple[ArmatureObject, list[str]]:
    text = storage.store(plan.name, file.content, made)
    workshop = bpy.data.collections.new(f"{plan.name} (in the making)")
    made.append(workshop)
    context.scene.collection.children.link(workshop)
    rig = armatures.build_rig(context, plan, made, workshop)
    controls = armatures.build_controls(context, plan, made, workshop)
    assert options.unit is not None  # import_file has filled it in
    _connect(plan, rig, controls, text, file.path, options.unit)
    runtime.take(rig, file.dna, file.rig)
    progress(0.4)
    built = []
    for number, mesh_plan in enumerate(plan.meshes):
        item = meshes.build_mesh(plan, mesh_plan, rig, made, options.normals)
        parts.point(rig, f"{parts.MESH_PREFIX}{number:03d}", item)
        built.append(item)
        progress(0.4 + 0.3 * (number + 1) / len(plan.meshes))
    values.carry_on_largest(rig)
    warnings = []
    # Make drivers only after Blender evaluated the properties that they read, because a driver that
    # was evaluated without its property stays invalid.
    objects = [rig, controls, *built]
    for item in objects:
        workshop.objects.link(item)
    settle(context, rig, controls)
    armatures.pull_controls(rig, controls)
    if options.materials:
        found = _find_textures(plan, file.path, options)
        simple = options.simple_materials
        warnings = materials.build_materials(plan, rig, built, made, found, simple)
        rig[parts.TEXTURES] = found.summary()
    progress(0.8)
    _add_shapes(plan, file.dna, rig, built, options.mode)
    made += [key for item in built if (key := item.data.shape_keys) is not None]
    progress(0.95)
    _into_place(context, plan, workshop, rig, controls)
    lods.show(rig, _first(plan))
    return rig, warnings


def _first(plan: plans.CharacterPlan) -> int:
    return min(lod for mesh in plan.meshes for lod in mesh.lods)


def settle(context: Context, *items: bpy.types.Object) -> None:
    """Make Blender evaluate objects again after custom properties were added to them.

    Args:
        context: its view layer is updated.
        items: objects with new properties.
    """
    for item in items:
        item.update_tag()
    context.view_layer.update()


def _connect(
    plan: plans.CharacterPlan,
    rig: ArmatureObject,
    controls: ArmatureObject,
    text: bpy.types.Text,
    path: Path,
    unit: float,
) -> None:
    parts.point(controls, parts.RIG, rig)
    parts.point(rig, parts.CONTROLS, controls)
    parts.point(rig, parts.DNA, text)
    form.be_born(controls)
    rig[parts.UNIT] = unit
    rig[parts.LOD] = 0
    rig[parts.LOD_RENDER] = lods.SAME
    rig[parts.FOLLOW] = True
    for key in (parts.LOD, parts.LOD_RENDER, parts.FOLLOW):
        rig.property_overridable_library_set(f'["{key}"]', True)
    rig[parts.SOURCE] = _source(path)
    for key, value in plan.origin.items():
        controls.data[names.cut(f"dna_{key}")] = value


def _source(path: Path) -> str:
    """The path of a DNA file for the operator Reload.

    The path is relative to the .blend file if both files are on the same drive.
    """
    try:
        return bpy.path.relpath(str(path)) if bpy.data.filepath else str(path)
    except ValueError:  # the files are on different drives
        return str(path)


def _find_textures(
    plan: plans.CharacterPlan, path: Path, options: BuildOptions
) -> texture_search.TexturePlan:
    """The textures near the file and in the chosen folder; none if `options.textures` is off."""
    if not options.textures:
        return texture_search.TexturePlan()
    chosen = bpy.path.abspath(options.texture_folder) if options.texture_folder else ""
    folders = texture_search.folders_of(Path(path), chosen)
    return texture_search.find(plan.textures, [(m.base, m.kind) for m in plan.meshes], folders)


def _add_shapes(
    plan: plans.CharacterPlan,
    dna: native.Dna,
    rig: ArmatureObject,
    built: Sequence[MeshObject],
    mode: str,
) -> None:
    labels = channel_labels(dna)
    for item, mesh_plan in zip(built, plan.meshes, strict=True):
        dna_mesh = dna.meshes[mesh_plan.index]
        meshes.set_mode(item, rig, dna_mesh, plan.space, labels, _kind_of_keys(mode))
    choose_skinning(rig, mode)


def _kind_of_keys(mode: str) -> str:
    return "KEYS" if mode == "KEYS" else "LIVE"


def choose_skinning(rig: ArmatureObject, mode: str) -> None:
    """Store whether a face may use Direct mode (skinning/direct.py), which LIVE forbids.

    Args:
        rig: the deforming armature.
        mode: AUTO, LIVE or KEYS.
    """
    if mode == "LIVE":
        rig[parts.SKINNING] = mode
    else:
        rig.pop(parts.SKINNING, None)


def channel_labels(dna: native.Dna) -> list[str]:
    """Unique names for the shape keys of KEYS mode, one for each blend shape channel."""
    return names.unique_labels(dna.blend_shape_channel_names, ["Basis", plans.LIVE_KEY])


def _into_place(
    context: Context,
    plan: plans.CharacterPlan,
    workshop: bpy.types.Collection,
    rig: ArmatureObject,
    controls: ArmatureObject,
) -> None:
    """Give the character's collection its final name, and select only the control armature."""
    workshop.name = plan.name
    compat.deselect_all(context.view_layer)
    controls.select_set(True, view_layer=context.view_layer)
    context.view_layer.objects.active = controls


def change_mode(rig: ArmatureObject, mode: str) -> list[str]:
    """Switch the shape keys of a character's meshes to another mode.

    Args:
        rig: the deforming armature.
        mode: "LIVE": each mesh has one shape key with the sum of the blend shape channels, which
            the armature then deforms; "AUTO": the same, but the shape key gets the final positions
            if Direct mode is possible; "KEYS": one shape key for each blend shape channel.

    Returns:
        Sentences about meshes that could not be switched.
    """
    live = runtime.there(rig)
    trouble = []
    items = parts.meshes_of(rig)
    found = [(i, m) for i in items if (m := runtime.dna_mesh(live, i)) is not None]
    for item, dna_mesh in found:
        labels = channel_labels(live.dna)
        if not meshes.set_mode(item, rig, dna_mesh, live.space, labels, _kind_of_keys(mode)):
            trouble.append(
                f"{item.name} has not as many vertices as in its file: its shapes stay as they are."
            )
    choose_skinning(rig, mode)
    last_written.forget()
    return trouble


def remove(rig: ArmatureObject) -> None:
    """Remove a character and its datablocks from the .blend file.

    Datablocks that have other users stay.
    """
    controls = parts.controls_of(rig)
    text = storage.text_of(rig)
    items = parts.meshes_of(rig)
    data = [i.data for i in (*items, rig, controls) if i is not None]
    used = [m for i in items for m in i.data.materials if m is not None]
    collections = [c for c in bpy.data.collections if rig.name in c.objects]
    circles = {b.custom_shape for b in controls.pose.bones if b.custom_shape} if controls else ()
    data += [c.data for c in circles]
    images = [n.image for n in sharing.nodes_of(rig)]
    _remove([i for i in (*items, rig, controls) if i is not None])
    for left in (circles, data, used, images):
        _remove([d for d in dict.fromkeys(left) if d is not None and d.users == 0])
    if text is not None and not any(r.get(parts.DNA) == text for r in parts.rigs()):
        _remove([text])
    _remove([c for c in collections if not c.all_objects])


def _remove(made: Iterable[bpy.types.ID | None]) -> None:
    """Remove datablocks that still exist."""
    alive = []
    for item in dict.fromkeys(made):
        try:
            if item is not None and item.name and not isinstance(item, bpy.types.Key):
                alive.append(item)  # a Key is removed with its mesh
        except ReferenceError:
            continue
    if alive:
        bpy.data.batch_remove(alive)
