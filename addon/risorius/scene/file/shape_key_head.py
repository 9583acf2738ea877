# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes with shape keys as the input of a joint rig."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import cast

import bpy
import numpy as np
from numpy.typing import NDArray

from ... import native
from ...logic.base.errors import FaceError
from ...logic.base.sentences import told
from ..base import parts
from ..base.blender_types import Context, MeshObject
from ..base.task import Task, telling

Doubles = NDArray[np.float64]


class HeadError(FaceError, ValueError):
    """No rig can be made from a mesh; the sentence gives the reason."""


def usable_head(item: bpy.types.Object | None) -> bool:
    """Whether an object is a mesh with shape keys, and no part of a face."""
    if item is None or item.type != "MESH" or parts.rig_of(item) is not None:
        return False
    keys = cast(MeshObject, item).data.shape_keys
    return keys is not None and len(keys.key_blocks) > 1


def head_of(context: Context) -> MeshObject | None:
    """The active object if it is a mesh with shape keys, or the first selected one."""
    there = [context.active_object, *context.selected_objects]
    return next((cast(MeshObject, item) for item in there if usable_head(item)), None)


def taken_with(context: Context, head: MeshObject) -> list[MeshObject]:
    """The head and all other selected meshes.

    Args:
        context: has the selection.
        head: from head_of.
    """
    others = [item for item in context.selected_objects if item != head and _is_plain(item)]
    return [head, *(cast(MeshObject, item) for item in others)]


def relatives_of(context: Context, taken: Sequence[MeshObject]) -> list[MeshObject]:
    """The visible meshes that share an armature or a parent with the chosen meshes.

    Args:
        context: has the view.
        taken: from taken_with.
    """
    above = {owner for item in taken for owner in _owners(item)}
    return [
        cast(MeshObject, item)
        for item in context.visible_objects
        if item not in taken and _is_plain(item) and not above.isdisjoint(_owners(item))
    ]


def _is_plain(item: bpy.types.Object) -> bool:
    """Whether an object is a mesh with faces, and no part of a face that was imported."""
    if item.type != "MESH" or parts.rig_of(item) is not None:
        return False
    return bool(cast(MeshObject, item).data.polygons)


def _owners(item: bpy.types.Object) -> set[bpy.types.Object]:
    """The parents and armatures of an object."""
    found = {cast(bpy.types.ArmatureModifier, m).object for m in item.modifiers
             if m.type == "ARMATURE"}  # fmt: skip
    return {owner for owner in (*found, item.parent) if owner is not None}


def shapes_of(
    context: Context,
    item: MeshObject,
    others: Sequence[MeshObject] = (),
    height_mm: float = 0.0,
    said: Mapping[str, str | list[str]] | None = None,
) -> native.ShapeSet:
    """A head and its shape keys as risorius.author.input.shape_face.ShapeSet, in cm with y up.

    Rotation and scale of the objects are applied, the location of the head is not. A key counts as
    its difference from its relative key. Muted keys are left out.

    Args:
        context: its scene gives the unit.
        item: has shape keys, see usable_head.
        others: meshes that belong to the head: teeth, eyes, hair.
        height_mm: height of the face from the chin to the top; 0: keep its size.
        said: the user's assignments of keys, see risorius.author.input.said.

    Raises:
        HeadError: the keys are not relative, or the mesh has no polygons.
        ShapeFileError: no key moves a vertex.
    """
    if not item.data.polygons:
        raise HeadError(told("{name} has no faces.", name=item.name))
    heads, face = native.part("author.heads.parts"), native.part("author.input.shape_face")
    rows = [_part_of(context, one, item) for one in (item, *others)]
    # An object has the size that it has: a face that is made smaller would not fit its body.
    size = {"height_mm": height_mm} if height_mm else {"scale": 1.0}
    wishes = heads.Wishes(rather=item.name, **size)
    join = native.part("author.heads.joining").join
    joined = join(item.name, rows, "cm", wishes, said or {}, ("+X", "+Z", "-Y"))
    return face.shape_set(item.name, joined)


