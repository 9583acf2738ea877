# SPDX-License-Identifier: MIT
"""Conform a face to a head from a file or another program: a sculpt of the face, or any mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ... import Dna
from ...author.geometry.rigid import rigid_fit
from ...author.geometry.skeleton import Doubles
from ...author.heads.parts import HeadPart, Wishes
from ...author.heads.sizes import UNITS
from ...author.input.obj import ObjMesh
from ...base.words import joined
from ..errors import AnyHeadError
from ..fittings.lower_teeth import lower_teeth
from ..fittings.sorting import sort_parts
from ..landmarks.marks import Landmarks
from ..laying import lay_surface
from ..standing import Standing, stand
from ..surface import Surface
from ..telling import Progress, telling
from .axes import mm_of, standing_axes, standing_skin
from .face import conform
from .parts import Ball, finest, skin_of
from .same import has_polygons_of, into_own_space, sculpted, turn_back

_STOOD, _LAID = 0.15, 0.75  # progress after landmarks are found, and after the skin is registered


@dataclass
class Conformed:
    """The result of conform_face.

    Attributes:
        dna: the conformed face.
        moved: float64[V, 3], the vertex positions of its skin, in the axes and the unit of the
            face's file.
        sculpted: names of the meshes that the head has with the topology of the face; empty if the
            skin was registered onto a head of another topology.
        notes: sentences about guesses and steps.
    """

    dna: Dna
    moved: Doubles
    sculpted: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def conform_face(
    dna: Dna,
    parts: Sequence[HeadPart],
    marks: Landmarks | None = None,
    progress: Progress | None = None,
    *,
    where: str = "the head",
    unit: str = "cm",
    wishes: Wishes | None = None,
    threads: int = 0,
) -> Conformed:
    """Conform a face to a head.

    If the head has the topology of the face (also triangulated), its vertex positions are taken
    directly. The skin of the face is registered onto any other head, and the eyes of the head give
    the positions of the eyes. The result keeps the axes, the unit and the position of the face.

    Args:
        dna: the source face; it is not changed.
        parts: the meshes of the head in one space.
        marks: landmarks that the user placed, in the space of the parts.
        progress: receives the finished share of the work, 0 to 1; stops the work if it returns
            False.
        where: name of the head in error messages.
        unit: the unit of the head's file format, "cm" or "m".
        wishes: values that the user gave and that are not guessed.
        threads: number of threads; 0: one for each core.

    Raises:
        AnyHeadError: the head has no polygons, the face has no skin, or a value of `wishes` is
            invalid.
        LandmarkError: no face was found in the head, or landmarks are missing.
        RegistrationError: no surface of the head is near the face.
        Stopped: `progress` returned False.
    """
    wishes = wishes or Wishes()
    skin = skin_of(dna)
    if skin < 0:
        raise AnyHeadError("a face with a mesh of skin at LOD 0 was expected, found none")
    name = dna.mesh_names[skin]
    named = [part for part in parts if part.source == wishes.mesh] if wishes.mesh else parts
    moved = sculpted(dna, named)
    if name in moved:
        if wishes.height_mm:
            raise AnyHeadError(
                f"{where}: a height was given, but the head has the topology of the face and keeps "
                "its size; use scale instead"
            )
        there, note = into_own_space(dna, moved, wishes.scale or None)
        notes = [f"{joined(list(there))}: the head has the topology of the face", note]
        made = conform(dna, there, telling(progress, 0.0, 1.0))
        return Conformed(made, there[name], list(there), [n for n in notes if n])
    standing = stand(where, parts, unit, wishes, marks, telling(progress, 0.0, _STOOD))
    points, balls, teeth = _laid(dna, skin, standing, threads, progress)
    made = conform(dna, {name: points}, telling(progress, _LAID, 1.0), balls, teeth)
    return Conformed(made, points, [], standing.notes)


def parts_of(dna: Dna) -> list[HeadPart]:
    """The meshes of LOD 0 of a face as parts of a head, in the file's unit, with x to the left, y
    up and z to the front.

    Args:
        dna: the face.
    """
    out = []
    for m in finest(dna):
        name, mesh = dna.mesh_names[m], dna.meshes[m]
        corners = np.asarray(mesh.layout_positions, np.int64)[np.asarray(mesh.face_layouts)]
        faces = [own.tolist() for own in np.split(corners, mesh.face_offsets[1:-1])]
        places = np.asarray(mesh.positions, np.float64) @ standing_axes(dna)
        bare = ObjMesh(places, np.zeros((0, 2)), faces, [[] for _ in faces])
        out.append(HeadPart(name, bare, source=name))
    return out


def _laid(
    dna: Dna, skin: int, standing: Standing, threads: int, progress: Progress | None
) -> tuple[Doubles, list[Ball], Doubles | None]:
    """The vertex positions of the face's skin on a head, and the eyeballs and the lower teeth of
    the head, in the axes, the unit and the position of the face."""
    axes, size = standing_axes(dna), mm_of(dna) / UNITS["cm"]
    before = np.asarray(dna.meshes[skin].positions, np.float64)
    template = standing_skin(dna, skin)
    parts = sort_parts(standing.parts)
    face = parts.face.mesh
    target = Surface.of_polygons(face.positions, face.faces)
    laid = lay_surface(
        template,
        dna.name or "the face",
        target,
        standing.found,
        threads,
        telling(progress, _STOOD, _LAID),
    )
    turn, _ = rigid_fit(template.points, laid.points)
    back = turn_back(turn)
    sure = laid.trust > 0 if (laid.trust > 0).any() else np.ones(len(before), bool)
    shift = template.points[sure].mean(axis=0) - (laid.points[sure] @ back.T).mean(axis=0)

    def there(places: Doubles) -> Doubles:
        return np.asarray((places @ back.T + shift) @ axes.T / size)

    balls = [Ball(there(eye.middle[None])[0], eye.radius / size) for eye in parts.eyes.values()]
    lower = lower_teeth(parts)
    return there(laid.points), balls, None if lower is None else there(lower)


def is_same_topology(dna: Dna, mesh: ObjMesh) -> bool:
    """Whether a mesh has the vertex count and the polygons of a face's skin.

    Args:
        dna: the face.
        mesh: the mesh.
    """
    skin = skin_of(dna)
    return skin >= 0 and has_polygons_of(dna.meshes[skin], mesh)
