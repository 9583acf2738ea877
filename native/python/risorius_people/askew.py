# SPDX-License-Identifier: MIT
"""No face has two sides that are alike: small shapes of one side, laid over a finished rig.

They are laid over it last, because joints are found on a face that mirrors, as an animator expects
of them; by some millimetres they and all that expressions do fit the other face as well.
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
)  # groups of the base mesh, by parts of names


def askew(source: Source, body: Body, person: Person) -> Floats:
    """float64[V, 3]: what makes one side unlike the other, decimetres.

    Args:
        source: the data.
        body: the person's.
        person: has the shapes and how much of each.
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
    """Lay the shape over the meshes of all levels.

    Args:
        dna: a face of these parts, and of levels whose vertices are some of LOD 0's; is changed.
        parts: its own meshes.
        shape: float64[V, 3], decimetres.
        unit: of the Dna's meshes, in decimetres.
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