def _part_of(context: Context, item: MeshObject, head: MeshObject) -> native.HeadPart:
    """A mesh and its shape keys, seen from where the head is."""
    author, heads = native.part("author.input.obj"), native.part("author.heads.parts")
    # Blender's x, z and -y are the file's x, y and z.
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    axes *= 100.0 * context.scene.unit_settings.scale_length
    turn = axes @ np.array(item.matrix_world.to_3x3(), np.float64)
    apart = item.matrix_world.translation - head.matrix_world.translation
    shift = axes @ np.array(apart, np.float64)

    def points(key: bpy.types.ShapeKey | None) -> Doubles:
        out = np.empty(3 * len(item.data.vertices), np.float32)
        (item.data.vertices if key is None else key.data).foreach_get("co", out)
        return out.reshape(-1, 3).astype(np.float64) @ turn.T

    keys = item.data.shape_keys
    if keys is None:
        mesh = author.ObjMesh(points(None) + shift, *_polygons(item))
        return heads.HeadPart(item.name, mesh, {}, source=item.name)
    if not keys.use_relative:
        raise HeadError(told("The shape keys are not relative: turn on Relative in their panel."))
    cached = {key.name: points(key) for key in keys.key_blocks}
    deltas = {
        key.name: cached[key.name] - cached[key.relative_key.name]
        for key in keys.key_blocks
        if key != keys.reference_key and not key.mute
    }
    mesh = author.ObjMesh(cached[keys.reference_key.name] + shift, *_polygons(item))
    return heads.HeadPart(item.name, mesh, deltas, source=item.name)


def _polygons(item: MeshObject) -> tuple[Doubles, list[list[int]], list[list[int]]]:
    """Texture coordinates, and by polygon the vertices and the places in these coordinates."""
    mesh = item.data
    vertices = np.empty(len(mesh.loops), np.int32)
    mesh.loops.foreach_get("vertex_index", vertices)
    starts = np.empty(len(mesh.polygons), np.int32)
    mesh.polygons.foreach_get("loop_start", starts)
    faces = [part.tolist() for part in np.split(vertices, starts[1:])]
    layer = mesh.uv_layers.active
    if layer is None:
        return np.zeros((0, 2)), faces, [[] for _ in faces]
    uvs = np.empty(2 * len(mesh.loops), np.float32)
    layer.data.foreach_get("uv", uvs)
    unique, place = np.unique(uvs.reshape(-1, 2), axis=0, return_inverse=True)
    places = [part.tolist() for part in np.split(place.ravel(), starts[1:])]
    return unique.astype(np.float64), faces, places


def rig_task(
    shapes: native.ShapeSet,
    path: str,
    joints: int,
    levels: int,
    tolerance_mm: float | None = None,
    *,
    keep: bool = True,
    said: Mapping[str, str | list[str]] | None = None,
) -> Task[tuple[native.JointRig, list[str]]]:
    """The task that makes a joint rig and writes its file; a cancelled task leaves no file.

    Args:
        shapes: from shapes_of.
        path: of the DNA file.
        joints: number of new joints.
        levels: number of levels of detail.
        tolerance_mm: largest error of joints without a blend shape; None: a share of the height.
        keep: whether there are blend shapes; False: joints alone.
        said: the user's assignments of keys, see risorius.author.input.said.

    Returns:
        A task whose result is risorius.author.JointRig and sentences about oddities.
    """
    author = native.part("author")
    face, matching = native.part("author.input.shape_face"), native.part("author.input.matching")
    library = native.part("author.input.library")

    def work(
        progress: Callable[[float], None], cancelled: Callable[[], bool]
    ) -> tuple[native.JointRig, list[str]]:
        odd = face.check_shapes(shapes)
        became = matching.assign(shapes.expressions, said or {})
        odd += became.notes
        dna = face.make_shape_face(shapes, became.controls)
        options = author.RigOptions(
            author.FitOptions(joints=joints),
            tolerance_mm,
            shapes=keep,
            lods=author.LodOptions(count=levels),
            kept=shapes.kept,
        )
        rig = author.make_joint_rig(dna, options, telling(progress, cancelled))
        if not cancelled():
            rig.dna.save(path)
            if became.expressions:
                folder = library.library_folder(Path(path))
                native.part("files.fileio").write_all(library.library_files(became, folder))
                odd.extend(library.about_library(became, folder))
        return rig, odd

    return Task(work)


def take_materials(meshes: Sequence[MeshObject], shapes: native.ShapeSet) -> None:
    """Give the meshes of LOD 0 the materials of their source objects.

    Both have the same polygons in the same order.

    Args:
        meshes: meshes of the face.
        shapes: the input of the face, from shapes_of.
    """
    for number, part in enumerate(shapes.parts):
        item = bpy.data.objects.get(part.source)
        made = next((m for m in meshes if m[parts.MESH] == number), None)
        if item is None or item.type != "MESH" or made is None:
            continue
        source = cast(MeshObject, item).data
        index = np.empty(len(source.polygons), np.int32)
        source.polygons.foreach_get("material_index", index)
        if part.polygons is not None:
            index = index[part.polygons]
        if not source.materials or len(made.data.polygons) != len(index):
            continue
        made.data.materials.clear()
        for material in source.materials:
            made.data.materials.append(material)
        made.data.polygons.foreach_set("material_index", index)
