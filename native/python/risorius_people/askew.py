# SPDX-License-Identifier: MIT
"""Makes faces asymmetric: adds small one-sided shapes to a finished rig.

No face is symmetric. The shapes are added after the joints are fitted, because animators expect
the joints at mirrored places. The shapes move the skin by only some millimetres, so the joints and
expressions still fit it.
"""

from __future__ import annotations

import numpy as np
from risorius import Dna
from risorius.author.geometry.polygon_mesh import vertex_normals

from .body import Body
from .part import Part
from .people import Person
from .polygons import Floats
from .source import Source

_STAYS = (
    "-eye",
    "eyeball",
    "cornea",
    "teeth",
    "tongue",
)  # a group of the base mesh stays symmetric if its name contains one of these, but not "lash"


def askew(source: Source, body: Body, person: Person) -> Floats:
    """float64[V, 3]: vertex displacements that make the two sides of a face differ, in decimetres.

    Args:
        source: the data with the shapes.
        body: the person's body.
        person: the person, with the names and weights of the shapes.
    """
    count = len(body.positions)
    out = np.zeros((count, 3))
    for name, weight in person.asymmetry.items():
        side = "l" if weight > 0 else "r"
        out += abs(weight) * source.feature(f"asym/asym-{name}-{side}", count)
    for group, own in body.groups.items():
        if any(part in group for part in _STAYS) and "lash" not in group:
            out[own] = 0
    return out


def set_askew(dna: Dna, parts: list[Part], shape: Floats, unit: float) -> None:
    """Adds the asymmetry shape to the vertex positions of the meshes of all LODs.

    Args:
        dna: a face made of `parts`; each vertex of its other, coarser meshes has the position of a
            vertex of LOD 0. Changed.
        parts: the meshes of the face that were made from the base mesh.
        shape: float64[V, 3], displacement of the base mesh's vertices in decimetres.
        unit: factor from decimetres to the unit of the Dna's meshes.
    """
    if not shape.any():
        return
    ways = {part.name: part.carry(shape) * unit for part in parts}
    finest: dict[str, tuple[dict[bytes, int], Floats]] = {}
    for part in parts:
        base = part.name.partition("_lod")[0]
        mesh = dna.meshes[list(dna.mesh_names).index(part.name)]
        if base not in finest:
            places = np.asarray(mesh.positions, np.float32)
            finest[base] = {p.tobytes(): i for i, p in enumerate(places)}, ways[part.name]
    meshes = list(dna.meshes)
    for mesh, name in zip(meshes, dna.mesh_names, strict=True):
        places = np.asarray(mesh.positions, np.float32)
        number, way = finest[name.partition("_lod")[0]]
        way = ways[name] if name in ways else way[[number[p.tobytes()] for p in places]]
        if not way.any():
            continue
        mesh.positions = moved = places + way.astype(np.float32)
        if name in ways:
            faces = next(part.polygons.faces for part in parts if part.name == name)
            mesh.normals = vertex_normals(np.asarray(moved, np.float64), faces)
    dna.meshes = meshes
