# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh with shape keys of any make as what a joint rig is made from."""

from __future__ import annotations

from collections.abc import Callable
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
    """A mesh that no rig can be made of; the sentence says why."""


def usable_head(item: bpy.types.Object | None) -> bool:
    """Whether an object is a mesh with shape keys, and no part of a face."""
    if item is None or item.type != "MESH" or parts.rig_of(item) is not None:
        return False
    keys = cast(MeshObject, item).data.shape_keys
    return keys is not None and len(keys.key_blocks) > 1


def shapes_of(context: Context, item: MeshObject) -> native.ShapeSet:
    """The mesh and its shape keys as risorius.author.input.shape_face.ShapeSet, in cm with y up.

    Rotation and size of the object count, its place does not. A key is what it adds to the key that
    it is relative to; muted ones are left out.

    Args:
        context: the scene says what a unit is.
        item: has shape keys, see usable_head.

    Raises:
        HeadError: the keys are not relative, or the mesh has no polygons.
    """
    keys = item.data.shape_keys
    if keys is None or not keys.use_relative:
        raise HeadError(told("The shape keys are not relative: turn on Relative in their panel."))
    if not item.data.polygons:
        raise HeadError(told("{name} has no faces.", name=item.name))
    author, face = native.part("author.input.obj"), native.part("author.input.shape_face")
    turn = np.array(item.matrix_world.to_3x3())
    # Blender's x, z and -y are the file's x, y and z.
    turn = turn[[0, 2, 1]] * np.array([[1.0], [1.0], [-1.0]])
    turn *= 100.0 * context.scene.unit_settings.scale_length

    def points(key: bpy.types.ShapeKey) -> Doubles:
        out = np.empty(3 * len(item.data.vertices), np.float32)
        key.data.foreach_get("co", out)
        return out.reshape(-1, 3).astype(np.float64) @ turn.T

    cached = {key.name: points(key) for key in keys.key_blocks}
    deltas = {
        key.name: cached[key.name] - cached[key.relative_key.name]
        for key in keys.key_blocks
        if key != keys.reference_key and not key.mute
    }
    mesh = author.ObjMesh(cached[keys.reference_key.name], *_polygons(item))
    return face.ShapeSet(item.name, mesh, deltas)


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
) -> Task[tuple[native.JointRig, list[str]]]:
    """The making of a joint rig, which ends with the file; a cancelled one leaves none.

    Args:
        shapes: as shapes_of gives them.
        path: of the DNA file.
        joints: new ones.
        levels: of detail.
        tolerance_mm: blend shapes keep what joints leave beyond it; None: a share of the height.
        keep: whether there are blend shapes; False: joints alone.

    Returns:
        A task whose result is risorius.author.JointRig and what is odd, a sentence each.
    """
    author = native.part("author")
    face, matching = native.part("author.input.shape_face"), native.part("author.input.matching")
    library = native.part("author.input.library")

    def work(
        progress: Callable[[float], None], cancelled: Callable[[], bool]
    ) -> tuple[native.JointRig, list[str]]:
        odd = face.check_shapes(shapes)
        became = matching.assign(shapes.expressions, {})
        odd += became.notes
        dna = face.make_shape_face(shapes, became.controls)
        options = author.RigOptions(
            author.FitOptions(joints=joints),
            tolerance_mm,
            shapes=keep,
            lods=author.LodOptions(count=levels),
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


def take_materials(face: MeshObject, item: MeshObject) -> None:
    """The head's materials on the new mesh, whose polygons are the same in the same order.

    Args:
        face: the new mesh.
        item: the head.
    """
    made = face.data
    if not item.data.materials or len(made.polygons) != len(item.data.polygons):
        return
    made.materials.clear()
    for material in item.data.materials:
        made.materials.append(material)
    index = np.empty(len(made.polygons), np.int32)
    item.data.polygons.foreach_get("material_index", index)
    made.polygons.foreach_set("material_index", index)
