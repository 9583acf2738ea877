# SPDX-License-Identifier: MIT
"""Defines the meshes of a head, their materials, and the user's settings for the head."""

from __future__ import annotations

from collections.abc import MutableMapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...controls import vocabulary
from ..geometry.skeleton import Doubles, Ints
from ..input.matching import guess
from ..input.obj import ObjMesh

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")


@dataclass
class Material:
    """The parts of a material that a face keeps.

    Attributes:
        name: name of the material.
        color: red, green, blue and opacity, 0 to 1, sRGB as in image files; None: unknown.
        pictures: role -> bytes of the image file. Roles are color, normal, roughness, and orm
            (roughness in the green channel).
        notes: sentences on parts that are left out.
    """

    name: str = ""
    color: tuple[float, float, float, float] | None = None
    pictures: dict[str, bytes] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def as_stored(linear: Sequence[float]) -> tuple[float, float, float, float]:
    """Convert a linear colour to sRGB. The opacity is not changed.

    Args:
        linear: red, green, blue and opacity, 0 to 1.
    """
    light = np.clip(np.array(linear, np.float64), 0.0, 1.0)
    coded = np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return float(coded[0]), float(coded[1]), float(coded[2]), float(light[3])


@dataclass
class HeadPart:
    """A mesh of a head, or a part of one.

    Attributes:
        name: name of the part; at first the name of the object.
        mesh: the mesh; all parts share one space.
        shapes: name -> displacements float64[V, 3].
        material: the material, or None.
        source: name of the object to which the part belongs.
        polygons: indices of the part's polygons in the object; None: all.
        groups: name of a vertex group, a joint or a group of polygons -> float64[n, 3], positions
            of the vertices that belong to it (for a joint: with a weight above 0.5), in the space
            of the parts. Groups of a mesh that is divided are in one of its parts.
    """

    name: str
    mesh: ObjMesh
    shapes: MutableMapping[str, Doubles] = field(default_factory=dict)
    material: Material | None = None
    source: str = ""
    polygons: Ints | None = None
    groups: dict[str, Doubles] = field(default_factory=dict)

    @property
    def center(self) -> Doubles:
        """float64[3]: the centre of the bounding box."""
        points = self.mesh.positions
        return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)


@dataclass
class Wishes:
    """The user's settings for a head; "" or 0 means that the value is guessed.

    Attributes:
        mesh: name of the face's mesh; the file must contain it.
        rather: name of the mesh that is preferred if the file has several heads.
        left: direction of the character's left, one of AXES.
        up: direction of the top, one of AXES.
        front: direction in which the face looks, one of AXES.
        unit: unit of the coordinates, a key of sizes.UNITS such as "cm".
        scale: factor of the coordinates in addition to the unit.
        height_mm: height from the chin to the top of the head, mm.
    """

    mesh: str = ""
    rather: str = ""
    left: str = ""
    up: str = ""
    front: str = ""
    unit: str = ""
    scale: float = 0.0
    height_mm: float = 0.0


def meaning(name: str) -> tuple[str, ...]:
    """A tuple that is equal for names with the same meaning: raw controls, expression, or name."""
    controls = guess(name)
    if controls:
        return tuple(sorted(controls))
    said = vocabulary.find(name)
    return ("", said.expression) if said is not None and said.expression else ("", "", name)


def in_face_names(face: HeadPart, part: HeadPart) -> dict[str, Doubles]:
    """The shapes of a mesh, renamed to the face's shapes with the same meaning; others keep their
    names. Of several shapes with the same new name, the first is kept.

    Args:
        face: the mesh of the face.
        part: the other mesh.
    """
    own = {meaning(name): name for name in reversed(list(face.shapes))}
    out: dict[str, Doubles] = {}
    for name, delta in part.shapes.items():
        known = name if name in face.shapes else own.get(meaning(name), name)
        out.setdefault(known, delta)
    return out


def first_vertices(part: HeadPart) -> Ints:
    """int64[polygons]: the first vertex of each polygon."""
    return np.array([face[0] for face in part.mesh.faces], np.int64)


def taken_apart(part: HeadPart, names: Sequence[str], of_face: Ints) -> list[HeadPart]:
    """Divide a mesh by labels of its polygons. Vertices on a cut are duplicated.

    Args:
        part: the mesh; it is not changed.
        names: name of the new part of each label; a label without polygons gives no part.
        of_face: int64[polygons], label of each polygon; -1 leaves the polygon out.
    """
    out = []
    numbers = part.polygons if part.polygons is not None else np.arange(len(of_face))
    for label, name in enumerate(names):
        chosen = np.flatnonzero(of_face == label)
        if not len(chosen):
            continue
        kept = np.unique(np.concatenate([part.mesh.faces[f] for f in chosen]))
        place = np.zeros(len(part.mesh.positions), np.int64)
        place[kept] = np.arange(len(kept))
        mesh = ObjMesh(
            part.mesh.positions[kept],
            part.mesh.uvs,
            [place[part.mesh.faces[f]].tolist() for f in chosen],
            [part.mesh.uv_faces[f] for f in chosen],
        )
        shapes = {shape: delta[kept] for shape, delta in part.shapes.items()}
        out.append(HeadPart(name, mesh, shapes, part.material, part.source, numbers[chosen]))
    return out
