# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads meshes and shape keys of Blender objects, and makes a joint rig (DNA file) from them."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple, cast

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
    """No rig can be made from a mesh; the text gives the reason."""


def usable_head(item: bpy.types.Object | None) -> bool:
    """Whether an object is a mesh with a shape key besides the basis, and no part of a face."""
    if item is None or item.type != "MESH" or parts.rig_of(item) is not None:
        return False
    keys = cast(MeshObject, item).data.shape_keys
    return keys is not None and len(keys.key_blocks) > 1


def head_of(context: Context) -> MeshObject | None:
    """The active object if `usable_head` accepts it, else the first selected object it accepts.

    None if it accepts no such object.
    """
    there = [context.active_object, *context.selected_objects]
    return next((cast(MeshObject, item) for item in there if usable_head(item)), None)


def taken_with(context: Context, head: MeshObject) -> list[MeshObject]:
    """The head and all other selected meshes with polygons that are no part of a face.

    Args:
        context: has the selection.
        head: result of head_of.
    """
    others = [item for item in context.selected_objects if item != head and is_plain(item)]
    return [head, *(cast(MeshObject, item) for item in others)]


def relatives_of(context: Context, taken: Sequence[MeshObject]) -> list[MeshObject]:
    """Other visible meshes that share an armature or a parent with the chosen meshes.

    Args:
        context: has the visible objects.
        taken: the chosen meshes, from taken_with.
    """
    above = {owner for item in taken for owner in _owners(item)}
    return [
        cast(MeshObject, item)
        for item in context.visible_objects
        if item not in taken and is_plain(item) and not above.isdisjoint(_owners(item))
    ]


def is_plain(item: bpy.types.Object | None) -> bool:
    """Whether an object is a mesh with polygons, and no part of an imported face."""
    if item is None or item.type != "MESH" or parts.rig_of(item) is not None:
        return False
    return bool(cast(MeshObject, item).data.polygons)


def _owners(item: bpy.types.Object) -> set[bpy.types.Object]:
    """The parent of an object and the armatures that deform it."""
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

    Rotation and scale of the objects are applied; the location of the head is the origin. A shape
    is the difference between a shape key and the shape key to which it is relative. Muted shape
    keys are left out.

    Args:
        context: its scene gives the unit.
        item: mesh object of the head with shape keys.
        others: meshes that belong to the head: teeth, eyes, hair.
        height_mm: the head is scaled to this height from chin to top of the head; 0: no scaling.
        said: name of a shape key -> the meaning that the user chose: the name of a raw control
            without prefix, "=" followed by the name of an ARKit unit, "@" followed by the name of
            an expression, or a list of raw controls; [] leaves the key out.

    Raises:
        HeadError: the shape keys are not relative, or the mesh has no polygons.
        ShapeFileError: no shape key moves a vertex.
    """
    if not item.data.polygons:
        raise HeadError(told("{name} has no polygons.", name=item.name))
    heads, face = native.part("author.heads.parts"), native.part("author.input.shape_face")
    rows = [part_of(context, one, item) for one in (item, *others)]
    # Keep the size by default, because a scaled face would not fit its body.
    size = {"height_mm": height_mm} if height_mm else {"scale": 1.0}
    wishes = heads.Wishes(rather=item.name, **size)
    join = native.part("author.heads.joining").join
    joined = join(item.name, rows, "cm", wishes, said or {}, ("+X", "+Z", "-Y"))
    return face.shape_set(item.name, joined)


def turn_of(context: Context, item: bpy.types.Object) -> Doubles:
    """float64[3, 3]: from object space to centimetres; x to the head's left, y up, z to the front.

    Args:
        context: its scene gives the unit.
        item: object whose rotation and scale are included.
    """
    return np.asarray(_axes(context) @ np.array(item.matrix_world.to_3x3(), np.float64))


def _axes(context: Context) -> Doubles:
    """float64[3, 3]: from Blender's axes and unit to the axes x, z, -y in centimetres."""
    axes = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    return axes * 100.0 * context.scene.unit_settings.scale_length


