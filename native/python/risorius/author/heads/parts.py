# SPDX-License-Identifier: MIT
"""The meshes that a head is made of, their materials, and what a person says of the whole."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...controls import vocabulary
from ..geometry.skeleton import Doubles, Ints
from ..input.matching import guess
from ..input.obj import ObjMesh

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")


@dataclass
class Material:
    """What of a material a face takes along.

    Attributes:
        name: of it.
        color: red, green, blue and opacity, 0 to 1 as files of pictures have them; None: none said.
        pictures: role (color, normal, roughness, or orm for roughness in the green of a picture)
            -> the picture as its file has it.
        notes: what is left out of it, a sentence each.
    """

    name: str = ""
    color: tuple[float, float, float, float] | None = None
    pictures: dict[str, bytes] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def as_stored(linear: Sequence[float]) -> tuple[float, float, float, float]:
    """A colour as pictures have it, of one that is proportional to light.

    Args:
        linear: red, green, blue and opacity.
    """
    light = np.clip(np.array(linear, np.float64), 0.0, 1.0)
    coded = np.where(light < 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return float(coded[0]), float(coded[1]), float(coded[2]), float(light[3])


@dataclass
class HeadPart:
    """A mesh of a head, or a part of one.

    Attributes:
        name: of its object.
        mesh: all parts in one space.
        shapes: float64[V, 3] by name, what each adds.
        material: None: none.
        source: the object's name, also where this is a part of it.
        polygons: which of its polygons, in the object's own numbers; None: all.
    """

    name: str
    mesh: ObjMesh
    shapes: dict[str, Doubles] = field(default_factory=dict)
    material: Material | None = None
    source: str = ""
    polygons: Ints | None = None

    @property
    def center(self) -> Doubles:
        """float64[3]: of its box."""
        points = self.mesh.positions
        return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)


@dataclass
class Wishes:
    """What a person says of a head, "" or 0 where it is to be guessed.

    Attributes:
        mesh: name of the one that is the face.
        rather: name of the one that it is where there are several heads.
        left, up, front: one of AXES each.
        unit: of the numbers, see sizes.UNITS.
        scale: what all numbers are multiplied with, on top of the unit.
        height_mm: from the chin to the top.
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
    """What two names of one meaning have alike: raw controls, or an expression; else the name."""
    controls = guess(name)
    if controls:
        return tuple(sorted(controls))
    said = vocabulary.find(name)
    return ("", said.expression) if said is not None and said.expression else ("", "", name)


def in_face_names(face: HeadPart, part: HeadPart) -> dict[str, Doubles]:
    """The shapes of another mesh, by the face's names where it has one of the same meaning.

    Args:
        face: has the names.
        part: the other mesh.
    """
    own = {meaning(name): name for name in reversed(face.shapes)}
    out: dict[str, Doubles] = {}
    for name, delta in part.shapes.items():
        known = name if name in face.shapes else own.get(meaning(name), name)
        out.setdefault(known, delta)
    return out


def first_vertices(part: HeadPart) -> Ints:
    """int64[polygons]: a vertex of each."""
    return np.array([face[0] for face in part.mesh.faces], np.int64)


def taken_apart(part: HeadPart, names: Sequence[str], of_face: Ints) -> list[HeadPart]:
    """A part divided, in the order of the labels; a vertex that two have becomes two.

    Args:
        part: is left as it is.
        names: of the new parts, by label.
        of_face: int64[polygons], the label of each.
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
