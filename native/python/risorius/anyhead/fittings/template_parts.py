# SPDX-License-Identifier: MIT
"""Reads the meshes of a template (a DNA file) that can be fitted into a head that lacks them."""

from __future__ import annotations

import numpy as np

from ... import Dna, Mesh
from ...author.correctives.poser import Poser
from ...author.geometry.skeleton import Doubles
from ...author.heads.parts import HeadPart
from ...author.input.obj import ObjMesh
from ...author.work import listed_meshes
from ...gameface.parts import axes_of

_CM = 100.0  # cm per metre, the unit of axes_of
_LEAST = 1e-3  # cm: smaller motions are ignored
_OWN = ("tongue", "lash", "eye")  # meshes with shapes that do not follow from the skin


def template_parts(dna: Dna) -> tuple[int, list[HeadPart]]:
    """All meshes of LOD 0 in cm, y up, the face towards +z, and before them the index of the skin
    among these meshes.

    The parts keep only expressions in which a mesh does not simply follow the skin: all that move
    the tongue, the controls of the lashes for lashes, and the controls of the pupils for eyes.

    Args:
        dna: a face with geometry.
    """
    axes = _CM * axes_of(dna)
    flipped = bool(np.linalg.det(axes) < 0)
    meshes = [m for m in listed_meshes(dna, 0) if len(dna.meshes[m].positions)]
    skin = max(meshes, key=lambda m: len(dna.meshes[m].positions))
    names = [name.rpartition(".")[2] for name in dna.raw_control_names]
    own = [m for m in meshes if m != skin and any(w in dna.mesh_names[m].lower() for w in _OWN)]
    shapes = _shapes(dna, own, names, axes)
    parts = []
    for m in meshes:
        name = dna.mesh_names[m].removesuffix("_mesh").removesuffix("_lod0")
        mesh = _polygons(dna.meshes[m], axes, flipped=flipped)
        parts.append(HeadPart(name, mesh, shapes.get(m, {}), None, dna.mesh_names[m]))
    return meshes.index(skin), parts


def _polygons(mesh: Mesh, axes: Doubles, *, flipped: bool) -> ObjMesh:
    offsets = np.asarray(mesh.face_offsets, np.int64)
    layouts = np.asarray(mesh.face_layouts, np.int64)
    points = np.asarray(mesh.layout_positions, np.int64)[layouts]
    uvs = np.asarray(mesh.layout_texture_coordinates, np.int64)[layouts]
    order = -1 if flipped else 1
    pairs = list(zip(offsets[:-1].tolist(), offsets[1:].tolist(), strict=True))
    return ObjMesh(
        np.asarray(mesh.positions, np.float64) @ axes.T,
        np.asarray(mesh.texture_coordinates, np.float64),
        [points[a:b][::order].tolist() for a, b in pairs],
        [uvs[a:b][::order].tolist() for a, b in pairs],
    )


def _shapes(
    dna: Dna, own: list[int], names: list[str], axes: Doubles
) -> dict[int, dict[str, Doubles]]:
    """Index of each mesh of `own` -> control -> displacements of the mesh, float64[V, 3]."""
    out: dict[int, dict[str, Doubles]] = {m: {} for m in own}
    if not own:
        return out
    poser = Poser(dna, own[0], own[1:])  # the order of the meshes is arbitrary
    rest = poser.neutral
    for control, name in enumerate(names):
        for m, before, after in zip(own, rest, poser.pose((control,)), strict=True):
            eye = "eye" in dna.mesh_names[m].lower() and "lash" not in dna.mesh_names[m].lower()
            lash = "lash" in dna.mesh_names[m].lower()
            if (eye and "Pupil" not in name) or (lash and not name.startswith("eyelash")):
                continue
            way = (after - before) @ axes.T
            if np.abs(way).max(initial=0.0) > _LEAST:
                out[m][name] = way
    return out