def part_at_rest(context: Context, item: MeshObject, head: MeshObject) -> native.HeadPart:
    """The neutral mesh of an object, in centimetres with y up.

    Without a visible Mirror modifier, the result has the positions of the reference shape key. With
    a visible Mirror modifier, the result is the mesh after the modifier, which includes the shape
    keys at their current values.

    Args:
        context: its scene gives the unit.
        item: the object.
        head: mesh object of the head; its location becomes the origin.
    """
    author, heads = native.part("author.input.obj"), native.part("author.heads.parts")
    keys, whole = item.data.shape_keys, _mirrored(context, item)
    mesh = whole if whole is not None else item.data
    apart = item.matrix_world.translation - head.matrix_world.translation
    held = keys.reference_key.data if keys is not None and whole is None else mesh.vertices
    points = np.empty(3 * len(mesh.vertices), np.float32)
    held.foreach_get("co", points)
    placed = points.reshape(-1, 3).astype(np.float64) @ turn_of(context, item).T
    placed += _axes(context) @ np.array(apart, np.float64)
    out = heads.HeadPart(item.name, author.ObjMesh(placed, *_polygons(mesh)), source=item.name)
    out.groups = _groups(item, mesh, placed)
    if whole is not None:
        bpy.data.meshes.remove(whole)
    return out


def _groups(item: MeshObject, mesh: bpy.types.Mesh, points: Doubles) -> dict[str, Doubles]:
    """Name of each vertex group -> float64[n, 3], positions of the vertices with a weight above
    0.5. Groups whose names tell nothing about a head are left out.

    Args:
        item: the object, which has the names of the groups.
        mesh: its mesh, perhaps with modifiers applied, which has the weights.
        points: float64[V, 3], the positions of the mesh's vertices.
    """
    place_of = native.part("anyhead.landmarks.groups").place_of
    names = {group.index: group.name for group in item.vertex_groups if place_of(group.name)}
    held: dict[str, list[int]] = {name: [] for name in names.values()}
    for vertex in mesh.vertices if names else ():
        for row in vertex.groups:
            if row.weight > 0.5 and row.group in names:
                held[names[row.group]].append(vertex.index)
    return {name: points[own] for name, own in held.items() if own}


def _mirrored(context: Context, item: MeshObject) -> bpy.types.Mesh | None:
    """A new mesh with the shown Mirror modifiers of an object applied; None if there is none."""
    kinds = [modifier.type for modifier in item.modifiers if modifier.show_viewport]
    if "MIRROR" not in kinds:
        return None
    twin = item.copy()
    for modifier in list(twin.modifiers):
        if modifier.type != "MIRROR":
            twin.modifiers.remove(modifier)
    context.scene.collection.objects.link(twin)
    seen = twin.evaluated_get(context.evaluated_depsgraph_get())
    mesh = bpy.data.meshes.new_from_object(seen)
    bpy.data.objects.remove(twin)
    return mesh


def part_of(context: Context, item: MeshObject, head: MeshObject) -> native.HeadPart:
    """A mesh and its shape keys in centimetres with y up, relative to the head's location.

    Args:
        context: its scene gives the unit.
        item: the mesh object.
        head: mesh object of the head, whose location is the origin.

    Raises:
        HeadError: the shape keys are not relative.
    """
    if item.data.shape_keys is None:
        return part_at_rest(context, item, head)
    author, heads = native.part("author.input.obj"), native.part("author.heads.parts")
    turn = turn_of(context, item)
    apart = item.matrix_world.translation - head.matrix_world.translation
    shift = _axes(context) @ np.array(apart, np.float64)

    def points(key: bpy.types.ShapeKey) -> Doubles:
        out = np.empty(3 * len(item.data.vertices), np.float32)
        key.data.foreach_get("co", out)
        return out.reshape(-1, 3).astype(np.float64) @ turn.T

    keys = item.data.shape_keys
    if not keys.use_relative:
        raise HeadError(
            told("The shape keys are not relative: turn on Relative in the panel Shape Keys.")
        )
    cached = {key.name: points(key) for key in keys.key_blocks}
    deltas = {
        key.name: cached[key.name] - cached[key.relative_key.name]
        for key in keys.key_blocks
        if key != keys.reference_key and not key.mute
    }
    mesh = author.ObjMesh(cached[keys.reference_key.name] + shift, *_polygons(item.data))
    return heads.HeadPart(item.name, mesh, deltas, source=item.name)


def _polygons(mesh: bpy.types.Mesh) -> tuple[Doubles, list[list[int]], list[list[int]]]:
    """float64[n, 2] unique UV coordinates; for each polygon its vertex indices, and its indices
    into the UV coordinates."""
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


