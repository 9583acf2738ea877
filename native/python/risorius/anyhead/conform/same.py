# SPDX-License-Identifier: MIT
"""Finds meshes of a head that have the topology of a face, and converts their axes and unit."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ... import Dna, Mesh
from ...author.geometry.rigid import rigid_fit
from ...author.geometry.skeleton import Doubles
from ...author.heads.parts import HeadPart
from ...author.heads.sizes import UNITS
from ...author.input.obj import ObjMesh
from .parts import finest, skin_of

_AS_IT_IS = 2.0  # a head up to twice as large or small has the unit of the face
_LEANS = np.cos(np.radians(30.0))  # cosine of the largest angle of a head to the axes of its file
# Largest number of corners of a polygon that is compared. A triangulated polygon with more corners
# is not recognised; a polygon of the other mesh with more corners is accepted without a comparison.
_FIVE = 5


def sculpted(dna: Dna, parts: Sequence[HeadPart]) -> dict[str, Doubles]:
    """float64[V, 3] by mesh name: vertex positions in the head, for each LOD 0 mesh with a match.

    A mesh of the head matches if has_polygons_of() is true. If several meshes of the head match,
    such as both eyes, the mesh is taken whose name has the longest common beginning with the name
    of the face's mesh; of equally similar names, the first. A mesh of the head is taken only
    once.

    Args:
        dna: the face.
        parts: the meshes of the head.
    """
    out: dict[str, Doubles] = {}
    left = list(parts)
    for m in sorted(finest(dna), key=lambda m: m != skin_of(dna)):
        name, mesh = dna.mesh_names[m], dna.meshes[m]
        alike = [part for part in left if has_polygons_of(mesh, part.mesh)]
        if alike:
            part = max(alike, key=lambda p: (_same_start(p.name, name), -left.index(p)))
            left.remove(part)
            out[name] = np.asarray(part.mesh.positions, np.float64)
    return out


def has_polygons_of(mesh: Mesh, other: ObjMesh) -> bool:
    """Whether a mesh has the vertex count of a mesh of a face, and only polygons of that mesh.

    Args:
        mesh: the mesh of the face.
        other: the other mesh; polygons of up to 5 corners may be triangulated in it. Its polygons
            with more corners are accepted without a comparison.
    """
    if len(other.positions) != len(mesh.positions) or not other.faces:
        return False
    corners = np.asarray(mesh.layout_positions, np.int64)[np.asarray(mesh.face_layouts, np.int64)]
    offsets = np.asarray(mesh.face_offsets, np.int64).tolist()
    known = set()
    for begin, end in itertools.pairwise(offsets):
        own = sorted(set(corners[begin:end].tolist()))
        known.add(tuple(own))
        if 3 < len(own) <= _FIVE:
            known.update(itertools.combinations(own, 3))
    found = [tuple(sorted(set(face))) in known for face in other.faces]
    longer = [len(face) > _FIVE for face in other.faces]
    return all(f or more for f, more in zip(found, longer, strict=True)) and any(found)


def into_own_space(
    dna: Dna, moved: dict[str, Doubles], factor: float | None = None
) -> tuple[dict[str, Doubles], str]:
    """Convert a sculpt to the axes and the unit of a face.

    A sculpt in the axes and the unit of the face is returned unchanged. Any other sculpt is rotated
    by the result of turn_back() and scaled. The second value is a sentence about the conversion;
    it is "" if the sculpt is unchanged.

    Args:
        dna: the face.
        moved: float64[V, 3] by mesh name; the skin is required.
        factor: the scale; None: 1 if the sizes of the head and the face differ by a factor below
            2, else the ratio of two units that fits best.
    """
    skin = skin_of(dna)
    before = np.asarray(dna.meshes[skin].positions, np.float64)
    after = moved[dna.mesh_names[skin]]
    turn, _ = rigid_fit(before, after)
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    size = float((b * (a @ turn.T)).sum()) / max(float((a**2).sum()), 1e-300)
    own = turn_back(turn)
    if factor is None:
        factor = 1.0 if 1 / _AS_IT_IS < size < _AS_IT_IS else unit_back(size)
    if factor == 1.0 and np.array_equal(own, np.eye(3)):
        return moved, ""
    there = {name: factor * points @ own.T for name, points in moved.items()}
    return there, f"the head is rotated to the axes of the face and multiplied by {factor:g}"


def turn_back(turn: Doubles) -> Doubles:
    """float64[3, 3]: the rotation from a head to a face.

    A rotation by right angles is returned if the head is turned by less than 30 degrees from it,
    otherwise the inverse of `turn`.

    Args:
        turn: float64[3, 3], the rotation from the face to the head.
    """
    best = max(right_angles(), key=lambda own: float(np.trace(own @ turn)))
    leans = (np.trace(best @ turn) - 1) / 2
    return best if leans > _LEANS else turn.T


def right_angles() -> list[Doubles]:
    """float64[3, 3] each: the 24 rotations that map axes to axes, the identity first."""
    out = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            turn = np.array(signs)[:, None] * np.eye(3)[list(order)]
            if np.linalg.det(turn) > 0:
                out.append(turn)
    return out


def unit_back(size: float) -> float:
    """The ratio of two units that scales a head to about the size of the face.

    Args:
        size: the size of the head divided by the size of the face, above 0.
    """
    ratios = {one / other for one in UNITS.values() for other in UNITS.values()}
    return min(sorted(ratios), key=lambda ratio: abs(np.log(ratio * max(size, 1e-12))))


def _same_start(one: str, other: str) -> int:
    """The length of the common prefix of two names."""
    pairs = zip(one.lower(), other.lower(), strict=False)
    return sum(1 for _ in itertools.takewhile(lambda pair: pair[0] == pair[1], pairs))