class Rigged(NamedTuple):
    """Result of making a joint rig.

    Attributes:
        rig: the joint rig with its DNA.
        odd: sentences about problems of the head's meshes and shapes.
    """

    rig: native.JointRig
    odd: list[str]


class RigWishes(NamedTuple):
    """Options of a joint rig.

    Attributes:
        path: path of the DNA file to write.
        joints: number of new joints.
        levels: number of levels of detail.
        tolerance_mm: largest error of joints alone; blend shapes correct larger errors. None: a
            fraction of the head's height.
        keep: True: add corrective blend shapes; False: joints only.
    """

    path: str
    joints: int
    levels: int
    tolerance_mm: float | None = None
    keep: bool = True


def rig_task(
    shapes: native.ShapeSet,
    wishes: RigWishes,
    said: Mapping[str, str | list[str]] | None = None,
) -> Task[Rigged]:
    """A task that makes a joint rig and writes its DNA file and expressions.

    A cancelled task writes no file.

    Args:
        shapes: the head and its shapes, from shapes_of.
        wishes: options of the rig.
        said: name of a shape key -> the user's meaning, in the form that shapes_of describes.
    """

    def work(progress: Callable[[float], None], cancelled: Callable[[], bool]) -> Rigged:
        return make_rig(shapes, wishes, said, progress, cancelled)

    return Task(work)


def make_rig(
    shapes: native.ShapeSet,
    wishes: RigWishes,
    said: Mapping[str, str | list[str]] | None,
    progress: Callable[[float], None],
    cancelled: Callable[[], bool],
) -> Rigged:
    """Make a joint rig and write its DNA file and expressions, without using Blender data.

    Args:
        shapes: the head and its shapes, from shapes_of.
        wishes: options of the rig.
        said: name of a shape key -> the user's meaning, in the form that shapes_of describes.
        progress: function that is called with the progress, 0 to 1.
        cancelled: function that returns whether to stop; then no file is written.
    """
    face, matching = native.part("author.input.shape_face"), native.part("author.input.matching")
    library = native.part("author.input.library")
    odd = face.check_shapes(shapes)
    became = matching.assign(shapes.expressions, said or {})
    odd += became.notes
    dna = face.make_shape_face(shapes, became.controls)
    rig = joint_rig(dna, wishes, shapes.kept, telling(progress, cancelled))
    if not cancelled():
        rig.dna.save(wishes.path)
        if became.expressions:
            folder = library.library_folder(Path(wishes.path))
            native.part("files.fileio").write_all(library.library_files(became, folder))
            odd.extend(library.about_library(became, folder))
    return Rigged(rig, odd)


def joint_rig(
    dna: native.Dna,
    wishes: RigWishes,
    kept: Sequence[str],
    progress: Callable[[float], bool],
    fit_vertices: int | None = None,
) -> native.JointRig:
    """Make a joint rig from a face of blend shapes.

    Args:
        dna: the face with blend shapes.
        wishes: options of the rig.
        kept: texts; a mesh whose name contains one of them keeps its skin weights and blend
            shapes.
        progress: function that is called with the progress, 0 to 1; it returns False to cancel.
        fit_vertices: number of vertices to which joints are fitted; None: the default number.
    """
    author = native.part("author")
    options = author.RigOptions(
        author.FitOptions(joints=wishes.joints),
        wishes.tolerance_mm,
        shapes=wishes.keep,
        lods=author.LodOptions(count=wishes.levels),
        kept=tuple(kept),
    )
    if fit_vertices is not None:
        options = dataclasses.replace(options, fit_vertices=fit_vertices)
    rig: native.JointRig = author.make_joint_rig(dna, options, progress)
    return rig


def take_materials(meshes: Sequence[MeshObject], shapes: native.ShapeSet) -> None:
    """Give the meshes of LOD 0 the materials of the objects that the face was made from.

    A new mesh must have the polygons of its object, or the part of them that the face uses, in the
    same order. They may be repeated, as a Mirror modifier repeats them. If the numbers of polygons
    do not fit, the mesh is skipped.

    Args:
        meshes: mesh objects of the new face.
        shapes: the result of shapes_of from which the face was made.
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
        count = len(made.data.polygons)
        if not source.materials or not len(index) or count % len(index):
            continue
        index = np.tile(index, count // len(index))  # repeat for polygons of a Mirror modifier
        made.data.materials.clear()
        for material in source.materials:
            made.data.materials.append(material)
        made.data.polygons.foreach_set("material_index", index)
